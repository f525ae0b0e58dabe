"""What joints transmit, by their names: the result of `reactions`."""

from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float

from ..checks import no_such, place_of
from ..errors import UnknownNameError
from ..model.describe import COMPONENTS
from ..tables import short, told
from ..typing import ArrayLike


class JointReaction(eqx.Module):
    """The wrench a joint transmits, with all that acts inside it (drives, joint springs).

    Attributes:
        force [N], moment [N m]: (..., 3), the moment about the origin of the joint's frame on that side.
        effort: (..., n) along the joint's freedoms [N or N m]: drive, motor and spring efforts.
        unique_force, unique_moment: (3,) bool in the joint's axes: whether statics alone determines the component.
    """

    force: Float[Array, "... 3"]
    moment: Float[Array, "... 3"]
    effort: Float[Array, "... n"]
    undetermined: tuple[bool, ...] = eqx.field(static=True)

    @property
    def unique_force(self) -> np.ndarray:
        return ~np.array(self.undetermined[:3])

    @property
    def unique_moment(self) -> np.ndarray:
        return ~np.array(self.undetermined[3:])


def _told(loads):
    """Every joint in a row: the largest sizes, and what statics leaves open."""
    size = lambda x: short(np.max(np.linalg.norm(np.asarray(x), axis=-1)))  # noqa: E731
    rows = []
    for name, load in loads.items():
        effort = np.abs(np.asarray(load.effort))
        marks = [c for c, open_ in zip(COMPONENTS, load.undetermined, strict=True) if open_]
        cells = (size(load.force), size(load.moment), short(effort.max()) if effort.size else "-")
        rows.append((name, *cells, ", ".join(marks) or "-"))
    ok = np.asarray(loads.ok)
    summary = f"{len(rows)} joints" + (f", {ok.size} instants" if ok.ndim else "")
    summary += ", ok" if ok.all() else f", {np.count_nonzero(~ok)} not ok"
    return summary, [("joint", "force [N]", "moment [N m]", "effort", "undetermined"), *rows]


class LawForce(eqx.Module):
    """What a force element does at its place.

    Attributes:
        effort: (..., n) between two points one number, positive pushes them apart [N]; on a joint that along its
            freedom [N or N m]; of a `Bushing` force and moment in the axes of its first frame; of a load force and
            moment in world axes; of a law of the whole system that on every velocity.
        force [N], moment [N m]: (..., 3) world axes, on the second of two frames or on the loaded one, the moment
            about its origin; None where it acts on a joint or the whole system.
    """

    effort: Float[Array, "... n"]
    force: Float[Array, "... 3"] | None
    moment: Float[Array, "... 3"] | None


class RowLoad(eqx.Module):
    """What a coupler or rows of the user do.

    Attributes:
        multipliers: (..., k) of its rows, in units of work over the unit of the row.
        efforts: (..., n) by joint: what they exert along its freedoms [N or N m].
    """

    multipliers: Float[Array, "... k"]
    efforts: dict[str, Float[Array, "... n"]]


class Reactions(eqx.Module):
    """Reactions by joint or constraint name, `loads["main"].force`; of force elements `loads.law("spring").effort`,
    of couplers and rows of the user `loads.row("gear").efforts["pinion"]`.

    Attributes:
        multipliers: (..., rows) efforts along the constraint rows; a drive's multiplier is its effort.
        residual: (...) largest unbalanced effort `M u_dot + bias - Q - A^T lambda` of the solve, without derivative.
        ok: (...) whether they are those of an assembled state, finite, balance all loads but for 1e-6 of them, and
            belong to accelerations that keep the constraints as well (1e-2 in single precision).
        hidden: welds inside bodies that the builder split; found by name, not listed.
    """

    joints: dict
    multipliers: Float[Array, "... rows"]
    residual: Float[Array, "..."]
    ok: Bool[Array, "..."]
    hidden: tuple[str, ...] = eqx.field(static=True, default=())
    laws: dict[str, LawForce] = eqx.field(default_factory=dict)
    rows: dict[str, RowLoad] = eqx.field(default_factory=dict)

    __repr__, _repr_html_ = told(_told)

    def __getitem__(self, name: str) -> JointReaction:
        if name not in self.joints:
            raise UnknownNameError(no_such("joint or constraint", name, self) + self._elsewhere(name))
        return self.joints[name]

    def _elsewhere(self, name):
        """Where else a name is known."""
        found = [kind for kind, names in (("law", self.laws), ("row", self.rows)) if name in names]
        return "".join(f"; it is a {kind}: loads.{kind}({name!r})" for kind in found)

    def law(self, name: str) -> LawForce:
        """What a force element does, by its name.  Raises: UnknownNameError."""
        place_of("force element", name, self.laws)
        return self.laws[name]

    def row(self, name: str) -> RowLoad:
        """What a `Coupler`, `Rows` or `VelocityRows` does, by its name.  Raises: UnknownNameError."""
        place_of("coupler or rows", name, self.rows)
        return self.rows[name]

    def __iter__(self):
        return (name for name in self.joints if name not in self.hidden)

    def items(self) -> list[tuple[str, JointReaction]]:
        """Pairs of name and reaction."""
        return [(name, self.joints[name]) for name in self]

    def to_xarray(self, ts: ArrayLike | None = None) -> Any:
        """An `xarray.Dataset` of `force` [N] and `moment` [N m] by joint and component, and by time along a motion.

        Args: ts: its times [s] (default: their numbers).
        """
        import xarray

        names = list(self)
        force, moment = (np.stack([np.asarray(getattr(self[n], p)) for n in names], -2) for p in ("force", "moment"))
        lead = ("time",) * (force.ndim - 2)
        unique = [
            np.stack([getattr(self[name], part) for name in names]) for part in ("unique_force", "unique_moment")
        ]
        data = {
            "force": ((*lead, "joint", "component"), force, {"units": "N"}),
            "moment": ((*lead, "joint", "component"), moment, {"units": "N m"}),
            "unique_force": (("joint", "component"), unique[0]),
            "unique_moment": (("joint", "component"), unique[1]),
        }
        places: dict = {"joint": names, "component": ["x", "y", "z"]}
        if lead:
            places["time"] = ("time", np.arange(len(force)) if ts is None else np.asarray(ts), {"units": "s"})
        return xarray.Dataset(data, places)

    def to_pandas(self, ts: ArrayLike | None = None) -> Any:
        """A `pandas.DataFrame` by joint, and by time along a motion: "force x" to "moment z"."""
        import pandas

        found = self.to_xarray(ts)
        parts = [found[part].to_dataframe()[part].unstack("component").add_prefix(f"{part} ") for part in found][:2]
        return pandas.concat([part.rename_axis(columns=None) for part in parts], axis=1)
