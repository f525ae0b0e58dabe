"""Crank trains in torsion: inertias in a row on shafts, natural frequencies and vibration by orders of torques."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Complex, Float

from ..checks import any_concrete, faults_if
from ..errors import ModelError
from ..linear._system import LinearSystem
from ..math import _square as square
from ..runtime import as_array
from ..tables import fields_repr
from ..typing import ArrayLike, Convertible
from ._orders import Orders


class CrankTrain(eqx.Module):
    """Inertias in a row, joined by shafts.

    Attributes:
        inertias: (n,) [kg m^2], of a crank throw with half the oscillating mass at the crank's radius.
        stiffness: (n - 1,) of the shafts between [N m/rad]; losses: (n - 1,) their dampers [N m s/rad].
        damping: (n,) to ground [N m s/rad].

    Raises: ModelError for numbers that do not fit each other.
    """

    inertias: Convertible[Float[Array, " n"]] = eqx.field(converter=as_array)
    stiffness: Convertible[Float[Array, " shafts"]] = eqx.field(converter=as_array)
    losses: Convertible[Float[Array, " shafts"]]
    damping: Convertible[Float[Array, " n"]]

    __repr__ = fields_repr

    def __init__(
        self, inertias: ArrayLike, stiffness: ArrayLike, losses: ArrayLike = 0.0, damping: ArrayLike = 0.0
    ) -> None:
        self.inertias, self.stiffness = as_array(inertias), as_array(stiffness)
        n = self.inertias.size
        losses, damping = as_array(losses), as_array(damping)
        faults = faults_if(
            (self.inertias.ndim != 1 or n < 2, "inertias must be a row of at least two"),
            (self.stiffness.shape != (n - 1,), f"stiffness must be a row of {n - 1}, one for each shaft"),
            (losses.shape not in ((), (n - 1,)), f"losses must be one number or {n - 1}"),
            (damping.shape not in ((), (n,)), f"damping must be one number or {n}"),
            (any_concrete(lambda x: ~((x > 0) & np.isfinite(x)), self.inertias), "inertias must be positive"),
            (any_concrete(lambda x: ~((x > 0) & np.isfinite(x)), self.stiffness), "stiffness must be positive"),
            *(
                (any_concrete(lambda x: ~((x >= 0) & np.isfinite(x)), x), f"{name} must not be negative")
                for name, x in (("losses", losses), ("damping", damping))
            ),
        )
        if faults:
            raise ModelError(faults, "the crank train")
        self.losses, self.damping = jnp.broadcast_to(losses, (n - 1,)), jnp.broadcast_to(damping, (n,))

    def linear(self) -> LinearSystem:
        """The train as a linear system, its angles "0 rz", "1 rz", ..."""
        n = self.inertias.size
        D = jnp.asarray(np.diff(np.eye(n), axis=0), self.inertias.dtype)
        K, C = (D.T @ (x[:, None] * D) for x in (self.stiffness, self.losses))
        names = [f"{k} rz" for k in range(n)]
        return LinearSystem(
            mass=jnp.diag(self.inertias), stiffness=K, damping=C + jnp.diag(self.damping), coordinates=names
        )

    def frequencies(self) -> Float[Array, " n_1"]:
        """Natural frequencies (n - 1,) [rad/s] without losses, the rotation of the whole left out."""
        D = jnp.asarray(np.diff(np.eye(self.inertias.size), axis=0), self.inertias.dtype)
        A = jnp.sqrt(self.stiffness)[:, None] * D / jnp.sqrt(self.inertias)[None, :]
        return jnp.sqrt(jnp.linalg.eigvalsh(A @ A.T))

    def critical_speeds(self, order: float) -> Float[Array, " n_1"]:
        """Speeds (n - 1,) [rad/s] at which an order meets the natural frequencies."""
        if not order > 0:
            raise ModelError([f"order={order!r} must be positive"], "the crank train")
        return self.frequencies() / order

    def response(self, speed: ArrayLike, torques: dict[int, Orders]) -> Complex[Array, "K n"]:
        """Angles (K, n) [rad] of the inertias at a speed () [rad/s], for each order but the mean.

        Args: torques: number of an inertia -> orders of the torque on it [N m], all of the same orders.

        Raises: ModelError.
        """
        n, given = self.inertias.size, list(torques.items())
        faults = [f"torques: there is no inertia {k!r}" for k, _ in given if k not in range(n)]
        sizes = {tuple(np.asarray(found.orders).tolist()) for _, found in given}
        faults += [] if len(sizes) == 1 else ["torques must have the same orders, at least at one inertia"]
        if faults:
            raise ModelError(faults, "the crank train")
        load = jnp.stack([jnp.zeros_like(given[0][1].amplitudes)] * n)
        for k, found in given:
            load = load.at[k].add(found.amplitudes)
        system = self.linear()
        w = as_array(speed) * given[0][1].orders[1:]
        M, C, K = (jnp.asarray(x) for x in (system.mass, system.damping, system.stiffness))
        Z = jnp.stack([_dynamic_stiffness(M, C, K, x) for x in w])
        return jnp.stack([square.solve(z, f) for z, f in zip(Z, load.T[1:], strict=True)])

    def shaft_torques(self, angles: ArrayLike) -> Complex[Array, "K shafts"]:
        """Torques (K, n - 1) [N m] in the shafts at angles (K, n) of `response`."""
        angles = jnp.asarray(angles)
        return jnp.diff(angles, axis=1) * self.stiffness[None, :].astype(angles.dtype)


def _dynamic_stiffness(M, C, K, w):
    """`K + i w C - w^2 M`."""
    return lax.complex(K - w**2 * M, w * C)
