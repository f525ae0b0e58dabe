"""Blocks have the transfer functions, limits and sampled forms that SciPy and control theory give them."""
