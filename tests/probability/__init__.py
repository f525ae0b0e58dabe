"""Distributions against SciPy's in both tails, correlations and normal integrals against closed forms."""
