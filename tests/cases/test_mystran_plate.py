"""A clamped plate of four equal plies beside the displacements that MYSTRAN left (pyNastran's `pcomp_cquad4`).

Its CQUAD4 are four MIN3 triangles round a middle node (Tessler and Hughes 1985), another element than ours.
They stand here to show that the numbers are theirs.
"""

import numpy as np
import pytest

from jaxmbs.io import read_nastran

SIDE, CELLS, YOUNG, POISSON, THICKNESS = 2.0, 5, 210000.0, 0.3, 0.4
# Deflections along the edge and the two lines of nodes beside it, from the clamp; the other half is the same.
PRINTED = np.array(
    [
        [0.0, 0.7292858362197876, 3.149007558822632, 6.914159774780273, 11.575414657592773, 16.68600845336914],
        [0.0, 0.9364638328552246, 3.453044891357422, 7.19006872177124, 11.756830215454102, 16.744152069091797],
        [0.0, 0.972037672996521, 3.545224189758301, 7.2949981689453125, 11.836542129516602, 16.780887603759766],
    ]
)
EDGES = ((0, 1), (1, 2), (2, 0))


def min3(corners):
    """Bending and shear stiffness (9, 9) of a triangle, coordinates w and the slopes of the section along x and y.

    The deflection is quadratic, so that the shear along each edge is constant.
    """
    slopes = np.linalg.inv(np.c_[np.ones(3), corners])[1:]
    (a, b), (c, d) = corners[1:] - corners[0]
    area = (a * d - b * c) / 2
    curvature = np.zeros((3, 9))
    curvature[0, 1::3] = curvature[2, 2::3] = slopes[0]
    curvature[1, 2::3] = curvature[2, 1::3] = slopes[1]
    D = YOUNG * THICKNESS**3 / 12 / (1 - POISSON**2) * np.array([[1, POISSON, 0], [POISSON, 1, 0], [0, 0, 0.35]])
    G = 5 / 6 * YOUNG / 2 / (1 + POISSON) * THICKNESS
    across = np.zeros((9, 9))
    for place in (np.array([0.5, 0.5, 0.0]), np.array([0.0, 0.5, 0.5]), np.array([0.5, 0.0, 0.5])):
        shear = np.zeros((2, 9))
        shear[:, ::3] = slopes
        shear[0, 1::3] = shear[1, 2::3] = place
        for i, j in EDGES:
            bump = (slopes[:, i] * place[j] + slopes[:, j] * place[i]) / 2
            for k, sign in ((i, -1), (j, 1)):
                shear[:, 3 * k + 1 : 3 * k + 3] += sign * np.outer(bump, corners[j] - corners[i])
        across += area / 3 * G * shear.T @ shear
    return area * curvature.T @ D @ curvature, across


def four_triangles():
    """Stiffness (12, 12) of a square with its middle node condensed.

    Shear times `2 k / (2 k + s)`, k and s the traces of rotations in bending and shear.
    """
    square = SIDE * np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    whole, turns = np.zeros((15, 15)), [1, 2, 4, 5, 7, 8]
    for i in range(4):
        j = (i + 1) % 4
        bending, shear = min3(np.array([square[i], square[j], square.mean(axis=0)]))
        k, s = (np.trace(A[np.ix_(turns, turns)]) for A in (bending, shear))
        rows = [3 * n + d for n in (i, j, 4) for d in range(3)]
        whole[np.ix_(rows, rows)] += bending + 2 * k / (2 * k + s) * shear
    inner = np.linalg.solve(whole[12:, 12:], whole[12:, :12])
    return whole[:12, :12] - whole[:12, 12:] @ inner


def test_numbers_of_mystran_are_those_of_four_triangles():
    count = CELLS + 1
    K, own = np.zeros((3 * count**2, 3 * count**2)), four_triangles()
    for row in range(CELLS):
        for column in range(CELLS):
            first = row * count + column
            rows = [3 * n + d for n in (first, first + 1, first + count + 1, first + count) for d in range(3)]
            K[np.ix_(rows, rows)] += own
    force = np.zeros(len(K))
    force[3 * (np.arange(count) * count + CELLS)] = 100.0
    free = np.flatnonzero((np.arange(len(K)) // 3) % count)
    w = np.zeros(len(K))
    w[free] = np.linalg.solve(K[np.ix_(free, free)], force[free])
    w = w[::3].reshape(count, count)
    np.testing.assert_allclose(w[:3], PRINTED, rtol=2e-7)
    np.testing.assert_allclose(w[::-1], w, rtol=1e-7, atol=1e-12)


@pytest.mark.long
def test_deflections_of_the_deck(tmp_path):
    """On 25 squares they differ by 2e-3 of the largest."""
    count = CELLS + 1
    text = "BEGIN BULK\nPCOMP,1" + "\n,1,.1,,,1,.1" * 2 + "\nMAT1,1,210000.,,.3\n"
    for k in range(count**2):
        text += f"GRID,{k + 1},,{SIDE * (k % count)},{SIDE * (k // count)},0.\n"
    for k in range(CELLS**2):
        first = k // CELLS * count + k % CELLS + 1
        text += f"CQUAD4,{k + 1},1,{first},{first + 1},{first + count + 1},{first + count}\n"
    clamp, tip = (range(k, count**2 + 1, count) for k in (1, count))
    text += "".join(f"SPC1,2,123456,{n}\n" for n in clamp) + "".join(f"FORCE,2,{n},,100.,,,1.\n" for n in tip)
    (tmp_path / "deck.bdf").write_text(text)
    w = np.asarray(read_nastran(tmp_path / "deck.bdf").statics("LOAD 2"))[:, 2].reshape(count, count)
    difference = np.abs(w[:3] - PRINTED).max() / PRINTED.max()
    assert 1e-3 < difference < 2.5e-3
