"""Steady states by harmonics are those of shooting, of case PO1, and of linear rotors; their slopes those of PO1."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import rotors
from tests.cases.test_duffing_cycles import CYCLES, NUMBERS, SLOPES

GIVEN = {"m": 1.0, "c": 0.1, "k": 1.0, "k3": 0.5, "F": 0.3}


def cubic(k3, x, v):
    return -k3 * x**3


def steady(omega, numbers, start):
    """Duffing's oscillator at one frequency, near a start (displacement, speed)."""
    m, c, k = (jnp.reshape(jnp.asarray(numbers[name]), (1, 1)) for name in "mck")
    system = mbs.LinearSystem(mass=m, stiffness=k, damping=c, coordinates=["x"])
    law = jax.tree_util.Partial(cubic, jnp.asarray(numbers["k3"]))
    start = {"x": start[0] - 1j * start[1] / omega}
    loads = {"x": numbers["F"]}
    return mbs.cycles.harmonic_balance(system, [omega], loads, {"cubic": ("x", law)}, harmonics=25, start=start)


@pytest.mark.slow
def test_cycles_of_po1():
    """All rows of its cycles but the multipliers, and the slopes."""
    for (omega, start), (x0, v0, peak, _, third) in zip(CYCLES.values(), NUMBERS, strict=True):
        found = steady(omega, GIVEN, start)
        a = np.asarray(found.amplitudes[0, :, 0])
        speeds = np.sum((1j * np.arange(26) * omega * a).real)
        shown = [np.sum(a.real), speeds, found.peak("x")[0], abs(a[3])]
        np.testing.assert_allclose(shown, [x0, v0, peak, third], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(np.max(np.abs(found.history("x", 4096))), peak, rtol=1e-5)


@pytest.mark.long
def test_slopes_of_po1():
    slopes = jax.grad(lambda d: steady(1.5, d, CYCLES["upper at 1.5"][1]).peak("x")[0])(GIVEN)
    for name, slope in SLOPES.items():
        np.testing.assert_allclose(slopes[name], slope, rtol=1e-6, err_msg=name)


@pytest.mark.long
def test_a_gap_as_by_shooting():
    """Two masses with a gap between them."""
    stop = lambda x, v: -200.0 * (jnp.maximum(x - 0.02, 0.0) - jnp.maximum(-x - 0.02, 0.0))
    K = np.array([[150.0, -50.0], [-50.0, 50.0]])
    linear = mbs.LinearSystem(mass=np.diag([2.0, 1.0]), stiffness=K, damping=0.02 * K, coordinates=["a", "b"])
    laws = {"gap": (("a", "b"), stop)}
    found = mbs.cycles.harmonic_balance(linear, [6.0], {"a": 4.0}, laws, harmonics=60, samples=2048)
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    for name, mass, before, stiffness in (("a", 2.0, "ground", 100.0), ("b", 1.0, "a", 50.0)):
        b.body(name, mass=mass)
        b.joint(name, mbs.Prismatic("x"), before, name)
        b.force(f"spring {name}", mbs.SpringDamper(stiffness=stiffness, damping=0.02 * stiffness), joint=name)
    b.force("push", mbs.Actuator(lambda x, v, t: 4.0 * jnp.cos(6.0 * t)), joint="a")
    b.force("gap", mbs.Actuator(lambda x, v, t: stop(x, v)), joint="b")
    system = b.build()
    cycle = mbs.periodic(system, 2.0 * np.pi / 6.0)
    x = np.asarray(cycle.states.coordinates[:-1])
    assert np.max(np.abs(x[:, 1])) > 0.03 and cycle.stable
    np.testing.assert_allclose(found.history("a", 120)[0], x[:, 0], atol=2e-6)
    np.testing.assert_allclose(found.history("b", 120)[0], x[:, 0] + x[:, 1], atol=2e-6)


@pytest.mark.long
def test_a_rotor_whose_law_is_linear_whirls_as_it_says():
    shaft = rotors.Shaft([0.0, 0.4, 1.0], 0.02, divisions=2)
    rotor = lambda more: rotors.Rotor(
        shaft,
        [rotors.Disk(1, 8.0, 0.05, 0.09)],
        [rotors.Bearing(0, 1e7, 500.0), rotors.Bearing(2, 8e6 + more, 400.0)],
    )
    omega = np.linspace(50.0, 400.0, 8)
    spring = lambda x, v: -2e6 * x
    loads = {"1 x": 1e-3 * omega**2, "1 y": -1e-3j * omega**2}
    laws = {"spring": (["2 x", "2 y"], spring)}
    found = mbs.cycles.harmonic_balance(rotor(0.0).at_speed, omega, loads, laws, harmonics=(1, 3))
    wanted = rotors.unbalance_response(rotor(2e6), omega, {1: 1e-3}).deflections
    places = [found.coordinates.index(f"{k} {axis}") for k in range(3) for axis in "xy"]
    np.testing.assert_allclose(found.amplitudes[:, 0, places].reshape(-1, 3, 2), wanted, rtol=1e-9, atol=1e-15)
    assert found.ok.all() and "1.1 slope y" in found.coordinates


@pytest.mark.long
def test_networks_and_reduced_components_as_the_whole():
    """A clamped tube with a stop at its end, whole; and of two halves, one of them reduced with all of its modes."""
    tube = mbs.elements.Beam(70e9, 27e9, 4e-4, 2e-8, 2e-8, 4e-8, 2700.0)
    place = {name: np.array([x, 0.0, 0.0]) for name, x in zip("abcd", (0.0, 0.4, 0.7, 1.0), strict=True)}

    def part(names, interface, supports=None):
        pairs = list(zip(names[:-1], names[1:], strict=True))
        structure = mbs.fem.Structure({n: place[n] for n in names}, {"tube": (tube, pairs)}, supports or {})
        return mbs.fem.assemble(structure, list(interface))

    whole = part("abcd", "bd", {"a": "all"})
    right = mbs.reductions.reduce(part("bcd", "bd"), mbs.reductions.CraigBampton(6))
    bonds = {"joint": mbs.coupling.rigid_bond("left.b", "right.b")}
    net = mbs.coupling.connect({"left": part("ab", "b", {"a": "all"}), "right": right}, bonds)
    stop = lambda x, v: -4e4 * jnp.maximum(x - 2e-4, 0.0) - 30.0 * v
    answers = []
    for system, tip, middle in ((whole, "d z", "b z"), (net, "right.d z", "left.b z")):
        found = mbs.cycles.harmonic_balance(
            system, [180.0, 200.0], {tip: 60.0}, {"stop": (tip, stop)}, harmonics=24, samples=512
        )
        assert found.ok.all()
        answers.append([found.peak(tip), found.peak(middle), np.abs(found.forces[:, 2, 0])])
    np.testing.assert_allclose(answers[1], answers[0], rtol=1e-8)
    assert np.all(np.asarray(answers[0][0]) > 2.5e-4)  # the stop is met


def test_wrong_arguments_are_refused():
    system = mbs.LinearSystem(mass=np.eye(1), stiffness=np.eye(1), coordinates=["x"])
    law = {"law": ("x", lambda x, v: -x)}
    ask = lambda omega=(1.0,), forces=None, laws=law, **given: mbs.cycles.harmonic_balance(
        system, omega, {"x": 1.0} if forces is None else forces, laws, **given
    )
    for match, given in {
        "row of frequencies": {"omega": 1.0},
        "positive": {"omega": [-1.0]},
        "first one must be among": {"harmonics": (0, 3)},
        "samples": {"samples": 3},
        "no coordinate or node": {"forces": {"y": 1.0}},
        "one number": {"forces": {"x": [1.0, 2.0]}},
        "takes .coordinates": {"laws": {"law": "x"}},
    }.items():
        with pytest.raises((mbs.ModelError, mbs.UnknownNameError), match=match):
            ask(**given)
    with pytest.raises(mbs.UnknownNameError, match="harmonic 9"):
        ask(forces={("x", 9): 1.0})


@pytest.mark.slow
def test_harmonics_that_are_missing_are_told():
    """A quadratic law moves the mean, to first order by `-k2 a^2 / (2 k)`."""
    k2, a = 0.4, 0.5
    system = mbs.LinearSystem(mass=[[1.0]], stiffness=[[4.0]], damping=[[0.4]], coordinates=["x"])
    law = {"quadratic": ("x", lambda x, v: -k2 * x**2)}
    ask = lambda harmonics: mbs.cycles.harmonic_balance(system, [2.0], {"x": 0.8j * a}, law, harmonics, samples=64)
    with pytest.warns(UserWarning, match="harmonics beside .1, 3. would move the laws"):
        found = ask((1, 3))
    complete = ask(7)
    mean, second = (abs(complete.amplitudes[0, k, 0]) for k in (0, 2))
    np.testing.assert_allclose(mean, k2 * a**2 / 8.0, rtol=2e-2)
    np.testing.assert_allclose(found.neglected[0] * a, np.hypot(mean, second), rtol=5e-2)
    assert complete.neglected[0] < 1e-6
