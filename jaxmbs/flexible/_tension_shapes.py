"""Shapes of an elastic body whose interfaces are pulled, which normal modes at rest describe badly."""

import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..fem import Structure, geometric_stiffness
from ..linear._system import LinearSystem
from ..math._linalg import direction
from ..math._spd import spd_solve
from ..reductions._base import Reduced
from ..reductions._craig_bampton import CraigBampton
from ..runtime import jit, lapack
from ._second_order import check_structure

#: Of each other interface: across the pull two displacements and two rotations.
SHAPES = 4
#: Pull in units of the largest that is sure to be below buckling, in whichever direction.
PULL = 0.9
#: Smallest eigenvalue of the energies of shapes of unit energy, and smallest energy beside that of the motions across
#: the pull, from which on shapes count as independent of each other and of the modes.
APART = 1e-8


def has_tension_shapes(system: LinearSystem, outer: tuple[int, ...], num_modes: int) -> bool:
    """True if there are other interfaces, and twice as many inner coordinates as modes and shapes."""
    added = SHAPES * (len(outer) // 6 - 1)
    return added > 0 and 2 * (num_modes + added) <= system.num_rows - len(outer)


def with_tension_shapes(
    system: LinearSystem, structure: Structure, outer: tuple[int, ...], num_modes: int
) -> Float[Array, "n m"]:
    """The basis of Craig and Bampton, and `SHAPES` more for each interface but the first.

    They are the static shapes of the interface's displacements and rotations across the line to the first interface
    while it is pulled along that line, less those without pull, and less their parts along the modes.  A blade with
    a mass at its tip needs them: under tension it bends near its ends only, and its lag, whose squared frequency is
    that of the flap less `speed^2`, shows an error of the flap much enlarged.

    Raises: ModelError as `check_structure`.  Source: Craig and Bampton (1968), for the static shapes of a body under
    stress.
    """
    rows = check_structure(system, structure)
    num = num_modes + SHAPES * (len(outer) // 6 - 1)
    basis = CraigBampton(num).of(system.with_interface(*outer)).basis
    return _replaced(system, structure, basis, outer, len(outer) + num_modes, rows)


@jit
def _replaced(system, structure, basis, outer, kept, rows):
    """The basis with its columns from `kept` on replaced by shapes under tension."""
    K, inner = system.stiffness, np.setdiff1d(np.arange(system.num_rows), outer)
    modes, others = basis[:, len(outer) : kept], basis[:, kept:]
    found = [_under_tension(system, structure, basis, outer, rows, inner, k) for k in range(6, len(outer), 6)]
    X = jnp.concatenate(found, axis=1)
    # modes are orthogonal to each other in the stiffness
    X = X - modes @ ((modes.T @ K @ X) / jnp.sum(modes * (K @ modes), axis=0)[:, None])
    X = X / jnp.sqrt(jnp.sum(X * (K @ X), axis=0) + APART)[None]
    return jnp.concatenate([basis[:, :kept], jnp.where(_are_independent(X, K), X, others)], axis=1)


def _are_independent(X, K):
    """True for shapes (n, m) that are independent; parts without geometric stiffness have none."""
    X, K = lax.stop_gradient((X, K))
    return lapack.eigh(X.T @ K @ X)[0][0] > APART


def _under_tension(system, structure, basis, outer, rows, inner, first):
    """Changes (n, SHAPES) by a pull of the static shapes of an interface, whose columns begin at `first`; of motions
    whose energy without pull is one."""
    K, own = system.stiffness, np.array(outer[first : first + 6])
    place = system.positions[system.nodes.index(system.coordinates[own[0]][0])]
    root = system.positions[system.nodes.index(system.coordinates[outer[0]][0])]
    axis = direction(place - root)
    free = np.setdiff1d(np.arange(len(K)), outer[:6])
    load = jnp.zeros(len(K), K.dtype).at[own[:3]].set(axis)
    stretched = jnp.zeros_like(load).at[free].set(spd_solve(K[np.ix_(free, free)], load[free]))
    G = _geometric(system, structure, stretched, rows)
    soft = spd_solve(K[np.ix_(inner, inner)], G[np.ix_(inner, inner)])
    size = jnp.sum(soft * soft.T)  # sum of the squares of all inverse buckling loads
    pull = jnp.where(size > 0, PULL / jnp.sqrt(jnp.where(size > 0, size, 1.0)), 0.0)
    across = _across(axis)
    motions = basis[:, first : first + 6] @ jnp.kron(jnp.eye(2, dtype=K.dtype), across)
    motions = motions / jnp.sqrt(jnp.sum(motions * (K @ motions), axis=0))[None]
    stressed = (K + pull * G)[np.ix_(inner, inner)]
    change = spd_solve(stressed, -pull * (G @ motions)[inner])
    return jnp.zeros_like(motions).at[inner].set(change)


def _geometric(system, structure, x, rows):
    """Geometric stiffness (n, n) of the substructure at its displacements x (n,)."""
    chosen = np.array(rows, int)
    if isinstance(system, Reduced):
        E = system.basis[chosen]
        return E.T @ geometric_stiffness(structure, E @ x) @ E
    G = geometric_stiffness(structure, x[chosen])
    return jnp.zeros((len(x), len(x)), x.dtype).at[np.ix_(chosen, chosen)].set(G)


def _across(axis):
    """Two unit vectors (3, 2) across an axis and each other."""
    helper = jnp.eye(3, dtype=axis.dtype)[jnp.argmin(jnp.abs(axis))]
    first = direction(jnp.cross(axis, helper))
    return jnp.stack([first, jnp.cross(axis, first)], axis=1)
