"""Derivatives through assembly, simulation and reactions: reverse, forward and central differences agree."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.math._rotation import rotation_matrix
from tests.models import DOWN_Y, four_bar

EULER = diffrax.Euler()  # short to compile


def outputs(system, state, joints, gradient, solver, dt=0.02):
    """Final coordinates and velocities of a short run, and the reactions of some joints at its end."""
    motion = mbs.simulate(system, state, ts=jnp.array([0.2]), dt=dt, gradient=gradient, solver=solver)
    last = jax.tree.map(lambda x: x[-1], motion.states)
    loads = mbs.reactions(system, last) if joints else {}
    parts = [last.coordinates, last.velocities]
    parts += [part for name in joints for part in (loads[name].force, loads[name].moment, loads[name].effort)]
    return jnp.concatenate(parts)


# --------------------------------------------------------------------------------------------------- a tree
TREE = {
    "mass": np.array([1.0, 2.0]),
    "com": np.array([0.1, 0.0, -0.3]),
    "inertia": np.array([0.1, 0.12, 0.15]),
    "position": np.array([0.1, -0.2, 0.3]),
    "turn": np.array([0.2, 0.1, -0.3]),
    "spring": np.array([20.0, 0.5, 0.3]),
    "anchor": np.array([0.2, 0.1, 0.4]),
    "force": np.array([1.0, -2.0, 0.5]),
    "start": np.array([0.4]),
    "rates": np.array([0.5, -0.4, 0.8, 1.0]),
}
AT_ZERO = TREE | {
    "turn": np.zeros(3),
    "anchor": np.zeros(3),
    "spring": np.array([20.0, 0.0, 0.0]),  # a damper's force has no direction there
    "start": np.zeros(1),
    "rates": np.zeros(4),
}


def tree(design, gradient, solver=EULER):
    """A ball-jointed body on a turning arm, a spring from the ground to it and a force on it."""
    d = design
    b = mbs.SystemBuilder()
    b.body("arm", mass=d["mass"][0], com=d["com"], inertia=d["inertia"])
    b.body("bob", mass=d["mass"][1], com=2.0 * d["com"], inertia=0.5 * d["inertia"])
    place = mbs.Pose(d["position"], rotation_matrix(d["turn"]))
    b.joint("hinge", mbs.Revolute(axis="y"), "ground", "arm", parent_frame=place)
    b.joint("ball", mbs.Spherical(), "arm", "bob", parent_frame=place)
    stiffness, damping, free = d["spring"]
    anchor = 2.0 * d["position"]  # the bob's origin in the neutral pose: a spring of no length if d["anchor"] is zero
    b.force("spring", mbs.SpringDamper(stiffness, damping, free), between=(("ground", anchor), ("bob", d["anchor"])))
    b.force("push", mbs.Force(d["force"]), on="bob")
    system = b.build()
    psi = jnp.concatenate([d["start"], jnp.array([1.0, 0.0, 0.0, 0.0])])
    return outputs(system, mbs.State(jnp.zeros(()), psi, d["rates"]), ("hinge", "ball"), gradient, solver)


# ------------------------------------------------------------------------------------------------- two loops
LOOP = {
    "lengths": np.array([1.0, 0.3, 0.9, 0.7]),
    "masses": np.array([1.0, 2.0, 1.5]),
    "stiffness": np.array(3.0),
    "load": np.array(2.0),
    "start": np.array([0.7, 2.0]),
}
GUESS = {"A": 0.7, "B": -0.4, "D": 1.4}


def loop(design, gradient, solver=EULER, joints=()):
    d = design
    system = four_bar(tuple(d["lengths"]), tuple(d["masses"]), d["stiffness"], d["load"], like=LIKE["loop"])
    state = mbs.State.at(system, A=d["start"][0], velocities={"A": d["start"][1]}, guess={"B": -0.4, "D": 1.4})
    return outputs(system, state, joints, gradient, solver)


def driven(design, gradient, solver=None):
    """The same four-bar with its crank prescribed: evaluated, not integrated; the drive has a parameter."""
    d = design
    drive = mbs.forces.Harmonic(d["start"][0], 0.5, d["start"][1])
    masses = tuple(d["masses"])
    system = four_bar(tuple(d["lengths"]), masses, d["stiffness"], d["load"], drive=drive, like=LIKE["driven"])
    return outputs(system, mbs.State.at(system, guess=GUESS), ("A", "C"), gradient, solver)


LIKE = {}
MODELS = {"tree": (tree, TREE), "loop": (loop, LOOP), "driven": (driven, LOOP)}


@pytest.fixture(scope="module", autouse=True)
def concrete_builds():
    LIKE["loop"] = four_bar()
    LIKE["driven"] = four_bar(drive=mbs.forces.Harmonic(0.7, 0.5, 2.0))
    assert LIKE["driven"].topology.mobility == 0


class Derivatives:
    """Compiled once per model: a weighted sum of outputs with its gradient by reverse mode, Jacobians by forward."""

    def __init__(self, model, **options):
        function, self.design = MODELS[model]
        size = jax.eval_shape(lambda d: function(d, "forward", **options), as_jax(self.design)).shape[0]
        self.weights = jnp.asarray(np.random.default_rng(0).normal(size=size))
        self.both = jax.jit(jax.value_and_grad(lambda d: jnp.dot(self.weights, function(d, "reverse", **options))))
        self.forward = jax.jit(jax.jacfwd(lambda d: function(d, "forward", **options)))

    def value(self, design):
        return self.both(design)[0]

    def reverse(self, design):
        return self.both(design)[1]


@pytest.fixture(scope="module", params=["tree", "loop", "driven"])
def derivatives(request):
    return Derivatives(request.param)


def as_jax(design):
    return {name: jnp.asarray(value) for name, value in design.items()}


def central(function, design, names):
    """Gradient of a scalar function by differences of fourth order."""
    out = {}
    for name in names:
        gradient = np.zeros_like(design[name])
        for index in np.ndindex(gradient.shape):
            h = 2e-3 * max(abs(design[name][index]), 0.1)

            def at(shift, name=name, index=index):
                moved = np.array(design[name])
                moved[index] += shift
                return float(function(as_jax(design | {name: moved})))

            gradient[index] = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)
        out[name] = gradient
    return out


def check_reverse(derivatives, design, names):
    found = derivatives.reverse(as_jax(design))
    for name, wanted in central(derivatives.value, design, names).items():
        assert np.abs(wanted).max() > 1e-3, f"{name} has no influence"
        error = np.abs(np.asarray(found[name]) - wanted).max() / np.abs(wanted).max()
        assert error < 1e-6, f"{name}: relative error {error:.1e}"
    return found


def check_forward(derivatives, design):
    """vmap of jvp, contracted with the weights, is the gradient of reverse mode."""
    forward, reverse = derivatives.forward(as_jax(design)), derivatives.reverse(as_jax(design))
    for name, jacobian in forward.items():
        expected = np.tensordot(np.asarray(derivatives.weights), np.asarray(jacobian), axes=1)
        assert np.all(np.isfinite(np.asarray(jacobian))), name
        np.testing.assert_allclose(reverse[name], expected, rtol=1e-7, atol=1e-8 * np.abs(expected).max(initial=1.0))


@pytest.mark.parametrize(
    "derivatives",
    [
        pytest.param("tree", marks=pytest.mark.long),
        pytest.param("loop", marks=pytest.mark.long),
        pytest.param("driven", marks=pytest.mark.long),
    ],
    indirect=True,
)
def test_reverse_against_central_differences(derivatives):
    check_reverse(derivatives, derivatives.design, derivatives.design)


@pytest.mark.long
@pytest.mark.parametrize("derivatives", ["tree"], indirect=True)
def test_forward_equals_reverse(derivatives):
    check_forward(derivatives, derivatives.design)


@pytest.mark.parametrize("derivatives", ["tree"], indirect=True)
@pytest.mark.long
def test_finite_at_zero(derivatives):
    """Zero angles and rates, unit quaternion, a spring of no length: as smooth as elsewhere."""
    found = check_reverse(derivatives, AT_ZERO, ("mass", "turn", "anchor", "start", "rates", "force", "position"))
    assert all(np.all(np.isfinite(np.asarray(value))) for value in found.values())


@pytest.mark.long
def test_second_derivatives_of_a_motion():
    """The Hessian of a sprung pendulum's angle by mass, start and spring; second differences."""

    def scalar(x, gradient="forward"):
        b = mbs.SystemBuilder(gravity=DOWN_Y)
        b.body("bob", mass=x[0], com=(0.0, -0.8, 0.0))
        b.joint("pin", mbs.Revolute(axis="z"), "ground", "bob")
        b.force("spring", mbs.SpringDamper(x[2], 0.1, 0.2), joint="pin")
        return outputs(b.build(), mbs.State(jnp.zeros(()), x[1:2], jnp.zeros(1)), (), gradient, EULER, dt=0.1)[0]

    x, h = jnp.array([1.2, 0.7, 3.0]), 1e-3
    value, hessian = jax.jit(scalar), jax.jit(jax.jacfwd(jax.jacfwd(scalar)))(x)
    over_reverse = jax.jit(jax.jacfwd(jax.jacrev(lambda x: scalar(x, "reverse"))))(x)
    np.testing.assert_allclose(over_reverse, hessian, rtol=1e-9, atol=1e-9)
    for i, j in ((0, 0), (0, 1), (1, 2), (2, 2)):
        a, b = h * np.eye(3)[i], h * np.eye(3)[j]
        expected = (value(x + a + b) - value(x + a - b) - value(x - a + b) + value(x - a - b)) / (4 * h * h)
        np.testing.assert_allclose(hessian[i, j], expected, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(hessian, hessian.T, atol=1e-9)


@pytest.mark.long
def test_gravity_is_a_parameter():
    """The start of a fall: d(acceleration)/d(gravity) by hand."""

    def acceleration(g):
        b = mbs.SystemBuilder(gravity=g * jnp.array(DOWN_Y))
        b.body("bob", mass=2.0, com=(0.0, -0.8, 0.0))
        b.joint("pin", mbs.Revolute(axis="z"), "ground", "bob")
        return mbs.forward_dynamics(b.build(), mbs.State(jnp.zeros(()), jnp.array([0.5]), jnp.zeros(1)))[0][0]

    np.testing.assert_allclose(jax.jit(jax.grad(acceleration))(1.0), -9.81 * np.sin(0.5) / 0.8, rtol=1e-12)
