"""Critical speeds: those at which a rotor whirls as fast as it turns."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jaxtyping import Complex, Float

from ..checks import any_concrete
from ..errors import ModelError
from ..math import _square as square
from ..math._eigen import eig
from ..quantities import Quantity, numbered
from ..reports import Report, Reported
from ..runtime import as_array, jit
from ..typing import ArrayLike
from ._parts import Bearing
from ._rotor import Rotor
from ._whirl import check_number_of_roots, complex_of, sense_of


class CriticalSpeeds(Reported, eqx.Module):
    """Critical speeds (m,), rising.

    Attributes:
        roots: (m,) [rad/s] of synchronous whirl; imaginary where nothing damps.
        sense: (m,) of the orbits: 1 forward, which unbalance excites, -1 backward.
    """

    roots: Complex[Array, " m"]
    sense: Float[Array, " m"]

    def report(self) -> Report:
        mode = numbered("critical speed", self.roots.shape[-1])
        return Report(
            [Quantity("speed", self.speeds, "rad/s", (mode,)), Quantity("sense", self.sense, "", (mode,))],
        )

    @property
    def speeds(self) -> Float[Array, " m"]:
        """The speeds [rad/s]."""
        return self.roots.imag

    def of_sense(self, forward: bool) -> Float[Array, " k"]:
        """Those of forward, or of backward whirl (concrete ones)."""
        return self.speeds[np.asarray(self.sense) > 0.0 if forward else np.asarray(self.sense) < 0.0]


def critical_speeds(rotor: Rotor, count: int = 6) -> CriticalSpeeds:
    """The lowest critical speeds of a rotor on bearings of constant coefficients, by one eigenproblem.

    Synchronous whirl `q exp(i W t)` at the speed W: `W^2 (M - i G) q = (K + i W C) q`.

    Raises: ModelError for bearings whose coefficients depend on the speed, of which `whirl_speeds` and the peaks of
        `unbalance_response` tell; for a count that is none.

    Source: Genta, Dynamics of rotating systems (2005); Friswell and others (2010), 6.5.
    """
    check_number_of_roots(rotor, count)
    depend = [type(b).__name__ for b in rotor.bearings if not isinstance(b, Bearing)]
    if depend:
        words = "take whirl_speeds, or the peaks of unbalance_response"
        raise ModelError([f"{', '.join(depend)}: coefficients that depend on the speed; {words}"], "critical speeds")
    return CriticalSpeeds(*_critical(rotor, count))


@jit
def _critical(rotor, count):
    M, G, K = rotor.inertias()
    stiffness, damping = rotor.supports(jnp.zeros((), M.dtype))
    n = M.shape[0]
    turned = lax.complex(M, -G)
    both = square.solve(complex_of(K + stiffness), jnp.concatenate([turned, complex_of(damping)], axis=1))
    upper = complex_of(jnp.concatenate([jnp.zeros_like(M), jnp.eye(n, dtype=M.dtype)], axis=1))
    inverses, shapes, _ = eig(jnp.concatenate([upper, -both]))
    chosen = jnp.where(inverses.imag < -1e-9 * jnp.abs(inverses), jnp.abs(inverses), -1.0)
    order = jnp.argsort(-lax.stop_gradient(chosen))[:count]
    roots = jnp.where(chosen[order] > 0.0, 1.0 / inverses[order], complex(np.nan, np.nan))
    rising = jnp.argsort(lax.stop_gradient(roots.imag), stable=True)
    return roots[rising], sense_of(shapes[:n, order][:, rising])


def critical_speed_map(rotor: Rotor, stiffness: ArrayLike, count: int = 6) -> Float[Array, "k m"]:
    """Undamped critical speeds (k, count) [rad/s] over the stiffness (k,) [N/m] of all bearings, of either sense.

    Raises: ModelError for stiffnesses that are no row of positive numbers.
    """
    stiffness = as_array(stiffness)
    check_number_of_roots(rotor, count)
    if stiffness.ndim != 1 or any_concrete(lambda x: ~((x > 0) & np.isfinite(x)), stiffness):
        raise ModelError(["stiffness must be a row of positive numbers [N/m]"], "the map of critical speeds")

    def at(k):
        bearings = [Bearing(b.station, k) for b in rotor.bearings]
        return _critical(Rotor(rotor.shaft, rotor.disks, bearings), count)[0].imag

    return jit(lambda stiffness: lax.map(at, stiffness))(stiffness)
