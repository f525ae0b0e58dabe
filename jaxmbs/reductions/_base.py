"""Base of all reductions: `Reduced`, a linear system in few coordinates, interface first, with its expansion."""

import dataclasses
from abc import abstractmethod
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Inexact

from ..checks import check_count
from ..linear._condensation import partition
from ..linear._labels import find_rows, format_label, parse_label
from ..linear._massless import condense_massless, massless_rows
from ..linear._rigid_motions import rigid_loads, rigid_rows
from ..linear._storage import as_inexact
from ..linear._symmetric import require_symmetric
from ..linear._system import LinearSystem
from ..runtime import jit
from ..tables import fields_repr
from ..typing import AnyArray, CoordinateLike


class Reduced(LinearSystem):
    """A reduced linear system, `x = basis rho`: interface coordinates first, modal coordinates after them.

    It is a `LinearSystem`, which every function takes, with the expansion to the component that was reduced.

    Attributes:
        basis: (whole, n), displacements of all coordinates of that component per reduced coordinate.
        whole: the labels of these coordinates.
    """

    basis: Inexact[Array, "whole n"]
    whole: tuple[tuple[str, str], ...] = eqx.field(static=True)

    def __init__(self, whole: LinearSystem, basis: Array, num_interface: int | None = None, **options: Any) -> None:
        """Build the reduced system of `whole` on a basis (whole, n).

        Args: num_interface: default that of `whole`; options: arguments of `LinearSystem`.

        Raises: ValueError where no coordinate is left.
        """
        if len(options["coordinates"]) == 0:
            raise ValueError("the reduction leaves no coordinate: give an interface, or keep modes")
        if whole.positions is not None and "positions" not in options:
            at = {parse_label(item)[0] for item in options["coordinates"]}
            kept = [i for i, name in enumerate(whole.nodes) if name in at]
            options["positions"] = tuple(whole.nodes[i] for i in kept), whole.positions[np.array(kept, int)]
        b = whole.num_interface if num_interface is None else num_interface
        super().__init__(interface=range(b), **options)
        self.basis, self.whole = basis, whole.coordinates
        self.ground_inertia = self._ground_inertia(whole)

    def with_ground_of(self, whole: LinearSystem) -> "Reduced":
        """The same system with the `ground_inertia` that follows from that of the component it was reduced from."""
        return self.replace(ground_inertia=self._ground_inertia(whole))

    def _ground_inertia(self, whole):
        """That on all coordinates of the component, less that of the motion of the reduced ones, as the basis of what
        is held need not contain rigid motions."""
        if whole.coupling_to_ground() is None or whole.positions is None or self.positions is None:
            return self.ground_inertia
        origin = jnp.zeros(3, whole.positions.dtype)
        return self.basis.T @ rigid_loads(whole, origin) - self.mass @ rigid_rows(self, origin)

    def expand(self, rho: AnyArray) -> Array:
        """Displacements (..., whole) of all coordinates, from reduced ones (..., n).  Source: S1 (5), (7)-(8)."""
        rho = as_inexact(rho)
        return jnp.matmul(rho, self.basis.T.astype(rho.dtype))

    def generalised_forces(self, forces: AnyArray) -> Array:
        """Generalised forces `F = basis^T f` (..., n) of forces (..., whole).  Source: S1 (17)-(18)."""
        forces = as_inexact(forces)
        return jnp.matmul(forces, self.basis.astype(forces.dtype))

    def outputs(self, *names: CoordinateLike) -> tuple[Array, tuple[str, ...]]:
        """Output matrix (k, n) and labels as in `LinearSystem.outputs`, also of coordinates that were reduced."""
        own = set(self.coordinates)
        labels = (*self.coordinates, *(item for item in self.whole if item not in own))
        faults = []
        rows = find_rows(names, labels, faults)
        if faults:
            return super().outputs(*names)
        places = {item: i for i, item in enumerate(self.whole)}
        unit = jnp.eye(self.num_rows, dtype=self.basis.dtype)
        found = [self.basis[places[labels[k]]] if labels[k] in places else unit[k] for k in rows]
        found = jnp.stack(found) if found else unit[:0]
        return found, tuple(format_label(labels[k]) for k in rows)

    def chain_to(self, whole: "Reduced") -> "Reduced":
        """The same system with its expansion continued to the component that `whole` was reduced from."""
        return self.replace(basis=whole.basis @ self.basis, whole=whole.whole)


class AbstractReduction(eqx.Module):
    """A way to reduce a linear system: `reduce(system, CraigBampton(20))`.

    Attributes:
        keeps_all: True if all coordinates outside the interface are kept, those without mass too.
    """

    keeps_all: ClassVar[bool] = False
    __repr__ = fields_repr

    def __check_init__(self) -> None:
        for field in dataclasses.fields(self):
            if field.type is int:
                check_count(f"{type(self).__name__}: {field.name}", getattr(self, field.name))

    @abstractmethod
    def of(self, system: LinearSystem) -> Reduced:
        """Reduce a system; the expansion of the result leads to the coordinates of this system."""


def reduce(system: LinearSystem, method: AbstractReduction) -> Reduced:
    """Reduce a linear system to few coordinates, interface first: `reduce(wing, CraigBampton(num_modes=20))`.

    A reduced system can be reduced again; `expand` then leads back all the way.  Rows outside the interface that have
    no mass are condensed statically first, which is exact.

    Args: method: an instance of one of the reductions of `jaxmbs.reductions`.

    Raises: as the method states; ValueError with the names of rows that have neither mass nor stiffness.
    """
    reduced = method.of(system) if method.keeps_all else _reduce_without_massless(system, method)
    return reduced.chain_to(system) if isinstance(system, Reduced) else reduced


def _reduce_without_massless(system, method):
    """Condense the rows without mass, reduce the others, and expand to all of them."""
    if not isinstance(system.mass, jax.Array | np.ndarray) or not massless_rows(system, system.interior):
        return method.of(system)
    whole = condense_massless(system, system.interior, damped=False)
    reduced = method.of(whole.system)
    found = reduced.replace(basis=whole.expand(reduced.basis.T).T, whole=system.coordinates)
    return found.with_ground_of(system)


class Unreduced(AbstractReduction):
    """No reduction: all coordinates [m, rad] with their signs, those of the interface first.  Source: S1 (7)-(9)."""

    keeps_all = True

    def of(self, system: LinearSystem) -> Reduced:
        system = system.to_dense()
        order = np.concatenate([system.interface, system.interior]).astype(int)
        matrices = {name: getattr(system, name) for name in ("mass", "stiffness", "damping")}
        return Reduced(
            system,
            jnp.asarray(np.eye(len(order))[:, order], system.dtype),
            **_reorder(matrices, order),
            coordinates=[system.coordinates[i] for i in order],
            massless=[k for k, i in enumerate(order) if i in system.massless],
        )


@jit
def _reorder(matrices, order):
    return {name: None if A is None else A[order][:, order] for name, A in matrices.items()}


def interface_first(system: LinearSystem) -> Reduced:
    """The system as a `Reduced` with its interface first: itself if it is one, else reordered."""
    if isinstance(system, Reduced) and system.interface == tuple(range(system.num_interface)):
        return system
    return reduce(system, Unreduced())


def project(system: LinearSystem, basis, labels, num_interface: int | None = None, massless=()) -> Reduced:
    """Project a system on a basis (n, r): `basis^T K basis` and so on.  Source: S1 (9), (12).

    Args: labels: of all r coordinates, the interface first.
    """
    M, K, C = (None if A is None else basis.T @ A @ basis for A in (system.mass, system.stiffness, system.damping))
    return Reduced(
        system, basis, num_interface, mass=M, stiffness=K, damping=C, coordinates=labels, massless=massless
    )


def reduced_labels(system: LinearSystem, **counts: int) -> tuple:
    """Labels of the interface, then `kind 0`, `kind 1`, ... of every kind."""
    own = tuple(system.coordinates[i] for i in system.interface)
    return own + tuple(item for kind, count in counts.items() for item in numbered_labels(kind, count))


def symmetric_partition(system: LinearSystem) -> tuple:
    """Interior and interface, stiffness and mass, which a reduction takes for symmetric: NaN if traced and not so.

    Raises: ValueError, if concrete, as `require_symmetric.check_symmetric`.
    """
    inner, outer = partition(system.num_rows, system.interface)
    return inner, outer, *require_symmetric(stiffness=system.stiffness, mass=system.mass)


def check_num_modes(num: int, available: int) -> None:
    """Refuse what is no number of modes, and more than there are.  Raises: ValueError."""
    check_count("num_modes", num)
    if not 0 <= num <= available:
        raise ValueError(f"num_modes = {num} must be between 0 and {available}, the number of modes of this kind")


def numbered_labels(kind: str, count: int) -> tuple[str, ...]:
    """Labels `kind 0`, `kind 1`, ... up to a count."""
    return tuple(f"{kind} {k}" for k in range(count))
