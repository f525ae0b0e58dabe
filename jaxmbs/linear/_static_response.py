"""Static response; free structures by inertia relief: the inertia of the steady acceleration balances the loads."""

import dataclasses
from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float

from ..blocksparse import BlockMatrix
from ..checks import is_concrete
from ..math import _square as square
from ..quantities import Quantity, numbered
from ..reports import Report, Reported, failures
from ..runtime import as_array, jit
from ..typing import AnyArray, ArrayLike
from ._block_statics import PROBE_ERROR, solve_statics
from ._rigid_motions import rigid_rows
from ._system import LinearSystem


class StaticResponse(Reported, eqx.Module):
    """Static displacements of a linear system under loads, or during the steady acceleration that they cause.

    Attributes:
        displacement: (..., n) [m, rad].
        acceleration: (..., d) along the rigid motions, d = 0 for a constrained system.
        rigid: (n, d), the rigid motions.
        forces: the forces that were given to `equilibrium`, for `reactions`.
    """

    displacement: Float[Array, "... n"]
    acceleration: Float[Array, "... d"]
    rigid: Float[Array, "n d"]
    forces: tuple = ()

    def report(self) -> Report:
        own, rigid = (
            numbered(n, x.shape[-1]) for n, x in (("coordinate", self.displacement), ("motion", self.acceleration))
        )
        return Report(
            [
                Quantity("displacement", self.displacement, "m or rad", (own,)),
                Quantity("acceleration along rigid", self.acceleration, "m/s^2 or rad/s^2", (rigid,)),
            ],
            fault=failures(self.ok, "not finite"),
        )

    @property
    def ok(self) -> Bool[Array, "..."]:
        """True where the displacements are finite; under tracing a singular stiffness makes them infinite or NaN."""
        return jnp.all(jnp.isfinite(self.displacement), axis=-1)

    def terms(self, system: LinearSystem) -> tuple:
        """Displacement, velocity (None: at rest) and acceleration (..., n) on which K, C and M act."""
        return self.displacement, None, self.acceleration @ self.rigid.T


def static_response(
    *, K: AnyArray, load: AnyArray, M: AnyArray | None = None, rigid: AnyArray | None = None
) -> StaticResponse:
    """Solve `K x = f`; with rigid motions R `K x + M R a = f` and `R^T M x = 0` (inertia relief).

    Args:
        K: stiffness (n, n).
        load: f (..., n), any number of load cases.
        M, rigid: mass (n, n) and R (n, d) of a free structure: `rigid_motions` of its nodes, or its rigid modes.

    Raises: ValueError for rigid motions without M and, if concrete, for a singular stiffness: supports or rigid
    motions are missing.
    Source: S1 (3), (30).
    """
    if rigid is not None and M is None:
        raise ValueError("inertia relief needs the mass matrix: give M together with the rigid motions")
    if rigid is None or not rigid.shape[1]:
        _check_nonsingular(K, _missing(False))
        still = as_array(np.zeros((*load.shape[:-1], 0)), K.dtype)
        return StaticResponse(_solve(K, load), still, as_array(np.zeros((len(K), 0)), K.dtype))
    K, weight = _saddle(K, M, rigid)
    _check_nonsingular(K, _missing(True))
    n, d = rigid.shape
    found = _solve(K, jnp.concatenate([load, jnp.zeros((*load.shape[:-1], d), load.dtype)], -1))
    return StaticResponse(found[..., :n], weight * found[..., n:], jnp.asarray(rigid))


@jit
def _solve(K, load):
    return square.solve(K, load.reshape(-1, load.shape[-1]).T).T.reshape(load.shape)


@jit
def _saddle(K, M, rigid):
    """The matrix of displacements and accelerations along the rigid motions, and the unit of these."""
    d = rigid.shape[1]
    carried = jnp.matmul(jnp.asarray(M), rigid)
    size = jnp.max(jnp.abs(K))  # zero where all components are rigid
    size = jnp.where(size > 0, size, 1)
    weight = lax.stop_gradient(size / jnp.max(jnp.abs(carried)))  # equal sizes in the saddle
    return jnp.block([[jnp.asarray(K), weight * carried], [weight * carried.T, jnp.zeros((d, d), K.dtype)]]), weight


def equilibrium(system: LinearSystem, forces: Mapping | ArrayLike, free: bool = False) -> StaticResponse:
    """Static equilibrium `K x = f` under forces; of a free structure the steady acceleration that they cause.

    Args:
        forces: by name as `LinearSystem.load` takes them, or (..., n): any number of load cases.
        free: True for a free structure: the inertia of its rigid motions, found from the positions of its nodes,
            balances the forces.

    Raises: ValueError for a singular stiffness, if concrete; UnknownNameError; ModelError where positions are
    missing.
    Source: S1 (3), (30).
    """
    rigid = None
    if free:
        rigid = rigid_rows(system)
        if is_concrete(rigid):
            rigid = rigid[:, np.any(np.asarray(rigid) != 0, axis=0)]
    if isinstance(system.stiffness, BlockMatrix):
        return _block_equilibrium(system, forces, rigid)
    system = system.to_dense()
    found = static_response(K=system.stiffness, M=system.mass, load=system.load(forces), rigid=rigid)
    return dataclasses.replace(found, forces=(forces,))


def _block_equilibrium(system, forces, rigid):
    load = system.load(forces)
    columns = load.reshape(-1, load.shape[-1]).T
    x, a, error = solve_statics(system, columns, rigid)
    if is_concrete(error) and not error < PROBE_ERROR:
        raise ValueError(_SINGULAR + _missing(rigid is not None))
    rigid = jnp.zeros((system.num_rows, 0), x.dtype) if rigid is None else rigid
    acceleration = a.T.reshape(*load.shape[:-1], rigid.shape[1])
    return StaticResponse(x.T.reshape(load.shape), acceleration, rigid, (forces,))


_SINGULAR = "the stiffness is singular: there is a motion without strain, "


def _missing(free):
    return "other than those given" if free else "and the structure's mass and rigid motions are not given"


def _check_nonsingular(K, left):
    if not is_concrete(K):
        return
    K = np.asarray(K)
    size = np.sqrt(np.maximum(np.max(np.abs(K), axis=1), 1e-300))
    if not np.linalg.cond(K / np.outer(size, size), 1) < 0.01 / np.finfo(K.dtype).eps:
        raise ValueError(_SINGULAR + left)
