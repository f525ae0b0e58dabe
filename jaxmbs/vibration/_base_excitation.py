"""Acceleration gains of a structure on a moving base, mode by mode, and the mobilities behind them."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Complex, Float

from ..checks import not_positive
from ..linear._condensation import interface_basis, partition
from ..typing import AnyArray, ArrayLike, RowsLike
from ._gains import mobility_from_gain
from ._modes import stable_modes


class ResonanceGains(eqx.Module):
    """The table of S1 (45): the share of every mode k in the acceleration at a point i, per acceleration of the base,
    while the base vibrates at the mode's own frequency.

    Attributes:
        gains: (modes, outputs, base) complex; near `-i` times a real number, a quarter period behind.
        omega: (modes,) [rad/s] with the base held; ratios: (modes,) of damping.
        static: (outputs, base), the motion that follows the base at once.
        mass: (base,) [kg] of the whole structure in a unit motion of each base coordinate.
    """

    gains: Complex[Array, "modes outputs base"]
    omega: Float[Array, " modes"]
    ratios: Float[Array, " modes"]
    static: Float[Array, "outputs base"]
    mass: Float[Array, " base"]

    @property
    def mobilities(self) -> Complex[Array, "modes outputs base"]:
        """`B_ik = k_g w_k / (M w_k^2)`: velocity per inertia force of the whole mass.  Source: S1 (44)."""
        return jnp.asarray(mobility_from_gain(self.gains, self.mass[None, None], self.omega[:, None, None]))

    def transmissibility(self, omega: ArrayLike) -> Complex[Array, "frequencies outputs base"]:
        """The motion at any frequencies [rad/s] per motion of the base, the sum over the modes.

        `T = static + sum_k k_g 2 i z_k w^2 / (w_k^2 - w^2 + 2 i z_k w_k w)`.  Source: S1 (43), (45).
        """
        w, wk, z = jnp.asarray(omega, self.omega.dtype)[:, None], self.omega[None], self.ratios[None]
        top = lax.complex(jnp.zeros_like(w * wk), 2 * z * w**2)
        share = top / lax.complex(wk**2 - w**2, 2 * z * wk * w)
        return self.static.astype(share.dtype)[None] + jnp.einsum("wk,kib->wib", share, self.gains)


def resonance_gains(
    *, K: AnyArray, M: AnyArray, base: RowsLike, out: RowsLike, ratios: ArrayLike, num: int | None = None
) -> ResonanceGains:
    """The gains `k_g,ik = q''_ik / x''_C` of a structure driven through its base: `-i phi_ik Gamma_k / (2 z_k)`.

    `Gamma_k = phi_k^T (M T)_N` is the participation of the mode with the base held; T is the static motion with the
    base.  All modes are the `transmissibility` of a structure with this damping inside of it.

    Args:
        base: coordinates that are moved; out: coordinates outside of it.
        ratios: damping of the modes, one or (modes,), none of them zero.
        num: modes, default all.

    A single mode of a group of equal frequencies has no derivative of its own; frequencies and sums over groups have.

    Raises: ValueError for outputs on the base and, if concrete, ratios that are not positive; as `stable_modes`.
    Source: S1 (43)-(45).
    """
    if not_positive(ratios):
        raise ValueError(f"ratios = {ratios}: at its resonance an undamped mode has no gain")
    inner, outer = partition(len(K), base)
    place = {int(c): k for k, c in enumerate(inner)}
    if not set(out) <= set(place):
        raise ValueError(f"outputs {list(out)} must be coordinates outside the base, 0 ... {len(K) - 1}")
    T = interface_basis(K, outer)
    modes = stable_modes(K=K[inner][:, inner], M=M[inner][:, inner], num=num, num_rigid=0)
    participation = modes.shapes.T @ (M @ T)[inner]
    at = modes.shapes[np.array([place[int(c)] for c in out], int)]
    z = jnp.broadcast_to(jnp.asarray(ratios, K.dtype), modes.omega.shape)
    size = jnp.einsum("ik,kb->kib", at, participation) / (2 * z[:, None, None])
    gains = lax.complex(jnp.zeros_like(size), -size)
    mass = jnp.sum(T * (M @ T), axis=0)
    return ResonanceGains(gains, modes.omega, z, T[np.asarray(out, int)], mass)
