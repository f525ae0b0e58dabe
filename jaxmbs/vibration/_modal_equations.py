"""Response of modes over time, exact for loads that are straight between samples."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..checks import not_positive
from ..math._exponential import expm
from ..quantities import Quantity, numbered
from ..reports import Report, reported
from ..runtime import as_dtype
from ..typing import AnyArray, ArrayLike


@reported
class ModalMotion(NamedTuple):
    """Coordinates and their rates, modal or all, each (times, m)."""

    displacement: jax.Array
    velocity: jax.Array
    acceleration: jax.Array

    def report(self) -> Report:
        mode = (numbered("coordinate", np.shape(self.displacement)[-1]),)
        units = ("m or rad", "m/s or rad/s", "m/s^2 or rad/s^2")
        return Report([Quantity(n, x, unit, mode) for n, x, unit in zip(self._fields, self, units, strict=True)])


def modal_motion(
    omega: AnyArray,
    ratios: ArrayLike,
    loads: AnyArray,
    step: ArrayLike,
    displacement: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
) -> ModalMotion:
    """Solution of `q'' + 2 ratio omega q' + omega^2 q = f` for every mode, at the samples.

    No error of integration: between samples f is straight and the solution is the exponential of a matrix, so the
    step need only follow the load.  Rigid modes (omega = 0) and any damping included.

    With shapes of `natural_modes` derivatives are wrong where a parameter parts equal frequencies: `modal_response`.

    Args:
        omega, ratios: (m,), omega in rad/s; ratios may be one number.
        loads: (times, m) of unit modal mass.
        step: time between samples [s].
        displacement, velocity: at the first sample (m,), default 0.

    Source: S1 (42)-(43).
    """
    z = jnp.broadcast_to(as_dtype(ratios, loads.dtype), omega.shape)
    return oscillations(omega**2, 2 * z * omega, loads, step, displacement, velocity)


def oscillations(
    squares: AnyArray,
    rates: AnyArray,
    loads: AnyArray,
    step: ArrayLike,
    displacement: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
) -> ModalMotion:
    """`modal_motion` of `q'' + r q' + s q = f` for squares s and rates r (m,).

    Raises: ValueError, if concrete, for a step that is not positive.  Source: S1 (42)-(43).
    """
    m, loads = squares.shape[0], jnp.asarray(loads)
    h = as_dtype(step, loads.dtype)
    if not_positive(step):
        raise ValueError(f"step = {step}: the time between samples must be positive")
    root = jnp.sqrt(jnp.maximum(lax.stop_gradient(squares), 0.0))
    scale = jnp.maximum(root, 1.0 / lax.stop_gradient(h))  # velocities are carried as v / scale
    whole = jax.vmap(lambda w2, r, s: expm(h * _rates(w2, r, s, h)))(squares, rates, scale)
    q0 = jnp.zeros(m, loads.dtype) if displacement is None else as_dtype(displacement, loads.dtype)
    v0 = jnp.zeros(m, loads.dtype) if velocity is None else as_dtype(velocity, loads.dtype)

    def advance(state, sample):
        before, after = sample
        full = jnp.stack([*state, before, after - before])
        new = jnp.einsum("kij,jk->ik", whole, full)[:2]
        return (new[0], new[1]), new

    start = (q0, v0 / scale)
    _, rest = lax.scan(advance, start, (loads[:-1], loads[1:]))
    both = jnp.concatenate([jnp.stack(start)[None], rest])
    q, v = both[:, 0], both[:, 1] * scale[None, :]
    return ModalMotion(q, v, loads - rates[None, :] * v - squares[None, :] * q)


def _rates(w2, r, s, h):
    """Rates of (q, v / s, f, rise of f in a step)."""
    zero = jnp.zeros_like(w2)
    rows = [[zero, s, zero, zero], [-w2 / s, -r, 1 / s, zero]]
    rows += [[zero, zero, zero, 1 / h], [zero] * 4]
    return jnp.stack([jnp.stack(row) for row in rows])


def base_load(mass: AnyArray, motions: AnyArray, acceleration: AnyArray) -> AnyArray:
    """Load (times, n) on coordinates relative to a moving base: `-M motions a`.

    Args:
        motions: (n, k) of the whole structure with the base (rigid, or `linear.interface_basis`).
        acceleration: (times, k) of the base.
    """
    return -(acceleration @ (mass @ motions).T)
