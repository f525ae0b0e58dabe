"""Linear motion of joined components in their modes: exact for loads that are straight between samples."""

from collections.abc import Mapping, Sequence

import jax.numpy as jnp
import numpy as np

from ..linear.modal_response import modal_response
from .network import Network
from .primal import Assembly
from .transient import Transient, by_number, check_forces, check_masses


def modal_transient(
    joined: Assembly | Network,
    step,
    forces: Sequence | Mapping,
    ratios=None,
    num: int | None = None,
    static_start: bool = False,
) -> Transient:
    """Motion under loads at the samples, from rest, or from static balance with the first load.

    Args:
        joined: of `join` or `connect`.
        step: between samples [s].
        forces: on the components' own coordinates (n_c, T), None for none; by name for a network.
        ratios: damping of the modes, one number or one for each; None takes the components' own damping matrices,
            which must not couple the modes.
        num, static_start: as of `modal_response`, whose derivatives these are.

    With `ratios` the reactions' residual at the joints is what the damping puts there.

    Raises: ValueError for forces that do not fit, coordinates without mass, and as `modal_response`.
    Source: S1 (30)-(31), (42)-(43).
    """
    assembly, forces, _ = by_number(joined, forces)
    check_masses(assembly)
    check_forces(assembly, forces, max((np.shape(f)[-1] for f in forces if f is not None), default=0))
    damping, ratios = (assembly.damping, 0.0) if ratios is None else (None, ratios)
    load = assembly.load(forces)
    matrices = {"K": assembly.stiffness, "M": assembly.mass, "C": damping}
    x, v, a = modal_response(**matrices, load=load, step=step, ratios=ratios, num=num, static_start=static_start)
    times = step * jnp.arange(load.shape[1], dtype=load.dtype)
    return Transient(times, x, v, a, jnp.zeros((0, len(times)), x.dtype), tuple(forces), jnp.array(True))
