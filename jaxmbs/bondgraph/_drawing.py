"""A bond graph as an SVG drawing with half arrows and causal strokes, and as a networkx graph."""

from os import PathLike
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from ..atomic_write import write_atomic
from ..palette import BLUE, COLORS, GREY, ORANGE, RED, VIOLET
from ._layout import layout, text_of

_KIND_COLORS = {
    "I": BLUE,
    "C": COLORS[2],
    "R": RED,
    "Se": ORANGE,
    "Sf": ORANGE,
    "GR": VIOLET,
    "GY": VIOLET,
    "port": ORANGE,
    "MTF": GREY,
    "TF": GREY,
}
#: Colours of the bonds inside of elements by domain.
_DOMAIN_COLORS = {"electric": ORANGE, "fluid": BLUE}
_STYLE = (
    "text{font-family:'DejaVu Sans',Verdana,sans-serif;font-size:12px;fill:#222}"
    ".kind{font-weight:bold}.label{font-size:10px;fill:#444}"
    "path{stroke:#333;stroke-width:1.2;fill:none;stroke-linecap:round}.root{fill:#eef2f5;stroke:#9aa7b1}"
    ".signal{stroke:#777;stroke-width:0.9}.tip{fill:#777;stroke:none}.psi{font-size:9px;fill:#777}"
)
_MARGIN, _MAX_LINE_WIDTH = 18.0, 7.0


def draw_bond_graph(graph: Any, path: str | PathLike | None = None, powers: Any = None, seconds: float = 6.0) -> str:
    """SVG text of a bond graph; tooltips name every element and bond.

    Args:
        graph: what `bond_graph` returned.
        path: file to write as well.
        powers: `bond_powers` of the same view: bonds become as wide as the power they carry; along a motion of
            several states the drawing is animated over `seconds`.

    Raises: ValueError when the powers belong to another view.
    """
    places = layout(graph)
    boxes = np.array(list(places.boxes.values()))
    low, high = boxes[:, :2].min(axis=0) - _MARGIN, boxes[:, 2:].max(axis=0) + _MARGIN
    size = high - low
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{size[0]:.0f}" height="{size[1]:.0f}" '
        f'viewBox="{low[0]:.1f} {low[1]:.1f} {size[0]:.1f} {size[1]:.1f}">',
        f"<style>{_STYLE}</style>",
        f'<rect x="{low[0]:.1f}" y="{low[1]:.1f}" width="{size[0]:.1f}" height="{size[1]:.1f}" fill="white"/>',
    ]
    widths = _widths(graph, powers)
    parts += [_bond_svg(bond, places.paths[bond.name], widths.get(bond.name), seconds) for bond in graph.bonds]
    parts += [_element_svg(graph, e, places.boxes[e.name], places.side.get(e.name, 0)) for e in graph.elements]
    text = "\n".join([*parts, "</svg>"]) + "\n"
    if path is not None:
        write_atomic(path, text)
    return text


def to_networkx(graph):
    """The graph as a `networkx.MultiDiGraph` along the half arrows.

    Nodes carry kind, label, size and domain, edges (key: the bond's name) size, stroke and domain.

    Raises: ModuleNotFoundError without networkx; it is in the extra `viz`.
    """
    import networkx

    net = networkx.MultiDiGraph(view=graph.view)
    for e in graph.elements:
        net.add_node(e.name, kind=e.kind, label=e.label, size=e.size, domain=e.domain)
    for b in graph.bonds:
        net.add_edge(b.tail, b.head, key=b.name, size=b.size, stroke=b.stroke, domain=b.domain)
    return net


def _widths(graph, powers):
    """Line widths (T,) by bond from powers."""
    if powers is None:
        return {}
    if powers.graph.view != graph.view or set(powers.effort) != {bond.name for bond in graph.bonds}:
        raise ValueError(f"these powers belong to the {powers.graph.view} view of a graph, not to this one")
    size = {name: np.atleast_1d(np.abs(np.asarray(power))) for name, power in powers.power.items()}
    largest = max((value.max() for value in size.values()), default=0.0) or 1.0
    return {name: 1.0 + (_MAX_LINE_WIDTH - 1.0) * value / largest for name, value in size.items()}


def _path_data(points):
    return "M" + " L".join(f"{x:.1f} {y:.1f}" for x, y in points)


def _bond_svg(bond, points, widths, seconds):
    """Line, half arrow at the head, causal stroke across its end."""
    points = np.asarray(points, float)
    along = (points[-1] - points[-2]) / np.linalg.norm(points[-1] - points[-2])
    barb = points[-1] - 9.0 * (along @ np.array([[0.83, 0.55], [-0.55, 0.83]]))
    marks = _path_data([points[-1], barb])
    if bond.stroke:
        end, before = (points[-1], points[-2]) if bond.stroke == "head" else (points[0], points[1])
        across = np.array([before[1] - end[1], end[0] - before[0]]) / np.linalg.norm(end - before)
        marks += " " + _path_data([end - 5.0 * across, end + 5.0 * across])
    color = _DOMAIN_COLORS.get(bond.domain)
    style, moving = f' style="stroke:{color}"' if color else "", ""
    if widths is not None:
        style = f' style="stroke-width:{widths[0]:.2f};stroke:{color or BLUE};stroke-opacity:0.75"'
        if len(widths) > 1:
            values = ";".join(f"{w:.2f}" for w in widths)
            moving = (
                f'<animate attributeName="stroke-width" values="{values}" dur="{seconds}s" repeatCount="indefinite"/>'
            )
    domain = "" if bond.domain == "mechanical" else f", {bond.domain}"
    title = f"<title>{escape(bond.name)} ({bond.size}{domain})</title>"
    return f'<g>{title}<path d="{_path_data(points)}"{style}>{moving}</path><path d="{marks}"/></g>'


def _signal_svg(x, top):
    """The signal of the coordinates, a full arrow without power that modulates a transformer, S2 Fig. 2."""
    arrow = f'<path class="signal" d="M{x:.1f} {top - 13:.1f} L{x:.1f} {top - 4:.1f}"/>'
    head = f'<path class="tip" d="M{x - 2.5:.1f} {top - 5:.1f} L{x + 2.5:.1f} {top - 5:.1f} L{x:.1f} {top:.1f} Z"/>'
    text = f'<text class="psi" x="{x + 4:.1f}" y="{top - 5:.1f}">Ψ</text>'
    return arrow + head + text


def _element_svg(graph, element, box, side):
    x, (text, label) = (box[0] + box[2]) / 2, text_of(element)
    y = (box[1] + box[3]) / 2 if element.name in graph.roots else box[1] + 9.0
    parts = [f"<title>{escape(element.name)} ({element.size})</title>"]
    if element.name in graph.roots:
        w, h = box[2] - box[0], box[3] - box[1]
        parts.append(
            f'<rect class="root" x="{box[0]:.1f}" y="{box[1]:.1f}" width="{w:.1f}" height="{h:.1f}" rx="8"/>'
        )
        y -= 7.0
    if side:
        x = box[0] if side > 0 else box[2]
    anchor = {0: "middle", 1: "start", -1: "end"}[side]
    ink = f' style="fill:{_KIND_COLORS[element.kind]}"' if element.kind in _KIND_COLORS else ""
    parts.append(
        f'<text class="kind" x="{x:.1f}" y="{y + 4.3:.1f}" text-anchor="{anchor}"{ink}>{escape(text)}</text>'
    )
    if element.kind == "MTF":
        parts.append(_signal_svg(x, box[1]))
    if label:
        parts.append(f'<text class="label" x="{x:.1f}" y="{y + 17:.1f}" text-anchor="middle">{escape(label)}</text>')
    return f"<g>{''.join(parts)}</g>"
