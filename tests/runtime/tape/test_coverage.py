"""Primitives that tapes do not have: those are known, and no more."""

import jax

from jaxmbs.runtime.tape._coverage import missing_primitives

#: What no program of the library has.
MISSING = {
    *("approx_top_k", "bitcast_convert_type", "cholesky_update", "clz", "conv_general_dilated", "cumlogsumexp"),
    *("hessenberg", "igamma_grad_a", "lu_pivots_to_permutation", "mulhi", "ormqr", "population_count", "reduce"),
    *("reduce_window", "reduce_window_max", "reduce_window_min", "reduce_window_sum", "reduce_xor"),
    *("rng_bit_generator", "rng_uniform", "select_and_gather_add", "select_and_scatter", "select_and_scatter_add"),
    *("shift_left", "shift_right_arithmetic", "shift_right_logical", "symmetric_product", "top_k", "tridiagonal"),
    "tridiagonal_solve",
}


def test_missing_primitives_are_known():
    found = set(missing_primitives())
    assert {"top_k", "reduce_window"} <= found
    assert found <= MISSING or jax.__version_info__[:2] > (0, 12), found - MISSING
