"""Layout of a bond graph: roots as tall bars, their branches in rows beside them.

One root has branches on both sides; with two, phi_dot is left and the drives right of the branches that both move.
"""

from dataclasses import dataclass

ROW_HEIGHT, COLUMN_GAP, BAR_WIDTH = 48.0, 46.0, 30.0
KIND_WIDTH, PORT_WIDTH, LABEL_WIDTH = 10.0, 7.6, 6.3  # widths of letters of kinds, of one-ports and of labels


@dataclass(frozen=True)
class GraphLayout:
    """Boxes (left, top, right, bottom) by element, bond paths (points from tail to head) by bond name, in pixels."""

    boxes: dict
    paths: dict
    side: dict  # +1 where an element's text starts at its left edge, -1 where it ends at its right edge


def text_of(element) -> tuple[str, str]:
    """The text of an element and the small label below it: "I : m crank", or "MTF" above "G_t crank"."""
    if element.is_port:
        return (f"{element.kind} : {element.label}" if element.label else element.kind), ""
    return element.kind, element.label


def text_width(element) -> float:
    """Estimated width of an element's text [px]."""
    text, label = text_of(element)
    return max((PORT_WIDTH if element.is_port else KIND_WIDTH) * len(text), LABEL_WIDTH * len(label), 18.0)


def layout(graph) -> GraphLayout:
    """Places of all elements and bonds."""
    left, middle, right = _sides(graph, _branches(graph))
    first, last = graph.roots[0], graph.roots[-1]
    rows, boxes, side = {}, {}, {}
    heights = [_rows(graph, group, rows) for group in (left, middle, right)]
    for group, height in zip((left, middle, right), heights, strict=True):
        for name in (n for branch in group for n in branch):
            rows[name] += (max(heights) - height) / 2
    width = _columns(graph, middle, rows, boxes, side, BAR_WIDTH / 2, 1)
    shift = 0.0 if first == last else width + COLUMN_GAP + BAR_WIDTH / 2
    _drive_transformers(graph, middle, rows, boxes, side, shift - BAR_WIDTH / 2 - COLUMN_GAP)
    _columns(graph, left, rows, boxes, side, -BAR_WIDTH / 2, -1)
    _columns(graph, right, rows, boxes, side, shift + BAR_WIDTH / 2, 1)
    for root, x in ((first, 0.0), (last, shift)):
        beside = [rows[other] * ROW_HEIGHT for _, other, _ in graph.bonds_of(root)]
        boxes[root] = (x - BAR_WIDTH / 2, min(beside) - 22, x + BAR_WIDTH / 2, max(beside) + 22)
    return GraphLayout(boxes, {bond.name: _path(graph, bond, boxes, rows) for bond in graph.bonds}, side)


def _branches(graph):
    """Connected parts of the graph without its roots, each in the graph's order."""
    part = {e.name: {e.name} for e in graph.elements if e.name not in graph.roots}
    for bond in graph.bonds:
        if bond.tail in part and bond.head in part and part[bond.tail] is not part[bond.head]:
            joined = part[bond.tail] | part[bond.head]
            part.update(dict.fromkeys(joined, joined))
    unique = {id(branch): branch for branch in part.values()}
    return [sorted(branch, key=graph.order.get) for branch in unique.values()]


def _roots_of(graph, branch):
    return {other for name in branch for _, other, _ in graph.bonds_of(name)} & set(graph.roots)


def _sides(graph, branches):
    """Branches left of, between and right of the roots."""
    if len(graph.roots) == 2:
        groups = {("phi_dot",): [], ("drives", "phi_dot"): [], ("drives",): []}
        for branch in branches:
            groups[tuple(sorted(_roots_of(graph, branch))) or ("phi_dot",)].append(branch)
        return list(groups.values())
    sides, counts = ([], [], []), [0, 0, 0]
    sources = [b for b in branches if any(graph[n].kind in ("Se", "Sf") for n in b) and len(b) <= 2]
    for branch in sources + [b for b in branches if b not in sources]:
        at = 0 if branch in sources or counts[0] < counts[2] else 2
        sides[at].append(branch)
        counts[at] += sum(not graph.outward(n) for n in branch)
    return sides


def _is_drive_transformer(graph, name):
    """A transformer of the drives in a graph that has both roots."""
    return len(graph.roots) == 2 and graph[name].kind == "MTF" and graph.inward(name)[0][1] == "drives"


def _rows(graph, group, rows):
    """Gives every element a row: ends of branches one each, others the mean of theirs; returns how many."""
    used = 0
    for branch in group:
        lower = [name for name in branch if _is_drive_transformer(graph, name)]
        ends = [name for name in branch if not graph.outward(name)]
        for name in ends + lower:
            rows[name], used = float(used), used + 1
        for name in reversed(branch):
            if name not in ends + lower:
                outer = [rows[o] for _, o, _ in graph.outward(name)]
                rows[name] = sum(outer) / len(outer)
    return used


def _depths(graph, branch):
    """Columns of a branch from the root outwards; the drives' own transformers stand elsewhere."""
    depth = {}
    for name in branch:
        inner = [depth[o] for _, o, _ in graph.inward(name) if o in depth]
        if not _is_drive_transformer(graph, name):
            depth[name] = 1 + max(inner, default=-1)
    return depth


def _columns(graph, group, rows, boxes, side, edge, sign):
    """Boxes of a group of branches in columns that start at x = edge and run to the right (+1) or left (-1)."""
    depth = {name: d for branch in group for name, d in _depths(graph, branch).items()}
    for column in range(max(depth.values(), default=-1) + 1):
        names = [name for name, d in depth.items() if d == column]
        width = max(text_width(graph[name]) for name in names)
        _spread(rows, names)
        edge += sign * COLUMN_GAP
        for name in names:
            own, element = text_width(graph[name]), graph[name]
            start = edge if element.is_port else edge + sign * (width - own) / 2
            boxes[name] = _box(min(start, start + sign * own), own, rows[name], element)
            side[name] = sign if element.is_port else 0
        edge += sign * width
    return edge


def _spread(rows, names):
    """Rows of the elements of one column no nearer to each other than one, as they are where branches are trees."""
    order = sorted(names, key=rows.__getitem__)
    before = [rows[name] for name in order]
    for upper, name in zip(order, order[1:], strict=False):
        rows[name] = max(rows[name], rows[upper] + 1.0)
    shift = sum(before) / len(before) - sum(rows[name] for name in order) / len(order)
    for name in order:
        rows[name] += shift


def _drive_transformers(graph, group, rows, boxes, side, edge):
    for name in (n for branch in group for n in branch if _is_drive_transformer(graph, n)):
        own = text_width(graph[name])
        boxes[name], side[name] = _box(edge - own, own, rows[name], graph[name]), 0


def _box(left, width, row, element):
    return (left, row * ROW_HEIGHT - 9, left + width, row * ROW_HEIGHT + (20 if text_of(element)[1] else 9))


def _path(graph, bond, boxes, rows):
    """Points of a bond from its tail to its head."""
    inner, outer = sorted((bond.tail, bond.head), key=graph.order.get)
    a, b = boxes[inner], boxes[outer]
    y = rows[outer] * ROW_HEIGHT
    if inner in graph.roots:
        start, end = ((a[2], y), (b[0], y)) if b[0] > a[2] else ((a[0], y), (b[2], y))
    elif graph[outer].kind == "0" and _is_drive_transformer(graph, inner):
        x, low = (b[0] + b[2]) / 2, rows[inner] * ROW_HEIGHT
        return _orient_path(bond, inner, [(a[0] - 3, low), (x, low), (x, b[3] + 3)])
    else:
        others = sorted((rows[o], o) for _, o, _ in graph.outward(inner))
        place = [o for _, o in others].index(outer) - (len(others) - 1) / 2
        from_y = rows[inner] * ROW_HEIGHT + min(12.0, 24.0 / len(others)) * place
        start, end = ((a[2], from_y), (b[0], y)) if b[0] > a[2] else ((a[0], from_y), (b[2], y))
    toward = 3.0 if end[0] > start[0] else -3.0
    return _orient_path(bond, inner, [(start[0] + toward, start[1]), (end[0] - toward, end[1])])


def _orient_path(bond, inner, points):
    return points if bond.tail == inner else points[::-1]
