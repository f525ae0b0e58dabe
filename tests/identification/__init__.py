"""Tests of identification, with the case of NIST's regressions."""
