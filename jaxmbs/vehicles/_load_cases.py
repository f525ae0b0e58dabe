"""Load cases of a suspension: loads of every hardpoint and member from loads at the wheel, and their envelope."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..checks import any_concrete, faults_if, no_such, shape_of
from ..errors import ModelError
from ..forces._fields import number
from ..quantities import XYZ, Axis, Quantity
from ..reports import Report, Reported
from ..typing import ArrayLike, ScalarLike, WordedError
from ._rig import PartLoads, Rig


class LoadTable(Reported, eqx.Module):
    """Loads of a suspension in load cases.

    Attributes:
        tensions: of rods and "strut" by name (cases,) [N].
        points: forces (cases, 3) of the chassis on the suspension by hardpoint, of arms on the upright by ball [N].
        hinge: force (cases, 3) [N] and moment (cases, 3) [N m] of the chassis at the hinge, where there is one.
        names: of the cases (static).
    """

    tensions: dict[str, Array]
    points: dict[str, Array]
    hinge: dict[str, Array]
    names: tuple[str, ...] = eqx.field(static=True)

    @property
    def sizes(self) -> dict[str, Array]:
        """Sizes (cases,) of the forces at the points [N]."""
        return {name: jnp.sqrt(jnp.sum(x**2, axis=-1)) for name, x in self.points.items()}

    def envelope(self) -> dict[str, tuple[Array, str, Array, str]]:
        """Of every member's tension and every point's size the least and the largest, each with its case."""
        found = {}
        for name, values in (self.tensions | self.sizes).items():
            low, high = jnp.argmin(values), jnp.argmax(values)
            cases = [self.names[int(np.asarray(k))] for k in (low, high)]
            found[name] = (values[low], cases[0], values[high], cases[1])
        return found

    def margins(self, allowed: Mapping[str, ArrayLike]) -> dict[str, Array]:
        """Margins of safety (cases,), `allowed / load - 1`, of members and points by name.

        Args: allowed: [N]; of a tension one number for both signs, or (compression, tension), both positive.
        Raises: ModelError for names that carry no load.
        """
        known = self.tensions | self.sizes
        faults = [no_such("member or point", name, known) for name in allowed if name not in known]
        faults += [
            f"what {n!r} may carry must be positive" for n, x in allowed.items() if any_concrete(_is_not_positive, x)
        ]
        if faults:
            raise ModelError(faults, "the margins")
        found = {}
        for name, value in allowed.items():
            limits, load = jnp.atleast_1d(number(value)), known[name]
            limit = jnp.where(load < 0.0, limits[0], limits[-1])
            found[name] = limit / jnp.maximum(jnp.abs(load), 1e-12) - 1.0
        return found

    def report(self) -> Report:
        cases = Axis("case", self.names)
        rows = [Quantity(f"tension {name}", x, "N", (cases,)) for name, x in self.tensions.items()]
        rows += [Quantity(f"force {name}", x, "N", (cases, XYZ)) for name, x in self.points.items()]
        units = {"force": "N", "moment": "N m"}
        rows += [Quantity(f"hinge {name}", x, units[name], (cases, XYZ)) for name, x in self.hinge.items()]
        head = ("case", *self.tensions, *(f"|{name}|" for name in self.sizes))
        values = [*self.tensions.values(), *self.sizes.values()]
        table = [
            (case, *(f"{float(x[k]):.0f}" for x in map(np.asarray, values))) for k, case in enumerate(self.names)
        ]
        return Report(rows, f"{len(self.names)} load cases, forces [N]", table=[head, *table])


def load_cases(
    rig: WordedError[Rig],
    cases: Mapping[str, ArrayLike],
    unit: str = "N",
    wheel_load: ScalarLike | None = None,
    travel: ScalarLike | Mapping[str, ScalarLike] = 0.0,
    rack: ScalarLike = 0.0,
    at: str | Mapping[str, str] = "contact",
    hardpoints: Mapping[str, ArrayLike] | None = None,
) -> LoadTable:
    """Loads of every hardpoint and member of a suspension in load cases, with derivatives by hardpoints.

    Args:
        rig: `kc_rig(suspension)`.
        cases: by name, force (3,) on the wheel, x forwards, y outwards, z up; or (6,) with the moment.
        unit: "N" (and N m), or "g": multiples of the wheel load, moments then in wheel load times metres.
        wheel_load: static load of the wheel [N], needed for "g".
        travel: of the wheel [m], one for all cases or by case (default 0).
        rack: displacement of the rack [m].
        at: where the force acts, "contact" or "centre", for all cases or by case (default "contact").
        hardpoints: in place of those of the suspension [m].

    Raises: ModelError with every fault.
    """
    if not isinstance(rig, Rig):
        raise ModelError([f"load_cases takes the Rig of kc_rig, got {type(rig).__name__}"], "the question")
    loads, travels, places = _checked(cases, unit, wheel_load, travel, rack, at)
    own, y = rig.with_points(hardpoints), number(rack)
    one = lambda load, z, place: own.part_loads(load[:3], load[3:], z, y, place)
    found: PartLoads = jax.vmap(one)(loads, travels, places)
    return LoadTable(found.tensions, found.chassis | found.balls, found.hinge, tuple(cases))


def _checked(cases, unit, wheel_load, travel, rack, at):
    """Loads (cases, 6) in N and N m, travels (cases,), flags (cases,) of those at the contact."""
    if not isinstance(cases, Mapping) or not cases:
        raise ModelError(["cases must be {name: (fx, fy, fz)}, one or more"], "the load cases")
    faults = faults_if(
        (unit not in ("N", "g"), f"unit must be 'N' or 'g', not {unit!r}"),
        (unit == "g" and wheel_load is None, "unit 'g' needs wheel_load"),
        (wheel_load is not None and any_concrete(_is_not_positive, wheel_load), "wheel_load must be positive"),
        (wheel_load is not None and shape_of(wheel_load) != (), "wheel_load must be one number"),
    )
    for name, load in cases.items():
        is_load = not isinstance(load, str) and shape_of(load) in ((3,), (6,)) and not np.iscomplexobj(load)
        if not is_load or any_concrete(lambda x: ~np.isfinite(x), load):
            faults.append(f"case {name!r} must be three forces, or forces and moments, not {load!r}")
    heights = list(travel.values()) if isinstance(travel, Mapping) else [travel]
    for what, value in (*(("travel", x) for x in heights), ("rack", rack)):
        if shape_of(value) != () or any_concrete(lambda x: ~np.isfinite(x), value):
            faults.append(f"{what} must be one finite number, not {value!r}")
    by_case = {"travel": travel, "at": at}
    for what, given in by_case.items():
        if isinstance(given, Mapping):
            faults += [f"{what}: " + no_such("case", name, cases) for name in given if name not in cases]
    places = [at.get(name, "contact") if isinstance(at, Mapping) else at for name in cases]
    faults += [f"at must be 'contact' or 'centre', not {place!r}" for place in places if place not in _PLACES]
    if faults:
        raise ModelError(faults, "the load cases")
    size = number(1.0 if unit == "N" or wheel_load is None else wheel_load)
    loads = jnp.stack([jnp.concatenate([number(x), jnp.zeros(6 - shape_of(x)[0])]) for x in cases.values()]) * size
    travels = [travel.get(name, 0.0) if isinstance(travel, Mapping) else travel for name in cases]
    return loads, jnp.stack([number(x) for x in travels]), jnp.asarray([place == "contact" for place in places])


_PLACES = ("contact", "centre")


def _is_not_positive(x):
    return ~(np.asarray(x, float) > 0.0)
