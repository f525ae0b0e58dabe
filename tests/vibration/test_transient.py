"""Two beams on a foot, a gap between their tips and a hardening spring, against SciPy on the whole structure."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.integrate
from jaxtyping import Array

import jaxmbs as mbs
from jaxmbs.coupling import connect, rigid_bond
from jaxmbs.errors import ModelError, SimulationError, UnknownNameError
from jaxmbs.forces import AbstractScalarLaw, BumpStop
from jaxmbs.linear import LinearSystem
from jaxmbs.reductions import CraigBampton, reduce
from jaxmbs.vibration import CoordinateLaw, ModalSuperposition
from tests.structural_matrices import beam, component

TIMES = np.linspace(0.0, 2.0, 41)
RISE, TIP = 1e-3, 6
PUSH = np.where(TIMES < 0.6, np.sin(np.pi * TIMES / 0.6), 0.0)
GAP, STOP, HARD = 0.02, 3e4, 40.0
P = jnp.array([GAP, HARD, 1.0, 0.2])
PAIRS = {"weld": rigid_bond("a", "b"), "free": rigid_bond("b", "c")}


class Hardening(AbstractScalarLaw):
    """A cubic spring."""

    stiffness: Array = eqx.field(converter=jnp.asarray)

    def effort(self, x, v, t):
        return -self.stiffness * x**3


def network(EI, modes=6, damper=P[3]):
    """A foot on a spring, and two beams that stand on it side by side, their roots not turning."""
    foot = component(jnp.array([[30.0]]), jnp.array([[0.5]]), (0,), jnp.reshape(damper, (1, 1)))
    beams = {"left": beam(3, EI), "right": beam(3, 1.7)}
    parts = {name: reduce(component(K, M, (0, 1), RISE * K), CraigBampton(modes)) for name, (K, M) in beams.items()}
    bonds = {f"{name} root": rigid_bond((name, [0]), "foot") for name in beams}
    return connect({"foot": foot} | parts, bonds | {f"{name} slope": rigid_bond((name, [1])) for name in beams})


def laws(gap, hard):
    stop = BumpStop(STOP, upper=gap, damping=0.4)
    return [
        CoordinateLaw(stop, {f"left.{TIP}": 1.0, f"right.{TIP}": -1.0}),
        CoordinateLaw(Hardening(hard), {f"left.{TIP}": 1.0}),
    ]


built = eqx.filter_jit(network)


def loads():
    return {"left": PUSH[:, None] * np.eye(8)[TIP]}


@jax.jit
@partial(jax.value_and_grad, has_aux=True)
def run(p):
    """A number of the motion, and the motion with its reactions, and the number's gradient.

    p is gap, hardening, EI of the first beam and the foot's damper.
    """
    net = network(p[2], damper=p[3])
    motion = mbs.simulate(net, ts=TIMES, forces=loads(), laws=laws(p[0], p[1]), rtol=1e-10, atol=1e-13)
    found = mbs.reactions(net, motion)
    return jnp.sum(found["left root"].on_first ** 2), (motion, net.expand(motion.displacement), found)


def by_scipy():
    """Histories of the foot and of what lies above the roots, beam by beam; the force at the first root."""
    K, M, C = np.zeros((13, 13)), np.zeros((13, 13)), np.zeros((13, 13))
    K[0, 0], M[0, 0], C[0, 0] = 30.0, 0.5, 0.2
    places = [np.r_[0, 1:7], np.r_[0, 7:13]]
    parts = [[np.delete(np.delete(np.asarray(A), 1, 0), 1, 1) for A in beam(3, EI)] for EI in (1.0, 1.7)]
    for place, (k, m) in zip(places, parts, strict=True):
        at = np.ix_(place, place)
        K[at], M[at], C[at] = K[at] + k, M[at] + m, C[at] + RISE * k
    row = np.zeros(13)
    row[5], row[11] = 1.0, -1.0

    def accelerated(t, y):
        x, v = y[:13], y[13:]
        depth, rate = row @ x - GAP, row @ v
        push = STOP * max(depth, 0.0) ** 2 * (1 + 0.4 * max(rate, 0.0))
        f = -K @ x - C @ v - push * row
        f[5] += np.interp(t, TIMES, PUSH) - HARD * x[5] ** 3
        return np.linalg.solve(M, f)

    y, kept = np.zeros(26), [np.zeros(26)]
    for span in zip(TIMES[:-1], TIMES[1:], strict=True):
        options = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-12}
        y = scipy.integrate.solve_ivp(lambda t, y: np.r_[y[13:], accelerated(t, y)], span, y, **options).y[:, -1]
        kept.append(y)
    y = np.array(kept)
    a = np.array([accelerated(t, row) for t, row in zip(TIMES, y, strict=True)])
    k, m = parts[0]
    force = [
        k[0] @ x[places[0]] + RISE * k[0] @ v[places[0]] + m[0] @ b[places[0]]
        for x, v, b in zip(y[:, :13], y[:, 13:], a, strict=True)
    ]
    return y[:, :13].T, np.array(force)


@pytest.mark.long
def test_a_gap_and_a_hardening_spring():
    (_, (motion, parts, found)), _ = run(P)
    exact, force = by_scipy()
    efforts = motion.efforts[:, 0]
    assert np.min(efforts) < -0.1 and np.mean(efforts == 0) > 0.2  # both open and shut
    np.testing.assert_allclose(parts["foot"][:, 0], exact[0], atol=1e-7 * np.abs(exact).max())
    np.testing.assert_allclose(parts["left"][:, 2:], exact[1:7].T, atol=1e-7 * np.abs(exact).max())
    np.testing.assert_allclose(parts["right"][:, 2:], exact[7:].T, atol=1e-7 * np.abs(exact).max())
    np.testing.assert_allclose(found["left root"].on_first[:, 0], force, atol=1e-6 * np.abs(force).max())
    assert float(found.residual) < 1e-9 and found.ok and motion.ok


@pytest.mark.long
def test_gradient_against_differences():
    _, slope = run(P)
    for i, h in enumerate((1e-5, 1e-2, 1e-4, 1e-4)):
        step = h * np.eye(4)[i]
        np.testing.assert_allclose(slope[i], (run(P + step)[0][0] - run(P - step)[0][0]) / (2 * h), rtol=2e-4)


@pytest.mark.long
def test_linear_motion_in_modes():
    """Without laws: exact in the modes; a static start stays where the load is constant; a damper couples modes."""
    net = built(1.0, damper=jnp.array(RISE * 30.0))
    found = mbs.simulate(net, ts=TIMES, forces=loads(), solver=ModalSuperposition())
    (_, (exact, _, loads_exact)), _ = run(jnp.array([1e3, 0.0, 1.0, RISE * 30.0]))
    for name in ("displacement", "velocity", "acceleration"):
        a, b = getattr(found, name), getattr(exact, name)
        np.testing.assert_allclose(a, b, atol=1e-7 * np.abs(b).max())
    root, other = (x["left root"].on_first for x in (mbs.reactions(net, found), loads_exact))
    np.testing.assert_allclose(root, other, atol=1e-6 * np.abs(other).max())
    push = {f"left.{TIP}": jnp.full(5, 2.0)}
    still = mbs.simulate(net, ts=0.1 * np.arange(5), forces=push, solver=ModalSuperposition(num=4, static_start=True))
    np.testing.assert_allclose(still.displacement @ net.stiffness, net.load(push), atol=1e-9)
    with pytest.raises(ValueError, match="damping couples the modes"):
        mbs.simulate(built(1.0), ts=TIMES, forces=loads(), solver=ModalSuperposition())


@pytest.mark.long
def test_loads_of_a_motion_damped_by_ratios():
    """They balance; without a component's own damping; what is free accelerates by the bonds' forces alone."""
    ratio = 0.2
    ends = {
        name: LinearSystem(mass=[[m]], stiffness=[[k]], interface=[0]) for name, m, k in (("a", 2, 18), ("b", 1, 9))
    }
    net = connect(ends | {"c": LinearSystem(mass=[[1.0]], stiffness=[[0.0]], interface=[0])}, PAIRS)
    push = np.sin(2.0 * TIMES)
    motion = mbs.simulate(net, ts=TIMES, forces={"a.0": push}, solver=ModalSuperposition(jnp.array(ratio)))
    found = mbs.reactions(net, motion)
    x, v, a = (getattr(motion, name)[:, 0] for name in ("displacement", "velocity", "acceleration"))
    np.testing.assert_allclose(4.0 * a, push - 27.0 * x - 2 * ratio * np.sqrt(27.0 * 4.0) * v, atol=1e-9)
    assert found.ok
    np.testing.assert_allclose(found["free"].on_first[:, 0], -a, atol=1e-9)  # on b: c has no stiffness, so no damping
    damped = net.with_damping(jnp.array([[5.0]]))
    again = mbs.simulate(damped, ts=TIMES, forces={"a.0": push}, solver=ModalSuperposition(ratio))
    np.testing.assert_allclose(again.displacement, motion.displacement)

    def size(EI):
        beams = network(EI)
        answer = mbs.simulate(beams, ts=TIMES, forces=loads(), solver=ModalSuperposition(0.1))
        carried = mbs.reactions(beams, answer)
        return jnp.sum(carried["left root"].on_first ** 2), carried.ok

    (value, ok), slope = jax.jit(jax.value_and_grad(size, has_aux=True))(1.0)
    assert ok
    difference = (size(1.0 + 1e-5)[0] - size(1.0 - 1e-5)[0]) / 2e-5
    np.testing.assert_allclose(slope, difference, rtol=1e-4)


@pytest.mark.long
def test_rest_and_a_start_from_it():
    """A constant force from its rest moves nothing; the bonds carry at rest what they carry in that motion."""
    net, push = built(1.0), {f"left.{TIP}": 2.0, "right": -np.eye(8)[4]}
    rest = mbs.equilibrium(net, push)
    motion = mbs.simulate(net, rest, ts=TIMES[:3], forces=lambda t: push)
    np.testing.assert_allclose(motion.displacement, np.tile(rest.displacement, (3, 1)), atol=1e-12)
    at_rest, moving = mbs.reactions(net, rest), mbs.reactions(net, motion)
    np.testing.assert_allclose(at_rest["left root"].on_first, [-2.0], rtol=1e-9)
    np.testing.assert_allclose(moving["left root"].on_first, np.full((3, 1), -2.0), rtol=1e-6)
    assert at_rest["left root"].force.shape == (3,)  # its coordinates have no directions: zeros
    with pytest.raises(UnknownNameError, match="no bond 'left rot': did you mean 'left root'"):
        at_rest["left rot"]
    with pytest.raises(ModelError, match="a network made by"):
        mbs.reactions(net.components[0], rest)


@pytest.mark.long
def test_a_batch_of_gaps_and_a_load_that_is_a_function():
    """Modes left out and single precision: near the exact motion; with the gap wide open the tips never meet."""
    low = jax.tree.map(lambda a: a.astype(jnp.float32), network(1.0, 4))
    force = lambda t: {f"left.{TIP}": jnp.interp(t, *_low())}
    gaps = jnp.array([GAP, 10.0], jnp.float32)
    motions = jax.vmap(lambda gap: mbs.simulate(low, ts=TIMES, forces=force, laws=laws(gap, jnp.float32(HARD))[:1]))(
        gaps
    )
    assert motions.displacement.dtype == jnp.float32 and np.all(motions.ok)
    assert np.all(motions.efforts[1] == 0)
    (_, (exact, _, _)), _ = run(P.at[1].set(0.0))
    error = np.abs(np.asarray(motions.displacement[0, :, 0]) - np.asarray(exact.displacement[:, 0])).max()
    assert error < 0.02 * np.abs(exact.displacement[:, 0]).max()


def _low():
    return jnp.asarray(TIMES, jnp.float32), jnp.asarray(PUSH, jnp.float32)


@pytest.mark.long
def test_what_does_not_fit_is_told():
    net, law = built(1.0), BumpStop(1.0)
    soft = LinearSystem(mass=np.diag([1.0, 0.0]), stiffness=np.diag([1.0, 0.0]), interface=[0], massless=[1])
    for call, told in (
        (lambda: mbs.simulate(net, ts=TIMES[::-1]), "ts must increase"),
        (lambda: mbs.simulate(net, ts=TIMES, forces={"tail": PUSH}), "no component 'tail'"),
        (lambda: mbs.simulate(net, ts=TIMES, forces=jnp.zeros((41, net.num_rows + 1))), r"not \(\.\.\., "),
        (lambda: mbs.simulate(net, ts=TIMES[:5], forces=loads()), "times first"),
        (
            lambda: mbs.simulate(net, ts=TIMES, forces={"left": loads()["left"].T}),
            r"shape \(8, 41\), not \(\.\.\., 8\)",
        ),
        (
            lambda: mbs.simulate(net, ts=TIMES, laws=[CoordinateLaw(law, {"left.8": 1.0})]),
            "no coordinate or node '8'",
        ),
        (lambda: mbs.simulate(net, ts=TIMES, laws=[CoordinateLaw(law, {"tail.0": 1.0})]), "no component 'tail'"),
        (lambda: mbs.simulate(net, ts=TIMES, gradient="back"), "must be one of reverse"),
        (lambda: CoordinateLaw(law, {}), "at least one coordinate"),
        (lambda: mbs.simulate(soft, ts=TIMES), "1 have neither mass nor stiffness"),
        (lambda: mbs.simulate(net, ts=TIMES, solver=ModalSuperposition()), "from rest under sampled forces"),
    ):
        with pytest.raises(ValueError, match=told):
            call()
    with pytest.raises(
        SimulationError,
        match="maximum number of steps reached; it reached t = .*, by 20 steps of .*; reduce the components further",
    ):
        mbs.simulate(net, ts=TIMES, forces=loads(), max_steps=20)
    assert not mbs.simulate(net, ts=TIMES, forces=loads(), max_steps=20, throw=False).ok
