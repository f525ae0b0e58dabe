"""Result of `reactions`: loads of joints, force elements, drives and constraint rows by name."""

import dataclasses
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from ..checks import no_such
from ..errors import UnknownNameError
from ..model._describe import COMPONENTS
from ..named_arrays import part_of
from ..quantities import XYZ, Quantity, along_freedoms
from ..reports import Report, Reported, failures
from ..status import Status
from ..tables import format_number
from ..typing import ArrayLike

if TYPE_CHECKING:
    from ..dynamics._validity import Validity


class JointReaction(Reported, eqx.Module):
    """Wrench that a joint transmits, with everything that acts inside it (drives, joint springs).

    Attributes:
        force [N], moment [N m]: (..., 3), the moment about the origin of the joint's frame on that side.
        effort: (..., n) [N or N m] of the joint's drive alone, or of its actuator; of a joint without either the same
            as `total_effort`.
        total_effort: (..., n) along the joint's freedoms, of everything that acts there: drive or actuator, force
            elements, couplers and rows; the part of force and moment along the freedoms.
        unique_force, unique_moment: (..., 3) bool in the axes of `force` and `moment`, true where statics alone
            determines the component at this pose; false for those of self-stresses, which compliances distribute,
            and where `lacks_contact`.  A pose within 1e-6 of a singular one (1e-3 in single precision) counts as
            singular.
        lacks_contact: (...) bool, None without couplers.  A coupler acts on coordinates only: the bearings of the
            joints that it ties, and of those between, are computed without the contact forces of teeth, threads or
            cams.  The missing components are marked as not unique; efforts along the freedoms are right.
        t: (...) times of the states [s], None where they are not known.
    """

    force: Float[Array, "... 3"]
    moment: Float[Array, "... 3"]
    effort: Float[Array, "... n"]
    total_effort: Float[Array, "... n"]
    unique_force: Bool[Array, "... 3"]
    unique_moment: Bool[Array, "... 3"]
    lacks_contact: Bool[Array, "..."] | None = None
    t: Float[Array, "..."] | None = None

    def report(self) -> Report:
        wrench = [Quantity("force", self.force, "N", (XYZ,)), Quantity("moment", self.moment, "N m", (XYZ,))]
        efforts = [along_freedoms(n, x) for n, x in (("effort", self.effort), ("total effort", self.total_effort))]
        open_ones = [c for c, mark in zip(COMPONENTS, _every_unique(self), strict=True) if not mark]
        marks = [
            Quantity(name, getattr(self, name.replace(" ", "_")), "", (XYZ,), in_table=False)
            for name in ("unique force", "unique moment")
        ]
        summary = f"undetermined: {', '.join(open_ones)}" if open_ones else ""
        return Report([*wrench, *efforts, *marks], summary, t=self.t)


class JointReactions(eqx.Module):
    """Reactions of n joints by name, as few arrays: a program returns thousands of small ones slowly.

    Attributes:
        force, moment, unique_force, unique_moment (..., n, 3); lacks_contact (..., n): see `JointReaction`.
        efforts (..., m): total efforts of the velocities, then efforts of drives.
        names; own, total: slices of `efforts` of each joint, as pairs.
    """

    force: Float[Array, "... n 3"]
    moment: Float[Array, "... n 3"]
    efforts: Float[Array, "... m"]
    unique_force: Bool[Array, "... n 3"]
    unique_moment: Bool[Array, "... n 3"]
    lacks_contact: Bool[Array, "... n"] | None
    names: tuple[str, ...] = eqx.field(static=True)
    own: tuple[tuple[int, int], ...] = eqx.field(static=True)
    total: tuple[tuple[int, int], ...] = eqx.field(static=True)

    def __getitem__(self, name: str) -> JointReaction:
        k = self.names.index(name)
        unique_force, unique_moment = (part_of(x, np.s_[..., k, :]) for x in (self.unique_force, self.unique_moment))
        force, moment = (part_of(x, np.s_[..., k, :]) for x in (self.force, self.moment))
        own, total = (part_of(self.efforts, np.s_[..., slice(*part[k])]) for part in (self.own, self.total))
        contact = None if self.lacks_contact is None else part_of(self.lacks_contact, np.s_[..., k])
        return JointReaction(force, moment, own, total, unique_force, unique_moment, contact)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __contains__(self, name: object) -> bool:
        return name in self.names


def _summary(loads):
    """Summary and table of all joints: largest magnitudes, and components that are open at some instant."""
    rows = [(name, *_largest_magnitudes(load), _undetermined_text(load)) for name, load in loads.items()]
    ok = np.asarray(loads.ok)
    summary = f"{len(rows)} joints" + (f", {ok.size} instants" if ok.ndim else "")
    summary += ", ok" if ok.all() else ""
    summary += f", {loads.note}" if loads.note else ""
    side = "" if loads.side == "child" else ", on the parents"
    summary += f"; axes of the {'world' if loads.frame == 'world' else 'joints'}{side}"
    if loads.validity is not None:
        summary += "".join(f"; {fault}" for fault in loads.validity.faults())
    if any(_has_contact(load) for _, load in loads.items()):
        summary += f"; bearings carry no contact forces of {', '.join(loads.rows)}"
    return summary, [("joint", "force [N]", "moment [N m]", "effort [N or N m]", "undetermined"), *rows]


def _largest_magnitudes(load):
    """The largest force, moment and effort, as text."""
    size = lambda x: format_number(np.max(np.linalg.norm(np.asarray(x), axis=-1)))
    effort = np.abs(np.asarray(load.effort))
    return size(load.force), size(load.moment), format_number(effort.max()) if effort.size else "-"


def _undetermined_text(load):
    """The components that are not unique at some instant, as text."""
    marks = ", ".join(c for c, known in zip(COMPONENTS, _every_unique(load), strict=True) if not known)
    return (marks or "-") + (" (contact)" if _has_contact(load) else "")


def _every_unique(load):
    """True (6,) for the components that are unique at all instants."""
    return np.concatenate([load.unique_force, load.unique_moment], axis=-1).reshape(-1, 6).all(axis=0)


def _has_contact(load):
    return load.lacks_contact is not None and bool(np.any(load.lacks_contact))


class LawForce(Reported, eqx.Module):
    """Effort and force of a force element.

    Attributes:
        effort: (..., n) between two points one number, positive pushes them apart [N]; on a joint that along its
            freedom [N or N m]; of a `Bushing` force and moment in the axes of its first frame; of a load force and
            moment in world axes; of a law of the whole system that on every velocity.
        force [N], moment [N m]: (..., 3) world axes, on the second of two frames or on the loaded one, the moment
            about its origin; None where it acts on a joint or the whole system.
        t: (...) times of the states [s], None where they are not known.
    """

    effort: Float[Array, "... n"]
    force: Float[Array, "... 3"] | None
    moment: Float[Array, "... 3"] | None
    t: Float[Array, "..."] | None = None

    def report(self) -> Report:
        wrench = (("force", self.force, "N"), ("moment", self.moment, "N m"))
        parts = [Quantity(name, x, unit, (XYZ,)) for name, x, unit in wrench if x is not None]
        return Report([along_freedoms("effort", self.effort, axis="component"), *parts], t=self.t)


class DriveLoad(Reported, eqx.Module):
    """Effort of a drive, or of an actuator in its place.

    Attributes:
        effort: (..., n) along the freedoms of its joint [N or N m].
        unique: (..., n) bool, true where statics alone determines it; false where several drives share the load.
        t: (...) times of the states [s], None where they are not known.
    """

    effort: Float[Array, "... n"]
    unique: Bool[Array, "... n"]
    t: Float[Array, "..."] | None = None

    def report(self) -> Report:
        open_one = "" if np.all(self.unique) else "not determined by statics"
        return Report([along_freedoms("effort", self.effort)], open_one, t=self.t)


class RowLoad(Reported, eqx.Module):
    """Efforts of a coupler or of user rows.

    Attributes:
        multipliers: (..., k) of its rows, in units of work over the unit of the row.
        efforts: (..., n) by joint, along its freedoms [N or N m].
        unique: (..., k) bool, true where statics alone determines the multiplier; false where several share the load.
        t: (...) times of the states [s], None where they are not known.
    """

    multipliers: Float[Array, "... k"]
    efforts: dict[str, Float[Array, "... n"]]
    unique: Bool[Array, "... k"]
    t: Float[Array, "..."] | None = None

    def report(self) -> Report:
        open_one = "" if np.all(self.unique) else "not determined by statics"
        efforts = [along_freedoms(f"effort on {name}", effort) for name, effort in self.efforts.items()]
        multipliers = along_freedoms("multiplier", self.multipliers, "J per unit of the row", "row")
        return Report([multipliers, *efforts], open_one, t=self.t)


class RowLoads(eqx.Module, Mapping):  # type: ignore[misc]
    """Loads of couplers and user rows by name, as few arrays.

    Attributes:
        multipliers, unique: (..., rows) of all rows of the system.
        efforts: (..., n, nv) of each of the n on every velocity.
        names; places: first row and end of each.
        joints: name, first velocity and end of the joints that each acts on.
    """

    multipliers: Float[Array, "... rows"]
    efforts: Float[Array, "... n nv"]
    unique: Bool[Array, "... rows"]
    names: tuple[str, ...] = eqx.field(static=True)
    places: tuple[tuple[int, int], ...] = eqx.field(static=True)
    joints: tuple[tuple[tuple[str, int, int], ...], ...] = eqx.field(static=True)

    def __getitem__(self, name: str) -> RowLoad:
        if name not in self.names:
            raise KeyError(name)
        k = self.names.index(name)
        own = np.s_[..., slice(*self.places[k])]
        efforts = {joint: part_of(self.efforts, np.s_[..., k, a:b]) for joint, a, b in self.joints[k]}
        return RowLoad(part_of(self.multipliers, own), efforts, part_of(self.unique, own))

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


class Reactions(Reported, eqx.Module):
    """Reactions by joint or constraint name, `loads["main"].force`; of force elements `loads.law("spring").effort`,
    of drives and actuators `loads.drive("shaft").effort`, of couplers and user rows
    `loads.row("gear").efforts["pinion"]`.

    Along every freedom the sums close: a joint's `total_effort` is the sum of the efforts of its drive or actuator,
    the force elements on it, couplers and rows.

    Attributes:
        multipliers: (..., rows) efforts along the constraint rows; a drive's multiplier is its effort.
        residual: (...) largest unbalanced effort `M u_dot + bias - Q - A^T lambda` of the solve, without derivative.
        ok: (...) true where the state is assembled, the reactions are finite and balance all loads to 1e-6, and the
            accelerations satisfy the constraints to 1e-6 (both 1e-2 in single precision).
        hidden: welds inside bodies that the builder split; found by name, not listed.
        frame, side: axes and side of the components, as given to `reactions`.
        t: (...) times of the states [s].
        validity: margins of the parts of the system to the ends of their models; None where none has any.  Its
            `faults()` are in the print.
        note: a word on the state asked for, such as that it is an unstable equilibrium (static).
    """

    joints: Mapping[str, JointReaction] | JointReactions
    multipliers: Float[Array, "... rows"]
    residual: Float[Array, "..."]
    ok: Bool[Array, "..."]
    hidden: tuple[str, ...] = eqx.field(static=True, default=())
    laws: Mapping[str, LawForce] = eqx.field(default_factory=dict)
    rows: Mapping[str, RowLoad] = eqx.field(default_factory=dict)
    drives: Mapping[str, DriveLoad] = eqx.field(default_factory=dict)
    frame: str = eqx.field(static=True, default="world")
    side: str = eqx.field(static=True, default="child")
    t: Float[Array, "..."] | None = None
    validity: "Validity | None" = None
    note: str = eqx.field(static=True, default="")

    def report(self) -> Report:
        summary, rows = _summary(self)
        found = []
        for name, load in self.items():
            found += [q._replace(name=f"{q.name} of {name}") for q in load.report().quantities]
        return Report(found, summary, failures(self.ok), self.t, rows)

    @property
    def result(self) -> Int[Array, "..."]:
        """Result code (...): VALIDITY where a part is beyond the end of its model; `ok` is of the solution."""
        if self.validity is None:
            return jnp.full(jnp.shape(self.ok), int(Status.SUCCESS))
        return jnp.where(self.validity.is_outside, int(Status.VALIDITY), int(Status.SUCCESS))

    @property
    def status(self) -> Status:
        """The worst status of its states, `str` of it in words (concrete ones)."""
        if self.note:
            return Status.UNSTABLE
        return Status(int(np.max(np.asarray(self.result), initial=int(Status.SUCCESS))))

    def __getitem__(self, name: str) -> JointReaction:
        return self._found("joint or constraint", name, self.joints, list(self))

    def _found(self, kind, name, among, listed=None):
        """Entry of a name; otherwise an UnknownNameError that says which other method knows the name."""
        if name in among:
            return dataclasses.replace(among[name], t=None if self.t is None else jnp.asarray(self.t))
        doors = {"law": self.laws, "row": self.rows, "drive": self.drives}
        found = [f"it is a {door}: loads.{door}({name!r})" for door, names in doors.items() if name in names]
        found += [f"it is a joint or constraint: loads[{name!r}]"] * (name in self.joints)
        raise UnknownNameError("; ".join([no_such(kind, name, among if listed is None else listed), *found]))

    def law(self, name: str) -> LawForce:
        """Force of a force element by name.  Raises: UnknownNameError."""
        return self._found("force element", name, self.laws)

    def drive(self, name: str) -> DriveLoad:
        """Load of the drive or actuator of a joint, by the joint's name.  Raises: UnknownNameError."""
        return self._found("drive or actuator", name, self.drives)

    def row(self, name: str) -> RowLoad:
        """Load of a `Coupler`, `PositionRows` or `VelocityRows` by name.  Raises: UnknownNameError."""
        return self._found("coupler or rows", name, self.rows)

    def __iter__(self):
        return (name for name in self.joints if name not in self.hidden)

    def items(self) -> list[tuple[str, JointReaction]]:
        """Pairs of name and reaction."""
        return [(name, self.joints[name]) for name in self]

    def to_xarray(self, ts: ArrayLike | None = None) -> Any:
        """An `xarray.Dataset` of `force` [N] and `moment` [N m] by joint and component, and by time along a motion,
        with `unique_force` and `unique_moment` beside them, and the `effort` by joint and freedom [N or N m], NaN
        where a joint has less of them; its attributes `frame` and `side` say the axes.

        Args: ts: other labels of the times [s], as many as there are.

        Raises: ValueError for another number of them.
        """
        import xarray

        names, data = list(self), {}
        for part, unit in {"force": "N", "moment": "N m", "unique_force": "", "unique_moment": ""}.items():
            values = np.stack([np.asarray(getattr(self[n], part)) for n in names], -2)
            lead = ("time",) * (values.ndim - 2)
            data[part] = ((*lead, "joint", "component"), values, {"units": unit} if unit else {})
        places: dict = {"joint": names, "component": ["x", "y", "z"]}
        efforts = [np.asarray(self[n].effort, float) for n in names]
        most = max(effort.shape[-1] for effort in efforts)
        if most:
            short = [[(0, 0)] * len(lead) + [(0, most - effort.shape[-1])] for effort in efforts]
            padded = [np.pad(e, w, constant_values=np.nan) for e, w in zip(efforts, short, strict=True)]
            data["effort"] = ((*lead, "joint", "freedom"), np.stack(padded, -2), {"units": "N or N m"})
            places["freedom"] = np.arange(most)
        if lead:
            times = np.asarray(self.t if ts is None else ts)
            if times.shape != values.shape[:1]:
                raise ValueError(f"ts has shape {times.shape}, the reactions have {len(values)} instants")
            places["time"] = ("time", times, {"units": "s"})
        return xarray.Dataset(data, places, {"frame": self.frame, "side": self.side})

    def to_pandas(self, ts: ArrayLike | None = None) -> Any:
        """A `pandas.DataFrame` by joint, and by time along a motion: "force x" to "moment z", and "effort", of
        several freedoms "effort 0", "effort 1", ..."""
        import pandas

        found = self.to_xarray(ts)
        parts = [found[p].to_dataframe()[p].unstack("component").add_prefix(f"{p} ") for p in ("force", "moment")]
        if "effort" in found:
            efforts = found["effort"].to_dataframe()["effort"].unstack("freedom")
            alone = efforts.shape[1] == 1
            parts.append(efforts.set_axis(["effort"] if alone else [f"effort {k}" for k in efforts.columns], axis=1))
        return pandas.concat([part.rename_axis(columns=None) for part in parts], axis=1)
