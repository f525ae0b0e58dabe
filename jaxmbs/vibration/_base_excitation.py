"""Acceleration gains of a structure on a moving base, mode by mode, and the mobilities behind them."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Complex, Float

from ..checks import not_positive
from ..linear._condensation import interface_basis, partition
from ..quantities import Quantity, numbered
from ..reports import Report, Reported
from ..runtime import as_dtype
from ..typing import AnyArray, ArrayLike, RowsLike
from ._gains import mobility_from_gain
from ._modes import stable_modes


class ResonanceGains(Reported, eqx.Module):
    """Acceleration gains at resonance: contribution of mode k at output i per acceleration of the base, while the
    base vibrates at the frequency of that mode; the table of S1 (45).

    Attributes:
        gains: (modes, outputs, base) complex; `-i` times a real number, a quarter period behind the base.
        omega: (modes,) [rad/s] with the base fixed; ratios: (modes,) damping ratios.
        static: (outputs, base), the quasi-static motion with the base.
        mass: (base,) [kg] of the whole structure in a unit motion of each base coordinate.
    """

    gains: Complex[Array, "modes outputs base"]
    omega: Float[Array, " modes"]
    ratios: Float[Array, " modes"]
    static: Float[Array, "outputs base"]
    mass: Float[Array, " base"]

    def report(self) -> Report:
        names = zip(("mode", "output", "base"), self.gains.shape, strict=True)
        mode, output, base = (numbered(*pair) for pair in names)
        return Report(
            [
                Quantity("frequency", np.asarray(self.omega) / (2 * np.pi), "Hz", (mode,)),
                Quantity("damping ratio", self.ratios, "", (mode,)),
                Quantity("gain", self.gains, "", (mode, output, base)),
                Quantity("static", self.static, "", (output, base)),
                Quantity("mass", self.mass, "kg", (base,)),
            ]
        )

    @property
    def mobilities(self) -> Complex[Array, "modes outputs base"]:
        """Mobilities `B_ik = k_g w_k / (M w_k^2)`: velocity per inertia force of the whole mass.  Source: S1 (44)."""
        return jnp.asarray(mobility_from_gain(self.gains, self.mass[None, None], self.omega[:, None, None]))

    def transmissibility(self, omega: ArrayLike) -> Complex[Array, "frequencies outputs base"]:
        """Motion per motion of the base at any frequencies [rad/s], summed over the modes.

        `T = static + sum_k k_g 2 i z_k w^2 / (w_k^2 - w^2 + 2 i z_k w_k w)`.  Source: S1 (43), (45).
        """
        w, wk, z = as_dtype(omega, self.omega.dtype)[:, None], self.omega[None], self.ratios[None]
        top = lax.complex(jnp.zeros_like(w * wk), 2 * z * w**2)
        share = top / lax.complex(wk**2 - w**2, 2 * z * wk * w)
        return self.static.astype(share.dtype)[None] + jnp.einsum("wk,kib->wib", share, self.gains)


def resonance_gains(
    *, K: AnyArray, M: AnyArray, base: RowsLike, out: RowsLike, ratios: ArrayLike, num: int | None = None
) -> ResonanceGains:
    """Acceleration gains `k_g,ik = q''_ik / x''_C = -i phi_ik Gamma_k / (2 z_k)` of a structure driven by its base.

    `Gamma_k = phi_k^T (M T)_N` is the participation of the mode with the base fixed; T is the static motion with the
    base.  With all modes the result has the `transmissibility` of a structure with this modal damping.

    Args:
        K, M: (n, n).
        base: coordinates that are moved; out: coordinates outside the base.
        ratios: damping ratios of the modes, one or (modes,), none of them zero.
        num: number of modes, default all.

    A single mode of a group of equal frequencies has no derivative of its own; frequencies and sums over groups have.

    Raises: ValueError for outputs on the base, negative stiffness and, if concrete, ratios that are not positive.
    Source: S1 (43)-(45).
    """
    if not_positive(ratios):
        raise ValueError(f"ratios = {ratios} must be positive: an undamped mode has no finite gain at its resonance")
    inner, outer = partition(len(K), base)
    place = {int(c): k for k, c in enumerate(inner)}
    if not set(out) <= set(place):
        raise ValueError(f"outputs {list(out)} must be coordinates outside the base, 0 ... {len(K) - 1}")
    T = interface_basis(K, outer)
    modes = stable_modes(K=K[inner][:, inner], M=M[inner][:, inner], num=num, num_rigid=0)
    participation = modes.shapes.T @ (M @ T)[inner]
    at = modes.shapes[np.array([place[int(c)] for c in out], int)]
    z = jnp.broadcast_to(as_dtype(ratios, K.dtype), modes.omega.shape)
    size = jnp.einsum("ik,kb->kib", at, participation) / (2 * z[:, None, None])
    gains = lax.complex(jnp.zeros_like(size), -size)
    mass = jnp.sum(T * (M @ T), axis=0)
    return ResonanceGains(gains, modes.omega, z, T[np.asarray(out, int)], mass)
