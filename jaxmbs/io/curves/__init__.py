"""Curves over time or frequency in CSV and universal files: events, shocks, spectra."""

from ._curves import Curves, read_curves, read_psd, write_curves, write_psd

__all__ = ["Curves", "read_curves", "read_psd", "write_curves", "write_psd"]
