"""Linear motion of joined components in their modes: exact for loads that are straight between samples."""

from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp
import numpy as np

from ..structures.transient import modal_motion
from .coupling import Assembly
from .network import Network
from .transient import Transient, by_number, check_forces


def modal_transient(
    joined: Assembly | Network,
    step,
    forces: Sequence | Mapping,
    ratios=None,
    num: int | None = None,
    static_start: bool = False,
) -> Transient:
    """Motion under loads at the samples, all modes at once; from rest, or from static balance with the first load.

    Args:
        joined: of `join` or `connect`.
        step: between samples [s].
        forces: on the components' own coordinates (n_c, T), None for none; by name for a network.
        ratios: damping of the modes, one number or one for each; None takes the components' own damping matrices,
            which must not couple the modes.
        num: modes that move; those above follow the loads statically, without inertia and damping.
        static_start: elastic modes start at rest in balance.

    A derivative where frequencies repeat is that of `transient`, not of this function, unless all of a group change
    alike.  With `ratios` the reactions' residual at the joints is what the damping puts there.

    Raises: ValueError for forces that do not fit, and for a damping, if concrete, that couples the modes.
    Source: S1 (30)-(31), (42)-(43).
    """
    assembly, forces, _ = by_number(joined, forces)
    check_forces(assembly, forces, max((np.shape(f)[-1] for f in forces if f is not None), default=0))
    load = assembly.load(forces)
    modes = assembly.modes()
    w, X = modes.angular_frequencies, modes.shapes
    m = len(w) if num is None else num
    z = _own_ratios(assembly, w, X) if ratios is None else jnp.broadcast_to(jnp.asarray(ratios, w.dtype), w.shape)
    F = X.T @ load
    static = jnp.where(modes.is_rigid[:, None], 0.0, F / jnp.where(modes.is_rigid, 1.0, modes.values)[:, None])
    start = static[:m, 0] if static_start else None
    motion = modal_motion(w[:m], z[:m], F[:m].T, step, start)
    x = X[:, :m] @ motion.displacement.T + X[:, m:] @ static[m:]
    v, a = (X[:, :m] @ q.T for q in (motion.velocity, motion.acceleration))
    times = step * jnp.arange(load.shape[1], dtype=load.dtype)
    return Transient(times, x, v, a, jnp.zeros((0, len(times)), x.dtype), tuple(forces), jnp.array(True))


def _own_ratios(assembly, w, X):
    if assembly.damping is None:
        return jnp.zeros_like(w)
    C = X.T @ assembly.damping @ X
    own = jnp.diagonal(C)
    if not isinstance(C, jax.core.Tracer):
        size = np.sqrt(np.abs(np.outer(own, own))) + 1e-6 * np.max(np.abs(own), initial=1e-300)
        if np.max(np.abs(C - np.diag(own)) / size, initial=0.0) > 1e3 * np.sqrt(np.finfo(C.dtype).eps):
            raise ValueError("the damping couples the modes: use transient, or give ratios")
    return jnp.where(w > 0, own / jnp.where(w > 0, 2 * w, 1.0), 0.0)
