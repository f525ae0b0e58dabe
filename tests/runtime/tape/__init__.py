"""Tapes compute what XLA does in every operation, are checked before they run, and bear threads and forks."""
