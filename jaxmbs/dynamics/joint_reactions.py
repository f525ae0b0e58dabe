"""What joints transmit, by their names: the result of `reactions`."""

from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float

from ..checks import no_such
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


class Reactions(eqx.Module):
    """Reactions by joint or constraint name, `loads["main"].force`.

    Attributes:
        multipliers: (..., rows) efforts along the constraint rows; a drive's multiplier is its effort.
        residual: (...) largest unbalanced effort `M u_dot + bias - Q - A^T lambda` of the solve.
        ok: (...) whether they are those of an assembled state, finite, balance all loads but for 1e-6 of them, and
            belong to accelerations that keep the constraints as well (1e-2 in single precision).
        hidden: welds inside bodies that the builder split; found by name, not listed.
    """

    joints: dict
    multipliers: Float[Array, "... rows"]
    residual: Float[Array, "..."]
    ok: Bool[Array, "..."]
    hidden: tuple[str, ...] = eqx.field(static=True, default=())

    __repr__, _repr_html_ = told(_told)

    def __getitem__(self, name: str) -> JointReaction:
        if name not in self.joints:
            raise UnknownNameError(no_such("joint or constraint", name, self))
        return self.joints[name]

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
