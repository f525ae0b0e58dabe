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
from ._geometry import BAR_RADIUS
from ._objects import SceneObject, scene_object
from ._solid_library import SolidLibrary, encode_array
from ._view import camera_distance, fit_view

# Sizes relative to the extent of the scene, chosen by eye.
_LONGEST_ARROW = 0.34  # the largest load: a third of the machine is long enough to compare, and does not hide it
_CAPTION = (
    0.62  # height of the names of systems side by side above the centre, over half the view: just above the box
)
_FLOOR = 2.6  # half width of the floor over half the view: it fades out beyond the edges of the picture
_SPACING = 1.3  # distance of systems side by side over their width
_SECONDS = (3.0, 10.0)  # duration on the screen, unless real time is within


class Scene:
    """A scene: `html` is the whole page, `data` the data that it plays; notebooks display it."""

    def __init__(self, data: dict) -> None:
        self.data = data
        page, player = (resources.files(__package__).joinpath(f"player.{end}") for end in ("html", "js"))
        try:
            text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
        except ValueError:
            raise ModelError(["the scene has a number that is not finite: a motion, a load or a scale"]) from None
        shell = page.read_text("utf-8").replace("SCENE_TITLE", html.escape(str(data["title"]) or "jaxmbs"))
        self.html = shell.replace("PLAYER", player.read_text("utf-8")).replace("SCENE_DATA", text)

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
    stresses: Mapping | None = None,
    scale: ScalarLike = 1.0,
    title: str = "",
) -> Scene:
    """Make a 3-D scene of a motion for a browser or a notebook; the page works without network.

    Args:
        system: a mechanism, a structure or a network; or several, by name or in a row, side by side.
        motion: a result of `simulate`, a State, a mode by `animate_mode`, or displacements (T, n) of a linear system;
            for several systems one for each.
        path: the file to write, "motion.html".
        loads: `reactions` of the motion (of each), in any frame and on any side: arrows show forces of joints on
            their children, of contacts on their round parts, and of cables on the bodies of their elements; True
            shows those of contacts and cables alone.
        limits: allowed force [N] of joints, contacts and cables by name, or objects of `Limit` with an upper bound;
            arrows are then coloured by utilisation, those without a limit grey.
        traces: names of frames or bodies whose paths are drawn.
        shapes: lists of `Solid` by body (or "ground"), in place of the default shapes:
            `{"ram": [Solid.stl("a.stl")]}`; a contact or spring of that name is not drawn.
        structures: the mesh of a linear system; of a network structures by component; of a mechanism `(structure,
            floating frame)` by elastic body.
        stresses: values (T, nodes) [Pa] by elastic body, `flexible.stresses(...).at_nodes()` of the motion, that
            colour its mesh in place of displacements; from zero to the largest.
        scale: factor of deformations of meshes.
        title: heading of the picture, and of the browser's window.

    Returns: a `Scene`; for a four-bar of about 0.1 MB.

    Raises: UnknownNameError; ModelError for systems without positions or instants, or with other instants than
    others.
    """
    if not np.isfinite(scale):
        raise ModelError([f"scale must be a finite number, got {scale}"])
    systems, motions, found = (_one_per_system(x, system) for x in (system, motion, loads))
    names, traces = list(system) if isinstance(system, Mapping) else [""] * len(systems), list(traces)
    shown = [scene_object(*pair, structures, scale, stresses) for pair in zip(systems, motions, strict=True)]
    if any(len(one.ts) != len(shown[0].ts) for one in shown):
        raise ModelError("motions of several systems need the same number of instants")
    _check_traces(traces, shown)
    made = Scene({"title": title} | _scene_data(shown, names, found, limits or {}, traces, shapes or {}))
    if path is not None:
        made.save(path)
    return made


def _scene_data(shown, names, loads, limits, traces, shapes):
    """Data of the scene: all objects, the solids that they share, and the view."""
    points, solids = np.concatenate([one.points for one in shown]), SolidLibrary()
    extent = float(np.max(np.ptp(points, axis=0), initial=0.0)) or 1.0
    radius = BAR_RADIUS * extent
    view, reach = fit_view(points, shown[0].gravity, 4 * radius), _LONGEST_ARROW * extent
    arrows = [one.arrows(own, limits) for one, own in zip(shown, loads, strict=True)]
    largest = max((float(np.max(np.linalg.norm(a["force"], axis=-1), initial=0.0)) for a in arrows if a), default=0.0)
    offsets = _side_by_side(view, len(shown))
    seen = [one.points + offset for one, offset in zip(shown, offsets, strict=True)]
    seen += [
        _arrow_tips(a, offset, reach / largest)
        for a, offset in zip(arrows, offsets, strict=True)
        if a and largest > 0
    ]
    objects = [
        one.contents(solids, radius, view.up, shapes, traces)
        | {"name": str(name), "offset": offset.tolist(), "arrows": None if a is None else _encode_arrows(a, largest)}
        for one, name, a, offset in zip(shown, names, arrows, offsets, strict=True)
    ]
    return {
        "ts": encode_array(shown[0].ts),
        "objects": objects,
        "solids": solids.stored,
        "cylinder": solids.cylinder,
        "cone": solids.cone,
        "ball": solids.ball,
        "radius": radius,
        "reach": reach,
        "up": view.up.tolist(),
        "front": view.front.tolist(),
        "centre": view.centre.tolist(),
        "caption": (view.centre + view.up * (_CAPTION * view.half)).tolist(),
        "ground": view.ground,
        **_floor_and_camera(view, extent, np.concatenate(seen), len(shown)),
        **_playback(shown[0]),
        "scale": _legend(largest, limits) if largest > 0 else _stress_legend(shown),
        "has": {
            "loads": largest > 0,
            "traces": bool(traces),
            "rest": any(s["meshes"] for s in objects),
            "names": True,
        },
    }


def _side_by_side(view, count):
    """Offsets (count, 3) of systems side by side."""
    along = (np.arange(count) - (count - 1) / 2) * _SPACING * view.width
    return along[:, None] * np.cross(view.up, view.front)[None]


def _one_per_system(x, systems):
    """One entry for each system; a single motion or loads count for all systems."""
    if isinstance(systems, Mapping):
        given = x if isinstance(x, Mapping) else dict.fromkeys(systems, x)
        missing = [no_such("system", name, systems) for name in given if name not in systems]
        if missing or len(given) < len(systems):
            raise UnknownNameError("; ".join(missing) or "give one motion per system, keyed by its name")
        return [given[name] for name in systems]
    if isinstance(systems, list | tuple):
        return list(x) if isinstance(x, list | tuple) else [x] * len(systems)
    return [x]


def _check_traces(traces, shown):
    wrong = [name for name in traces if not any(name in one.traceable for one in shown)]
    if wrong:
        raise UnknownNameError("; ".join(no_such("frame or body", n, shown[0].traceable) for n in wrong))


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


def _stress_legend(shown):
    largest = max(getattr(one, "largest_stress", 0.0) for one in shown)
    return f"stress: 0 to {largest / 1e6:.3g} MPa" if largest > 0 else None


def _arrow_tips(arrow, offset, scale):
    """Tips (n, 3) of all arrows at all times."""
    return (arrow["place"] + offset + scale * arrow["force"]).reshape(-1, 3)


def _floor_and_camera(view, extent, points, count):
    """A floor with cells of round size under all objects, and a camera that sees all points (n, 3)."""
    half = np.hypot(view.half, 0.5 * _SPACING * view.width * (count - 1))
    wide = _FLOOR * half
    step = 10.0 ** np.floor(np.log10(extent / 3))
    step *= next(k * tens for tens in 10.0 ** np.arange(20) for k in (1, 2, 5) if wide / (k * tens * step) <= 20)
    angle = 0.5  # field of view [rad], about that of a 75 mm lens: little perspective distortion
    camera = {"azimuth": view.azimuth * (1.0 if count == 1 else 0.3), "elevation": view.elevation}
    camera["distance"] = camera_distance(view, points, angle, 5 * BAR_RADIUS * extent, **camera)
    return {"floor": wide, "cells": wide / step, "angle": angle, "camera": camera}


def _playback(shown: SceneObject):
    """Speed of playback and format of the clock."""
    span = float(shown.ts[-1] - shown.ts[0])
    if shown.frequency is not None:
        return {"speed": span / 2.0, "digits": 4, "clock": f"{shown.frequency:.4g} Hz"}
    low, high = _SECONDS
    duration = min(max(span, low), high) if span > 0 else 1.0
    digits = int(np.clip(2 - np.floor(np.log10(span)), 1, 6)) if span > 0 else 2
    return {"speed": span / duration, "digits": digits, "clock": None}
