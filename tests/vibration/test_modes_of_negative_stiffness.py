"""Negative stiffness is an instability, a soft mount no rigid motion: marks, frequencies, reductions, derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.elements import Beam, Quadrilateral
from jaxmbs.fem import Structure, assemble_dense
from jaxmbs.reductions import (
    Characteristic,
    CraigBampton,
    CraigChang,
    Guyan,
    Hurty,
    MacNeal,
    Mixed,
    Rubin,
    reduce,
)
from jaxmbs.vibration import modal_response
from jaxmbs.vibration._damping import modal_damping
from jaxmbs.vibration._modes import natural_modes
from tests.marks import cases
from tests.structural_matrices import beam, chain, component, kw

BUCKLED = jnp.diag(jnp.array([-0.5, 1.0, 2.0]))


@pytest.mark.long
def test_negative_stiffness_is_marked():
    """Such modes have no frequency, in jit and in a batch too; zero between them is rigid."""
    modes = natural_modes(K=BUCKLED, M=jnp.eye(3))
    assert modes.is_unstable.tolist() == [True, False, False] and modes.num_rigid == 0
    np.testing.assert_allclose(modes.omega, [np.nan, 1.0, 2.0**0.5], rtol=1e-14)
    np.testing.assert_array_equal(modes.damping_ratios, [np.nan, 0.0, 0.0])
    np.testing.assert_allclose(modes.values[0], -0.5, rtol=1e-14)
    assert "nan" in repr(modes) and "unstable" in repr(modes)
    batch = jax.jit(jax.vmap(lambda k: natural_modes(K=jnp.diag(k), M=jnp.eye(3))))
    found = batch(jnp.array([[-0.5, 0.0, 2.0], [0.0, 0.0, 1.0], [-1.0, -1.0, 0.0]]))
    assert found.is_unstable.tolist() == [[True, False, False], [False] * 3, [True, True, False]]
    assert found.is_rigid.tolist() == [[False, True, False], [True, True, False], [False, False, True]]
    groups = jax.vmap(lambda m: m.groups)(found)
    assert groups.tolist() == [[0, 1, 2], [0, 0, 1], [0, 0, 1]]
    K, M = chain(6, ends=0)
    modes = natural_modes(K=K - 0.25 * jnp.eye(6), M=M)
    np.testing.assert_allclose(modes.values[0], -0.25, rtol=1e-13)
    assert modes.is_unstable.tolist() == [True] + [False] * 5


@pytest.mark.long
def test_derivatives_of_frequencies():
    """At zero and at repeated values: finite, those of the roots; of a mode without a frequency not a number."""

    def frequencies(k):
        return natural_modes(K=jnp.diag(k), M=jnp.eye(4)).omega

    slopes = jax.jit(jax.jacrev(frequencies))(jnp.array([-4.0, 0.0, 1.0, 1.0]))
    assert np.all(np.isfinite(slopes[1:])) and np.isnan(slopes[0, 0])
    np.testing.assert_allclose(slopes[1], 0.0, atol=1e-14)
    np.testing.assert_allclose(jnp.sum(slopes[2:], axis=0), [0.0, 0.0, 0.5, 0.5], atol=1e-14)
    K, M = beam(3)
    slope = jax.grad(lambda s: jnp.sum(natural_modes(K=s * K, M=M).frequencies))(1.0)
    np.testing.assert_allclose(slope, jnp.sum(natural_modes(K=K, M=M).frequencies) / 2, rtol=1e-8)


def mounted(n, k, mount):
    """A chain of n unit masses on a soft spring to the wall."""
    K, M = chain(n, k, 1.0, ends=0)
    return K.at[0, 0].add(mount), M


@pytest.mark.parametrize("n", [2, 5, *(pytest.param(n, marks=pytest.mark.slow) for n in (30, 100))])
def test_a_soft_mount_of_a_stiff_mesh(n):
    """0.1 Hz under a mesh of 2.2 MHz, the mesh itself carried; the exact value to the rounding of the entries."""
    w = 2 * np.pi * 0.1
    modes = natural_modes(**kw(mounted(n, (np.pi * 2.2e6) ** 2, n * w**2)))
    assert not np.any(modes.is_rigid | modes.is_unstable)
    np.testing.assert_allclose(modes.frequencies[0], 0.1, rtol=0.2)


@pytest.mark.slow
def test_soft_mounts_beside_a_stiff_mesh():
    """Three mounts and a rigid body, coupled to nothing stiff, mixed by the first look: all told apart."""
    k = (np.pi * 2.2e6) ** 2
    stiff, mass = chain(5, k, 1.0, ends=2)
    soft = (2 * np.pi * jnp.array([0.0, 0.1, 0.2, 0.1])) ** 2
    K = jnp.zeros((9, 9)).at[:5, :5].set(stiff).at[5:, 5:].set(jnp.diag(soft))
    turn = np.eye(9)
    turn[5:, 5:] = np.linalg.qr(np.random.default_rng(1).normal(size=(4, 4)))[0]
    modes = natural_modes(K=turn @ K @ turn.T, M=jnp.eye(9))
    assert modes.is_rigid.tolist() == [True] + [False] * 8
    np.testing.assert_allclose(modes.frequencies[:4], [0.0, 0.1, 0.1, 0.2], rtol=1e-12)


def shell(n):
    """A free plate of n by n quadrilaterals, oblique in space and far from the origin."""
    x, y = np.meshgrid(np.linspace(0, 1.0, n + 1), np.linspace(0, 1.3, n + 1), indexing="ij")
    flat = np.stack([x.ravel(), y.ravel(), 0.1 * np.sin(3 * x.ravel())], axis=1)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    i = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]], axis=-1).reshape(-1, 4)
    return Structure(flat @ turn.T + 3.0, {"plate": (Quadrilateral(7e10, 0.3, 1e-3, 2700.0), quads)})


def frame(n):
    """A free ring of n slender beams."""
    angle = 2 * np.pi * np.arange(n) / n
    nodes = np.stack([np.cos(angle), np.sin(angle), 0.2 * np.sin(2 * angle)], axis=1) @ shell_turn()
    tube = Beam(2.1e11, 8e10, 1e-4, 1e-10, 1e-10, 2e-10, 7800.0)
    return Structure(nodes, {"tube": (tube, [(k, (k + 1) % n) for k in range(n)])})


def shell_turn():
    return np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]


@pytest.mark.long
@pytest.mark.parametrize("structure", [shell(3), shell(6), frame(12), frame(60)], ids=["3", "6", "12", "60"])
def test_free_structures_have_six_rigid_motions(structure):
    modes = natural_modes(**kw(assemble_dense(structure)))
    assert modes.num_rigid == 6 and not np.any(modes.is_unstable)


@pytest.mark.slow
@pytest.mark.parametrize("n", [4, 20, 80])
def test_free_beams_in_both_precisions(n):
    K, M = beam(n, EI=3.0, rhoA=0.7)
    for scale in (1.0, 1e-7, 1e9):
        assert natural_modes(K=scale * K, M=M).num_rigid == 2
    if n < 20:
        modes = natural_modes(**kw(jnp.asarray(A, jnp.float32) for A in (K, M)))
        assert modes.num_rigid == 2 and modes.values.dtype == jnp.float32


NEGATIVE = {
    "rubin": lambda K, M: reduce(component(K, M, (0, 1)), Rubin(4)),
    "rubin, number given": lambda K, M: reduce(component(K, M, (0, 1)), Rubin(4, num_rigid=0)),
    "macneal": lambda K, M: reduce(component(K, M, (0, 1)), MacNeal(4)),
    "mixed": lambda K, M: reduce(component(K, M, (0, 1)), Mixed(4, fixed=(1,))),
    "craig_chang": lambda K, M: reduce(component(K, M, (0, 1)), CraigChang(4)),
    "hurty": lambda K, M: reduce(component(K, M, (0, 1)), Hurty(4)),
    "characteristic": lambda K, M: reduce(component(K, M, tuple(range(4, 10))), Characteristic(2)),
    "modal damping": lambda K, M: modal_damping(K=K, M=M, ratios=0.01),
}
TRACED = {
    "rubin": lambda K, M: reduce(component(K, M, (0, 1)), Rubin(4, num_rigid=0)).basis,
    "macneal": lambda K, M: reduce(component(K, M, (0, 1)), MacNeal(4, num_rigid=0)).basis,
    "modal damping": lambda K, M: modal_damping(K=K, M=M, ratios=0.01),
}


@pytest.mark.parametrize("name", cases(NEGATIVE, long=["rubin", "mixed"]))
def test_reductions_refuse_negative_stiffness(name):
    K, M = chain(10, ends=2)
    with pytest.raises(ValueError, match="stiffness is negative"):
        NEGATIVE[name](K.at[7, 7].add(-4.0), M)


@pytest.mark.parametrize("name", TRACED)
def test_negative_stiffness_under_tracing(name):
    K, M = chain(10, ends=2)
    ask = jax.jit(TRACED[name])
    assert np.all(np.isfinite(ask(K, M)))
    assert np.any(np.isnan(ask(K.at[7, 7].add(-4.0), M)))


@pytest.mark.long
def test_motion_of_an_unstable_structure():
    """It grows as the closed form says where its damping is a matrix; ratios mean nothing for it."""
    K, M, load = jnp.diag(jnp.array([-4.0, 9.0])), jnp.eye(2), jnp.ones((41, 2))
    x = modal_response(K=K, M=M, load=load, step=0.05, C=jnp.zeros((2, 2))).displacement
    t = 0.05 * np.arange(41)
    np.testing.assert_allclose(x.T, [(np.cosh(2 * t) - 1) / 4, (1 - np.cos(3 * t)) / 9], rtol=1e-11, atol=1e-14)
    with pytest.raises(ValueError, match="negative stiffness"):
        modal_response(K=K, M=M, load=load, step=0.05, ratios=0.01)


@pytest.mark.long
def test_damping_that_couples_modes_under_tracing():
    """Concrete it is refused; traced it is not a number; within a group of equal frequencies as well."""
    K, M = chain(3)
    load = jnp.ones((5, 3))
    respond = jax.jit(lambda C: modal_response(K=K, M=M, load=load, step=0.1, C=C).displacement)
    assert np.all(np.isfinite(respond(0.1 * K)))
    assert np.any(np.isnan(respond(jnp.diag(jnp.array([0.1, 0.0, 0.0])))))
    with pytest.raises(ValueError, match="couples modes of equal frequency"):
        modal_response(K=jnp.eye(2), M=jnp.eye(2), load=load[:, :2], step=0.1, C=jnp.array([[1.0, 0.5], [0.5, 1.0]]))


@pytest.mark.parametrize("which", ["stiffness", "mass"])
@pytest.mark.parametrize(
    "way",
    [
        lambda K, M: natural_modes(K=K, M=M).values,
        lambda K, M: reduce(component(K, M, (0, 1)), Guyan()).mass,
        lambda K, M: reduce(component(K, M, (0, 1)), CraigBampton(2)).mass,
        lambda K, M: reduce(component(K, M, (0, 1)), Hurty(2, determinate=())).mass,
    ],
    ids=["natural_modes", "guyan", "craig_bampton", "hurty"],
)
def test_unsymmetric_matrices(way, which):
    """Also between coordinates of the interface: refused when concrete, not a number when traced."""
    K, M = chain(6)
    spoilt = (K.at[0, 1].add(0.3), M) if which == "stiffness" else (K, M.at[0, 1].add(0.3))
    with pytest.raises(ValueError, match=f"the {which} is unsymmetric"):
        way(*spoilt)
    assert np.all(np.isfinite(jax.jit(way)(K, M)))
    assert np.any(np.isnan(jax.jit(way)(*spoilt)))


def test_nothing_to_reduce():
    K, M = chain(3)
    for way in (CraigBampton(0), Hurty(0)):
        with pytest.raises(ValueError, match="the interface is the whole component"):
            reduce(component(K, M, (0, 1, 2)), way)
    with pytest.raises(ValueError, match="has no modes: give at least one coordinate"):
        natural_modes(K=jnp.zeros((0, 0)), M=jnp.zeros((0, 0)))
