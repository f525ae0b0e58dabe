"""Interface of one kind of bodies, rigid or elastic; `_bodies.py` sums over the kinds of a system.

`at` is a `VelocityKinematics` unless said otherwise.  Efforts, momenta, energies and reactions use this interface
only, so that a new kind of body is one new class.
"""

import abc
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from ..forces._validity import Margin
from ..kinematics._configuration import Configuration
from ._loads import Loads


class AbstractBodies(eqx.Module):
    """Bodies of one kind, one group of arrays."""

    @abc.abstractmethod
    def mass(self, system) -> Array:
        """Total mass of these bodies [kg]."""

    @abc.abstractmethod
    def momenta(self, system, at) -> Loads:
        """Momenta of these bodies, summed on nodes."""

    @abc.abstractmethod
    def inertial_loads(self, system, at) -> Loads:
        """Rates of the momenta that are due to the motion itself and to gravity, summed on nodes."""

    @abc.abstractmethod
    def inverse_dynamics_loads(self, system, at, V_dot, u_dot, owners) -> Loads:
        """Loads beside gravity that twist rates V_dot (nodes, 6) and accelerations u_dot (nv,) require, summed on
        `owners`, a `WrenchTargets`."""

    def acceleration_loads(self, system, at, V_dot, u_dot, owners) -> Loads:
        """The part of `inverse_dynamics_loads` that is linear in the accelerations."""

        def of(V_dot, u_dot):
            return self.inverse_dynamics_loads(system, at, V_dot, u_dot, owners)

        return jax.jvp(of, (jnp.zeros_like(V_dot), jnp.zeros_like(u_dot)), (V_dot, u_dot))[1]

    @abc.abstractmethod
    def energies(self, system, at) -> tuple[Array, Array]:
        """Kinetic energy [J], and first moment of mass (3,) about the world origin [kg m], for the energy of
        gravity."""

    @abc.abstractmethod
    def weight(self, system, at, Gamma) -> Array:
        """Efforts (N,) of gravity on independent velocities, with Gamma (nv, N) of `velocity_map`; `at` is a
        `Configuration`.  Source: S2 (75)."""

    def validity(self, system, at) -> tuple[tuple[str, ...], dict[str, Margin]]:
        """Names of the bodies, and their margins (bodies,) to the ends of the model by name; none by default."""
        return (), {}

    def strain_efforts(self, system, at, owners) -> tuple[Loads, tuple[Array, ...]]:
        """Loads of stiffness and damping inside the bodies, and a tuple of the array of their dampers' powers, or
        ()."""
        return Loads(), ()

    def frozen_strain_loads(self, system, at) -> Callable[[Configuration], Loads]:
        """Strain loads of the configuration `at`, frozen: a function from another configuration to the loads that
        the same internal loads exert there."""
        return lambda moved: Loads()

    def strain_energy(self, system, at) -> Array:
        """Energy stored in strains [J]; `at` is a `Configuration`."""
        return jnp.zeros((), at.psi.dtype)

    def strain_energy_and_validity(self, system, at) -> tuple[Array, tuple[tuple[str, ...], dict[str, Margin]]]:
        """`strain_energy` and `validity`, which share the deformations."""
        return self.strain_energy(system, at), self.validity(system, at)

    def strain_stiffness(self, system, at, Gamma) -> Array:
        """Stiffness (N, N) of the strains on the independent velocities; `at` is a `Configuration`."""
        return jnp.zeros((Gamma.shape[1],) * 2, at.psi.dtype)
