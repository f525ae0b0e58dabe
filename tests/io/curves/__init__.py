"""Curves and spectra in files come back, and what is wrong with a file is said by its line."""
