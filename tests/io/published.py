"""Decks of the published benchmarks of NAFEMS, written here, and the frequencies [Hz] that were published.

Sources: Selected benchmarks for natural frequency analysis, NAFEMS (1987), and The standard NAFEMS benchmarks, NAFEMS
(1990): tests FV2, FV4, FV5, FV12, FV16, FV22, FV32, FV52.  `tolerance` is what these meshes and elements reach.
"""

from typing import NamedTuple

import numpy as np


class Published(NamedTuple):
    """A deck, the frequencies that were published for it, from the mode `first` on, and how near we come."""

    deck: str
    frequencies: tuple[float, ...]
    tolerance: float
    first: int = 0


STEEL = "MAT1,1,200.+9,,0.3,8000.\n"


def _grids(points, tail=""):
    return "".join(f"GRID,{k},,{x:.12g},{y:.12g},{z:.12g}{tail}\n" for k, (x, y, z) in enumerate(points, start=1))


def _deck(*parts):
    return (
        "SOL 103\nCEND\nMETHOD = 1\nSPC = 1\nBEGIN BULK\nPARAM,COUPMASS,1\nEIGRL,1,,,20\n"
        + "".join(parts)
        + "ENDDATA\n"
    )


def _square(side):
    """PBAR of a square section: A, I, I, J of the beams' torsion."""
    return f"PBAR,1,1,{side**2:.12g},{side**4 / 12:.12g},{side**4 / 12:.12g},{side**4 / 6:.12g}\n"


def double_cross():
    """FV2: eight arms of 5 m, four elements each, ends pinned, in the plane."""
    points, bars = [(0.0, 0.0, 0.0)], []
    for k in range(8):
        direction = np.array([np.cos(k * np.pi / 4), np.sin(k * np.pi / 4), 0.0])
        row = [1, *range(len(points) + 1, len(points) + 5)]
        points += [tuple(1.25 * j * direction) for j in range(1, 5)]
        bars += list(zip(row[:-1], row[1:], strict=True))
    lines = "".join(f"CBAR,{k},1,{a},{b},0.,0.,1.\n" for k, (a, b) in enumerate(bars, start=1))
    ends = ",".join(str(5 + 4 * k) for k in range(6)), ",".join(str(5 + 4 * k) for k in (6, 7))
    held = f"SPC1,1,345,1,THRU,33\nSPC1,1,12,{ends[0]}\nSPC1,1,12,{ends[1]}\n"
    return _deck(STEEL, _square(0.125), _grids(points), lines, held)


def off_centre_masses():
    """FV4: a cantilever of 10 m, 0.5 m thick, whose end carries 10 t and 1 t, each 2 m to its side, on rigid arms."""
    d = 0.5
    A, I = np.pi * d**2 / 4, np.pi * d**4 / 64
    points = [(x, 0.0, 0.0) for x in np.linspace(0, 10, 6)] + [(10.0, 2.0, 0.0), (10.0, -2.0, 0.0)]
    bars = "".join(f"CBAR,{k},1,{k},{k + 1},0.,1.,0.\n" for k in range(1, 6))
    section = f"PBAR,1,1,{A:.12g},{I:.12g},{I:.12g},{2 * I:.12g}\n"
    masses = "CONM2,11,7,,10000.\nCONM2,12,8,,1000.\nRBE2,21,6,123456,7,8\n"
    return _deck(STEEL, section, _grids(points), bars, masses, "SPC1,1,123456,1\n")


def deep_beam():
    """FV5: simply supported, 10 m long, 2 x 2 m thick, ten elements with shear."""
    I = 2.0**4 / 12
    points = [(x, 0.0, 0.0) for x in np.linspace(0, 10, 11)]
    bars = "".join(f"CBEAM,{k},1,{k},{k + 1},0.,1.,0.\n" for k in range(1, 11))
    section = f"PBEAM,1,1,4.,{I:.12g},{I:.12g},0.,{2 * I:.12g}\n,,,,,,,,,\n,.8333333,.8333333\n"
    return _deck(STEEL, section, _grids(points), bars, "SPC1,1,1234,1\nSPC1,1,23,11\n")


def _sheet(n, m, place, thickness, held, kind="CQUAD4", membrane=False):
    """A deck of n x m plates over the unit square carried by `place`."""
    a, b = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, m + 1), indexing="ij")
    points = np.stack(place(a.ravel(), b.ravel()), axis=1)
    at = np.arange(1, (n + 1) * (m + 1) + 1).reshape(n + 1, m + 1)
    cells, k = "", 1
    for i in range(n):
        for j in range(m):
            p, q, r, s = at[i, j], at[i + 1, j], at[i + 1, j + 1], at[i, j + 1]
            for corners in ((p, q, r, s),) if kind == "CQUAD4" else ((p, q, r), (p, r, s)):
                cells += f"{kind},{k},1," + ",".join(map(str, corners)) + "\n"
                k += 1
    supports = "".join(f"SPC1,1,{directions},{node}\n" for nodes, directions in held(at) for node in np.ravel(nodes))
    return _deck(STEEL, f"PSHELL,1,1,{thickness},1,,1\n", _grids(points), cells, supports)


def free_plate(n=16):
    """FV12: free thin square plate, 10 m, 0.05 m thick, out of its plane."""
    return _sheet(n, n, lambda a, b: (10 * a, 10 * b, 0 * a), 0.05, lambda at: [(at, "126")])


def cantilevered_plate(kind="CQUAD4"):
    """FV16: the same plate, one edge clamped."""
    held = lambda at: [(at, "126"), (at[0], "345")]
    return _sheet(10, 10, lambda a, b: (10 * a, 10 * b, 0 * a), 0.05, held, kind)


def rhombic_plate(n=16):
    """FV22: thick rhombic plate, 10 m, 45 degrees, 1 m thick, clamped all round."""
    c = np.sqrt(0.5)
    edges = lambda at: [(at, "126"), (np.unique([at[0], at[-1], at[:, 0], at[:, -1]]), "345")]
    return _sheet(n, n, lambda a, b: (10 * a + 10 * c * b, 10 * c * b, 0 * a), 1.0, edges)


def tapered_membrane(n=12):
    """FV32: 10 m long, 5 m to 1 m high, 0.05 m thick, held along its root, in its plane."""
    place = lambda a, b: (10 * a, (b - 0.5) * (5 - 4 * a), 0 * a)
    return _sheet(2 * n, n, place, 0.05, lambda at: [(at, "345"), (at[0], "12")])


def solid_plate(n=8, layers=2):
    """FV52: square plate of solids, 10 x 10 x 1 m, lower edges held across the plane."""
    counts = np.array([n, n, layers])
    grid = np.stack(np.meshgrid(*(np.arange(k + 1) for k in counts), indexing="ij"), axis=-1)
    points = grid.reshape(-1, 3) * np.array([10 / n, 10 / n, 1 / layers])
    at = np.arange(1, len(points) + 1).reshape(counts + 1)
    cells = ""
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    for k, (i, j, m) in enumerate(np.ndindex(*counts), start=1):
        nodes = [int(at[i + a, j + b, m + c]) for a, b, c in corners]
        cells += f"CHEXA,{k},1," + ",".join(map(str, nodes[:6])) + "\n," + ",".join(map(str, nodes[6:])) + "\n"
    edge = np.unique([at[0, :, 0], at[-1, :, 0], at[:, 0, 0], at[:, -1, 0]])
    held = "".join(f"SPC1,1,3,{node}\n" for node in edge)
    return _deck(STEEL, "PSOLID,1,1\n", _grids(points), cells, held)


PUBLISHED = {
    "FV2 double cross": Published(double_cross(), (11.336, *[17.709] * 7, 45.345, *[57.390] * 7), 0.01),
    "FV4 off-centre masses": Published(off_centre_masses(), (1.723, 1.727, 7.413, 9.972, 18.155, 26.957), 0.005),
    "FV5 deep beam": Published(
        deep_beam(), (42.649, 42.649, 77.542, 125.00, 148.31, 148.31, 233.10, 284.55, 284.55), 0.02
    ),
    "FV12 free plate": Published(free_plate(), (1.622, 2.360, 2.922, 4.233, 4.233, 7.416), 0.02, 3),
    "FV16 cantilevered plate": Published(cantilevered_plate(), (0.421, 1.029, 2.582, 3.306, 3.753, 6.555), 0.02),
    "FV16, triangles": Published(cantilevered_plate("CTRIA3"), (0.421, 1.029, 2.582, 3.306, 3.753, 6.555), 0.025),
    "FV22 rhombic plate": Published(rhombic_plate(), (133.95, 201.41, 265.81, 283.68, 334.45), 0.075),
    "FV32 tapered membrane": Published(tapered_membrane(), (44.623, 130.03, 162.70, 246.05, 379.90, 391.44), 0.015),
    "FV52 solid plate": Published(solid_plate(), (45.897, 109.44, 109.44, 167.89, 193.59, 206.19, 206.19), 0.05, 3),
}
