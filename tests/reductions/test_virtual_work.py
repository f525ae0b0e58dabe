"""Virtual work of bonds and loads against what inertia and elasticity take, by NumPy; closed forms of a beam."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.coupling import connect, rigid_bond
from jaxmbs.reductions import Hurty, reduce, virtual_work
from tests.structural_matrices import beam, component

N, BONDS, METHOD = 14, (12, 0, 1, 13), Hurty(3, determinate=(0, 12))  # both ends, in an order of their own
K, M = map(np.asarray, beam(6))
BEAM = component(jnp.asarray(K), jnp.asarray(M), BONDS)
MOTIONS, BEAM_REDUCED = jax.jit(lambda beam: (METHOD.motions(beam), reduce(beam, METHOD)))(BEAM)


def moving(seed=0):
    """A motion, loads at the bonds and all over, and what the bonds then have to give by Newton's law."""
    random = np.random.default_rng(seed)
    x, a, load = random.normal(size=(3, N))
    needed = K @ x + M @ a
    load = np.where(np.isin(np.arange(N), BONDS), load, needed)
    return needed, (needed - load)[list(BONDS)], load


@jax.jit
def works(displacement, R, f):
    return (
        virtual_work(BEAM, displacement, R, f),
        virtual_work(BEAM, displacement, R),
        virtual_work(BEAM, displacement),
    )


def test_work_of_bonds_and_loads_is_what_inertia_and_stiffness_take():
    """S1 (13) along three displacements at once, each part of it alone by NumPy too."""
    needed, R, f = moving()
    u = np.random.default_rng(1).normal(size=(3, N))
    both, bonds, none = works(u, R, f)
    np.testing.assert_allclose(both, u @ needed, rtol=1e-10)
    np.testing.assert_allclose(bonds, u[:, BONDS] @ R, rtol=1e-12)
    np.testing.assert_array_equal(none, np.zeros(3))
    by_name = virtual_work(BEAM, jnp.asarray(u[0]), forces={"12": 2.0, "5": -3.0})
    np.testing.assert_allclose(by_name, 2 * u[0, 12] - 3 * u[0, 5], rtol=1e-12)
    with pytest.raises(ValueError, match=r"reactions have shape \(3,\)"):
        virtual_work(BEAM, jnp.asarray(u), jnp.ones(3))


def test_work_of_elastic_forces_is_the_change_of_their_energy():
    """At rest the bonds and loads do the work that the strain energy takes up, by differences of it."""
    random = np.random.default_rng(2)
    x, u = random.normal(size=(2, N))
    f = np.where(np.isin(np.arange(N), BONDS), 0.7, K @ x)

    def energy(s):
        return (x + s * u) @ K @ (x + s * u) / 2

    found = works(u, (K @ x - f)[list(BONDS)], f)[0]
    np.testing.assert_allclose(found, (energy(1e-4) - energy(-1e-4)) / 2e-4, rtol=1e-7)


def test_generalised_forces_do_the_same_work():
    """`dW = sum P d rho` (15)-(16) along rigid, constraint and normal motions; P by the shapes that statics gives."""
    needed, R, f = moving()
    rho = np.random.default_rng(3).normal(size=7)
    P = np.asarray(MOTIONS.generalised_forces(R, f))
    np.testing.assert_allclose(P @ rho, works(MOTIONS.shapes @ rho, R, f)[0], rtol=1e-10)
    along = np.arange(7) / 6
    rigid_motions = np.zeros((N, 2))
    rigid_motions[0::2] = np.stack([1 - along, along], axis=1)
    rigid_motions[1::2] = [-1.0, 1.0]
    np.testing.assert_allclose(MOTIONS.shapes[:, :2], rigid_motions, atol=1e-10)
    assert MOTIONS.counts == (2, 2, 3)
    np.testing.assert_allclose(P[:2], rigid_motions.T @ needed, rtol=1e-9)
    inner = np.setdiff1d(np.arange(N), BONDS)
    turned = np.zeros((N, 2))
    turned[[1, 13], [0, 1]] = 1.0
    turned[inner] = -np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, [1, 13])])
    np.testing.assert_allclose(P[2:4], turned.T @ needed, rtol=1e-8)
    np.testing.assert_allclose(P[4:], (np.asarray(MOTIONS.shapes[:, 4:]).T @ f), rtol=1e-9)


def test_which_bonds_work_along_which_motions():
    """`phi~` (14), (20): the normal motions move no bond, the constraint motions no determinate one."""
    rho = np.random.default_rng(4).normal(size=(2, 7))
    u = MOTIONS.bond_displacements(jnp.asarray(rho))
    phi = np.zeros((4, 7))  # bonds in the order w1, w0, slope 0, slope 1
    phi[0, 1] = phi[1, 0] = phi[2, 2] = phi[3, 3] = 1.0
    phi[2:, :2] = [-1.0, 1.0]
    np.testing.assert_allclose(u, rho @ phi.T, atol=1e-10)
    np.testing.assert_allclose(
        MOTIONS.generalised_forces(np.array([1.0, 2.0, 3.0, 4.0])), phi.T @ [1.0, 2, 3, 4], atol=1e-10
    )


def test_a_beam_on_two_supports_under_its_weight():
    """`F^R = q L / 2` at either support, the reactions its opposite, so that `P^R` vanishes at rest."""
    q, h = -3.0, 1 / 6
    weight = np.zeros(N)
    for e in range(6):
        weight[2 * e : 2 * e + 4] += q * h * np.array([1 / 2, h / 12, 1 / 2, -h / 12])
    np.testing.assert_allclose(MOTIONS.generalised_forces(forces=weight)[:2], [q / 2, q / 2], rtol=1e-9)
    R = np.array([-q / 2, -q / 2, 0.0, 0.0])
    np.testing.assert_allclose(MOTIONS.generalised_forces(R, weight)[:2], 0.0, atol=1e-9)
    np.testing.assert_allclose(
        MOTIONS.generalised_forces(R, weight)[2:4], [q / 12, -q / 12], rtol=1e-8
    )  # clamped ends' moments


@pytest.mark.long
def test_bonds_of_a_network_do_no_work_together():
    """S1 (25): what the weld takes from one component it gives to the other, along any motion that keeps it whole."""
    clamped = component(*beam(6, fixed=2), (10, 11))
    free = component(jnp.asarray(K), jnp.asarray(M), (0, 1))
    net = connect({"a": clamped, "b": free}, {"weld": rigid_bond("a", "b")})
    weld = mbs.reactions(net, mbs.equilibrium(net, {"b.12": 2.0}))["weld"]
    np.testing.assert_allclose(weld.on_first, [2.0, 2.0], rtol=1e-7)  # the tip load and its moment
    moved = net.expand(jnp.asarray(np.random.default_rng(5).normal(size=net.num_rows)))
    works = virtual_work(clamped, moved["a"], weld.on_first), virtual_work(free, moved["b"], weld.on_second)
    assert abs(works[0]) > 0.1
    np.testing.assert_allclose(sum(works), 0.0, atol=1e-8)


@pytest.mark.long
def test_whole_numbers_and_single_precision():
    """Loads and coordinates in whole numbers are numbers like others; single precision stays single."""
    ones = np.ones(N, int)
    for f in (BEAM_REDUCED.expand, MOTIONS.bond_displacements):
        np.testing.assert_allclose(f(np.arange(7)), f(np.arange(7.0)), rtol=1e-12)
    for f in (BEAM_REDUCED.generalised_forces, lambda load: MOTIONS.generalised_forces(forces=load)):
        np.testing.assert_allclose(f(ones), f(1.0 * ones), rtol=1e-12)
    np.testing.assert_allclose(virtual_work(BEAM, ones, ones[:4], 2 * ones), 4 + 28)
    low = MOTIONS.generalised_forces(np.ones(4, np.float32), np.ones(N, np.float32))
    assert low.dtype == np.float32
    np.testing.assert_allclose(low, MOTIONS.generalised_forces(np.ones(4), np.ones(N)), rtol=1e-4, atol=1e-4)
    both = MOTIONS.generalised_forces(np.ones((3, 4)), 1j * np.ones(N))
    apart = (np.asarray(MOTIONS.generalised_forces(a, b)) for a, b in ((np.ones(4), 0.0), (0.0, np.ones(N))))
    np.testing.assert_allclose(both[2], next(apart) + 1j * next(apart), rtol=1e-12)


@pytest.mark.long
def test_gradient_and_batches():
    """Generalised forces by the stiffness of one half, against differences, for two loads at once."""
    _, R, f = moving()

    def forces(t):
        stiff = jnp.asarray(K).at[:6, :6].multiply(t)
        made = METHOD.motions(component(stiff, jnp.asarray(M), BONDS))
        P = jax.vmap(made.generalised_forces)(jnp.stack([R, 2 * R]), jnp.stack([f, f]))
        return P[:, :4]  # normal shapes have any sign

    value, slope = (jax.jit(g)(1.0) for g in (forces, jax.jacfwd(forces)))
    np.testing.assert_allclose(value[0], MOTIONS.generalised_forces(R, f)[:4], rtol=1e-8)
    step = 1e-5
    plus, minus = (jax.jit(forces)(1.0 + s) for s in (step, -step))
    np.testing.assert_allclose(slope, (plus - minus) / (2 * step), rtol=1e-5, atol=1e-6)
