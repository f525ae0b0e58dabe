"""Largest loads of all joints along a motion, each with its time and the pose then, as one table."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from ..assembly._state_report import shown_coordinates
from ..constraints._reaction_map import reaction_carriers
from ..math._linalg import safe_norm
from ..model._system import System
from ..quantities import Axis, Quantity
from ..reaction import reactions
from ..reports import Report, Reported
from ..runtime import jit
from ..tables import format_number
from ._motion import Motion
from ._peaks import Peak, check_one_motion, peak


def _table_parts(peaks):
    rows = [
        (name, *(format_number(x) for p in (peaks.force[name], peaks.moment[name]) for x in (p.value, p.time)))
        for name in peaks.force
    ]
    return f"{len(rows)} joints", [("joint", "force [N]", "at [s]", "moment [N m]", "at [s]"), *rows]


class LoadPeaks(Reported, eqx.Module):
    """The largest force [N] and the largest moment [N m] of every joint along a motion, by the name of the joint.

    A `Peak` of each, with its time [s] and the State then.
    """

    force: dict[str, Peak]
    moment: dict[str, Peak]

    def report(self) -> Report:
        summary, rows = _table_parts(self)
        found = []
        for what, unit, peaks in (("force", "N", self.force), ("moment", "N m", self.moment)):
            joint = (Axis("joint", tuple(peaks)),)
            values, times = (np.asarray([getattr(p, part) for p in peaks.values()]) for part in ("value", "time"))
            found += [Quantity(what, values, unit, joint), Quantity(f"time of {what}", times, "s", joint)]
        return Report(found, summary, table=rows)

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` by joint and by load, "force" or "moment": its value, its time, and the coordinates of
        the pose then, by joint."""
        import pandas

        rows = {
            (name, kind): {"value": float(p.value), "time": float(p.time), **_coordinates(p.state)}
            for kind, peaks in (("force", self.force), ("moment", self.moment))
            for name, p in peaks.items()
        }
        table = pandas.DataFrame.from_dict(rows, orient="index")
        return table.rename_axis(["joint", "load"]).sort_index(level=0, sort_remaining=False)


def _coordinates(state):
    """The coordinates of a state by joint, "ball rx" and on of a joint with several."""
    return {name: float(value) for name, value, _ in shown_coordinates(state)}


def load_peaks(system: System, motion: Motion) -> LoadPeaks:
    """The largest force and moment of every joint along a motion, found between the saved times as `peak` does.

    Forces and moments by their size, the moments about the origin of the joint's frame on its child.  Of a joint with
    components that statics leaves open they are those of the default compliances, see `reactions`.

    Returns: LoadPeaks, nan where the motion failed; its numbers have derivatives as those of `peak`.

    Raises: ValueError for a batch of motions; ModelError for the motion of another system.
    """
    check_one_motion(system, motion)
    return _load_peaks(system, motion)


@jit(compile="tape")
def _load_peaks(system, motion):
    hidden = {joint.name for joint in system.topology.joints if joint.is_hidden}
    names = [name for name, *_ in reaction_carriers(system) if name not in hidden]

    def sizes(state):
        loads = reactions(system, state)
        wrenches = jnp.stack([jnp.stack([loads[name].force, loads[name].moment]) for name in names])
        return jax.vmap(jax.vmap(safe_norm))(wrenches)

    found = peak(system, motion, sizes)
    force, moment = (
        {name: jax.tree.map(lambda x, j=j, k=k: x[j, k], found) for j, name in enumerate(names)} for k in (0, 1)
    )
    return LoadPeaks(force, moment)
