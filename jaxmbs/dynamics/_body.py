"""What dynamics asks of bodies of one kind; `bodies.py` has the kinds of a system and their sums.

`at` is a `Moving`.  A new kind answers these questions; efforts, momenta, energies and reactions know none.
"""

import abc
from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
from jax import Array

from ..kinematics._configuration import Configuration
from ._loads import Loads


class AbstractBodies(eqx.Module):
    """Bodies of one kind, one group of arrays."""

    @abc.abstractmethod
    def mass(self, system) -> Array:
        """Of all of them [kg]."""

    @abc.abstractmethod
    def momenta(self, system, at) -> Loads:
        """On nodes."""

    @abc.abstractmethod
    def inertial_loads(self, system, at) -> Loads:
        """What changes the momenta beside loads: the motion itself, and gravity; on nodes."""

    @abc.abstractmethod
    def inverse_dynamics_loads(self, system, at, V_dot, u_dot, owners) -> Loads:
        """Beside gravity, for twist rates V_dot (nodes, 6) and accelerations u_dot (nv,); on `kinematics.owners`."""

    @abc.abstractmethod
    def energies(self, system, at) -> tuple[Array, Array]:
        """Kinetic energy [J], and mass times place (3,) about the world origin [kg m], what gravity lifts."""

    @abc.abstractmethod
    def weight(self, system, at, Gamma) -> Array:
        """Efforts (N,) of gravity on independent velocities, with Gamma (nv, N) of `velocity_map`; `at` of a
        `Configuration`.  Source: S2 (75)."""

    def strain_efforts(self, system, at, owners) -> tuple[Loads, tuple[Array, ...]]:
        """Loads of stiffness and damping inside the bodies, and the powers of their dampers, in one array or none."""
        return Loads(), ()

    def frozen_strain_loads(self, system, at) -> Callable[[Configuration], Loads]:
        """What stiffness exerts at `at`, a `Configuration`, held: a function of another one to the loads there."""
        return lambda moved: Loads()

    def strain_energy(self, system, at) -> Array:
        """[J]; `at` of a `Configuration`."""
        return jnp.zeros((), at.psi.dtype)

    def strain_stiffness(self, system, at, Gamma) -> Array:
        """(N, N) on independent velocities; `at` of a `Configuration`."""
        return jnp.zeros((Gamma.shape[1],) * 2, at.psi.dtype)
