"""Pictures of structures, networks and their modes: faces and bars, coloured by displacement."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..fem._structure import Structure
from ..linear._system import LinearSystem
from ..typing import ScalarLike
from ..vibration._modes import Modes
from ._canvas import get_axes, split_columns
from ._mechanism import format_view
from ._mesh import DisplayMesh, display_mesh, moving_meshes
from ._mode_animation import animate_mode
from ._projection import read_projection

_MAP = "viridis"


def plot_structure(
    what: Structure | LinearSystem,
    x: Any = None,
    plane: str = "iso",
    ax: Any = None,
    *,
    structures: Any = None,
    values: Any = None,
    label: str = "",
    scale: ScalarLike | None = None,
) -> Any:
    """Plot a mesh at rest, or displaced and coloured by the size of displacements, the mesh at rest in grey behind
    it.

    Args:
        what: a structure, a linear system whose nodes have positions, or a network.
        x: displacements (n,) of its coordinates (of a structure: of its rows or, (nodes, 3 or 6), of its nodes).
        plane: as of `plot_mechanism`.
        ax: matplotlib axes to draw into (default: new ones).
        structures: as of `scene`.
        values: numbers (nodes,) to colour a single mesh by, such as stresses, in place of displacements.
        label: their label.
        scale: factor of the displacements (default: the largest becomes 8 % of the extent).

    Raises: ModelError without positions; ValueError for displacements of another shape or an unknown plane.
    """
    look, ax = read_projection(plane), get_axes(ax)
    meshes = _displaced_meshes(what, x, structures)
    extent = max(mesh.extent for mesh, _ in meshes)
    largest = max(np.max(np.linalg.norm(u, axis=-1), initial=0.0) for _, u in meshes)
    if scale is None:
        scale = 0.08 * extent / largest if largest > 0 else 0.0
    top, unit, text = _length_unit(largest, extent) if values is None else (np.max(values), 1.0, label)
    colored, low = x is not None or values is not None, 0.0 if values is None else min(0.0, float(np.min(values)))
    shown = None
    for mesh, u in meshes:
        if largest > 0 and scale:
            _draw_undeformed(ax, mesh, look)
        numbers = (np.linalg.norm(u, axis=-1) if values is None else np.asarray(values)) * unit
        shown = (
            _draw_mesh(ax, mesh, mesh.rest + scale * u, look, numbers if colored else None, (low, top * unit))
            or shown
        )
    if colored and shown is not None and text:
        _color_bar(shown, ax, text)
    ax.autoscale_view()
    return format_view(ax, look)


def plot_modes(
    system: LinearSystem,
    modes: Modes,
    numbers: Iterable[int] | None = None,
    plane: str = "iso",
    ax: Any = None,
    *,
    structures: Any = None,
) -> Any:
    """Plot modes beside each other at their largest displacement, with frequencies [Hz].

    Colours are shares of the largest displacement of each mode.

    Args:
        numbers: indices of modes (default: the first four that are not rigid).
        ax: matplotlib axes to draw into (default: new ones); they become the leftmost.

    Raises: ModelError as `plot_structure`; ValueError for no such mode or none.
    """
    if numbers is None:
        first = modes.num_rigid
        numbers = range(first, min(first + 4, modes.shapes.shape[1]))
    numbers = list(numbers)
    if not numbers:
        raise ValueError("there is no mode to show: numbers is empty, or all modes are rigid")
    ax, shown = get_axes(ax, (2.6 * len(numbers) + 0.6, 1.9)), None
    rooms = split_columns(ax, len(numbers))
    for room, number in zip(rooms, numbers, strict=True):
        mode = animate_mode(system, modes, number, frames=2)
        meshes = moving_meshes(system, np.asarray(mode.displacement)[:1], structures).values()
        look = read_projection(plane)
        largest = max(np.max(np.linalg.norm(u, axis=-1)) for _, u in meshes)
        for mesh, u in meshes:
            _draw_undeformed(room, mesh, look)
            share = np.linalg.norm(u[0], axis=-1) / (largest or 1.0)
            shown = _draw_mesh(room, mesh, mesh.rest + u[0], look, share, (0.0, 1.0)) or shown
        room.autoscale_view()
        format_view(room, look).set_title(f"{mode.frequency:.4g} Hz", fontsize="medium")
    if shown is not None:
        _color_bar(shown, rooms, "share of\nthe largest")
    return ax


def _displaced_meshes(what, x, structures):
    """Pairs of mesh and translations (nodes, 3)."""
    if isinstance(what, Structure):
        mesh = display_mesh(what)
        return [(mesh, _node_displacements(mesh, what, x))]
    n = what.num_rows
    x = np.zeros(n) if x is None else np.real(np.asarray(x))
    if x.shape != (n,):
        raise ValueError(f"displacements must have the shape ({n},), not {x.shape}")
    return [(mesh, u[0]) for mesh, u in moving_meshes(what, x[None], structures).values()]


def _node_displacements(mesh: DisplayMesh, structure, x):
    if x is None:
        return np.zeros_like(mesh.rest)
    x = np.real(np.asarray(x))
    if x.shape in ((len(mesh.rest), 3), (len(mesh.rest), 6)):
        return x[:, :3]
    labels = structure.labels
    if x.shape != (len(labels),):
        raise ValueError(
            f"displacements must have the shape ({len(labels)},) or ({len(mesh.rest)}, 3 or 6), not {x.shape}"
        )
    return mesh.node_translations(labels, x)


def _color_bar(shown, rooms, text):
    """Add a colour bar at the right of axes."""
    figure = (rooms[0] if isinstance(rooms, list) else rooms).figure
    bar = figure.colorbar(shown, ax=rooms, shrink=0.6, pad=0.02)
    bar.set_label(text)
    bar.outline.set_visible(False)


def _length_unit(largest, extent):
    """Unit and label of displacements: millimetres, or metres for large ones."""
    return (largest, 1e3, "displacement [mm]") if largest < 0.5 * extent else (largest, 1.0, "displacement [m]")


def _draw_undeformed(ax, mesh, look):
    from matplotlib.collections import LineCollection

    lines = look(mesh.rest[np.concatenate([mesh.edges, mesh.bars])])
    ax.add_collection(LineCollection(lines, colors="0.75", linewidths=0.6, zorder=1))


def draw_moving(ax, meshes, look, largest):
    """Draw meshes with translations (T, nodes, 3) at their first instant; returns a function that shows another."""
    drawn: list = []

    def show(k):
        while drawn:
            drawn.pop().remove()
        before = len(ax.collections)
        for mesh, u in meshes:
            _draw_mesh(ax, mesh, mesh.rest + u[k], look, np.linalg.norm(u[k], axis=-1), (0.0, largest))
        drawn.extend(ax.collections[before:])

    for mesh, _ in meshes:
        _draw_undeformed(ax, mesh, look)
    show(0)
    return show


def _draw_mesh(ax, mesh, places, look, numbers, limits):
    """Draw faces from far to near, bars and nodes; returns the artist for a colour bar."""
    from matplotlib.collections import LineCollection, PolyCollection

    shown, options = None, {"cmap": _MAP, "clim": limits}
    flat = look(places)
    if len(mesh.cells):
        order = np.argsort((places @ look.depth)[mesh.cells].mean(axis=1))
        faces = mesh.cells[order]
        if numbers is None:
            shade = {"facecolors": "#c9d6e2", "edgecolors": "none"}
        else:
            shade = {"array": numbers[faces].mean(axis=1), "edgecolors": "face", "linewidths": 0.2, **options}
        shown = ax.add_collection(PolyCollection(flat[faces], zorder=2, **shade))
        edges = LineCollection(flat[mesh.edges], colors="0.15", linewidths=0.3, alpha=0.6, zorder=2.2)
        ax.add_collection(edges)
    if len(mesh.bars):
        style = {"colors": "#1f5f8b"} if numbers is None else {"array": numbers[mesh.bars].mean(axis=1), **options}
        bars = LineCollection(flat[mesh.bars], linewidths=2.2, capstyle="round", zorder=2.4, **style)
        shown = ax.add_collection(bars)
    elif len(mesh.balls) and not len(mesh.cells):
        style = {"color": "#1f5f8b"} if numbers is None else {"c": numbers[mesh.balls], "cmap": _MAP}
        shown = ax.scatter(*flat[mesh.balls].T, s=18, zorder=3, **style)
        shown.set_clim(*limits)
    return None if numbers is None else shown
