"""`scene`: a motion or a mode in three dimensions, as one file for a browser that needs nothing else."""

import html
import json
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ...atomic_write import write_atomic
from ...checks import no_such
from ...errors import ModelError, UnknownNameError
from ...linear._system import LinearSystem
from ...model._system import System
from ...typing import ScalarLike
from ._objects import SceneObject, scene_object
from ._geometry import SolidLibrary, encode_array
from ._view import camera_distance, fit_view

_BAR_RADIUS = 0.02  # radius of bars over the extent
_LONGEST_ARROW = 0.34  # length of the longest arrow over the extent
_SECONDS = (3.0, 10.0)  # what a film lasts on the screen, unless real time is within


class Scene:
    """A scene: `html` is the whole page, `data` what it plays; a notebook shows it."""

    def __init__(self, data: dict) -> None:
        self.data = data
        page, player = (resources.files(__package__).joinpath(f"player.{end}") for end in ("html", "js"))
        try:
            text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
        except ValueError:
            raise ModelError(["the scene has a number that is not finite: a motion, a load or a scale"]) from None
        self.html = page.read_text("utf-8").replace("PLAYER", player.read_text("utf-8")).replace("FILM", text)

    def save(self, path: str | PathLike) -> Path:
        """Write the page.  Raises: OSError."""
        path = Path(path)
        write_atomic(path, self.html)
        return path

    def __repr__(self) -> str:
        return f"<Scene {self.data['title']!r}: {len(self.html) / 1e6:.2f} MB>"

    def _repr_html_(self) -> str:
        style = "width:100%;height:480px;border:1px solid #dde3e8;border-radius:6px"
        return f'<iframe srcdoc="{html.escape(self.html)}" style="{style}" title="scene"></iframe>'


def scene(
    system: System | LinearSystem | Sequence | Mapping,
    motion: Any,
    path: str | PathLike | None = None,
    *,
    loads: Any = None,
    limits: Mapping | None = None,
    traces: Iterable[str] = (),
    shapes: Mapping | None = None,
    structures: Any = None,
    scale: ScalarLike = 1.0,
    title: str = "",
) -> Scene:
    """A scene to be turned, played and looked at, in a browser or a notebook, without network.

    Args:
        system: a mechanism, a structure or a network; or several, by name or in a row, side by side.
        motion: of it: what `simulate` returned, a State, a mode by `swing`, displacements (T, n) of a linear system;
            of several systems one for each.
        path: the file to write, "motion.html".
        loads: `reactions` of the motion (of each): forces of joints on their children as arrows, in whichever frame
            and on whichever side they were asked.
        limits: force [N] that a joint may carry by name, or objects of `Limit` with an upper bound; arrows are then
            coloured by how much of it is used, those of joints without a limit grey.
        traces: names of frames or bodies whose paths are drawn.
        shapes: lists of `Solid` by body (or "ground"), in place of what its joints suggest:
            `{"ram": [Solid.stl("a.stl")]}`.
        structures: the mesh of a linear system; of a network structures by component; of a mechanism `(structure,
            floating frame)` by elastic body.
        scale: what deformations of meshes are multiplied by.

    Returns: a `Scene`; of a four-bar it is about 0.1 MB.

    Raises: UnknownNameError; ModelError for what has no positions, no instants or other instants than its neighbours.
    """
    if not np.isfinite(scale):
        raise ModelError([f"scale must be a finite number, got {scale}"])
    systems, motions, found = (_one_per_system(x, system) for x in (system, motion, loads))
    names, traces = list(system) if isinstance(system, Mapping) else [""] * len(systems), list(traces)
    acts = [scene_object(*pair, structures, scale) for pair in zip(systems, motions, strict=True)]
    if any(len(act.ts) != len(acts[0].ts) for act in acts):
        raise ModelError("motions side by side need the same number of instants")
    _check_traces(traces, acts)
    made = Scene({"title": title} | _scene_data(acts, names, found, limits or {}, traces, shapes or {}))
    if path is not None:
        made.save(path)
    return made


def _scene_data(acts, names, loads, limits, traces, shapes):
    """All that is played: the stages of all acts, the solids they share, and from where they are seen."""
    points, solids = np.concatenate([act.points for act in acts]), SolidLibrary()
    extent = float(np.max(np.ptp(points, axis=0), initial=0.0)) or 1.0
    radius = _BAR_RADIUS * extent
    view, reach = fit_view(points, acts[0].gravity, 4 * radius), _LONGEST_ARROW * extent
    arrows = [act.arrows(own, limits) for act, own in zip(acts, loads, strict=True)]
    largest = max((float(np.max(np.linalg.norm(a["force"], axis=-1), initial=0.0)) for a in arrows if a), default=0.0)
    offsets = _side_by_side(view, len(acts))
    seen = [act.points + offset for act, offset in zip(acts, offsets, strict=True)]
    seen += [
        _arrow_tips(a, offset, reach / largest) for a, offset in zip(arrows, offsets, strict=True) if a and largest > 0
    ]
    stages = [
        act.contents(solids, radius, view.up, shapes, traces)
        | {"name": str(name), "offset": offset.tolist(), "arrows": None if a is None else _encode_arrows(a, largest)}
        for act, name, a, offset in zip(acts, names, arrows, offsets, strict=True)
    ]
    return {
        "ts": encode_array(acts[0].ts),
        "stages": stages,
        "solids": solids.stored,
        "cylinder": solids.cylinder,
        "cone": solids.cone,
        "ball": solids.ball,
        "radius": radius,
        "reach": reach,
        "up": view.up.tolist(),
        "front": view.front.tolist(),
        "centre": view.centre.tolist(),
        "caption": (view.centre + view.up * (0.62 * view.half)).tolist(),
        "ground": view.ground,
        **_floor_and_camera(view, extent, np.concatenate(seen), len(acts)),
        **_playback(acts[0]),
        "scale": _legend(largest, limits) if largest > 0 else None,
        "has": {
            "loads": largest > 0,
            "traces": bool(traces),
            "rest": any(s["meshes"] for s in stages),
            "names": True,
        },
    }


def _side_by_side(view, count):
    """Where acts stand side by side, (count, 3)."""
    along = (np.arange(count) - (count - 1) / 2) * 1.3 * view.width
    return along[:, None] * np.cross(view.up, view.front)[None]


def _one_per_system(x, systems):
    """One entry for each system; a motion or loads for all of them alike where only one is given."""
    if isinstance(systems, Mapping):
        given = x if isinstance(x, Mapping) else dict.fromkeys(systems, x)
        missing = [no_such("system", name, systems) for name in given if name not in systems]
        if missing or len(given) < len(systems):
            raise UnknownNameError("; ".join(missing) or "there is one motion for each system, by its name")
        return [given[name] for name in systems]
    if isinstance(systems, list | tuple):
        return list(x) if isinstance(x, list | tuple) else [x] * len(systems)
    return [x]


def _check_traces(traces, acts):
    wrong = [name for name in traces if not any(name in act.traceable for act in acts)]
    if wrong:
        raise UnknownNameError("; ".join(no_such("frame or body", n, acts[0].traceable) for n in wrong))


def _encode_arrows(arrow, largest):
    return {
        "names": arrow["names"],
        "place": encode_array(arrow["place"]),
        "force": encode_array(arrow["force"]),
        "limits": arrow["limits"],
        "largest": largest,
    }


def _legend(largest, limits):
    if limits:
        return "loads: 0 to 100 % of their limits"
    unit, name = next(((u, n) for u, n in ((1e6, "MN"), (1e3, "kN")) if largest >= u), (1.0, "N"))
    return f"loads: 0 to {largest / unit:.3g} {name}"


def _arrow_tips(arrow, offset, scale):
    """Where arrows end at any time, (n, 3)."""
    return (arrow["place"] + offset + scale * arrow["force"]).reshape(-1, 3)


def _floor_and_camera(view, extent, points, count):
    """A grid of round meshes about all stages, and the camera that sees all points (n, 3)."""
    half = np.hypot(view.half, 0.5 * 1.3 * view.width * (count - 1))
    wide = 2.6 * half
    step = 10.0 ** np.floor(np.log10(extent / 3))
    step *= next(k for k in (1, 2, 5, 10) if wide / (k * step) <= 20)
    angle = 0.5
    camera = {"azimuth": view.azimuth * (1.0 if count == 1 else 0.3), "elevation": view.elevation}
    camera["distance"] = camera_distance(view, points, angle, 5 * _BAR_RADIUS * extent, **camera)
    return {"floor": wide, "cells": wide / step, "angle": angle, "camera": camera}


def _playback(act: SceneObject):
    """How fast it plays, and what the clock shows."""
    span = float(act.ts[-1] - act.ts[0])
    if act.frequency is not None:
        return {"speed": span / 2.0, "digits": 4, "clock": f"{act.frequency:.4g} Hz"}
    low, high = _SECONDS
    shown = min(max(span, low), high) if span > 0 else 1.0
    digits = int(np.clip(2 - np.floor(np.log10(span)), 1, 6)) if span > 0 else 2
    return {"speed": span / shown, "digits": digits, "clock": None}
