"""Cyclic symmetry: rings of equal sectors, modelled by one sector and the number of nodal diameters."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from ..checks import is_concrete
from ..elements import DIRECTIONS
from ..errors import ModelError
from ..linear._labels import format_label
from ..linear._system import LinearSystem
from ._base import AbstractReduction
from ._placement import POSITION_TOLERANCE, coordinate_rotation
from ._symmetry_subspace import SymmetrySubspace


def _as_pairs(faces: Mapping | tuple) -> tuple:
    return tuple((str(a), str(b)) for a, b in (faces.items() if isinstance(faces, Mapping) else faces))


def _as_tuple(nodes: Any) -> tuple:
    return tuple(nodes)


class Cyclic(AbstractReduction):
    """Motions of a ring of equal sectors with a given number of nodal diameters, from one sector.

    `[reduce(sector, Cyclic(12, h, {"left": "right"})) for h in range(7)]` is the whole ring.  The next sector is this
    one rotated by a twelfth of a turn about the axis through the origin, and its nodes "left" are the nodes "right"
    of this one.  In harmonic h it moves with a phase lag of `2 pi h / 12`.  Elements in a face belong to one of its
    two
    sectors.  For `h = 0` and `h` equal to half the number of sectors each coordinate that is left gives one
    coordinate, for others two, "tip z cos" and "tip z sin": the pattern may have any angle, and frequencies come in
    pairs.  Coordinates: those of the interface [m, rad], then the others in their order, with the signs of the first
    sector.

    Attributes:
        num_sectors: number of sectors of the ring.
        harmonic: number of nodal diameters, 0 ... num_sectors // 2.
        faces: nodes (or coordinates without direction) of one face, each with its partner on the other face.
        axis: "x", "y" or "z".
        centre: nodes on the axis, shared by all sectors; each sector has its part of their stiffness and mass.

    Returns (of `reduce`): a `SymmetrySubspace` of num_sectors parts.

    Raises: ModelError for impossible numbers and axes, faces whose nodes differ in their coordinates or do not meet
    after the rotation.  Source: S1 (5)-(8), section 5; D. L. Thomas, Int. J. Numer. Meth. Engng 14 (1979) 81.
    """

    keeps_all = True

    num_sectors: int = eqx.field(static=True)
    harmonic: int = eqx.field(static=True)
    faces: tuple = eqx.field(static=True, converter=_as_pairs)
    axis: str = eqx.field(static=True, default="z")
    centre: tuple = eqx.field(static=True, default=(), converter=_as_tuple)

    def of(self, system: LinearSystem) -> SymmetrySubspace:
        system = system.to_dense()
        self._check(system)
        N, h = self.num_sectors, self.harmonic
        single = 2 * h % N == 0
        Z, labels, num_interface = self._complex_basis(system)
        real = [Z.real, Z.imag] if single else [np.hstack([Z.real, -Z.imag]), np.hstack([Z.imag, Z.real])]
        if not single:
            first, m = num_interface, len(labels)
            order = np.r_[0:first, m : m + first, first:m, m + first : 2 * m]
            labels = [f"{format_label(label)} {part}" for part in ("cos", "sin") for label in labels]
            real, labels = [A[:, order] for A in real], [labels[k] for k in order]
            num_interface *= 2
        cosine, sine = (jnp.asarray(A, system.dtype) for A in real)
        angles = 2 * np.pi * h / N * np.arange(N)
        copies = np.cos(angles)[:, None, None] * real[0] - np.sin(angles)[:, None, None] * real[1]
        turns = np.stack([axis_rotation(self.axis, 2 * np.pi * k / N) for k in range(N)])
        matrices = {name: getattr(system, name) for name in ("mass", "stiffness", "damping")}
        return SymmetrySubspace(
            system,
            jnp.asarray(copies, system.dtype),
            jnp.asarray(turns, system.dtype),
            (1 if single else 2) / N,
            num_interface,
            **{
                name: None if A is None else cosine.T @ A @ cosine + sine.T @ A @ sine for name, A in matrices.items()
            },
            coordinates=labels,
            massless=self._massless(system, real),
        )

    def _complex_basis(self, system):
        """Basis Z (n, m) with `x = Z y` for amplitudes `x e^(i h k angle)` of sector k; labels; number of interface
        ones.

        The far face moves as the near one, rotated and with the phase of one sector; a centre moves in the motions
        that all sectors share.
        """
        angle = 2 * np.pi / self.num_sectors
        step, turn = np.exp(1j * self.harmonic * angle), axis_rotation(self.axis, angle)
        step = step.real if 2 * self.harmonic % self.num_sectors == 0 else step
        near, far = (np.array(system.rows(*side), int) for side in zip(*self.faces, strict=True))
        centre = np.array(system.rows(*self.centre), int)
        own = np.setdiff1d(np.arange(system.num_rows), np.r_[far, centre])
        interface = [i for i in system.interface if i in set(own.tolist())]
        own = np.array(interface + [i for i in own if i not in set(interface)], int)
        Z = np.zeros((system.num_rows, len(own)), type(step))
        Z[own, np.arange(len(own))] = 1.0
        turned, shared = (
            coordinate_rotation([system.coordinates[i] for i in rows], turn)[0] for rows in (near, centre)
        )
        Z[far] = step * turned @ Z[near]
        free = _null_space(np.eye(len(centre)) - step * shared)
        wide = np.zeros((system.num_rows, free.shape[1]), Z.dtype)
        wide[centre] = free
        labels = [system.coordinates[i] for i in own] + [(f"centre {k}", "") for k in range(free.shape[1])]
        return np.hstack([Z, wide]), labels, len(interface)

    def _massless(self, system, real):
        """Numbers of the coordinates that move only rows without mass."""
        heavy = np.setdiff1d(np.arange(system.num_rows), system.massless)
        moved = sum(np.abs(A[heavy]).sum(axis=0) for A in real)
        return np.flatnonzero(moved == 0).tolist() if system.massless else ()

    def _check(self, system):
        N, h, faults = self.num_sectors, self.harmonic, []
        if N < 2 or not 0 <= h <= N // 2:
            faults.append(
                f"harmonic {h} of {N} sectors: a ring needs at least 2 sectors, harmonics 0 ... {max(N, 2) // 2}"
            )
        if self.axis not in DIRECTIONS[:3]:
            faults.append(f"unknown axis {self.axis!r}: give one of {', '.join(DIRECTIONS[:3])}")
        if not self.faces:
            faults.append("a ring needs the faces of its sector: give pairs of nodes")
        if faults:
            raise ModelError(faults)
        for a, b in self.faces:
            near, far = ([system.coordinates[i][1] for i in system.rows(node)] for node in (a, b))
            faults += [] if near == far else [f"faces: {a!r} and {b!r} have different coordinates"]
        faults += self._meeting_faults(system)
        if faults:
            raise ModelError(faults)

    def _meeting_faults(self, system):
        """Faults of nodes that do not meet after the rotation, where their positions are known."""
        if system.positions is None or not is_concrete(system.positions):
            return []
        places = dict(zip(system.nodes, np.asarray(system.positions), strict=True))
        turn = axis_rotation(self.axis, 2 * np.pi / self.num_sectors)
        size = max((np.max(np.abs(place)) for place in places.values()), default=0.0)
        meets = [*self.faces, *((str(node), str(node)) for node in self.centre)]
        return [
            f"faces: {a!r} rotated by 1/{self.num_sectors} turn about {self.axis} does not meet {b!r}"
            for a, b in meets
            if a in places
            and b in places
            and np.max(np.abs(turn @ places[a] - places[b])) > POSITION_TOLERANCE * size
        ]


def axis_rotation(axis: str, angle: float) -> np.ndarray:
    """Matrix (3, 3) of a right-handed rotation about x, y or z."""
    k = DIRECTIONS.index(axis)
    i, j = (k + 1) % 3, (k + 2) % 3
    Q = np.eye(3)
    Q[[i, i, j, j], [i, j, i, j]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
    return Q


def _null_space(A):
    """Orthonormal basis of the null space of A, the largest entry of each column positive."""
    if A.size == 0:
        return A
    _, s, Vh = np.linalg.svd(A)
    free = Vh[np.sum(s > POSITION_TOLERANCE) :].conj().T
    largest = free[np.argmax(np.abs(free), axis=0), np.arange(free.shape[1])]
    return free * (np.abs(largest) / largest)
