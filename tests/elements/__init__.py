"""Finite elements pass patch tests and published benchmarks, with derivatives, batches and single precision."""
