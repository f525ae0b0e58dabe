"""`ComponentNetwork`, a linear system of components joined by named bonds, and the loads of the bonds."""

from collections.abc import Iterable, Mapping
from typing import Any, Protocol, runtime_checkable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..checks import is_concrete
from ..errors import ModelError
from ..linear._block_rows import NumberTable
from ..linear._storage import as_inexact
from ..linear._system import LinearSystem
from ..tables import table_repr
from ..typing import ArrayLike, CoordinateLike
from ._bond_loads import BondLoads, Determinacy, bond_loads, tie_loads
from ._group_reactions import tie_forces
from ._primal_assembly import Assembly, interface_reactions, joint_reactions
from ._self_stresses import component_self_stresses
from ._ties import Ties, split_component


def _table_rows(net):
    """Summary line and table of a network: components with their coordinates, bonds with their tied directions."""
    summary = f"{net.num_rows} coordinates of {len(net.names)} components, {len(net.bonds)} bonds"
    if net.linear_solver != "dense":
        summary += f", linear solver: {net.linear_solver}"
    rows = [
        (name, "component", f"{c.num_rows} coordinates, {c.num_interface} of them interface")
        for name, c in zip(net.names, net.components, strict=True)
    ]
    rows += [(name, "bond", " ".join(tie.labels[k] for k in tie.kept) or "ties nothing") for name, tie in net.bonds]
    return summary, [("name", "", ""), *rows]


class ComponentNetwork(Assembly):
    """Components and bushings joined by bonds with `connect`: a `LinearSystem` over the joined coordinates.

    Coordinates of components are named "stage.top z", also those that were reduced.

    Attributes:
        names: names of the components, then of the bushings.
        bonds: pairs (name, `Ties`).
        joints: by component, the joint number of each interface coordinate, -1 for the ground.
        points: by rigid body, matrix (k, 6) of the coordinates of its points per its own coordinates.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    bonds: tuple[tuple[str, Ties], ...] = eqx.field(static=True)
    joints: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    points: dict[str, Array]

    __repr__, _repr_html_ = table_repr(_table_rows)

    def __init__(
        self,
        *,
        names: Iterable[str],
        bonds: Iterable[tuple[str, Ties]],
        joints: tuple[tuple[int, ...], ...],
        points: Mapping[str, Array] | None = None,
        **options: Any,
    ) -> None:
        super().__init__(**options)
        self.names, self.bonds, self.joints, self.points = tuple(names), tuple(bonds), joints, dict(points or {})

    def expand(self, xi: ArrayLike) -> dict[str, Array]:
        """Displacements (..., n_c) of all coordinates of every component, by name, from joined ones (..., N)."""
        parts = self.component_coordinates(jnp.moveaxis(as_inexact(xi), -1, 0))
        found = zip(self.names, self.components, parts, strict=True)
        return {name: jnp.moveaxis(jnp.tensordot(c.basis.astype(rho.dtype), rho, 1), 0, -1) for name, c, rho in found}

    def outputs(self, *names: CoordinateLike) -> tuple[Array, tuple[str, ...]]:
        """Output matrix (k, N) and labels of coordinates "stage.top z", ("stage", "top z"), or nodes "stage.top"."""
        rows, labels = [jnp.zeros((0, self.num_rows), self.dtype)], []
        for name in names:
            component, own = self._component(name)
            found, which = self.components[component].outputs(own)
            place = np.array(self.places[component])
            spread = jnp.zeros((len(found), self.num_joined + 1), self.dtype)  # the last column is held
            spread = spread.at[:, place].add(found.astype(self.dtype))[:, :-1]
            rows.append(spread if self.transformation is None else spread @ self.transformation)
            labels += [f"{self.names[component]}.{label}" for label in which]
        return jnp.concatenate(rows), tuple(labels)

    def _component(self, name):
        component, own = split_component(name, self.names)
        return self.names.index(component), own

    def load(self, forces: Mapping | ArrayLike) -> Array:
        """Load vectors (..., N) of forces as in `LinearSystem.load`, or (..., n_c) by the name of a component.

        Source: S1 (18), (21)-(25).
        """
        if not isinstance(forces, Mapping):
            return super().load(forces)
        shares = self.component_forces(forces)
        times = np.broadcast_shapes(*(s.shape[:-1] for s in shares if s is not None))
        shares = [None if s is None else _coordinates_first(s, times) for s in shares]
        if all(share is None for share in shares):
            return jnp.zeros(self.num_rows, self.dtype)
        return jnp.moveaxis(self.gather_forces(shares), 0, -1)

    def component_forces(self, forces: Mapping) -> list:
        """Generalised forces (..., r_c) on every component, None for none.  Source: S1 (17)-(18)."""
        if not isinstance(forces, Mapping):
            raise ValueError("forces on a network must be given by name, such as {'stage.top z': 1.0}")
        own = [{} for _ in self.names]
        for name, force in forces.items():
            if name in self.names:
                component, force = self.names.index(name), as_inexact(force)
                basis = self.components[component].basis
                if force.shape[-1:] != (len(basis),):
                    raise ValueError(f"forces on {name!r} have shape {force.shape}, not (..., {len(basis)})")
                own[component][None] = force @ basis.astype(force.dtype)
            else:
                component, label = self._component(name)
                own[component][label] = force
        return [
            _generalised_force(c, dict(given)) if given else None
            for c, given in zip(self.components, own, strict=True)
        ]

    def determinacy(self, rigid: Mapping | None = None) -> Determinacy:
        """Static determinacy of the bonds, on the host.

        Args: rigid: by component, rigid motions of its interface (b, d); default: the motions below the widest gap
            in the eigenvalues of the stiffness of each component's interface.

        Source: S1 (14), (20).
        """
        rigid = None if rigid is None else [rigid[name] for name in self.names]
        ties = self._rows()
        if not is_concrete(ties):
            raise ValueError("redundant bonds are found on the host, which is not possible under tracing")
        stresses, free = component_self_stresses(np.asarray(ties), self.components, rigid)
        unknown, certain, at = np.abs(stresses).max(axis=1, initial=0.0) > 1e-6, {}, 0
        for name, bond in self.bonds:
            certain[name] = tuple(not flag for flag in unknown[at : at + len(bond.kept)])
            at += sum(len(pairs) for pairs in bond.pairs)
        labels = {name: tuple(bond.labels[k] for k in bond.kept) for name, bond in self.bonds}
        return Determinacy(stresses.shape[1], free, certain, labels)

    def _tie_table(self):
        """Pairs (ties, 2) of interface coordinates of all components that the ties join, -1 for the ground."""
        starts = np.cumsum([0, *map(len, self.joints)])
        place = dict(zip(self.names, starts.tolist(), strict=False))
        pairs = [pair for _, bond in self.bonds for side in bond.pairs for pair in side]
        table = [[-1 if c is None else place[c[0]] + c[1] for c in pair] for pair in pairs]
        return NumberTable(np.array(table, int).reshape(-1, 2))

    def _rows(self):
        """Rows of the ties (ties, b) over all interface coordinates; of rigid bodies over their own six."""
        starts = np.cumsum([0, *map(len, self.joints)])
        pairs = self._tie_table().numbers
        rows = np.zeros((len(pairs), starts[-1] + 1))  # the last column is the ground
        every = np.arange(len(pairs))
        rows[every, pairs[:, 0]], rows[every, pairs[:, 1]] = 1.0, -1.0
        rows = rows[:, :-1]
        if not self.points:
            return rows
        parts = zip(self.names, np.split(rows, starts[1:-1], axis=1), strict=True)
        return jnp.concatenate([B @ self.points[name] if name in self.points else B for name, B in parts], axis=1)


def _generalised_force(component, given):
    """Generalised forces (..., r_c): those of forces by label plus those given on all coordinates."""
    whole = given.pop(None, None)
    part = component.load(given) if given else None
    if whole is None or part is None:
        return part if whole is None else whole
    shape, dtype = np.broadcast_shapes(whole.shape, part.shape), np.result_type(whole.dtype, part.dtype)
    return jnp.broadcast_to(whole, shape).astype(dtype) + jnp.broadcast_to(part, shape).astype(dtype)


@runtime_checkable
class HasTerms(Protocol):
    """An answer of a linear system: the displacements and their rates (cases, r) that its matrices act on, and the
    forces given."""

    @property
    def forces(self) -> tuple: ...

    def terms(self, system: LinearSystem) -> tuple: ...


def reactions(network: LinearSystem, answer: HasTerms) -> BondLoads:
    """Loads of the bonds in a motion, at rest or over frequencies: `reactions(net, motion)["bolts"].force`.

    Args: answer: result of `simulate`, `equilibrium` or `harmonic_response` of this network.

    With fixed-interface modes these loads are those of mode acceleration.  Damping by `Modal(ratios)` or by a loss
    factor is distributed among the components as their stiffness is.

    Raises: ModelError for a linear system without bonds.  Source: S1 (3), (19)-(25).
    """
    if not isinstance(network, ComponentNetwork):
        raise ModelError(
            ["this linear system has no bonds: `reactions` takes a mechanism, or a network made by `connect`"]
        )
    x, *rates = answer.terms(network)
    elastic: Array = jnp.moveaxis(x, -1, 0)
    viscous, inertial = (None if part is None else jnp.moveaxis(part, -1, 0) for part in rates)
    shares = [None] * len(network.names)
    for given in answer.forces:
        new = [
            None if s is None else _coordinates_first(s, elastic.shape[1:]).astype(elastic.dtype)
            for s in network.component_forces(given)
        ]
        shares = [b if a is None else a if b is None else a + b for a, b in zip(shares, new, strict=True)]
    if network.groups:
        forces, *checks = joint_reactions(network, (elastic, viscous, inertial), shares)
        return bond_loads(network.bonds, tie_forces(network._tie_table(), len(forces), forces), *checks)
    found = interface_reactions(network, elastic, inertial, viscous, shares)
    return bond_loads(
        network.bonds, tie_loads(network._rows(), jnp.concatenate(found.forces)), found.residual, found.rounding
    )


def _coordinates_first(share, times):
    """Move the coordinates of a force (..., r) first and broadcast it over the times: (r, ...)."""
    return jnp.moveaxis(jnp.broadcast_to(share, (*times, share.shape[-1])), -1, 0)
