"""What every reduction returns: a component in few coordinates, its interface among them."""

import dataclasses
from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Inexact

from ..linear.condensation import partition
from ..linear.modes import symmetric
from ..linear.system import LinearSystem
from ..math import square


class Reduced(eqx.Module):
    """A component `x = basis rho`: the coordinates `rho` that move the interface come first.

    Attributes:
        basis: (n, r), columns of displacement.
        mass, stiffness: (r, r).
        damping: (r, r) or None.
        connection: (b, r), the displacements of the bonds `u = connection rho`; zero past its first b columns, which
            are square and regular.  Source: S1 (14), (20).
        labels: what each coordinate is, (r,): "interface", "rigid", "constraint" or "normal", and its number.
        massless: coordinates whose mass the method neglects.
        names: what the bonds' displacements are, `(node, direction)` each, as `reduce` finds them; or ().
    """

    basis: Inexact[Array, "n r"]
    mass: Inexact[Array, "r r"]
    stiffness: Inexact[Array, "r r"]
    damping: Inexact[Array, "r r"] | None
    connection: Inexact[Array, "b r"]
    labels: tuple[str, ...] = eqx.field(static=True)
    massless: tuple[int, ...] = eqx.field(static=True, default=())
    names: tuple[tuple[str, str], ...] = eqx.field(static=True, default=())

    @property
    def num_interface(self) -> int:
        """How many coordinates couple: the rows of the connection."""
        return self.connection.shape[0]

    def expand(self, rho) -> Array:
        """Displacements (n, ...) of all coordinates, from reduced ones (r, ...).  Source: S1 (5), (7)-(8)."""
        return self.basis.astype(rho.dtype) @ rho

    def generalised(self, forces) -> Array:
        """Generalised forces `F = basis^T f` (r, ...) of forces (n, ...).  Source: S1 (17)-(18)."""
        return self.basis.T.astype(forces.dtype) @ forces

    def explicit(self) -> "Reduced":
        """The same component, the bonds' displacements themselves its first coordinates: connection `[1 0]`."""
        b, r = self.connection.shape
        E = jnp.eye(r, dtype=self.connection.dtype)
        E = E.at[:b, :b].set(square.inverse(self.connection[:, :b]))
        labels = numbered("interface", b) + self.labels[b:]
        return transformed(self, E, self.connection @ E, labels, self.names)

    def system(self, positions=None) -> LinearSystem:
        """The component as one to `check`, or to reduce once more: its interface by name, then the other coordinates.

        Args: positions: (3,) [m] by name of node.  Rigid motions are then those of the interface, as with
            fixed-interface modes.  An interface that just holds the component has no stiffness but rounding.
        """
        own, b = self.explicit(), self.num_interface
        labels = (*(self.names or own.labels[:b]), *own.labels[b:])
        return LinearSystem(
            mass=own.mass,
            stiffness=own.stiffness,
            damping=own.damping,
            interface=range(b),
            coordinates=labels,
            positions=positions,
        )


def project(basis, stiffness, mass, damping, connection, labels) -> Reduced:
    """The component on a basis (n, r): `basis^T K basis` and so on.  Source: S1 (9), (12)."""
    K, M, C = (None if A is None else basis.T @ A @ basis for A in (stiffness, mass, damping))
    return Reduced(basis, M, K, C, connection, tuple(labels))


def transformed(reduced: Reduced, E, connection, labels, names=()) -> Reduced:
    """A reduced component in new coordinates `rho = E rho'`; a massless one must keep its interface columns."""
    M, K, C = (None if A is None else E.T @ A @ E for A in (reduced.mass, reduced.stiffness, reduced.damping))
    return Reduced(reduced.basis @ E, M, K, C, connection, tuple(labels), reduced.massless, names)


def physical(stiffness, mass, interface: Sequence[int], damping=None) -> Reduced:
    """A component as it is, unreduced, its interface coordinates put first.  Source: S1 (7)-(9)."""
    inner, outer = parted(interface, stiffness, mass, damping)
    order = np.concatenate([outer, inner])
    basis = jnp.eye(len(order), dtype=stiffness.dtype)[:, order]
    return project(
        basis,
        stiffness,
        mass,
        damping,
        basis[outer],
        (*numbered("interface", len(outer)), *numbered("interior", len(inner))),
    )


def reduce(system, method, *args, **options) -> Reduced:
    """A reduction of a linear system, or of anything with `stiffness`, `mass`, `damping`, `interface`.

    `reduce(wing, craig_bampton, 20)`; where its `coordinates` have names, so have the interface's.
    """
    s = system
    reduced = method(s.stiffness, s.mass, tuple(s.interface), *args, damping=s.damping, **options)
    labels = getattr(s, "coordinates", None)
    named = labels is not None and reduced.num_interface == len(s.interface)
    return dataclasses.replace(reduced, names=tuple(labels[i] for i in s.interface)) if named else reduced


def parted(interface: Sequence[int], stiffness, mass, damping=None) -> tuple[np.ndarray, np.ndarray]:
    """`partition` for matrices of one size.  Raises: ValueError also for others."""
    shapes = [tuple(A.shape) for A in (stiffness, mass, damping) if A is not None]
    if len(set(shapes)) > 1:
        raise ValueError(f"stiffness, mass and damping differ in shape: {shapes}")
    return partition(len(stiffness), interface)


def admitted(interface: Sequence[int], stiffness, mass, damping=None) -> tuple:
    """`parted`, and the stiffness and mass, which a reduction takes for symmetric: NaN if traced and not so.

    Raises: ValueError as `parted` and, if concrete, as `structures.modes.check_symmetric`.
    """
    return *parted(interface, stiffness, mass, damping), *symmetric(stiffness=stiffness, mass=mass)


def check_num_modes(num: int, available: int) -> None:
    """Raises: ValueError where more modes are asked than there are."""
    if not 0 <= num <= available:
        raise ValueError(f"num_modes = {num}: the component has {available} such modes")


def numbered(kind: str, count: int) -> tuple[str, ...]:
    """Labels `kind 0`, `kind 1`, ..."""
    return tuple(f"{kind} {k}" for k in range(count))
