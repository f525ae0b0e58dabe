"""Every law on a scalar displacement: energy, dissipation, derivatives, stacking, faults."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import forces as F
from jaxmbs.friction import BearingFriction, SmoothCoulomb
from tests.marks import cases


def torque_curve(x, v, t):
    return 3.0 * jnp.sin(t) - 0.2 * x * v


class Gain(eqx.Module):
    gain: jax.Array

    def __call__(self, x, v, t):
        return self.gain * jnp.cos(t) * x


X_POINTS = [-1.0, -0.2, 0.0, 0.3, 1.0]
LAWS = {
    "spring_damper": F.SpringDamper(40.0, damping=0.7, free_length=0.3, preload=-2.0),
    "negative_spring": F.SpringDamper(-40.0),
    "table": F.Table(X_POINTS, [-9.0, -1.0, 0.0, 0.0, 4.0], [-2.0, 0.0, 1.0], [-3.0, 0.0, 5.0]),
    "table_spring": F.Table([-1.0, 1.0], [-5.0, 5.0]),
    "bump_stop": F.BumpStop(1e3, lower=-0.2, upper=0.3, exponent=1.5, damping=0.4),
    "one_stop": F.BumpStop(1e3, upper=0.3),
    "friction": F.FrictionForce(BearingFriction(5.0, 7.0, 0.01, viscous=0.2)),
    "actuator": F.Actuator(torque_curve),
    "actuator_module": F.Actuator(Gain(jnp.array(2.0))),
    "servo": F.PD(F.Harmonic(amplitude=0.5), kp=30.0, kd=2.0),
}
PASSIVE = [name for name, law in LAWS.items() if not law.is_source]
SPECIAL = [-1.7, -1.0, -0.2, 0.0, 0.3, 0.5, 1.0, 2.2]  # with the knots and edges
parametrise = pytest.mark.parametrize("name", LAWS)


def points():
    x, v = jnp.meshgrid(jnp.array(SPECIAL), jnp.array([-3.0, -0.01, 0.0, 1.0, 2.5]))
    return x.ravel(), v.ravel()


def efforts(law, x, v, t=0.4):
    return _efforts(law, x, v, jnp.array(t))


@jax.jit
def _efforts(law, x, v, t):
    return jax.vmap(lambda x, v: law.effort(x, v, t))(x, v)


@pytest.mark.parametrize("name", PASSIVE)
def test_effort_at_rest_is_minus_the_slope_of_the_potential(name):
    law, x = LAWS[name], jnp.linspace(-1.9, 2.1, 57)
    slope = jax.jit(jax.vmap(jax.grad(lambda x: law.potential(x, jnp.array(0.4)))))(x)
    np.testing.assert_allclose(efforts(law, x, jnp.zeros_like(x)), -slope, atol=1e-11)


@pytest.mark.parametrize("name", PASSIVE)
def test_potential_is_the_work_of_the_effort(name):
    law, (nodes, weights) = LAWS[name], np.polynomial.legendre.leggauss(20)
    edges = np.array([-1.7, *SPECIAL[1:]])
    middles, halves = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
    x = jnp.asarray(middles[:, None] + halves[:, None] * nodes[None, :])
    integrals = halves * (np.asarray(efforts(law, x.ravel(), 0 * x.ravel())).reshape(x.shape) @ weights)
    energies = jax.jit(jax.vmap(lambda x: law.potential(x, jnp.array(0.4))))(jnp.asarray(edges))
    np.testing.assert_allclose(np.diff(energies), -integrals, rtol=1e-5, atol=1e-10)


@pytest.mark.parametrize("name", PASSIVE)
def test_the_rest_dissipates(name):
    x, v = jax.random.normal(jax.random.key(0), (2, 500))
    power = (efforts(LAWS[name], x, v) - efforts(LAWS[name], x, 0 * v)) * v
    assert power.max() <= 1e-12


@pytest.mark.parametrize("name", cases(LAWS, long=["table"]))
def test_derivatives_are_finite_everywhere(name):
    def effort_and_energy(law, x, v, t):
        return law.effort(x, v, t) + law.potential(x, t)

    derivative = jax.grad(effort_and_energy, argnums=(0, 1, 2, 3))
    second = jax.hessian(effort_and_energy, argnums=(1, 2))
    x, v = points()
    for function in (derivative, second):
        values = jax.jit(jax.vmap(lambda x, v, f=function: f(LAWS[name], x, v, jnp.array(0.0))))(x, v)
        assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(values))


@pytest.mark.parametrize(
    "name", ["spring_damper", pytest.param("table", marks=pytest.mark.long), "bump_stop", "friction", "servo"]
)
def test_derivatives_with_respect_to_numbers(name):
    leaves, treedef = jax.tree.flatten(LAWS[name])

    @jax.jit
    def total(scale):
        law = jax.tree.unflatten(treedef, [leaf * s for leaf, s in zip(leaves, scale, strict=True)])
        x = jnp.array([-1.3, -0.5, 0.1, 0.75, 1.4])
        return efforts(law, x, 1.3 * x).sum() + jax.vmap(lambda x: law.potential(x, 0.0))(x).sum()

    one = [jnp.ones(())] * len(leaves)
    for i, slope in enumerate(jax.grad(total)(one)):
        ends = [total([s + h if j == i else s for j, s in enumerate(one)]) for h in (1e-6, -1e-6)]
        np.testing.assert_allclose(slope, (ends[0] - ends[1]) / 2e-6, rtol=2e-6, atol=2e-6)


@pytest.mark.parametrize("name", cases(LAWS, long=["table"], rest=pytest.mark.slow))
def test_laws_stack(name):
    law = LAWS[name]
    other = jax.tree.map(lambda leaf: leaf * 1.1, law)
    stack = jax.tree.map(lambda *leaves: jnp.stack(leaves), law, other)
    x, v = jnp.array([0.35, -0.4]), jnp.array([0.3, -1.0])
    together = jax.jit(jax.vmap(lambda law, x, v: law.effort(x, v, jnp.array(0.4))))(stack, x, v)
    alone = [law.effort(x[0], v[0], jnp.array(0.4)), other.effort(x[1], v[1], jnp.array(0.4))]
    np.testing.assert_allclose(together, jnp.stack(alone), rtol=1e-13, atol=1e-15)
    energy = jax.vmap(lambda law, x: law.potential(x, jnp.array(0.4)))(stack, x)
    assert energy.shape == (2,)


@parametrise
def test_numbers_are_leaves_and_faults_empty(name):
    law = LAWS[name]
    assert all(leaf.dtype == jnp.float64 for leaf in jax.tree.leaves(law))
    assert law.faults() == []
    assert jax.tree.structure(law) == jax.tree.structure(jax.tree.map(lambda leaf: leaf + 1, law))


def test_laws_are_built_under_tracing():
    def effort(k, c):
        laws = [F.SpringDamper(k, c), F.Table([-1.0, 1.0], [-k, k]), F.BumpStop(k, upper=0.1, damping=c)]
        laws += [F.FrictionForce(SmoothCoulomb(k, transition_speed=c)), F.PD(k, kp=k, kd=c)]
        assert all(law.faults() == [] for law in laws)
        return sum(law.effort(0.3, 0.2, 0.0) for law in laws)

    slopes = jax.jit(jax.grad(effort, argnums=(0, 1)))(3.0, 0.5)
    assert np.isfinite(slopes).all()


def test_numbers_and_signs():
    np.testing.assert_allclose(LAWS["spring_damper"].effort(0.5, 2.0, 0.0), -(40 * 0.2 - 2.0 + 1.4))
    assert F.Table([-1.0, 1.0], [-5.0, 5.0]).effort(3.0, 0.0, 0.0) == -15.0
    stop = F.BumpStop(100.0, lower=-0.2, upper=0.3, exponent=2.0, damping=0.5)
    np.testing.assert_allclose(stop.effort(0.5, 2.0, 0.0), -100 * 0.04 * 2.0)
    np.testing.assert_allclose(stop.effort(0.5, -9.0, 0.0), -100 * 0.04)
    np.testing.assert_allclose(stop.effort(-0.3, -2.0, 0.0), 100 * 0.01 * 2.0)
    assert stop.effort(0.29, 5.0, 0.0) == 0.0
    np.testing.assert_allclose(F.FrictionForce(5.0).effort(0.0, 1.0, 0.0), -5.0)
    bump = F.FrictionForce(BearingFriction(5.0, 7.0, 0.01, 0.5, viscous=0.2))
    by_hand = -5.0 * (1 + 0.4 * np.exp(-((0.3 / 0.5) ** 2))) * np.tanh(30.0) - 0.2 * 0.3
    np.testing.assert_allclose(bump.effort(0.0, 0.3, 0.0), by_hand, rtol=1e-12)
    by_default = F.FrictionForce(SmoothCoulomb(1.0, 1.4, 0.01), 5.0).effort(0.0, 0.1, 0.0)
    np.testing.assert_allclose(by_default, -5.0 * (1 + 0.4 * np.exp(-1.0)) * np.tanh(10.0), rtol=1e-12)
    np.testing.assert_allclose(F.PD(1.0, kp=2.0, kd=3.0).effort(0.5, 1.0, 0.0), 1.0 - 3.0)
    assert F.Actuator(torque_curve).is_source and not F.SpringDamper().is_source


@pytest.mark.parametrize("transition", [0.0, 0.2])
def test_damping_of_a_stop_sets_in_over_its_transition(transition):
    """`v^2 / sqrt(v^2 + transition^2)` in compression, nothing else; its slope has no jump unless there is none."""
    stop = F.BumpStop(100.0, upper=0.3, damping=0.5, transition=transition)
    for v in (0.01, 0.3, 4.0):
        rate = v if not transition else v**2 / np.hypot(v, transition)
        np.testing.assert_allclose(stop.effort(0.5, v, 0.0), -100 * 0.04 * (1 + 0.5 * rate), rtol=1e-12)
    for v in (0.0, -1e-3, -2.0):
        np.testing.assert_allclose(stop.effort(0.5, v, 0.0), -100 * 0.04, rtol=1e-12)
    slope = jax.grad(stop.effort, argnums=1)
    after, before = slope(0.5, 1e-6, 0.0), slope(0.5, -1e-6, 0.0)
    assert before == 0.0 and (abs(after) < 1e-4 if transition else np.isclose(after, -2.0))
    np.testing.assert_allclose(
        slope(0.5, 0.1, 0.0), (stop.effort(0.5, 0.1001, 0.0) - stop.effort(0.5, 0.0999, 0.0)) / 2e-4, rtol=1e-4
    )
    assert np.isfinite(slope(0.5, 0.0, 0.0)) and np.isfinite(slope(0.5, 1e-200, 0.0))
    assert np.isfinite(
        jax.grad(lambda s: F.BumpStop(9.0, 0.0, damping=1.0, transition=s).effort(-1.0, 0.0, 0.0))(0.1)
    )


FAULTY = [
    (F.SpringDamper(damping=-1.0), "damping must not be negative"),
    (F.SpringDamper(stiffness=jnp.nan), "stiffness is not a number"),
    (F.Table([0.0, 0.0], [1.0, 2.0]), "x_points must increase"),
    (F.Table([0.0, 1.0], [1.0, 2.0], [1.0, 0.0], [1.0, 0.0]), "flow_points must increase"),
    (F.Table([0.0, 1.0], [1.0, 2.0], [-1.0, 0.0], [1.0, 0.0]), "must oppose"),
    (F.Table([0.0, 1.0], [1.0, 2.0], [-1.0, 1.0], [-1.0, 2.0]), "zero at rest"),
    (F.Table([0.0, 1.0], [1.0, 2.0], [0.0, 1.0, 2.0], [0.0, 2.0, 1.0]), "fall at the ends"),
    (F.BumpStop(-1.0), "stiffness must not be negative"),
    (F.BumpStop(1.0, exponent=0.5), "exponent"),
    (F.BumpStop(1.0, lower=1.0, upper=0.0), "lower must not exceed upper"),
    (F.BumpStop(1.0, damping=-1.0), "damping must not be negative"),
    (F.BumpStop(1.0, transition=-1.0), "transition must not be negative"),
    (F.FrictionForce(-1.0), "dynamic"),
    (F.FrictionForce(SmoothCoulomb(1.0, 0.5)), "static must be at least dynamic"),
    (F.FrictionForce(SmoothCoulomb(1.0, transition_speed=0.0)), "transition_speed"),
    (F.FrictionForce(BearingFriction(1.0, viscous=-1.0)), "viscous"),
    (F.FrictionForce(1.0, -1.0), "load must not be negative"),
    (F.FrictionForce(1.0, radius=0.0), "radius must be positive"),
    (F.PD(F.Step(duration=0.0), kp=1.0), "target: duration must be positive"),
    (F.PD(0.0, kp=-1.0), "kp"),
]


@pytest.mark.parametrize("law, message", FAULTY)
def test_faults_are_reported(law, message):
    assert any(message in fault for fault in law.faults())


def test_wrong_shapes_are_refused():
    for arguments in [([0.0], [1.0]), ([0.0, 1.0], [1.0]), ([0.0, 1.0], [0.0, 1.0], [0.0, 1.0])]:
        with pytest.raises(ValueError):
            F.Table(*arguments)
