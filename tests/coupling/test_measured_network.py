"""Measured transfer functions among the components of `connect`, against networks in which all are modelled."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.coupling import MeasuredNetwork, bushing, connect, hinge, rigid_bond
from jaxmbs.errors import ModelError, UnknownNameError
from jaxmbs.linear import TransferFunctions
from jaxmbs.reductions import CraigBampton, reduce
from jaxmbs.vibration import frequency_response
from tests.coupling.test_network import AXES, DAMPING, MASS, PARTS, STIFFNESS

OMEGA = np.array([30.0, 110.0, 250.0])
BONDS = {
    "bolts": rigid_bond("stage.foot"),
    "mount": bushing("stage.top", "mast.root", stiffness=STIFFNESS, damping=DAMPING, mass=MASS, axes=AXES),
    "pin": hinge("mast.end", "panel.hinge", free="ry", axes=AXES),
    "stay": hinge("panel.far", free="rx ry rz"),
    "leg": bushing("panel.far", stiffness=[0, 0, 0, 4e2, 5e2, 6e2]),
}
ASKED = {"into": ["mast.middle x", "panel.edge"], "out": ["stage.knee y", "mast.root", ("panel", "edge z")]}


@functools.cache
def models():
    return PARTS | {"panel": reduce(PARTS["panel"], CraigBampton(6)), "mast": PARTS["mast"]}


def measured(name, *nodes, kind="receptance"):
    """A model asked at nodes, as if it had been measured."""
    found = frequency_response(models()[name], OMEGA, into=nodes, out=nodes, loss=0.02)
    return found.to(kind)


@pytest.fixture(scope="module")
def rig():
    return measured("mast", "root", "end", "middle x", kind="accelerance")


@pytest.mark.long
def test_a_measured_mass_on_a_modelled_spring():
    """`H = 1 / (k - (m + n) w^2)` with the measured mass m, which the bond pushes by `-m w^2 H`."""
    k, m, n, omega = 300.0, 2.0, 0.5, np.array([5.0, 9.0, 20.0])
    mass = TransferFunctions(omega, -1.0 / (m * omega**2)[:, None, None] + 0j, ("top x",), ("top x",))
    spring = mbs.LinearSystem(
        mass=jnp.array([[n]]), stiffness=jnp.array([[k]]), coordinates=["foot x"], interface=["foot x"]
    )
    net = connect({"mass": mass, "spring": spring}, {"glue": rigid_bond("mass.top x", "spring.foot x")})
    found = mbs.frequency_response(net, omega, into=["spring.foot x"], out=["mass.top x"])
    H = 1 / (k - (m + n) * omega**2)
    np.testing.assert_allclose(found.values[:, 0, 0], H, rtol=1e-10)
    loads = mbs.reactions(net, found)["glue"]
    np.testing.assert_allclose(loads.on_first[:, 0, 0], -m * omega**2 * H, rtol=1e-10)
    np.testing.assert_allclose(loads.on_second, -loads.on_first, rtol=1e-12)


@pytest.mark.long
def test_a_measured_component_among_models(rig):
    """A mast between a bushing with axes and mass and a hinge with axes; the ground; another frequency order."""
    whole = mbs.frequency_response(connect(models(), BONDS), OMEGA, **ASKED, loss=0.02)
    net = connect(models() | {"mast": rig}, BONDS)
    assert isinstance(net, MeasuredNetwork)
    found = mbs.frequency_response(net, OMEGA[::-1], **ASKED, loss=0.02)
    assert (found.outputs, found.inputs, found.kind) == (whole.outputs, whole.inputs, "receptance")
    np.testing.assert_allclose(found.values[::-1], whole.values, atol=1e-7 * np.abs(whole.values).max())
    np.testing.assert_allclose(net.omega, OMEGA)
    loads = mbs.reactions(net, found, loss=0.02)
    push = mbs.vibration.harmonic_response(connect(models(), BONDS), OMEGA[::-1], {"panel.edge rx": 1.0}, loss=0.02)
    for name, exact in mbs.reactions(connect(models(), BONDS), push).items():
        for side in ("on_first", "on_second"):
            one, other = getattr(loads[name], side)[:, found.inputs.index("panel.edge rx")], getattr(exact, side)
            np.testing.assert_allclose(one, other, atol=1e-7 * np.abs(other).max())
    assert loads.ok and loads["pin"].labels == ("x", "y", "z", "rx", "ry", "rz")


@pytest.mark.long
def test_two_measured_ones_and_one_direction():
    """One channel is tied, to a mechanism's coordinate; inputs and outputs that are not the same."""
    b = mbs.SystemBuilder()
    b.body("mass", mass=3.0)
    b.joint("slide", mbs.Prismatic("z"), "ground", "mass")
    b.force("spring", mbs.SpringDamper(stiffness=500.0, damping=2.0), joint="slide")
    system = b.build()
    slide = mbs.linearise(system, mbs.State.at(system))
    arms = {name: measured(name, "root", "end", "middle x") for name in ("mast",)}
    arms["mast"] = arms["mast"].at(None, ["end z", "middle x", "root x"])
    bonds = {"tie": rigid_bond("mast.end z", "slide.slide")}
    asked = {"into": ["slide.slide"], "out": ["mast.root y", "slide.slide"]}
    found = mbs.frequency_response(connect(arms | {"slide": slide}, bonds), OMEGA[1:2], **asked, loss=0.02)
    whole = connect({"mast": models()["mast"], "slide": slide}, bonds)
    exact = mbs.frequency_response(whole, OMEGA[1:2], **asked, loss=0.02)
    np.testing.assert_allclose(found.values, exact.values, rtol=1e-7)
    noisy = mbs.frequency_response(connect(arms | {"slide": slide}, bonds), OMEGA, **asked, rcond=1e-9)
    assert noisy.values.shape == (3, 2, 1)


@pytest.mark.long
def test_gradient_by_a_model_beside_a_measurement(rig):
    """Jitted, by the stiffness of the stage, against differences."""

    @jax.jit
    @jax.value_and_grad
    def level(scale):
        stage = models()["stage"].replace(stiffness=scale * models()["stage"].stiffness)
        net = connect({"stage": stage, "mast": rig}, {n: BONDS[n] for n in ("bolts", "mount")})
        found = mbs.frequency_response(net, OMEGA, into=["mast.middle x"], out=["stage.knee x"])
        return jnp.sum(jnp.abs(found.values) ** 2) * 1e12

    slope = level(1.0)[1]
    difference = (level(1.0 + 1e-5)[0] - level(1.0 - 1e-5)[0]) / 2e-5
    np.testing.assert_allclose(slope, difference, rtol=1e-5)


@pytest.mark.slow
def test_what_cannot_be_asked_is_told(rig):
    net = connect({"mast": rig, "panel": models()["panel"]}, {"pin": BONDS["pin"]})
    for question, ask in (
        ("modes", lambda: mbs.modes(net)),
        ("equilibrium", lambda: mbs.equilibrium(net, {"panel.edge z": 1.0})),
        ("simulate", lambda: mbs.simulate(net, ts=np.linspace(0.0, 1.0, 3))),
        ("check", lambda: mbs.check(net)),
    ):
        with pytest.raises(ModelError, match=f"{question} needs the matrices of 'mast'"):
            ask()
    for error, told, options in (
        (UnknownNameError, "outputs of 'mast': there is no .* 'middle y': did you mean", {"out": ["mast.middle y"]}),
        (UnknownNameError, "no component 'mats': did you mean 'mast'", {"into": ["mats.end x"]}),
        (UnknownNameError, "no coordinate or node 'hing x'", {"into": ["panel.hing x"]}),
        (ValueError, "omega = 31 rad/s was not measured: there are 3 frequencies, 30 to 250", {"omega": [31.0]}),
    ):
        with pytest.raises(error, match=told):
            mbs.frequency_response(net, **{"omega": OMEGA, "into": ["mast.end x"], "out": ["mast.end x"]} | options)
    one_way = TransferFunctions(OMEGA, rig.values[:, :, :5], rig.outputs, rig.inputs[:5])
    other = TransferFunctions(OMEGA + 1.0, rig.values, rig.outputs, rig.inputs)
    for parts, bond, told in (
        ({"a": one_way}, rigid_bond("a.root"), None),
        ({"a": one_way}, rigid_bond("a.end"), "interface of 'a': there is no coordinate or node 'end'"),
        ({"a": rig, "b": other}, rigid_bond("a.end", "b.end"), "at different frequencies"),
    ):
        if told is None:
            assert len(connect(parts, {"bond": bond}).ties[0][1].labels) == 5
            continue
        with pytest.raises(ModelError, match=told):
            connect(parts, {"bond": bond})
