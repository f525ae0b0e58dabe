"""Primitives of JAX that tapes do not have."""

import jax

from . import _written  # noqa: F401  (registers the rules)
from ._flatten import CALLS, FORMULAS
from ._pair_rules import PAIR_RULES
from ._writer import RULES

#: Of several devices and of the order of effects: programs with them run on one CPU no more than on a tape.
_OF_DEVICES = (
    *("after_all", "all_gather", "all_to_all", "axis_index", "create_token", "pmax", "pmin", "ppermute", "psum"),
    *("ragged_all_to_all", "sharding_constraint", "dce_sink", "stage"),
)


def missing_primitives() -> list[str]:
    """Names of the primitives of `jax.lax` that tapes do not have; XLA compiles programs with one of them."""
    faces = (jax.lax, jax.lax.linalg)
    every = {value.name for face in faces for name, value in vars(face).items() if name.endswith("_p")}
    known = {*RULES, *PAIR_RULES, *CALLS, *FORMULAS, *_OF_DEVICES, "custom_linear_solve", "linear_solve"}
    return sorted(every - known)
