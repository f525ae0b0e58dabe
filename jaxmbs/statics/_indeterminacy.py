"""Static indeterminacy of a network, on the host: rank, undetermined components and self-stresses."""

import dataclasses
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..runtime import jit, tuning
from ._bonds import Bonds
from ._cycles import cycle_pattern
from ._least_compliance import least_compliance
from ._network import BodyNetwork

_COMPONENTS = tuple(f"{kind} {axis}" for kind in ("force", "moment") for axis in "xyz")
_RANK_TOLERANCE = {8: 1e-9, 4: 1e-4}  # relative to the largest singular value
_COMPONENT_TOLERANCE = {8: 1e-6, 4: 1e-3}  # relative to the largest component of a self-stress
_MAX_PROBES = 512  # random vectors at most, doubled until some of what they span is not redundant


def _summary(found):
    """Summary and table of the bonds that have undetermined components."""
    summary = f"{found.redundant} redundant of rank {found.rank}, mobility {found.mobility}, by {found.method}"
    rows = [(name, ", ".join(components)) for name, components in found.components.items()]
    return summary, [("bond", "undetermined"), *rows]


@dataclass(frozen=True, eq=False, repr=False)
class Redundancy(Reported):
    """Result of `redundancy` at one configuration.  Source: S1 (26), q = 6p - N + r unknowns of rank 6p - N.

    `rank` of the free directions in the 6 S loop parameters; `redundant` r = 6 S - rank, number of reactions that
    statics leaves open; `mobility` N, freedoms of the bodies (those of floating parts as a whole left out).
    `undetermined`: (force x y z, moment x y z) of every bond in its axes.  `self_stress` (r, q, 6): components of an
    orthonormal basis (moments over the length) of the reactions without load, or None where there are too many.
    `method`: "svd" or "random projection".
    """

    network: BodyNetwork
    rank: int
    redundant: int
    mobility: int
    undetermined: tuple[tuple[bool, ...], ...]
    self_stress: np.ndarray | None
    method: str

    def report(self) -> Report:
        summary, rows = _summary(self)
        counts = {"rank": self.rank, "redundant": self.redundant, "mobility": self.mobility}
        axes = (Axis("bond", self.network.bonds), Axis("component", _COMPONENTS))
        marks = Quantity("undetermined", np.asarray(self.undetermined, bool).reshape(-1, 6), "", axes)
        return Report([*(Quantity(*pair) for pair in counts.items()), marks], summary, table=rows)

    @property
    def components(self) -> dict[str, tuple[str, ...]]:
        """The undetermined components by bond name, of the bonds that have any."""
        marks = zip(self.network.bonds, self.undetermined, strict=True)
        named = {name: tuple(c for c, m in zip(_COMPONENTS, row, strict=True) if m) for name, row in marks}
        return {name: row for name, row in named.items() if row}


def redundancy(bonds: Bonds, method: str = "auto") -> Redundancy:
    """Redundancy of concrete bonds at their configuration.  Source: S1 (26).

    Args: method: "svd" of the free directions against the loops, dense; "random projection" of many vectors onto the
        self-stresses and onto the motions by the solver of the reactions, linear in the size of the network, until
        more vectors bring no new direction; "auto": svd up to 6 S = 600.

    Raises: ValueError for another method; NotImplementedError when r and N are both beyond 512.
    """
    if method not in ("auto", "svd", "random projection"):
        raise ValueError(f"method must be 'auto', 'svd' or 'random projection', got {method!r}")
    network = bonds.network
    if not np.all([np.all(np.isfinite(x)) for x in (bonds.position, bonds.frame, bonds.free)]):
        raise ValueError("positions, frames and free directions of the bonds must be finite numbers")
    if method == "auto":
        small = (
            6 * network.num_loops <= tuning.SVD_PARAMETERS
            and len(network.bonds) * network.num_loops <= tuning.SVD_ENTRIES
        )
        method = "svd" if small else "random projection"
    middle = np.asarray(bonds.position).sum(0, keepdims=True) / max(1, len(network.bonds))
    near = eqx.tree_at(lambda b: b.position, bonds, bonds.position - jnp.asarray(middle))
    free = _free_count(near)
    if method == "svd" or network.num_loops == 0:
        stress = _self_stress_by_svd(near)
        redundant = len(stress)
    else:
        stress, redundant = _self_stress_by_projection(near, free)
    rank = 6 * network.num_loops - redundant
    mobility = free - rank
    marks = _undetermined_components(stress, bonds)
    basis = stress if redundant == len(stress) else None
    return Redundancy(network, rank, redundant, mobility, marks, _in_newtons(basis, bonds), method)


def with_redundancy(bonds: Bonds, found: Redundancy | None = None) -> Bonds:
    """The bonds with the undetermined components marked, so that reactions know which are unique."""
    found = redundancy(bonds) if found is None else found
    return dataclasses.replace(bonds, undetermined=found.undetermined)


def _wrench_scale(bonds):
    """Forces and moments (6,) of unit size; those of twists are its inverse."""
    return np.r_[np.ones(3), np.full(3, float(bonds.length))]


def _in_newtons(stress, bonds):
    return None if stress is None else stress * _wrench_scale(bonds)


def _undetermined_components(stress, bonds):
    if len(stress) == 0:
        return tuple((False,) * 6 for _ in bonds.network.bonds)
    change = np.abs(stress).max(axis=0)
    marks = change > _COMPONENT_TOLERANCE[bonds.position.dtype.itemsize] * change.max()
    return tuple(tuple(bool(m) for m in row) for row in marks)


def _free_rows(bonds):
    """Unit free twists (q, 6, f) in the bonds' axes, angles times the length; zero columns where unused."""
    size = np.asarray(bonds.free_sizes(), float)
    rows = _wrench_scale(bonds)[None, :, None] * np.asarray(bonds.free, float)
    return rows / np.sqrt(np.where(size > 0, size, np.inf))[:, None, :]


def _free_count(bonds):
    rows = _free_rows(bonds)
    # unit columns: they are one direction where they agree to 1e-6, as `_COMPONENT_TOLERANCE`
    return int(np.sum(np.linalg.svd(rows, compute_uv=False) > 1e-6)) if rows.size else 0


def _self_stress_by_svd(bonds):
    """Orthonormal self-stresses (r, q, 6), components in the bonds' axes, moments over the length."""
    Y, scale = cycle_pattern(bonds.network), _wrench_scale(bonds)
    q, S = Y.shape
    to_bond = np.swapaxes(np.asarray(bonds.twist_axes, float), 1, 2)
    to_bond = to_bond * scale[None, None, :] / scale[None, :, None]  # both sides in N, moments over the length
    wrench = np.einsum("qs,qij->qisj", Y, to_bond).reshape(q, 6, 6 * S)
    free = _free_rows(bonds)
    rows = np.einsum("qic,qis->qcs", free, wrench).reshape(q * free.shape[2], 6 * S)
    rows = np.linalg.qr(rows, mode="r")
    _, s, Vt = np.linalg.svd(rows) if rows.size else (None, np.zeros(0), np.eye(6 * S))
    tolerance = _RANK_TOLERANCE[bonds.position.dtype.itemsize] * max(s.max(initial=0.0), 1e-30)
    stress = wrench.reshape(6 * q, 6 * S) @ Vt[int(np.sum(s > tolerance)) :].T
    basis = np.linalg.qr(stress)[0].T
    return basis.reshape(len(basis), q, 6)


@jit(compile="tape")
def _project_probes(bonds, deformations, efforts):
    """Components (n, q, 6) of the self-stresses nearest to random ones, and the motions (n, q, f) along the free
    twists that random efforts there leave."""
    idle = jnp.zeros((len(bonds.network.bodies), 6), bonds.position.dtype)
    pairs = ((deformations, jnp.zeros_like(deformations)), (jnp.zeros_like(efforts), efforts))
    problems = (jnp.concatenate(pair) for pair in pairs)
    wrenches = jax.vmap(lambda d, e: bonds.components(least_compliance(bonds, d, e, idle)))(*problems)
    stresses, answers = jnp.split(wrenches, 2)
    return stresses, efforts - jnp.einsum("qic,nqi->nqc", bonds.free, answers)


def _self_stress_by_projection(bonds, free):
    """Self-stresses (n, q, 6) and their number r, from 8, 16, 32, ... random vectors; n < r where only the motions
    are few.  A randomised range finder: Halko, Martinsson, Tropp, SIAM Review 53, 2011."""
    # any seed, since random vectors miss no direction; a fixed one, so that a count can be repeated
    random, q, dtype = np.random.default_rng(3), len(bonds.network.bonds), bonds.position.dtype
    scale = _wrench_scale(bonds)
    equal = jnp.broadcast_to(jnp.diag(jnp.asarray(scale**-2, dtype)), bonds.compliance.shape)
    bonds = eqx.tree_at(lambda b: b.compliance, bonds, equal)  # the rank is that of any compliance
    size = np.sqrt(np.asarray(bonds.free_sizes(), float))
    count = 8
    while count <= _MAX_PROBES:
        deformations, efforts = random.normal(size=(count, q, 6)), random.normal(size=(count, *size.shape))
        deformations = np.einsum("qij,nqj->nqi", np.asarray(bonds.twist_axes, float), deformations / scale)
        stress, motion = _project_probes(bonds, jnp.asarray(deformations, dtype), jnp.asarray(efforts * size, dtype))
        stress = _orthonormal_basis(np.asarray(stress, float) / scale, dtype)
        motions = _orthonormal_basis(np.asarray(motion, float) / np.where(size > 0, size, np.inf), dtype)
        if len(stress) < count:
            return stress, len(stress)
        if len(motions) < count:
            return stress, 6 * bonds.network.num_loops - free + len(motions)
        count *= 2
    raise NotImplementedError(
        f"the network has more than {_MAX_PROBES} redundant reactions and more than {_MAX_PROBES} freedoms; split "
        'it, or use method="svd", which is dense'
    )


def _orthonormal_basis(vectors, dtype):
    """Orthonormal basis (n, q, k) of the vectors (m, q, k), without directions that are rounding."""
    if vectors.size == 0:
        return vectors[:0]
    _, s, Vt = np.linalg.svd(vectors.reshape(len(vectors), -1), full_matrices=False)
    n = int(np.sum(s > _COMPONENT_TOLERANCE[dtype.itemsize] * np.sqrt(vectors[0].size)))
    return Vt[:n].reshape(n, *vectors.shape[1:])
