"""Declarations become the system they describe, freedoms and redundancy by name; faults are refused by name."""
