"""`Rotor`: a shaft with disks on bearings, and its matrices at a speed."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.linalg import block_diag

from ..errors import ModelError
from ..linear._system import LinearSystem
from ..runtime import as_array
from ..tables import fields_repr
from ..typing import ArrayLike, ScalarLike
from ._bearing_groups import coefficients_of
from ._parts import Bearing, BearingTable, Disk
from ._plain_bearing import PlainBearing
from ._shaft import Shaft
from ._validity import bearing_validity, tell

_OF_DISKS = "mass", "diametral", "polar"


class Rotor(eqx.Module):
    """A shaft with disks on bearings, turning about z; positive speed turns x to y.

    Coordinates (n,) are deflection and slope of every node in the plane of x, then those in the plane of y.

    Attributes:
        shaft: a `Shaft`; disks: each a `Disk`.
        bearings: `Bearing`, `BearingTable`, `PlainBearing`, or another with a `station` and `coefficients(speed)`:
            stiffness and damping (2, 2) of x and y; where `depends_on_frequency` is true, at
            `coefficients(speed, omega)`, omega of the whirl.  Of one with a `validity` of the same arguments, margins
            by name, results tell where its model ends.

    Raises: ModelError for stations that the shaft has not, parts of another kind.
    """

    shaft: Shaft
    disks: tuple[Disk, ...]
    bearings: tuple[Bearing | BearingTable | PlainBearing, ...]

    __repr__ = fields_repr

    def __init__(self, shaft: Shaft, disks: Sequence = (), bearings: Sequence = ()) -> None:
        self.shaft, self.disks, self.bearings = shaft, tuple(disks), tuple(bearings)
        faults = [] if isinstance(shaft, Shaft) else [f"shaft must be a rotors.Shaft, not {type(shaft).__name__}"]
        faults += [f"disks: {type(d).__name__} is no rotors.Disk" for d in self.disks if not isinstance(d, Disk)]
        faults += [
            f"bearings: {type(b).__name__} has no coefficients by speed"
            for b in self.bearings
            if not callable(getattr(b, "coefficients", None)) or not hasattr(b, "station")
        ]
        if not faults:
            last = shaft.stations.size - 1
            parts = (*self.disks, *self.bearings)
            faults = [
                f"{type(p).__name__}: station {p.station}, the last is {last}" for p in parts if p.station > last
            ]
        if faults:
            raise ModelError(faults, "the rotor")

    @property
    def num_coordinates(self) -> int:
        return 4 * self.shaft.num_nodes

    def column(self, station: int, axis: str = "x") -> int:
        """Number of the deflection of a station along x or y.  Raises: ModelError."""
        last = self.shaft.stations.size - 1
        if isinstance(station, bool) or not isinstance(station, int | np.integer) or not 0 <= station <= last:
            raise ModelError([f"no station {station!r}: they are 0 to {last}"], "the rotor")
        if axis not in ("x", "y"):
            raise ModelError([f'axis {axis!r} must be "x" or "y"'], "the rotor")
        return 2 * self.shaft.node(station) + (2 * self.shaft.num_nodes if axis == "y" else 0)

    def inertias(self) -> tuple[Array, Array, Array]:
        """Mass M, gyroscopic matrix G and stiffness K of the shaft (n, n) with the disks, without bearings: at the
        speed W `M q'' + W G q' + K q = f`."""
        M, spins, K = self.shaft.plane()
        if self.disks:
            k = np.array([self.column(disk.station) for disk in self.disks])
            mass, diametral, polar = (jnp.stack([getattr(d, n) for d in self.disks]) for n in _OF_DISKS)
            M = M.at[k, k].add(mass).at[k + 1, k + 1].add(diametral)
            spins = spins.at[k + 1, k + 1].add(polar)
        none = jnp.zeros_like(spins)
        G = jnp.concatenate([jnp.concatenate([none, spins], 1), jnp.concatenate([-spins, none], 1)])
        return block_diag(M, M), G, block_diag(K, K)

    def at_speed(self, speed: ArrayLike) -> LinearSystem:
        """The rotor at a speed () [rad/s] as a linear system, gyroscopic terms within its damping.

        Bearings by frequency are those of whirl once a turn.  Coordinates are "3 x" and "3 slope x" of a station,
        "3.1 x" of the first node after it.  Warns of bearings beyond the ends of their models.
        """
        speed = as_array(speed)
        tell("at_speed", bearing_validity(self.bearings, speed[None]))
        M, G, K = self.inertias()
        stiffness, damping = self.supports(speed)
        first = [self.shaft.node(k) for k in range(self.shaft.stations.size)]
        nodes = []
        for k in range(self.shaft.num_nodes):
            station = max(i for i, node in enumerate(first) if node <= k)
            nodes.append(f"{station}" if first[station] == k else f"{station}.{k - first[station]}")
        names = [f"{node}{part} {axis}" for axis in "xy" for node in nodes for part in ("", " slope")]
        return LinearSystem(mass=M, stiffness=K + stiffness, damping=damping + speed * G, coordinates=names)

    @property
    def depends_on_frequency(self) -> bool:
        """True where the coefficients of some bearing depend on the frequency of the whirl."""
        return any(getattr(bearing, "depends_on_frequency", False) for bearing in self.bearings)

    def supports(self, speed: ScalarLike, omega: ScalarLike | None = None) -> tuple[Array, Array]:
        """Stiffness and damping (n, n) of the bearings at a speed () [rad/s] and an omega () of the whirl [rad/s],
        by default that of the speed."""
        n = self.num_coordinates
        K, C = jnp.zeros((2, n, n), self.shaft.young.dtype)
        for _, places, (k, c) in self.coefficients(speed, omega):
            K, C = (x.at[places[:, :, None], places[:, None, :]].add(y) for x, y in ((K, k), (C, c)))
        return K, C

    def coefficients(
        self, speed: ScalarLike, omega: ScalarLike | None = None
    ) -> list[tuple[list[int], np.ndarray, tuple[Array, Array]]]:
        """Numbers (b,) of bearings, columns (b, 2) of their deflections along x and y, their stiffness and damping
        (b, 2, 2), of each group of `coefficients_of`, at a speed [rad/s] and an omega [rad/s] of the whirl."""
        found = []
        for numbers, both in coefficients_of(self.bearings, speed, omega):
            stations = [self.bearings[k].station for k in numbers]
            found.append((numbers, np.array([[self.column(k, axis) for axis in "xy"] for k in stations]), both))
        return found
