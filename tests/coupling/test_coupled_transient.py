"""Two beams on a foot, a gap between their tips and a hardening spring, against SciPy on the whole structure."""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.integrate
from jaxtyping import Array

from jaxmbs.coupling import Link, connect, elastic_bond, join, modal_transient, rigid, transient
from jaxmbs.coupling.transient import by_number
from jaxmbs.errors import SimulationError
from jaxmbs.forces import AbstractScalarLaw, BumpStop
from jaxmbs.reductions import CraigBampton, reduce
from tests.structural_matrices import beam, component

TIMES = np.linspace(0.0, 2.0, 41)
RISE, TIP = 1e-3, 6
PUSH = np.where(TIMES < 0.6, np.sin(np.pi * TIMES / 0.6), 0.0)
GAP, STOP, HARD = 0.02, 3e4, 40.0
P = jnp.array([GAP, HARD, 1.0, 0.2])


class Hardening(AbstractScalarLaw):
    """A cubic spring."""

    stiffness: Array = eqx.field(converter=jnp.asarray)

    def effort(self, x, v, t):
        return -self.stiffness * x**3


def joined(EI, modes=6, damper=P[3]):
    """A foot on a spring, and two beams that stand on it side by side, their roots not turning."""
    foot = component(jnp.array([[30.0]]), jnp.array([[0.5]]), (0,), jnp.reshape(damper, (1, 1)))
    first, second = beam(3, EI), beam(3, 1.7)
    beams = [reduce(component(K, M, (0, 1), RISE * K), CraigBampton(modes)) for K, M in (first, second)]
    return join((foot, *beams), ((0,), (0, -1), (0, -1)))


def links(gap, hard):
    stop = BumpStop(STOP, upper=gap, damping=0.4)
    return [Link(stop, {(1, TIP): 1.0, (2, TIP): -1.0}), Link(Hardening(hard), {(1, TIP): 1.0})]


def loads():
    return None, jnp.zeros((8, 41)).at[TIP].set(PUSH), None


@jax.jit
@partial(jax.value_and_grad, has_aux=True)
def run(p):
    """A number of the motion, and the motion with its reactions, and the number's gradient.

    p is gap, hardening, EI of the first beam and the foot's damper.
    """
    assembly = joined(p[2], damper=p[3])
    motion = transient(assembly, TIMES, loads(), links(p[0], p[1]), rtol=1e-10, atol=1e-13)
    reactions = motion.reactions(assembly)
    return jnp.sum(reactions.forces[1][0] ** 2), (motion, assembly.expand(motion.displacement), reactions)


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


def test_a_gap_and_a_hardening_spring():
    (_, (motion, parts, reactions)), _ = run(P)
    exact, force = by_scipy()
    assert np.min(motion.efforts[0]) < -0.1 and np.mean(motion.efforts[0] == 0) > 0.2  # both open and shut
    np.testing.assert_allclose(parts[0][0], exact[0], atol=1e-7 * np.abs(exact).max())
    np.testing.assert_allclose(parts[1][2:], exact[1:7], atol=1e-7 * np.abs(exact).max())
    np.testing.assert_allclose(parts[2][2:], exact[7:], atol=1e-7 * np.abs(exact).max())
    np.testing.assert_allclose(reactions.forces[1][0], force, atol=1e-6 * np.abs(force).max())
    assert float(reactions.residual) < 1e-9


def test_gradient_against_differences():
    _, slope = run(P)
    for i, h in enumerate((1e-5, 1e-2, 1e-4, 1e-4)):
        step = h * np.eye(4)[i]
        np.testing.assert_allclose(slope[i], (run(P + step)[0][0] - run(P - step)[0][0]) / (2 * h), rtol=2e-4)


def test_linear_motion_in_modes():
    """Without links: exact in the modes; a static start stays where the load is constant; a damper couples modes."""
    assembly = joined(1.0, damper=jnp.array(RISE * 30.0))
    found = modal_transient(assembly, TIMES[1], loads())
    (_, (exact, _, _)), _ = run(jnp.array([1e3, 0.0, 1.0, RISE * 30.0]))
    for name in ("displacement", "velocity", "acceleration"):
        a, b = getattr(found, name), getattr(exact, name)
        np.testing.assert_allclose(a, b, atol=1e-7 * np.abs(b).max())
    still = modal_transient(assembly, 0.1, (None, jnp.zeros((8, 5)).at[TIP].set(2.0), None), num=4, static_start=True)
    np.testing.assert_allclose(assembly.stiffness @ still.displacement, assembly.load(still.forces), atol=1e-9)
    with pytest.raises(ValueError, match="damping couples the modes"):
        modal_transient(joined(1.0), 0.1, loads())


def test_components_by_name():
    """A network's motion is that of the assembly, its bonds' forces come by name; strangers are told."""
    assembly = joined(1.0, damper=jnp.array(RISE * 30.0))
    names = ("foot", "left", "right")
    bonds = {f"{n} root": rigid((n, [0]), "foot") for n in names[1:]} | {
        f"{n} slope": rigid((n, [1])) for n in names[1:]
    }
    network = connect(dict(zip(names, assembly.components, strict=True)), bonds)
    found = modal_transient(network, TIMES[1], {"left": loads()[1]}).reactions(network)
    exact = modal_transient(assembly, TIMES[1], loads()).reactions(assembly).forces[1]
    np.testing.assert_allclose(found.on_first["left root"][0], exact[0], atol=1e-9 * np.abs(exact).max())
    stop = Link(BumpStop(STOP), {("left", TIP): 1.0, ("right", TIP): -1.0})
    _, forces, (link,) = by_number(network, lambda t: {"right": t}, [stop])
    assert link.places == ((1, TIP), (2, TIP)) and forces(2.0) == [None, None, 2.0]
    np.testing.assert_array_equal(link.coefficients, [1.0, -1.0])
    for forces, others in (({"tail": loads()[1]}, []), (None, [Link(stop.law, {("tail", 0): 1.0})])):
        with pytest.raises(ValueError, match="links on tail: the components are foot, left, right"):
            transient(network, TIMES, forces, others)


@pytest.mark.long
def test_a_batch_of_gaps_and_a_load_that_is_a_function():
    """Modes left out and single precision: near the exact motion; with the gap wide open the tips never meet."""
    low = jax.tree.map(lambda a: a.astype(jnp.float32), joined(1.0, 4))
    force = lambda t: (None, jnp.zeros(8, t.dtype).at[TIP].set(jnp.interp(t, *_low())), None)  # noqa: E731
    gaps = jnp.array([GAP, 10.0], jnp.float32)
    motions = jax.vmap(lambda gap: transient(low, TIMES, force, links(gap, jnp.float32(HARD))[:1]))(gaps)
    assert motions.displacement.dtype == jnp.float32 and np.all(motions.ok)
    assert np.all(motions.efforts[1] == 0)
    (_, (exact, _, _)), _ = run(P.at[1].set(0.0))
    error = np.abs(np.asarray(motions.displacement[0][0]) - np.asarray(exact.displacement[0])).max()
    assert error < 0.02 * np.abs(exact.displacement[0]).max()


def _low():
    return jnp.asarray(TIMES, jnp.float32), jnp.asarray(PUSH, jnp.float32)


def test_what_does_not_fit_is_told():
    assembly, law = joined(1.0), BumpStop(1.0)
    bond = join((elastic_bond(jnp.eye(1)),), ((0, 1),))
    for call, told in (
        (lambda: transient(assembly, TIMES[::-1]), "times must increase"),
        (lambda: transient(assembly, TIMES, loads()[:2]), "3 components, but forces on 2"),
        (lambda: transient(assembly, TIMES[:5], loads()), r"shape \(8, 41\), not \(8, 5\)"),
        (lambda: transient(assembly, TIMES, links=[Link(law, {(1, 8): 1.0})]), "coordinate 8 of component 1"),
        (lambda: transient(assembly, TIMES, gradient="back"), "must be one of reverse"),
        (lambda: Link(law, {}), "at least one coordinate"),
        (lambda: transient(bond, TIMES), "no mass on joint 0, joint 1"),
    ):
        with pytest.raises(ValueError, match=told):
            call()
    with pytest.raises(ValueError, match="3 components, but forces on 2"):
        modal_transient(assembly, 0.1, loads()[:2])
    with pytest.raises(SimulationError, match="no end after 20 steps"):
        transient(assembly, TIMES, loads(), max_steps=20)
