"""Structures under initial stress: geometric stiffness, stiffness under preload, buckling."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import is_concrete
from ..elements._base import as_real
from ..errors import ModelError
from ..linear._free_motions import free_coordinates, name_some
from ..math._eigen import eigh
from ..math._nan import nan_where
from ..math._spd import spd_solve
from ..quantities import Quantity, numbered
from ..reports import Report, failures, reported
from ..runtime import jit, lapack
from ..typing import AnyArray
from ._assembly import assemble_dense, sum_dense
from ._structure import Structure, scatter_rows

#: Softening, over the largest stiffening or softening, that is rounding.
ROUNDING = {8: 1e-10, 4: 1e-4}
#: Squared pivot of the stiffness over its diagonal, in units of rounding, that is taken for zero.
_ZERO_PIVOT = 30


@reported
class Buckling(NamedTuple):
    """Buckling of a structure.

    Attributes:
        factors: (num,) by which the load must grow, ascending; infinite where the load does not buckle it, NaN where
            nothing holds the structure.
        shapes: (rows, num) of buckling, `x^T K x = 1`.
        displacements: (rows,) under the load itself, linear.
    """

    factors: Float[Array, " num"]
    shapes: Float[Array, "rows num"]
    displacements: Float[Array, " rows"]

    def report(self) -> Report:
        mode, row = (numbered(*pair) for pair in zip(("mode", "row"), np.shape(self.shapes)[::-1], strict=True))
        fault = failures(~np.isnan(np.asarray(self.factors)).any(), "nothing holds the structure")
        return Report(
            [
                Quantity("load factor", self.factors, "", (mode,)),
                Quantity("displacement", self.displacements, "m or rad", (row,), in_table=False),
                Quantity("shape", self.shapes, "", (row, mode), in_table=False),
            ],
            fault=fault,
        )


@jit
def geometric_stiffness(structure: Structure, x: AnyArray) -> Float[Array, "rows rows"]:
    """Geometric stiffness (rows, rows) [N/m, N, N m] at the stress of displacements x, in rows `structure.labels`.

    Args: x: (rows,) of the dense matrices, or (nodes, 6): small displacements from the state without stress.

    It is linear in x.  With the stiffness K of `assemble_dense`, `K + geometric_stiffness(structure, x)` resists
    small motions about the stressed state.

    Raises: ValueError for x of another shape.
    Source: Zienkiewicz and Taylor, The finite element method (2000), vol. 2, 10.3.
    """
    return sum_dense(structure, lambda name: element_geometric_stiffness(structure, name, at_nodes(structure, x)))


def at_nodes(structure: Structure, x: AnyArray) -> Array:
    """Displacements (nodes, 6) from rows (rows,) or from (nodes, 6) themselves.  Raises: ValueError."""
    x = as_real(x)
    return x if x.shape == (structure.num_nodes, 6) else scatter_rows(structure, x)


def element_geometric_stiffness(structure: Structure, name: str, u: Array) -> Array:
    """Geometric stiffness (elements, n, n) of the elements of a group at nodal displacements u (nodes, 6)."""
    group = structure.groups[name]
    at = u[group.connections, : group.element.coordinates]
    return group.map(lambda element, nodes, u: element.geometric_stiffness(nodes, u), structure.positions, at)


def buckling(structure: Structure, load: AnyArray, num: int = 1) -> Buckling:
    """Factors of a load (rows,) [N, N m] at which a held structure buckles, `(K + factor K_g) x = 0`.

    Args: load: as `gather_rows(structure, nodal_load(...))`.  num: how many, the lowest positive ones.

    A factor below one says that the structure has buckled under the load itself.  Repeated factors have derivatives.
    Forces keep their direction.  Moments on nodes are semi-tangential: they turn half with the node across them.
    So a shaft on two bearings buckles under a torque of 4.911 EI / L; under one whose axis keeps its direction, or
    turns all with the shaft, it would under Greenhill's 2 pi EI / L.  Between clamped ends both are 8.987 EI / L.

    Raises: ValueError for a load of another shape, or more factors than rows; ModelError, if concrete, for a
    structure that moves without strain: what nothing holds turns away under any compression.
    Source: Timoshenko and Gere, Theory of elastic stability (1961); Yang and McGuire, J. Struct. Eng. 112 (1986)
    853-877 for moments.
    """
    rows = structure.index.num_rows
    if not 0 < num <= rows:
        raise ValueError(f"the structure has {rows} rows, got num = {num}")
    found = _buckling(structure, load, num)
    if is_concrete(found) and np.isnan(found.factors[0]):
        _refuse_free(structure, "buckling")
    return found


@jit
def _buckling(structure, load, num):
    K, x = _under_load(structure, load)
    softening, shapes = eigh(geometric_stiffness(structure, x), K)
    # K_g x = -(1 / factor) K x: the most negative value is the lowest factor
    lost = jnp.isnan(x[:1])
    buckles = softening[:num] < -ROUNDING[softening.dtype.itemsize] * jnp.max(jnp.abs(softening))
    factors = jnp.where(buckles, -1.0 / jnp.where(buckles, softening[:num], -1.0), jnp.inf)
    return Buckling(jnp.where(lost, jnp.nan, factors), shapes[:, :num], x)


def stiffness_under_load(structure: Structure, load: AnyArray) -> Float[Array, "rows rows"]:
    """Stiffness (rows, rows) about a held structure under a load (rows,) [N, N m].

    Raises: ValueError for a load of another shape; ModelError, if concrete, for a load beyond buckling and for a
    structure that moves without strain.
    """
    K, x = _under_load(structure, load)
    if is_concrete(x) and np.isnan(np.asarray(x)).any():
        _refuse_free(structure, "preload")
        raise ModelError(
            ["preload: the stiffness is singular to rounding: hold more nodes, or stiffen the structure"]
        )
    total = K + geometric_stiffness(structure, x)
    if is_concrete(total) and np.linalg.eigvalsh(np.asarray(total))[0] <= 0.0:
        factor = float(buckling(structure, load).factors[0])
        raise ModelError([f"preload: the structure buckles under {factor:.4g} times this load: give less"])
    return total


def _under_load(structure, load):
    """Stiffness (rows, rows) without load, and displacements (rows,) under it, NaN where nothing holds it."""
    (K,) = assemble_dense(structure, ("stiffness",))
    load = as_real(load).astype(K.dtype)
    if load.shape != (len(K),):
        raise ValueError(f"the structure has {len(K)} rows, got a load of shape {load.shape}")
    fixed = lax.stop_gradient(K)
    pivots = jnp.diagonal(lapack.cholesky(fixed)) ** 2 / jnp.diagonal(fixed)
    is_held = jnp.min(pivots) > _ZERO_PIVOT * jnp.finfo(K.dtype).eps  # false for pivots that are NaN
    return K, nan_where(~is_held, spd_solve(K, load))


def _refuse_free(structure, what):
    """Raises: ModelError with the coordinates that move without strain."""
    (K,) = assemble_dense(structure, ("stiffness",))
    count, rows = free_coordinates(K)
    if count:
        names = name_some(structure.labels, rows)
        raise ModelError(
            [
                f"{what}: nothing holds {names}: motions without strain: {count}; hold nodes with "
                'Structure(..., held={"node": "all"})'
            ]
        )
