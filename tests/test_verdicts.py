"""Results with a verdict: where it is no, what follows from the failed search is not a number, and the print says so.

Every public class of results that has a verdict is in the table, or has a reason why its numbers stand.
"""

import inspect
import warnings

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.status import Status
from tests.cycles.oscillators import duffing
from tests.dynamics.test_joint_friction import JAM, drawer

WORDS = {"ok", "stable", "unique", "jammed", "converged", "self_locking", "status"}
#: Classes whose numbers stand beside a verdict that is no, and why.
STANDING = {
    "Actuation": "`gap` says how far the nearest efforts are from those required",
    "Batch": "a row answers NaN where its design failed: tests/batching",
    "BondLoads": "`residual` is the error of loads that do not balance",
    "Branch": "`stable` says how each of its cycles, which were found, answers a push",
    "DriveLoad": "`unique` marks a share by convention: least compliance",
    "InternalStates": "`ok` says that they are finite",
    "HarmonicCycles": "frequencies without a steady state answer NaN: tests/cycles",
    "HarmonicResponse": "`ok` says that the amplitudes are finite",
    "LimitResult": "the distance of a limit that is violated",
    "LinearMotion": "the rows after a failure are NaN: tests/vibration",
    "Linearisation": "`ok` says that the matrices are finite",
    "ModelUpdate": "the verdict of its identification",
    "ParetoFront": "the designs are what was reached; rates are NaN: tests/design",
    "Reactions": "`residual` is the error of loads that do not balance, and the print counts what is not ok",
    "RowLoad": "`unique` marks a share by convention: least compliance",
    "State": "NaN where it was not assembled within a trace: tests/kinematics",
    "StaticResponse": "`ok` says that the displacements are finite",
    "Validity": "margins, of which negative ones are the verdict",
    "SuspensionCheck": "the ratio and its limit are the verdict",
}


def slide(mass=2.0, **options):
    """A block that slides along x."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("block", mass=mass, com=(0, 0.5, 0), inertia=0.01)
    b.joint("guide", mbs.Prismatic("x"), "ground", "block", **options)
    return b


def free_fall():
    b = mbs.SystemBuilder()
    b.body("stone", mass=1.0, inertia=0.1)
    b.joint("fall", mbs.Prismatic("z"), "ground", "stone")
    system = b.build()
    found = mbs.equilibrium(system, mbs.State.at(system), throw=False)
    assert found.status == Status.NO_EQUILIBRIUM and not found.stable
    return found, [found.state.coordinates, found.state.velocities, found.stiffness, found.efforts], "no equilibrium"


def jam():
    """From mu = L / (2 c) = 0.2 on; `(2 mu c / L)^2` is what the loads grow by."""
    b = slide()
    b.friction("rub", "guide", 0.3, length=0.2)
    system = b.build()
    found = mbs.dynamics.joint_friction(system, mbs.State.at(system, velocities={"guide": 1.0}))
    assert found.jammed["guide"] and not found.unique["guide"]
    np.testing.assert_allclose(found.contraction, (2 * 0.3 * 0.5 / 0.2) ** 2, rtol=1e-6)
    return found, [found.loads["guide"], found.efforts["guide"], found.powers["guide"]], ""


def jam_that_impends():
    """A drawer that a hand pushes at its corner: it goes in at no effort."""
    system = drawer(1.01 * JAM, hand=True)
    found = mbs.analysis.impending_motion(system, mbs.State.at(system), ["push"])
    assert not found.ok and not found.self_locking
    return found, [found.forward["push"], found.efficiency], ""


def line(u):
    return u["a"] * jnp.linspace(1.0, 2.0, 9) + u["b"]


def cut_off_by_a_bound():
    data = 50.0 * np.linspace(1, 2, 9) + 3
    bounds = {"a": (0.0, 10.0), "b": None}
    found = mbs.identify(line, data, {"a": 2.0, "b": 0.0}, bounds, deviations=1e-3)
    assert not found.ok and found.chi_squared > 1e9 and "the model does not fit" in str(found)
    return found, [found.standard_errors[0], found.intervals()[0], found.covariance[0]], "cuts off a = 10"


def negative_stiffness():
    system = mbs.LinearSystem(mass=np.eye(2), stiffness=np.diag([-9.0, 4.0]), interface=[0])
    found = mbs.modes(system)
    assert list(found.is_unstable) == [True, False] and found.omega[1] == 2.0
    return found, [found.frequencies[0], found.omega[0], found.damping_ratios[0]], "unstable"


def a_motion_that_ends_early():
    b = slide()
    b.force("spring", mbs.SpringDamper(100.0), joint="guide")
    system = b.build()
    start = mbs.State.at(system, guide=0.1)
    found = mbs.simulate(system, start, ts=np.linspace(0.0, 9.0, 4), max_steps=3, throw=False)
    assert not found.ok
    return found, [found.states.coordinates[-1], found.diagnostics.kinetic[-1]], "maximum number of steps"


def a_rotor_without_steady_motion():
    """A body that nothing holds along the shaft, against its weight."""
    b = mbs.SystemBuilder()
    b.body("shaft", mass=1.0, inertia=0.1)
    b.body("collar", mass=1.0, inertia=0.1)
    b.joint("spin", mbs.Revolute("z"), "ground", "shaft")
    b.joint("fall", mbs.Prismatic("z"), "shaft", "collar")
    system = b.build()
    with pytest.raises(mbs.SimulationError, match="no steady motion"):
        mbs.analysis.campbell(system, [1.0, 2.0], "spin")
    roots, shapes, ok = mbs.analysis._campbell._roots(
        system, jnp.array([1.0, 2.0]), mbs.State.at(system), "spin", 0, "speed"
    )
    found = mbs.analysis.CampbellDiagram(jnp.array([1.0, 2.0]), roots, shapes, ok, ("fall", "rate of fall"))
    assert not np.any(found.ok)
    return found, [found.frequencies, found.shapes, found.critical_speeds(), found.damping_ratios], ""


def stopped_at_a_kink():
    """The design is the best one that was found; the reason says why it is no optimum."""
    f = lambda d: jnp.maximum(d["x"] + 0.3 * d["y"], -2.0 * d["x"] + 0.1 * d["y"]) + d["y"] ** 2
    found = mbs.minimise(f, {"x": 0.7, "y": 0.6}, {"x": (-2.0, 2.0), "y": (-2.0, 2.0)}, progress=False)
    assert not found.ok
    return found, [], "a kink"


def no_direction_to_failure():
    """Failures on both sides of the median: its slope leads to none."""
    found = mbs.design.reliability(lambda x: 9.0 - x["a"] ** 2, {"a": mbs.probability.Normal(0.0, 1.0)}, starts=1)
    assert not found.ok
    return found, [found.probability, found.index], "no slope"


def a_kink_that_no_polynomial_has():
    """The polynomial is there, with its error."""
    numbers = {"a": mbs.probability.Normal(0.0, 1.0)}
    found = mbs.design.polynomial_chaos(lambda x: jnp.abs(x["a"]), numbers, evaluations=30)
    assert not found.ok
    return found, [], "of the deviation off"


def no_cycle_of_another_period():
    """A shaken mass does not repeat after another period than that of its shaker."""
    with pytest.raises(mbs.SimulationError, match="another period; give theirs"):
        mbs.periodic(duffing(), 7.0)
    found = mbs.periodic(duffing(), 7.0, throw=False)
    assert not found.ok
    numbers = [found.states.coordinates, found.multipliers, found.period, found.diagnostics.kinetic, found.frequency]
    return found, numbers, "no periodic motion was found"


def limits_that_none_keeps():
    """The point that misses the limits least; its multipliers are no prices."""
    found = mbs.design.interior_point(lambda x: x**2, 0.5, inequalities=lambda x: jnp.stack([x - 1.0, 2.0 - x]))
    assert not found.ok
    return found, [], "no design near"


CASES = {
    "InteriorPoint": limits_that_none_keeps,
    "PolynomialChaos": a_kink_that_no_polynomial_has,
    "Reliability": no_direction_to_failure,
    "Cycle": no_cycle_of_another_period,
    "Equilibrium": free_fall,
    "FrictionLoads": jam,
    "ImpendingMotion": jam_that_impends,
    "Identification": cut_off_by_a_bound,
    "Modes": negative_stiffness,
    "Motion": a_motion_that_ends_early,
    "CampbellDiagram": a_rotor_without_steady_motion,
    "Optimum": stopped_at_a_kink,
}


@pytest.mark.long
@pytest.mark.parametrize("name", CASES)
def test_what_follows_from_a_failure_is_no_number(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found, numbers, said = CASES[name]()
    assert type(found).__name__ == name
    for number in numbers:
        assert np.all(np.isnan(np.asarray(number)))
    shown = found.table() if hasattr(found, "table") else repr(found)
    assert said in shown


def results():
    """Public classes with a verdict among their fields and properties."""
    found = {}
    for room in (getattr(mbs, name) for name in mbs.__all__):
        if not inspect.ismodule(room):
            continue
        for name in getattr(room, "__all__", ()):
            one = getattr(room, name)
            if inspect.isclass(one):
                fields = set(getattr(one, "__dataclass_fields__", ())) | set(getattr(one, "_fields", ()))
                own = fields | {k for k, v in inspect.getmembers(one) if isinstance(v, property)}
                if own & WORDS:
                    found[name] = one
    return found


def test_every_result_with_a_verdict_is_in_the_table():
    missing = sorted(set(results()) - set(CASES) - set(STANDING))
    assert not missing, f"add a case, or a reason, for {missing}"
    assert not set(STANDING) - set(results())
