"""Rows, ranks, influence coefficients and both saddle solvers agree with differences and dense algebra."""
