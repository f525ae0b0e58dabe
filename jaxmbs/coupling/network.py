"""Components joined by named bonds: a linear system whose bonds tell what they carry."""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..checks import no_such
from ..errors import ModelError, UnknownNameError
from ..linear.motion import LinearMotion
from ..linear.static_response import StaticResponse
from ..linear.system import LinearSystem
from .dual import dual_response, self_stresses
from .loads import BondLoads, Determinacy, by_bond
from .primal import Assembly, interface_reactions
from .ties import Ties


class Network(Assembly):
    """Components and bushings joined by bonds, as `connect` makes it: a `LinearSystem` over the joined coordinates.

    Coordinates of components are named "stage.top z", those that were reduced included.

    Attributes:
        names: of the components given, then of the bushings.
        bonds: `(name, what it ties)`.
        joints: of every component the numbers of the joint displacements of its interface, -1 for the ground's.
    """

    names: tuple[str, ...] = eqx.field(static=True)
    bonds: tuple[tuple[str, Ties], ...] = eqx.field(static=True)
    joints: tuple[tuple[int, ...], ...] = eqx.field(static=True)

    def __init__(self, *, names, bonds, joints, **options):
        super().__init__(**options)
        self.names, self.bonds, self.joints = tuple(names), tuple(bonds), joints

    def expand(self, xi) -> dict:
        """Displacements (..., n_c) of all coordinates of every component, by name, from joined ones (..., N)."""
        parts = self.part(jnp.moveaxis(xi, -1, 0))
        found = zip(self.names, self.components, parts, strict=True)
        return {name: jnp.moveaxis(jnp.tensordot(c.basis.astype(rho.dtype), rho, 1), 0, -1) for name, c, rho in found}

    def outputs(self, *names) -> tuple[Array, tuple[str, ...]]:
        """As of `LinearSystem`, of the components: "stage.top z", ("stage", "top z"), "stage.top"."""
        rows, labels = [jnp.zeros((0, self.num_rows), self.dtype)], []
        for name in names:
            component, own = self._component(name)
            found, which = self.components[component].outputs(own)
            place = np.array(self.places[component])
            spread = jnp.zeros((len(found), self.num_rows + 1), self.dtype)  # the last column is held
            rows.append(spread.at[:, place].add(found.astype(self.dtype))[:, :-1])
            labels += [f"{self.names[component]}.{label}" for label in which]
        return jnp.concatenate(rows), tuple(labels)

    def _component(self, name):
        component, own = name.partition(".")[::2] if isinstance(name, str) else name
        if component not in self.names:
            raise UnknownNameError(no_such("component", component, self.names))
        return self.names.index(component), own

    def load(self, forces: Mapping | Array) -> Array:
        """Forces (..., N): as of `LinearSystem`, and by name of a component on all of its coordinates (..., n_c).

        Source: S1 (18), (21)-(25).
        """
        if not isinstance(forces, Mapping):
            return super().load(forces)
        shares = self.shares(forces)
        times = np.broadcast_shapes(*(s.shape[:-1] for s in shares if s is not None))
        shares = [None if s is None else _first(s, times) for s in shares]
        if all(share is None for share in shares):
            return jnp.zeros(self.num_rows, self.dtype)
        return jnp.moveaxis(self.gathered(shares), 0, -1)

    def shares(self, forces: Mapping) -> list:
        """Generalised forces (..., r_c) on every component, None for none.  Source: S1 (17)-(18)."""
        if not isinstance(forces, Mapping):
            raise ValueError("forces of a network are given by name: which component bears them?")
        own = [{} for _ in self.names]
        for name, force in forces.items():
            if name in self.names:
                component, force = self.names.index(name), jnp.asarray(force)
                basis = self.components[component].basis
                if force.shape[-1:] != (len(basis),):
                    raise ValueError(f"forces on {name!r} have shape {force.shape}, not (..., {len(basis)})")
                own[component][None] = force @ basis.astype(force.dtype)
            else:
                component, label = self._component(name)
                own[component][label] = force
        return [_share(c, dict(given)) if given else None for c, given in zip(self.components, own, strict=True)]

    def response(self, forces: Mapping, omega=None) -> tuple[dict, BondLoads]:
        """Static or harmonic displacements (n_c,) by component, and the loads of the bonds: the dual assembly.

        Args: forces: by component (n_c,); omega: one frequency [rad/s].  Source: S1 (1)-(3), (19), (25).
        """
        parts = self.components
        stray = [no_such("component", name, self.names) for name in forces if name not in self.names]
        if stray:
            raise UnknownNameError("; ".join(stray))
        rhos, found = dual_response(parts, self.joints, [forces.get(name) for name in self.names], omega)
        moved = {n: c.basis.astype(rho.dtype) @ rho for n, c, rho in zip(self.names, parts, rhos, strict=True)}
        return moved, by_bond(self.bonds, self._rows(), jnp.concatenate(found.forces), found.residual)

    def determinacy(self, rigid: Mapping | None = None) -> Determinacy:
        """Redundant and statically determinate bonds; on the host.

        Args: rigid: by component, rigid motions of its interface (b, d); default: the motions
            below the widest gap in the stiffness of each component's interface.

        Source: S1 (13)-(14), (20).
        """
        rigid = None if rigid is None else [rigid[name] for name in self.names]
        stresses, free = self_stresses(self._rows(), self.components, rigid)
        unknown, known, at = np.abs(stresses).max(axis=1, initial=0.0) > 1e-6, {}, 0
        for name, bond in self.bonds:
            known[name] = tuple(not flag for flag in unknown[at : at + len(bond.kept)])
            at += sum(len(pairs) for pairs in bond.pairs)
        labels = {name: tuple(bond.labels[k] for k in bond.kept) for name, bond in self.bonds}
        return Determinacy(stresses.shape[1], free, known, labels)

    def _rows(self):
        """(ties, interface coordinates of all components in turn): first less second."""
        starts = np.cumsum([0, *(c.num_interface for c in self.components)])
        place = {name: start for name, start in zip(self.names, starts, strict=False)}
        pairs = [pair for _, bond in self.bonds for side in bond.pairs for pair in side]
        rows = np.zeros((len(pairs), starts[-1]))
        for row, pair in zip(rows, pairs, strict=True):
            for sign, coordinate in zip((1.0, -1.0), pair, strict=True):
                if coordinate is not None:
                    row[place[coordinate[0]] + coordinate[1]] = sign
        return rows


def _share(component, given):
    """(..., r_c) of forces by label, and of those on all coordinates, which are generalised already."""
    whole = given.pop(None, None)
    part = component.load(given) if given else None
    if whole is None or part is None:
        return part if whole is None else whole
    shape = np.broadcast_shapes(whole.shape, part.shape)
    return jnp.broadcast_to(whole, shape) + jnp.broadcast_to(part, shape)


def reactions(
    network: LinearSystem, motion: LinearMotion | StaticResponse, forces: Mapping | None = None
) -> BondLoads:
    """What the bonds carry in a motion or at rest: `reactions(net, motion)["bolts"].force`.

    Args:
        motion: of `simulate`, or of `equilibrium` with the `forces` that it was asked with.

    With fixed-interface modes these loads already are those of mode acceleration.  Damping by `Modal(ratios)` is not
    among the components' forces: it is what the sides of a bond then differ by, in `residual`, and the loads are
    their mean.

    Raises: ModelError for a linear system without bonds.  Source: S1 (3), (19)-(25).
    """
    if not isinstance(network, Network):
        raise ModelError(["reactions are those of a mechanism, or of the bonds of a network of `connect`"])
    rest = isinstance(motion, StaticResponse)
    given = (() if forces is None else (forces,)) if rest else motion.forces
    x = motion.displacement
    a, v = (jnp.zeros_like(x), None) if rest else (motion.acceleration, motion.velocity)
    return loads_of(network, x, a, v, given)


def loads_of(network: Network, x, a, v=None, forces=()) -> BondLoads:
    """Loads of the bonds in displacements, accelerations, velocities (..., N), complex amplitudes too.

    Args: forces: mappings as `Network.shares` takes them.  Source: S1 (3), (19)-(25).
    """
    along = [None if part is None else jnp.moveaxis(part, -1, 0) for part in (x, a, v)]
    shares = [None] * len(network.names)
    for given in forces:
        new = [None if s is None else _first(s, x.shape[:-1]) for s in network.shares(given)]
        shares = [b if a is None else a if b is None else a + b for a, b in zip(shares, new, strict=True)]
    found = interface_reactions(network, *along, shares)
    return by_bond(network.bonds, network._rows(), jnp.concatenate(found.forces), found.residual)


def _first(share, times):
    """(r, ...) of a share (..., r), which may be the same at all times."""
    return jnp.moveaxis(jnp.broadcast_to(share, (*times, share.shape[-1])), -1, 0)
