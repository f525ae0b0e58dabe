"""Outputs of responses by name: motions of coordinates, loads of bonds and of the base, stresses, rows of users."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..checks import as_flag, distinct_names, place_of
from ..coupling._network import reactions
from ..elements import DIRECTIONS
from ..errors import ModelError
from ..linear._labels import parse_label
from ..linear._system import LinearSystem
from ..quantities import Axis, Quantity
from ..runtime import as_array
from ..typing import ArrayLike, CoordinateLike

KINDS = ("displacement", "velocity", "acceleration")
_RATES = {"displacement": "", "velocity": "/s", "acceleration": "/s^2"}


def motion_units(labels: Iterable[str], kind: str) -> tuple[str, ...]:
    """Units of motions of coordinates by their labels, "tip rz"; none of modes."""
    own = {**dict.fromkeys(DIRECTIONS[:3], "m"), **dict.fromkeys(DIRECTIONS[3:], "rad")}
    found = (own.get(label.rpartition(" ")[2]) for label in labels)
    return tuple(unit + _RATES[kind] if unit else "" for unit in found)


def force_units(labels: Iterable[str]) -> tuple[str, ...]:
    """Units of forces on coordinates by their labels; none on modes."""
    own = {**dict.fromkeys(DIRECTIONS[:3], "N"), **dict.fromkeys(DIRECTIONS[3:], "N m")}
    return tuple(own.get(label.rpartition(" ")[2], "") for label in labels)


def common_unit(units: Iterable[str]) -> str:
    """The unit of all, or a word where they have several."""
    found = set(units)
    return found.pop() if len(found) == 1 else "by output" if found else ""


def unit_column(units: tuple[str, ...], output: Axis) -> list[Quantity]:
    """The units by output as a column of a data set, where they are known."""
    return [Quantity("unit", np.array(units), "", (output,))] if any(units) else []


class Terms(NamedTuple):
    """Motion on which outputs depend linearly; each part (cases, n).

    Attributes:
        relative: displacement, velocity, acceleration relative to the base.
        carried: those of the motion with the base; ground: (cases, 3) those of the ground in x, y, z.
        elastic: True if the carried displacement may strain the structure, as that of moved coordinates does and
            that of the ground does not.
        lag: (cases, n) displacement whose elastic forces are those of modal or structural damping.
        forces: (cases, n) loads; given: the same by name, for bonds.
        base: rows that are moved.
    """

    relative: tuple[Array, Array, Array]
    carried: tuple[Array, Array, Array]
    ground: tuple[Array, Array, Array]
    elastic: bool
    lag: Array
    forces: Array
    given: tuple
    base: tuple[int, ...]

    def total(self, power: int) -> Array:
        """Absolute displacement (0), velocity (1) or acceleration (2)."""
        return self.relative[power] + self.carried[power]

    def strained(self, power: int) -> Array:
        """Displacement (0) or velocity (1) on which stiffness and damping act."""
        return self.total(power) if self.elastic else self.relative[power]


class Coordinates(eqx.Module):
    """Motion of coordinates.

    Args:
        names: as in `LinearSystem.outputs`: "tip z", or a node for all of its coordinates.
        kind: "displacement", "velocity" or "acceleration".
        relative: to the base.  By default displacements and velocities are, accelerations are absolute.

    Raises: ModelError for an unknown kind.
    """

    names: tuple = eqx.field(static=True)
    kind: str = eqx.field(static=True)
    relative: bool = eqx.field(static=True)

    def __init__(
        self,
        names: CoordinateLike | Iterable[CoordinateLike],
        kind: str = "acceleration",
        relative: bool | None = None,
    ) -> None:
        if kind not in KINDS:
            raise ModelError([f"unknown kind {kind!r}: the kinds are {', '.join(KINDS)}"], "the output")
        self.names = distinct_names("names", (names,) if isinstance(names, str | int | np.integer) else names)
        self.kind = kind
        self.relative = kind != "acceleration" if relative is None else as_flag("relative", relative)

    def values(self, system: LinearSystem, terms: Terms) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
        rows, labels = system.outputs(*self.names)
        power = KINDS.index(self.kind)
        x = terms.relative[power] if self.relative else terms.total(power)
        values = x @ rows.T.astype(x.dtype)
        if not self.relative:
            values = values + terms.ground[power] @ _beyond_coordinates(system, rows, labels).T
        return values, labels if len(labels) > 1 else ("",), motion_units(labels, self.kind)


def _beyond_coordinates(system, rows, labels):
    """Motion (k, 3) of outputs with the ground in x, y, z that the motion of the coordinates does not give them: of
    reduced coordinates of what is held."""
    along = jnp.asarray(_translations(system.coordinates), rows.dtype)
    return jnp.asarray(_translations(map(parse_label, labels)), rows.dtype) - rows @ along


def _translations(labels):
    """Unit vectors (k, 3) of labels (node, direction), zero for rotations and modes."""
    return np.array([[direction == d for d in DIRECTIONS[:3]] for _, direction in labels], float).reshape(-1, 3)


class BondForces(eqx.Module):
    """Loads of bonds of a network, on their first ends.

    Args:
        bonds: their names, default all.
        factor: of the loads, () or one for each of them: a stress of a bracket [Pa] by its force is
            `BondForces("fl", factor=2.1e4, unit="Pa")`, in Pa/N.
        unit: of the loads times the factor, for tables; without a factor it is known.

    On a moving ground the masses of coordinates that are tied to it are not in these loads: where they matter, move
    those coordinates, `BaseAcceleration(..., at=...)`, and ask for `BaseForces`.
    """

    bonds: tuple[str, ...] | None = eqx.field(static=True)
    factor: Array
    unit: str | None = eqx.field(static=True)

    def __init__(self, *bonds: str, factor: ArrayLike | None = None, unit: str = "") -> None:
        self.bonds = distinct_names("bonds", bonds) or None
        self.factor = as_array(1.0 if factor is None else factor)
        self.unit = (unit or None) if factor is None else unit

    def units(self, labels: Iterable[str]) -> tuple[str, ...]:
        """Units of the loads (k,) by their labels."""
        return force_units(labels) if self.unit is None else tuple(self.unit for _ in labels)

    def values(self, system: LinearSystem, terms: Terms) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
        loads = reactions(system, _Answer(terms))
        names = list(loads) if self.bonds is None else self.bonds
        for name in names:
            place_of("bond", name, loads)
        labels = [f"{name} {label}" if len(names) > 1 else label for name in names for label in loads[name].labels]
        found = jnp.concatenate([loads[name].on_first for name in names], axis=-1)
        if jnp.shape(self.factor) not in ((), (len(labels),)):
            fault = f"a factor of shape {jnp.shape(self.factor)} for the {len(labels)} loads of bonds"
            raise ModelError([fault], "the output")
        found = found * jnp.broadcast_to(self.factor, found.shape).astype(found.dtype)
        return found, tuple(labels), self.units(labels)


class BaseForces(eqx.Module):
    """Forces that move the base: on every coordinate that is moved."""

    def values(self, system: LinearSystem, terms: Terms) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
        if not terms.base:
            raise ModelError(["BaseForces need moved coordinates: BaseAcceleration(..., at=...)"], "the output")
        rows = jnp.asarray(terms.base)
        x = terms.strained(0).astype(terms.lag.dtype) + terms.lag
        mass = terms.total(2) @ system.mass[rows].T
        forces = x @ system.stiffness[rows].T.astype(x.dtype) + mass.astype(x.dtype)
        if system.damping is not None:
            forces = forces + (terms.strained(1) @ system.damping[rows].T).astype(x.dtype)
        labels = tuple(system.label(k) for k in terms.base)
        return forces - terms.forces[..., rows].astype(x.dtype), labels, force_units(labels)


class Recovery(eqx.Module):
    """Any linear function of the displacements that strain the structure: stresses, element forces, rows of a user.

    Args:
        function: of displacements (n,) to an array, or a matrix (k, n).
        labels: names of the values.
        kind: "displacement", or "acceleration" for a function of absolute accelerations.
        unit: of the values, for tables.

    A function must be linear without a constant part, as `lambda x: element_stresses(structure, x)["plate"][3]`.

    Raises: ModelError for an unknown kind.
    """

    function: Callable | Array
    labels: tuple[str, ...] | None = eqx.field(static=True)
    kind: str = eqx.field(static=True)
    unit: str = eqx.field(static=True)

    def __init__(
        self,
        function: Callable | Array,
        labels: Iterable[str] | None = None,
        kind: str = "displacement",
        unit: str = "",
    ) -> None:
        if kind not in ("displacement", "acceleration"):
            raise ModelError([f"kind = {kind!r} must be 'displacement' or 'acceleration'"], "the output")
        self.function, self.kind, self.unit = function, kind, unit
        self.labels = None if labels is None else distinct_names("labels", labels)

    def values(self, system: LinearSystem, terms: Terms) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
        x = terms.strained(0) if self.kind == "displacement" else terms.total(2)
        function = self.function if callable(self.function) else lambda x: jnp.asarray(self.function, x.dtype) @ x
        values = jax.vmap(lambda x: jnp.ravel(function(x)))(x)
        labels = self.labels or (tuple(map(str, range(values.shape[1]))) if values.shape[1] > 1 else ("",))
        if len(labels) != values.shape[1]:
            raise ModelError([f"{len(labels)} labels for {values.shape[1]} values of a Recovery"], "the output")
        return values, labels, (self.unit,) * len(labels)


Output = Coordinates | BondForces | BaseForces | Recovery


class _Answer(NamedTuple):
    """Terms as `reactions` reads them."""

    motion: Terms

    def terms(self, system):
        lag = self.motion.lag
        x = self.motion.strained(0).astype(lag.dtype) + lag
        return tuple(part.astype(x.dtype) for part in (x, self.motion.strained(1), self.motion.total(2)))

    @property
    def forces(self):
        return self.motion.given


def named_outputs(out: Mapping[str, Any] | Iterable) -> dict[str, Output]:
    """Outputs by name; a sequence of names of coordinates stands for their absolute accelerations.

    Raises: ModelError for something else.
    """
    if isinstance(out, str):
        out = [out]
    if not isinstance(out, Mapping):
        out = distinct_names("out", out)
        out = {name if isinstance(name, str) else " ".join(map(str, name)): Coordinates([name]) for name in out}
    wrong = [name for name, given in out.items() if not isinstance(given, Output)]
    if wrong or not out:
        what = f"{wrong[0]!r} is no output" if wrong else "no output is given"
        raise ModelError([f"{what}: give Coordinates, BondForces, BaseForces or Recovery by name"], "the outputs")
    return dict(out)


def output_rows(
    outputs: Mapping[str, Output], system: LinearSystem, terms: Terms
) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
    """Values (cases, k) of all outputs, their names and their units."""
    parts, names, units = [], [], list[str]()
    for name, output in outputs.items():
        values, labels, own = output.values(system, terms)
        units += own
        parts.append(values.astype(terms.lag.dtype))
        names += [f"{name} {label}".strip() for label in labels]
    return jnp.concatenate(parts, axis=-1), tuple(names), tuple(units)
