"""S3: the plane truss of two substructures of NASTRAN-95's demonstration problem D02-03-3A, to the printed digit."""

import jax
import numpy as np

from jaxmbs.coupling import connect, rigid_bond
from jaxmbs.elements import Rod
from jaxmbs.fem import Structure, assemble
from jaxmbs.reductions import CraigBampton, reduce
from jaxmbs.vibration import modes

#: Seven digits of the printed output [Hz]; its table of differences from the whole truss in per cent.
PRINTED = [3.595773, 17.56351, 28.49219, 39.50692, 61.09858, 80.28014, 84.45366, 98.89752, 111.7643]
PRINTED += [123.3484, 127.5563, 130.3586, 134.9217, 153.6055, 162.0193, 180.3218, 200.7017]
DIFFERENCE = [0.0085, 0.0012, 0.0639, 0.0011, 0.0051, 0.0066, 0.379, 0.039, 0.018, 0.345, 0.548, 0.155]
DIFFERENCE += [2.220, 0.174, 2.98, 5.27, 14.89]


def part(first, last, clamped):
    """Columns of three nodes from one to another, joined to the rest at column 5; both have its uprights."""
    names = {(c, r): f"{c}.{r}" for c in range(first, last + 1) for r in range(3)}
    nodes = {name: (40.0 * c, 30.0 * (r - 1), 0.0) for (c, r), name in names.items()}
    rods = []
    for c in range(first, last + 1):
        rods += [(names[c, r], names[c, r + 1]) for r in range(2)]
        if c < last:
            rods += [(names[c, r], names[c + 1, r]) for r in range(3)]
            rods += [(names[c, 1], names[c + 1, r]) for r in (0, 2)]
    held = {name: "x y z" if clamped and c == 0 else "z" for (c, _), name in names.items()}
    structure = Structure(nodes, {"rods": (Rod(1e7, 0.3, 2.5e-3, lumped=True), rods)}, held)
    return assemble(structure, [names[5, r] for r in range(3)])


@jax.jit
def assemblies(parts):
    """Joined in few coordinates and in all, and their frequencies."""
    reduced = [reduce(p, CraigBampton(7)) for p in parts]
    whole = list(parts)
    joined = [connect({"a": a, "b": b}, {"seam": rigid_bond("a", "b")}) for a, b in (reduced, whole)]
    return joined, [modes(assembly, 17, damped=False).frequencies for assembly in joined]


def test_published_frequencies_and_differences():
    """Seven fixed-interface modes in each part, 20 coordinates for 54."""
    (reduced, whole), frequencies = assemblies((part(0, 5, True), part(5, 9, False)))
    found, exact = (np.asarray(f) for f in frequencies)
    assert reduced.num_rows == 20 and whole.num_rows == 54
    np.testing.assert_allclose(found, PRINTED, rtol=1e-6)
    difference = 100 * (found / exact - 1)
    digits = np.array([len(str(d).split(".")[1]) for d in DIFFERENCE])
    rounding = 0.51 * 10.0**-digits + 1e-4  # of single precision; in the first, 0.0085 for 5e-6, it is all there is
    np.testing.assert_array_less(np.abs(difference - DIFFERENCE)[1:], rounding[1:])
    assert 0 < difference[0] < DIFFERENCE[0]
