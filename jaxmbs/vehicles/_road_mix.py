"""Damage of hardpoints over a mix of roads: by spectra of a linearised vehicle, or by histories of loads.

A force along a fixed direction does damage as a stress does, after a curve of life over the amplitude of the force
[N].  A hardpoint, whose force has three components, is damaged in the worst of thirteen directions: the axes, and the
diagonals of the faces and of the space between them.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..analysis import Linearisation
from ..blocks import StateSpace
from ..checks import any_concrete, no_such, number_faults, shape_of
from ..errors import ModelError
from ..fatigue import SN, SpectralMoments, damage, spectral_damage
from ..forces._fields import number
from ..quantities import XYZ, Axis, Quantity
from ..reports import Report, Reported
from ..runtime import jit
from ..tables import format_number
from ..typing import ScalarLike, WordedError
from ._random_road import RandomRoad
from ._ride import wheel_inputs

_SIGNS = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1)]
_SIGNS += [(1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)]
#: Unit vectors (13, 3) of a half space.
_DIRECTIONS = np.array(_SIGNS) / np.linalg.norm(_SIGNS, axis=1, keepdims=True)
_OF_ONE = np.eye(3)[:1]  # of a load with one component


class RoadShare(NamedTuple):
    """A road of a mix: its spectrum, the speed on it > 0 [m/s], its share of the distance."""

    road: RandomRoad
    speed: Any
    share: Any


class RoadRecord(NamedTuple):
    """A recorded road: loads (times, 3) or (times,) by point [N], its length > 0 [m], its share of the distance."""

    loads: Mapping[str, Any]
    length: Any
    share: Any


class RoadMixDamage(Reported, eqx.Module):
    """Damage over a mix of roads (Palmgren, Miner).

    Attributes:
        by_road: (roads, points), in the direction that is worst over all roads together.
        directions: (points, 3) of that; of a load with one component its x.
        distance: over which it is done [m].
        roads, points: names (static).
    """

    by_road: Float[Array, "roads points"]
    directions: Float[Array, "points 3"]
    distance: Float[Array, ""]
    roads: tuple[str, ...] = eqx.field(static=True)
    points: tuple[str, ...] = eqx.field(static=True)

    @property
    def damage(self) -> Float[Array, " points"]:
        """Damage (points,) over the distance; at 1 life ends."""
        return jnp.sum(self.by_road, axis=0)

    @property
    def life(self) -> Float[Array, " points"]:
        """Distances (points,) of life [m]; infinite without damage."""
        total = self.damage
        acts = total > 0.0
        return jnp.where(acts, self.distance / jnp.where(acts, total, 1.0), jnp.inf)

    def report(self) -> Report:
        point, road = Axis("point", self.points), Axis("road", self.roads)
        found = [Quantity("damage", self.damage, "", (point,)), Quantity("life", self.life, "m", (point,))]
        found.append(Quantity("damage by road", self.by_road, "", (road, point)))
        found.append(Quantity("direction", self.directions, "", (point, XYZ)))
        parts = np.asarray(self.by_road / jnp.where(self.damage > 0.0, self.damage, 1.0)[None])
        head = ("point", "damage", "life [km]", "direction", *self.roads)
        rows = [head]
        for k, name in enumerate(self.points):
            way = " ".join(f"{x:.2f}" for x in np.asarray(self.directions[k]))
            whole, life = format_number(self.damage[k]), format_number(self.life[k] / 1e3)
            rows.append((name, whole, life, way, *(f"{100 * share:.1f} %" for share in parts[:, k])))
        return Report(found, f"{len(self.points)} points on {len(self.roads)} roads", table=rows)


def road_mix_damage(
    linearisation: WordedError[Linearisation],
    mix: Mapping[str, RoadShare],
    wheels: Mapping[str, tuple[ScalarLike, ScalarLike]],
    curves: WordedError[SN | Mapping[str, SN]],
    distance: ScalarLike,
    method: str = "dirlik",
    lowest: ScalarLike = 0.1,
    highest: ScalarLike = 100.0,
) -> RoadMixDamage:
    """Damage of every hardpoint over a mix of random roads, by the spectra of its forces.

    Args:
        linearisation: of the vehicle, with heights of the road as inputs, as of `linearise_hardpoints`: outputs
            "LF x", "LF y", "LF z" are those of one point, others are points with one component.
        mix: by name of the road; shares add up to one.
        wheels: by name of input, its place along the vehicle and to the side [m].
        curves: cycles of life over amplitudes of the force [N], one or by point.
        distance: of all roads together [m].
        method: of `fatigue.spectral_damage`, but "alpha0.75".
        lowest, highest: frequencies of the road [Hz].

    Damage of forces alone: what is carried at rest does none.  Derivatives by the vehicle, curves, speeds and shares.
    Raises: ModelError with every fault; those of `wheel_inputs` and `random_response`.
    Source: Beste et al. (1992), of directions; Dirlik (1985).
    """
    if not isinstance(linearisation, Linearisation):
        raise ModelError(["a vehicle rides about a state: linearise it first"], "the question")
    from ..verbs import random_response

    points = _points(linearisation.output_names)
    _check(mix, RoadShare, distance)
    model, curve_of = _along_directions(linearisation, points), _curves(curves, points)
    by_road = []
    for part in mix.values():
        inputs, coherence = wheel_inputs(part.road, part.speed, wheels, lowest, highest)
        rows, found = random_response(model, inputs, coherence=coherence).moments, {}
        for name, parts in points.items():
            own, rows = jnp.split(rows, [len(_directions(len(parts)))])
            found[name] = _by_spectra(own, curve_of[name], method) * number(part.share) / number(part.speed)
        by_road.append(found)
    return _worst(by_road, tuple(mix), number(distance))


def road_records_damage(
    records: Mapping[str, RoadRecord], curves: WordedError[SN | Mapping[str, SN]], distance: ScalarLike
) -> RoadMixDamage:
    """Damage of every hardpoint over a mix of recorded or simulated roads, by rainflow cycles.

    Args:
        records: by name of the road, with the same points, as of `hardpoint_loads`; shares add up to one.
        curves: cycles of life over amplitudes of the force [N], one or by point.
        distance: of all roads together [m].

    Damage of amplitudes alone.  Derivatives by loads, curves, lengths and shares.
    Raises: ModelError with every fault.  Source: Beste et al. (1992).
    """
    _check(records, RoadRecord, distance)
    points = _points_of_records(records)
    curve_of, by_road = _curves(curves, points), []
    for part in records.values():
        times = number(part.share) / number(part.length)
        by_road.append({name: _by_cycles(number(x), curve_of[name]) * times for name, x in part.loads.items()})
    return _worst([{name: found[name] for name in points} for found in by_road], tuple(records), number(distance))


def _directions(components):
    return _DIRECTIONS if components == 3 else np.eye(1)


def _points(names):
    """Rows of the outputs of each point: of three that end in x, y and z, or of one."""
    places, found = {name: k for k, name in enumerate(names)}, {}
    for name, k in places.items():
        head, _, axis = name.rpartition(" ")
        axes = [places.get(f"{head} {other}") for other in "xyz"]
        whole = bool(head) and axis in ("x", "y", "z") and None not in axes
        found[head if whole else name] = tuple(axes) if whole else (k,)
    return found


def _points_of_records(records):
    """Components (3 or 1 entries) of the loads of each point.  Raises: ModelError."""
    first, faults = next(iter(records.values())).loads, []
    for road, record in records.items():
        faults += [f"record {road!r}: " + no_such("point", name, first) for name in record.loads if name not in first]
        faults += [f"record {road!r} has no point {name!r}" for name in first if name not in record.loads]
        for name, x in record.loads.items():
            shape = shape_of(x)
            if (
                len(shape) not in (1, 2)
                or shape[1:] not in ((), (3,))
                or shape[1:] != shape_of(first.get(name, x))[1:]
            ):
                faults.append(f"record {road!r}: loads of {name!r} must be (times, 3) or (times,), as on other roads")
            elif any_concrete(lambda x: ~np.isfinite(x), x):
                faults.append(f"record {road!r}: loads of {name!r} must be finite")
    if faults:
        raise ModelError(faults, "the roads")
    return {name: tuple(range(np.prod(shape_of(x)[1:], dtype=int))) for name, x in first.items()}


def _along_directions(linearisation, points):
    """The linearisation with one output for each direction of each point."""
    A, B, C, D = linearisation.state_space
    rows = [np.zeros((0, len(C)))]
    for parts in points.values():
        ways = _directions(len(parts))
        rows.append(np.zeros((len(ways), len(C))))
        rows[-1][:, list(parts)] = ways
    take = jnp.asarray(np.concatenate(rows), C.dtype)
    names = tuple(f"direction {k}" for k in range(len(take)))
    return dataclasses.replace(linearisation, state_space=StateSpace(A, B, take @ C, take @ D), output_names=names)


@jit
def _by_spectra(moments, curve, method):
    """Damage per second (directions,)."""
    return jax.vmap(lambda row: spectral_damage(SpectralMoments(row), curve, method))(moments)


@jit
def _by_cycles(loads, curve):
    """Damage of a record (directions,)."""
    histories = loads[None] if loads.ndim == 1 else _DIRECTIONS @ loads.T
    return jax.vmap(lambda history: damage(history, curve))(histories)


def _worst(by_road, roads, distance):
    """Damage in the direction that is worst over all roads, from rates (directions,) by point of each road."""
    found, ways = [], []
    for name in by_road[0]:
        rates = jnp.stack([rates[name] for rates in by_road])
        worst = jnp.argmax(jnp.sum(rates, axis=0))
        found.append(rates[:, worst] * distance)
        axes = _DIRECTIONS if rates.shape[1] > 1 else _OF_ONE
        ways.append(jnp.asarray(axes, rates.dtype)[worst])
    return RoadMixDamage(jnp.stack(found, axis=1), jnp.stack(ways), distance, roads, tuple(by_road[0]))


def _curves(curves, points):
    """The curve of each point.  Raises: ModelError."""
    if isinstance(curves, SN):
        return dict.fromkeys(points, curves)
    if not isinstance(curves, Mapping):
        raise ModelError(
            [f"curves must be a fatigue.SN, or one by point, not {type(curves).__name__}"], "the question"
        )
    faults = [no_such("point", name, points) for name in curves if name not in points]
    faults += [f"curves has none of point {name!r}" for name in points if name not in curves]
    faults += [f"the curve of {name!r} must be a fatigue.SN" for name, x in curves.items() if not isinstance(x, SN)]
    if faults:
        raise ModelError(faults, "the question")
    return curves


def _check(mix, kind, distance):
    """Raise a ModelError with a sentence for each part that is none, and for shares that do not add up to one."""
    if not isinstance(mix, Mapping) or not mix:
        raise ModelError([f"a mix is {{name: {kind.__name__}(...)}}, of one road or more"], "the roads")
    faults = number_faults("distance", distance, positive=True)
    faults += [f"{name!r} must be a {kind.__name__}" for name, x in mix.items() if not isinstance(x, kind)]
    if not faults:
        for name, part in mix.items():
            second = "speed" if kind is RoadShare else "length"
            faults += number_faults(f"{second} of {name!r}", getattr(part, second), positive=True)
            faults += number_faults(f"share of {name!r}", part.share)
            if kind is RoadRecord and not (isinstance(part.loads, Mapping) and part.loads):
                faults.append(f"loads of {name!r} must be {{point: (times, 3)}}, one or more")
            if kind is RoadShare and not isinstance(part.road, RandomRoad):
                faults.append(f"the road of {name!r} must be a RandomRoad")
    if not faults and any_concrete(lambda *x: np.abs(np.sum(x) - 1.0) > 1e-6, *(part.share for part in mix.values())):
        faults.append("shares must add up to one")
    if faults:
        raise ModelError(faults, "the roads")
