"""Sections on a machine: its bodies, joints, elements and freedoms, and a scene of it."""

from html import escape
from typing import Any

import jax
import numpy as np

from ..linear._check import check
from ..linear._system import LinearSystem
from ..model._describe import describe_parts
from ..model._system import System
from ..named_arrays import elements_of
from ..tables import fields_repr, format_number
from ._page import Passage
from ._plots import picture
from ._results import result_section

_FRAMES = 240  # of the scene: eight seconds on the screen at thirty a second


def machine_section(system: Any, state: Any, results: dict) -> list[Passage]:
    """Sections on a mechanism; of a linear system its check; of another model its own report."""
    if not isinstance(system, System):
        return [result_section("Model", check(system) if isinstance(system, LinearSystem) else system)]
    moved = results.get("motion", state)
    found = [_overview(system, moved, results.get("reactions"))]
    found.append(Passage("Bodies", rows=_body_rows(system)))
    tables = {"Forces": _element_rows, "Friction": _friction_rows, "Hydraulics": _oil_rows, "Signals": _signal_rows}
    found += [Passage(title, rows=rows) for title, rows_of in tables.items() if (rows := rows_of(system))]
    return found


def _overview(system, moved, loads):
    heading, joints = describe_parts(system.topology, system.rows, system.doubts())
    gravity = ", ".join(map(format_number, np.asarray(system.gravity)))
    mass = format_number(np.sum(np.asarray(system.mass)))
    lines = [*heading, f"mass of the bodies {mass} kg, gravity ({gravity}) m/s^2"]
    return Passage("Machine", lines, joints, html=_scene(system, moved, loads))


def _scene(system, moved, loads):
    if moved is None or np.ndim(getattr(moved, "ts", 0.0)) > 1:  # nothing to draw, or a batch of motions
        return ""
    from ..viz import plot_mechanism, scene

    start = moved[0] if hasattr(moved, "ts") else moved
    moved, loads = _frames(moved, loads)
    played = scene(system, moved, loads=loads).html
    drawn = picture(lambda ax: plot_mechanism(system, start, ax=ax))
    frame = f'<iframe class="screen" srcdoc="{escape(played)}" title="the machine as it moves"></iframe>'
    return frame + (drawn and f'<figure class="paper"><img src="{drawn}" alt="the machine at the start"></figure>')


def _frames(moved, loads):
    """States and loads at so many times that a scene of them is small; forces alone of the whole motion."""
    times = len(moved) if hasattr(moved, "ts") else 1
    if times <= _FRAMES:
        return moved, loads
    kept = np.linspace(0, times - 1, _FRAMES).round().astype(int)
    thin = lambda x: x[kept] if np.ndim(x) and np.shape(x)[0] == times else x  # noqa: E731
    return moved[kept], jax.tree.map(thin, loads)


def _body_rows(system):
    centre, inertia = np.asarray(system.com), np.asarray(system.inertia)
    rows = [("body", "mass [kg]", "centre of mass [m]", "principal inertias [kg m^2]")]
    for name, mass, c, I in zip(system.topology.body_names, np.asarray(system.mass), centre, inertia, strict=True):
        principal = np.linalg.eigvalsh(I)
        rows.append((name, format_number(mass), *(", ".join(map(format_number, x)) for x in (c, principal))))
    return rows


def _element_rows(system):
    rows = [row for group in system.forces for row in _of_group(group.names, group.law)]
    return [("element", "law"), *rows] if rows else []


def _of_group(names, law):
    """Name and numbers of each element of stacked ones."""
    return [(name, fields_repr(element)) for name, element in elements_of(names, jax.tree.map(np.asarray, law))]


def _friction_rows(system):
    """Rubbing surfaces with their joints, models and sizes."""
    friction, rows = system.friction, []
    if friction is None:
        return rows
    for group in friction.models:
        for k, (_, model) in zip(group.surfaces, _of_group(map(str, group.surfaces), group.model), strict=True):
            sizes = zip(
                ("radius", "length", "preload"), (friction.radius, friction.length, friction.preload), strict=True
            )
            said = ", ".join(
                f"{what} {format_number(x[k])} {unit}"
                for (what, x), unit in zip(sizes, "mmN", strict=True)
                if float(x[k])
            )
            rows.append((friction.names[k], system.topology.joints[friction.joints[k]].name, model, said))
    return [("friction", "joint", "model", "sizes"), *rows]


def _oil_rows(system):
    """Nodes and elements of circuits, and what their ports are connected with."""
    ports = {
        record.name: ", ".join(f"{port}: {node}" for port, node in record.nodes)
        for record in system.topology.circuits
    }
    rows = [
        (*row, ports[row[0]])
        for group in system.blocks
        for row in _of_group(group.names, group.block)
        if row[0] in ports
    ]
    return [("part", "numbers", "ports"), *rows] if rows else []


def _signal_rows(system):
    """Measures and blocks, with what they read and drive."""
    oil = {record.name for record in system.topology.circuits}
    rows = [
        (name, type(group.reading).__name__, ", ".join((*places, *group.internal)), "")
        for group in system.measures
        for name, places in zip(group.names, group.places, strict=True)
    ]
    for group in system.blocks:
        own = zip(_of_group(group.names, group.block), group.reads, group.drives, strict=True)
        rows += [
            (
                name,
                block,
                ", ".join(read if isinstance(read, str) else "a function of time" for read in reads),
                ", ".join(drives),
            )
            for (name, block), reads, drives in own
            if name not in oil
        ]
    return [("signal", "what", "reads", "drives"), *rows] if rows else []
