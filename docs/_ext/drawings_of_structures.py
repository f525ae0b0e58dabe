"""The pictures of the catalogue's finite elements and reductions: one function each, by name."""

import math

from pen import BLUE, GREEN, INK, PALE, RED


def beam(p):
    p.line((-1.4, 0, -0.3), (1.2, 0, -0.3), width=7, color=BLUE)
    p.frame((0, 0, -0.3), 0.55, RED, ((1, 0, 0), (0, 0, 1), (0, -1, 0)))
    for x, name in ((-1.4, "1"), (1.2, "2")):
        p.dot((x, 0, -0.3))
        p.text((x, 0, -0.3), name, shift=(0, 13))
    p.arrow((1.2, 0, -0.3), (1.85, 0, -0.3), "Fx2", GREEN, (-6, -7))


def rod(p):
    p.line((-1.2, 0, -0.4), (1.1, 0, 0.4), width=4, color=BLUE)
    for x, z, name in ((-1.2, -0.4, "1"), (1.1, 0.4, "2")):
        p.dot((x, 0, z))
        p.text((x, 0, z), name, shift=(4, 13))
    p.arrow((1.1, 0, 0.4), (1.7, 0, 0.61), "+", GREEN)
    p.arrow((-1.2, 0, -0.4), (-1.8, 0, -0.61), "+", GREEN)


def spring(p):
    p.spring((-1.3, 0, 0), (1.3, 0, 0))
    for x, name in ((-1.3, "1"), (1.3, "2")):
        p.dot((x, 0, 0))
        p.text((x, 0, 0), name, shift=(0, 13))
    p.frame((0, 0, -0.9), 0.5, RED)


def ground_spring(p):
    p.hatch((-0.6, 0, -0.9), (0.6, 0, -0.9))
    p.spring((0, 0, -0.9), (0, 0, 0.5))
    p.dot((0, 0, 0.5))
    p.frame((0.9, 0, -0.5), 0.5, RED)


def point_mass(p):
    p.dot((-0.8, 0, -0.4))
    p.text((-0.8, 0, -0.4), "node", shift=(0, 13))
    p.line((-0.8, 0, -0.4), (0.5, 0, 0.3), width=1, dash="4 3")
    p.ball((0.5, 0, 0.3), 0.35)
    p.text((0.5, 0, 0.3), "value")
    p.text((-0.1, 0, 0.1), "offset", shift=(-12, -4))


def _nodes(p, places, offset=(0, 12)):
    for i, place in enumerate(places):
        p.dot(place)
        p.text(place, str(i), shift=offset)


def quadrilateral(p):
    corners = (-1.2, -1.0, -0.3), (1.0, -1.0, -0.3), (1.2, 1.0, -0.3), (-1.0, 1.0, -0.3)
    p.plane(*corners, fill=BLUE)
    _nodes(p, corners)
    p.frame((0, 0, -0.3), 0.6, RED)


def triangle(p):
    corners = (-1.5, -0.9, -0.3), (1.2, -0.9, -0.3), (-0.4, 1.3, -0.3)
    p.plane(*corners, fill=BLUE)
    _nodes(p, corners)
    p.frame((-0.3, -0.3, -0.3), 0.5, RED)


def hexahedron(p):
    p.box((-0.2, 0, -0.1), (1.5, 1.2, 1.0), BLUE)
    x, y, z = 0.75, 0.6, 0.5
    places = [(-x, -y, -z), (x, -y, -z), (x, y, -z), (-x, y, -z), (-x, -y, z), (x, -y, z), (x, y, z), (-x, y, z)]
    for i, (a, b, c) in enumerate(places):
        p.dot((a - 0.2, b, c - 0.1))
        p.text((a - 0.2, b, c - 0.1), str(i), shift=(7, -4))
    p.frame((1.25, 0, -1.1), 0.4, RED)


def _solid(p, corners, edges, with_middles):
    """A solid by its edges, with its nodes."""
    for a, b in edges:
        p.line(corners[a], corners[b], width=2, color=BLUE)
    middles = [tuple((a + b) / 2 for a, b in zip(corners[i], corners[j], strict=True)) for i, j in edges]
    _nodes(p, [*corners, *(middles if with_middles else [])], (8, -4))
    p.frame((1.25, 0, -1.1), 0.4, RED)


def tetrahedron(p, with_middles=False):
    corners = (-1.2, -0.8, -0.7), (1.1, -0.8, -0.7), (-0.3, 1.2, -0.7), (-0.2, 0, 1.1)
    _solid(p, corners, ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)), with_middles)


def wedge(p, with_middles=False):
    base = (-1.2, -0.8), (1.0, -0.8), (-0.3, 1.2)
    corners = [(x, y, z) for z in (-0.7, 0.7) for x, y in base]
    _solid(p, corners, ((0, 1), (1, 2), (2, 0), (0, 3), (1, 4), (2, 5), (3, 4), (4, 5), (5, 3)), with_middles)


def quadratic_hexahedron(p):
    x, y, z = 0.9, 0.7, 0.6
    base = (-x, -y), (x, -y), (x, y), (-x, y)
    ring = ((0, 1), (1, 2), (2, 3), (3, 0))
    edges = [*ring, *((k, k + 4) for k in range(4)), *((a + 4, b + 4) for a, b in ring)]
    _solid(p, [(a - 0.2, b, c) for c in (-z, z) for a, b in base], edges, True)


def _layers(p, corners):
    for k, color in enumerate((BLUE, PALE, GREEN)):
        p.plane(*[(x, y, -0.5 + 0.25 * k) for x, y in corners], fill=color)
    _nodes(p, [(x, y, -0.25) for x, y in corners])
    p.frame((0, 0, 0.3), 0.5, RED)


def layered_quadrilateral(p):
    _layers(p, ((-1.2, -1.0), (1.0, -1.0), (1.2, 1.0), (-1.0, 1.0)))


def layered_triangle(p):
    _layers(p, ((-1.5, -0.9), (1.2, -0.9), (-0.4, 1.3)))


def shear_panel(p):
    quadrilateral(p)
    p.arrow((-0.6, -1.15, -0.3), (0.5, -1.15, -0.3), "flow", GREEN)
    p.arrow((1.3, -0.5, -0.3), (1.35, 0.5, -0.3), "", GREEN)


def _curved(p, corners):
    count = len(corners)
    middles = []
    for i in range(count):
        a, b = corners[i], corners[(i + 1) % count]
        middles.append((0.54 * (a[0] + b[0]), 0.54 * (a[1] + b[1]), -0.2))
    ring = [place for pair in zip([(x, y, -0.3) for x, y in corners], middles, strict=True) for place in pair]
    p.plane(*ring, fill=BLUE)
    _nodes(p, [*((x, y, -0.3) for x, y in corners), *middles])
    p.frame((0, 0, -0.3), 0.5, RED)


def quadratic_quadrilateral(p):
    _curved(p, ((-1.2, -1.0), (1.0, -1.0), (1.2, 1.0), (-1.0, 1.0)))


def quadratic_triangle(p):
    _curved(p, ((-1.5, -0.9), (1.2, -0.9), (-0.4, 1.3)))


def _component(p, shape=None, held=(True, False), color=RED, words=""):
    """A bar between two interface nodes, and a shape that it moves in."""
    p.line((-1.4, 0, 0), (1.4, 0, 0), width=6, color=PALE)
    if shape:
        points = [(-1.4 + 2.8 * i / 40, 0, shape(i / 40)) for i in range(41)]
        p.line(*points, color=color, width=2)
    for x, is_held in zip((-1.4, 1.4), held, strict=True):
        p.dot((x, 0, 0), INK)
        if is_held:
            p.hatch((x, 0, -0.3), (x, 0, 0.3), below=(-0.1 if x < 0 else 0.1, 0, 0))
    p.text((0, 0, -1.1), words)


def guyan(p):
    _component(p, lambda s: 0.8 * s * s * (3 - 2 * s), (False, False), words="interface alone")


def craig_bampton(p):
    _component(p, lambda s: 0.55 * math.sin(math.pi * s) ** 2, (True, True), words="+ interface held: normal 0 ...")


def hurty(p):
    _component(p, lambda s: 0.55 * math.sin(math.pi * s) ** 2, (True, True), words="rigid + redundant + normal")
    p.line((-1.4, 0, 0.5), (1.4, 0, 0.95), color=GREEN, width=2)


def macneal(p):
    _component(p, lambda s: 0.7 * math.cos(2 * math.pi * s), (False, False), words="free modes, massless rest")


def rubin(p):
    _component(p, lambda s: 0.7 * math.cos(2 * math.pi * s), (False, False), words="free modes + attachment")
    p.arrow((1.4, 0, 0.2), (1.4, 0, 0.95), color=GREEN)


def craig_chang(p):
    _component(p, lambda s: 0.7 * math.cos(2 * math.pi * s), (False, False), words="rigid + elastic free modes")
    p.line((-1.4, 0, 0.5), (1.4, 0, 0.95), color=GREEN, width=2)


def mixed(p):
    _component(p, lambda s: 0.6 * s * s, (True, False), words="some held, some free")


def characteristic(p):
    _component(p, None, (False, False), words="modes of the interface")
    for x in (-1.4, 1.4):
        p.arrow((x, 0, 0), (x, 0, 0.75), "0" if x < 0 else "")


def unreduced(p):
    _component(p, None, (False, False), words="all coordinates")
    for i in range(7):
        p.dot((-1.4 + 2.8 * i / 6, 0, 0), RED)


def cyclic(p):
    for i in range(8):
        a, b = math.pi * i / 4, math.pi * (i + 1) / 4
        ring = [(r * math.cos(t), 0, r * math.sin(t)) for r, t in ((0.4, a), (1.2, a), (1.2, b), (0.4, b))]
        p.path([p.at(c) for c in ring], fill=BLUE if i == 1 else "#eceef0", width=1, closed=True)
    p.text((0.45, 0, 0.8), "sector", shift=(-4, 0))


def mirror(p):
    for x, fill in ((-0.75, PALE), (0.75, BLUE)):
        p.path(
            [p.at((x / 0.75 * a, 0, z)) for a, z in ((0, -0.6), (1.3, -0.3), (1.3, 0.5), (0, 0.6))],
            fill=fill,
            closed=True,
        )
    p.line((0, 0, -1.0), (0, 0, 1.1), dash="5 3", color=RED)
    p.arrow((0, 0, 0.9), (0.7, 0, 0.9), "normal")


STRUCTURES = {
    "Beam": beam,
    "Characteristic": characteristic,
    "CraigBampton": craig_bampton,
    "CraigChang": craig_chang,
    "Cyclic": cyclic,
    "GroundSpring": ground_spring,
    "Guyan": guyan,
    "Hexahedron": hexahedron,
    "Hurty": hurty,
    "LayeredQuadrilateral": layered_quadrilateral,
    "LayeredTriangle": layered_triangle,
    "MacNeal": macneal,
    "Mirror": mirror,
    "Mixed": mixed,
    "Unreduced": unreduced,
    "PointMass": point_mass,
    "QuadraticHexahedron": quadratic_hexahedron,
    "QuadraticQuadrilateral": quadratic_quadrilateral,
    "QuadraticTriangle": quadratic_triangle,
    "QuadraticTetrahedron": lambda p: tetrahedron(p, True),
    "QuadraticWedge": lambda p: wedge(p, True),
    "Quadrilateral": quadrilateral,
    "Rod": rod,
    "Rubin": rubin,
    "ShearPanel": shear_panel,
    "Spring": spring,
    "Tetrahedron": tetrahedron,
    "Triangle": triangle,
    "Wedge": wedge,
}
