"""Unknowns come back from data: certified regressions (NIST), closed forms, and what no data can tell."""
