"""Errors from below in words: functions that JAX cannot compile, switches, counts and numbers of another kind."""

import inspect

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import elements, experiment, fatigue, fem, linear, reductions, vibration
from jaxmbs.checks import count_faults, require_numbers, require_reals
from jaxmbs.runtime import explain_error

from .test_misuse import PUBLIC
from .zoo import Zoo

ZOO = Zoo()
HUGE = 10**400
TYPES = "Type-check error"  # of the annotations, which the tests check before the library does


def with_numpy(x):
    return np.sin(x)


def with_if(x):
    return 1.0 if x > 0 else -1.0


def with_int(x):
    return [1.0, 2.0][int(x)]


ASKED = {
    "batch": lambda f: mbs.batch(f, jnp.arange(3.0), progress=False),
    "minimise": lambda f: mbs.minimise(lambda d: f(d["k"]), {"k": 0.3}, {"k": (0.0, 2.0)}, progress=False),
    "event": lambda f: mbs.simulate(ZOO.hanging, ZOO.near_rest, t1=0.1, event=lambda s: f(s.t)),
    "tolerances": lambda f: mbs.design.tolerances(lambda d: f(d["k"]), {"k": 0.3}, {"k": 0.1}),
    "drive": lambda f: _pendulum(drive=f),
    "law": lambda f: _pendulum(mbs.Actuator(lambda x, v, t: f(x))),
}


def _pendulum(law=None, **options):
    b = mbs.SystemBuilder()
    b.body("bob", 1.0, com=(0.5, 0.0, 0.0), inertia=0.1)
    b.joint("pin", mbs.Revolute("y"), "ground", "bob", **options)
    if law is not None:
        b.force("push", law, joint="pin")
    system = b.build()
    return mbs.forward_dynamics(system, mbs.State.at(system))


@pytest.mark.parametrize(
    "function, way_out",
    [(with_numpy, "jnp.sin"), (with_if, "jnp.where"), (with_int, "leave out")],
    ids=lambda x: getattr(x, "__name__", x),
)
@pytest.mark.parametrize("asked", ASKED)
def test_functions_that_cannot_be_compiled_are_named_with_the_way_out(asked, function, way_out):
    with pytest.raises((TypeError, ValueError), match=rf"{function.__name__} \(test_raw_errors.py:\d+\).*{way_out}"):
        ASKED[asked](function)


def test_other_errors_keep_their_kind_and_first_line():
    assert explain_error(ValueError("one\ntwo")) == "ValueError: one"
    assert explain_error(KeyError()) == "KeyError: no words"


def test_a_signal_is_an_effort_of_time():
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("block", 2.0)
    b.joint("slide", mbs.Prismatic("x"), "ground", "block")
    b.force("push", mbs.Actuator(mbs.Ramp(3.0, 4.0)), joint="slide")
    system = b.build()
    np.testing.assert_allclose(
        mbs.forward_dynamics(system, mbs.State.at(system, t=0.5))[0], [(3.0 + 4.0 * 0.5) / 2.0]
    )


@pytest.mark.parametrize("text", ["no", "False", 0.5, None])
@pytest.mark.parametrize(
    "switch",
    [
        lambda x: mbs.forces.GearPair((20, 30), 2e-3, internal=x),
        lambda x: mbs.forces.HydraulicCylinder((2.0, 1.0), (1.0, 1.0), 1e3, varying=x),
        lambda x: elements.Rod(1.0, 1.0, lumped=x),
        lambda x: fatigue.SN(1e6, 5.0, ranges=x),
        lambda x: vibration.ModalSuperposition(static_start=x),
        lambda x: linear.check(_pair(), throw=x),
        lambda x: fatigue.equivalent_load([0.0, 1.0, 0.0], 3.0, ranges=x),
    ],
)
def test_text_is_no_switch(switch, text):
    with pytest.raises((TypeError, ValueError), match=f"must be True or False, not {text!r}|{TYPES}"):
        switch(text)


def _pair():
    return mbs.LinearSystem(mass=np.eye(2), stiffness=[[2.0, -1.0], [-1.0, 2.0]], coordinates=["a", "b"])


@pytest.mark.parametrize("count", [-1, 2.0, "1", True, None, HUGE])
@pytest.mark.parametrize(
    "kind", ["CraigBampton", "Hurty", "CraigChang", "Rubin", "MacNeal", "Mixed", "Characteristic"]
)
def test_numbers_of_modes_are_counts(kind, count):
    with pytest.raises((TypeError, ValueError), match=f"{kind}: num_modes|{TYPES}"):
        getattr(reductions, kind)(count)


@pytest.mark.parametrize("value", ["0.3", None, HUGE, [1.0, "2"]])
@pytest.mark.parametrize(
    "question",
    [
        lambda x: vibration.mobility(jnp.ones((2, 1, 1)), x),
        lambda x: vibration.gain_from_mobility(1.0, x, 2.0),
        lambda x: vibration.mac(jnp.eye(2), x),
        lambda x: experiment.noise_variance(jnp.ones((2, 1)), x),
        lambda x: mbs.forces.SpringDamper(x),
        lambda x: elements.Rod(x, 1.0),
        lambda x: fatigue.SN(x, 5.0),
    ],
)
def test_what_is_no_number_is_refused_by_name_or_in_words(question, value):
    with pytest.raises((TypeError, ValueError), match=f"number|inhomogeneous|must be positive|shape|{TYPES}"):
        question(value)


def test_checkers():
    require_numbers(a=1.0, b=[1, 2j], c=jnp.ones(2))
    require_reals([1.0, jnp.ones(2), 10**300])
    assert count_faults("n", 3) == [] and "401 digits" in count_faults("n", HUGE)[0]
    with pytest.raises(ValueError, match="401 digits"):
        require_reals(HUGE)
    jax.jit(lambda x: require_numbers(x=x))(1.0)


def test_widths_name_the_wrong_key():
    with pytest.raises(ValueError, match="there is no variable 'b'; there are: a; a is missing"):
        mbs.design.tolerances(lambda d: d["a"] ** 2, {"a": 1.0}, {"b": 0.1})


def test_a_coefficient_of_friction_in_text():
    b = mbs.SystemBuilder()
    b.body("block", 1.0)
    b.joint("slide", mbs.Prismatic("x"), "ground", "block")
    with pytest.raises((TypeError, ValueError), match=f"must be a coefficient or a model .* '0.3'|{TYPES}"):
        b.friction("rub", "slide", "0.3")
        b.build()


def test_a_preload_of_what_is_free():
    beam = elements.Beam(210e9, 80e9, 1e-4, 1e-8, 1e-8, 2e-8, density=7800.0)
    free = fem.Structure({"a": (0, 0, 0), "b": (1.0, 0, 0)}, {"beam": (beam, [("a", "b")])})
    with pytest.raises(mbs.ModelError, match="preload: nothing holds"):
        fem.assemble(free, preload=np.ones(12))


def earth(scale=1.0):
    m, r = 5.97e24 * scale, 6.371e6
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("earth", m, inertia=(0.33 * m * r * r,) * 3)
    b.joint("free", mbs.Free(), "ground", "earth")
    return b.build()


def chain(first, second, kind=mbs.Prismatic):
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("first", first, inertia=first)
    b.body("second", second, inertia=second)
    b.joint("wall", kind("x"), "ground", "first")
    b.joint("between", kind("x"), "first", "second")
    return b.build()


@pytest.mark.parametrize("scale", [1e-24, 1.0, 1e6])
def test_the_earth_on_a_free_joint_moves_inertia(scale):
    assert earth(scale).topology.num_velocities == 6


@pytest.mark.parametrize("masses", [(1e13, 1.0), (1.0, 1e13), (1e-9, 1e4)])
@pytest.mark.parametrize("kind", [mbs.Prismatic, mbs.Revolute])
def test_ratios_of_masses_are_no_lack_of_inertia(masses, kind):
    assert chain(*masses, kind).topology.num_velocities == 2


def test_a_satellite_beside_the_earth():
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    for name, m, r in (("earth", 5.97e24, 6.371e6), ("satellite", 1.0, 0.1)):
        b.body(name, m, inertia=(0.4 * m * r * r,) * 3)
        b.joint(f"{name} free", mbs.Free(), "ground", name)
    assert b.build().topology.num_velocities == 12


def test_what_moves_no_inertia_is_still_refused():
    b = mbs.SystemBuilder()
    b.body("arm", 1.0, inertia=1.0)
    b.body("rod", 1.0, com=(0.3, 0.4, 0.0))  # a line: no inertia about its own axis
    b.joint("turn", mbs.Revolute("z"), "ground", "arm")
    b.joint("spin", mbs.Revolute((3.0, 4.0, 0.0)), "arm", "rod")
    with pytest.raises(mbs.ModelError, match="spin moves no inertia"):
        b.build()
    with pytest.raises(mbs.ModelError, match="between moves no inertia"):
        chain(1.0, 0.0)
    with pytest.raises(mbs.ModelError, match="moves no inertia"):
        chain(0.0, 1.0)  # the two move against each other without the second


#: Public functions and classes with switches, and what is given for their other arguments, which comes after.
SWITCHES = [
    (name, key)
    for name, item in sorted(PUBLIC.items())
    for key, kind in getattr(item.__init__ if isinstance(item, type) else item, "__annotations__", {}).items()
    if kind is bool and key != "return"
]


@pytest.mark.parametrize("name, key", SWITCHES)
def test_no_public_switch_takes_text(name, key):
    item = PUBLIC[name]
    needed = [p for p in inspect.signature(item).parameters.values() if p.default is p.empty and p.name != key]
    given = {p.name: None for p in needed if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)}
    with pytest.raises((TypeError, ValueError), match=f"{key} must be True or False, not 'no'"):
        item(**given, **{key: "no"})
