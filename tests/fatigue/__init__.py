"""Cycles, damage and spectra are those of ASTM's example, of rainflow, fatpack and FLife, with derivatives."""
