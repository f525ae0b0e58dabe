"""Joined components against the structure they were cut from: frequencies, reactions, balance, redundancy."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

from jaxmbs.coupling import Components, connect, coupled_response, rigid_bond
from jaxmbs.coupling._primal_assembly import elastic_bond, interface_reactions, join
from jaxmbs.linear import interface_basis
from jaxmbs.reductions import CraigBampton, CraigChang, Guyan, Hurty, MacNeal, Rubin, Unreduced, reduce
from jaxmbs.reductions._recovery import harmonic_amplitudes
from jaxmbs.vibration import modes
from jaxmbs.vibration._modal_equations import modal_motion
from jaxmbs.vibration._modes import natural_modes
from tests.dual_assembly import dual_reactions
from tests.marks import cases
from tests.structural_matrices import beam, chain, component, kw

K, M = beam(8)
WHOLE = beam(16, length=2.0, fixed=2)
ENDS = (0, 1, 16, 17)
CLAMPED = ((-1, -1, 0, 1), (0, 1))


#: The free half by every method, and the tolerance of the frequencies.
KINDS = {
    "craig_bampton": (lambda K, M: reduce(component(K, M, (0, 1)), CraigBampton(8)), 1e-3),
    "hurty": (lambda K, M: reduce(component(K, M, (0, 1)), Hurty(8, determinate=(0, 1))), 1e-3),
    "physical": (lambda K, M: reduce(component(K, M, (0, 1)), Unreduced()), 1e-4),
    "rubin": (lambda K, M: reduce(component(K, M, (0, 1)), Rubin(8, num_rigid=2)), 1e-3),
    "macneal": (lambda K, M: reduce(component(K, M, (0, 1)), MacNeal(8, num_rigid=2)), 1e-2),
    "craig_chang": (lambda K, M: reduce(component(K, M, (0, 1)), CraigChang(6, determinate=(0, 1))), 1e-3),
}


@cache
def coupled():
    """The lowest squared frequencies: the clamped half by Craig and Bampton, the free half by every method."""

    @jax.jit
    def every(K, M):
        left = reduce(component(K, M, ENDS), CraigBampton(10))
        joined = {kind: join((left, right(K, M)), CLAMPED) for kind, (right, _) in KINDS.items()}
        return {kind: modes(assembly, 4, damped=False).values for kind, assembly in joined.items()}

    return every(K, M)


@pytest.mark.parametrize("kind", cases(KINDS, long=["craig_bampton"], rest=pytest.mark.slow))
def test_frequencies_of_the_uncut_beam(kind):
    exact = scipy.linalg.eigh(*(np.asarray(A) for A in WHOLE), eigvals_only=True)[:4]
    np.testing.assert_allclose(coupled()[kind], exact, rtol=KINDS[kind][1])


@pytest.mark.long
def test_massless_joints_are_condensed():
    """Two free halves by MacNeal: the joint has no mass and is condensed exactly."""

    @jax.jit
    def joined(K, M):
        half = reduce(component(K, M, (0, 1)), MacNeal(8, num_rigid=2))
        assembly = join((half, half), ((0, 1), (0, 1)))
        return assembly, modes(assembly, 6, damped=False)

    assembly, found = joined(K, M)
    assert assembly.massless == (0, 1)
    assert found.num_rigid == 2
    T = found.shapes
    np.testing.assert_allclose((assembly.stiffness @ T)[:2], 0.0, atol=1e-5)


def test_blocks_of_the_coupled_equations():
    """One component in physical coordinates, the other in relative ones; what the print has wrong is right here."""

    @jax.jit
    def joined(K, M):
        parts = reduce(component(K, M, (16, 17)), Unreduced()), reduce(component(K, M, (0, 1)), CraigBampton(16))
        return join(parts, ((0, 1), (0, 1))), parts[1], interface_basis(K, (0, 1))

    assembly, P, T = joined(K, M)
    inner, T = np.arange(16), np.asarray(T)
    K_, M_ = np.asarray(K), np.asarray(M)
    np.testing.assert_allclose(assembly.stiffness[:2, :2], K_[16:, 16:] + T.T @ K_ @ T, rtol=1e-9, atol=1e-7)
    np.testing.assert_allclose(assembly.mass[:2, :2], M_[16:, 16:] + T.T @ M_ @ T, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(assembly.stiffness[:2, 2:18], K_[16:, :16], atol=1e-9)  # not zero, as printed in (9)
    np.testing.assert_allclose(assembly.stiffness[:2, 18:], 0.0, atol=1e-7)
    np.testing.assert_allclose(T.T @ K_ @ T, 0.0, atol=1e-7)  # the interface just holds P
    Phi = np.asarray(P.basis)[2:, 2:]
    np.testing.assert_allclose(assembly.mass[:2, 18:], T.T @ M_[:, inner + 2] @ Phi, atol=1e-9)


@pytest.mark.long
def test_blocks_where_both_are_relative():
    """(12), every block by NumPy: the interface's stiffness is the sum of both condensed ones, here not zero."""
    rows, B, P = (14, 15), beam(8, fixed=2), beam(8, EI=0.7)

    @jax.jit
    def joined(B, P):
        clamped, held = component(*B, rows), component(*P, (0, 1, 16))
        parts = reduce(clamped, CraigBampton(14)), reduce(held, CraigBampton(15))
        assembly = join(parts, ((0, 1), (0, 1, -1)))
        loads = [part.generalised_forces(jnp.arange(1.0, part.basis.shape[0] + 1)) for part in parts]
        return assembly, parts, assembly.gather_forces(loads)

    assembly, parts, Q = joined(B, P)

    def relative(K, interface, rho):
        inner = np.setdiff1d(np.arange(len(K)), interface)
        T, I = np.zeros((len(K), len(interface))), np.zeros((len(K), len(inner)))
        T[list(interface)] = np.eye(len(interface))
        T[inner] = -np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, list(interface))])
        I[inner] = np.asarray(rho)[inner, len(interface) :]  # all of the modes: another basis of the interior
        return T, I

    (K_B, M_B), (K_P, M_P) = ((np.asarray(A) for A in pair) for pair in (B, P))
    T_B, I_B = relative(K_B, rows, parts[0].basis)
    T_P, I_P = relative(K_P, (0, 1, 16), parts[1].basis)
    T_P = T_P[:, :2]  # its far end is held
    for found, B_, P_ in ((assembly.stiffness, K_B, K_P), (assembly.mass, M_B, M_P)):
        zero = np.zeros((14, 15))
        expected = np.block(
            [
                [T_B.T @ B_ @ T_B + T_P.T @ P_ @ T_P, T_B.T @ B_ @ I_B, T_P.T @ P_ @ I_P],
                [I_B.T @ B_ @ T_B, I_B.T @ B_ @ I_B, zero],
                [I_P.T @ P_ @ T_P, zero.T, I_P.T @ P_ @ I_P],
            ]
        )
        np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-8 * np.abs(expected).max())
    assert np.min(np.linalg.eigvalsh(assembly.stiffness[:2, :2])) > 1.0
    np.testing.assert_allclose(assembly.stiffness[:2, 2:], 0.0, atol=1e-6)
    F_B, F_P = np.arange(1.0, 17.0), np.arange(1.0, 19.0)
    right = np.concatenate([T_B.T @ F_B + T_P.T @ F_P, I_B.T @ F_B, I_P.T @ F_P])  # the print takes F_P = 0
    np.testing.assert_allclose(Q, right, rtol=1e-8, atol=1e-8)


def exact_reactions(omega, load):
    """Harmonic displacements of the uncut beam, and the section force on the right half at its left end."""
    K_, M_ = (np.asarray(A) for A in WHOLE)
    x = np.linalg.solve(K_ * (1 + 0.02j) - omega**2 * M_, load)
    right = x[14:]
    return (np.asarray(K) * (1 + 0.02j) - omega**2 * np.asarray(M))[:2] @ right


@pytest.mark.long
def test_reactions_primal_dual_and_exact():
    """Harmonic section forces in the middle of the clamped beam, its tip loaded; all modes kept."""
    omega, tip = 20.0, jnp.zeros(18).at[16].set(1.0)
    damping = 0.02 * K / omega
    load = np.zeros(32)
    load[30] = 1.0
    exact = exact_reactions(omega, load)

    @jax.jit
    def every(K, M):
        left, right = (
            reduce(component(K, M, ENDS, damping), CraigBampton(14)),
            reduce(component(K, M, (0, 1), damping), CraigBampton(16)),
        )
        assembly, shares = join((left, right), CLAMPED), (None, right.basis.T @ tip)
        Z = jax.lax.complex(assembly.stiffness - omega**2 * assembly.mass, omega * assembly.damping)
        xi = jnp.linalg.solve(Z, assembly.gather_forces(shares).astype(Z.dtype))
        x, v, a = (y[0] for y in harmonic_amplitudes(xi[None], jnp.array([omega])))
        parts, loads = (left, right), (None, tip)
        duals = [dual_reactions(parts, CLAMPED, loads, w) for w in (jnp.asarray(omega), None)]
        return interface_reactions(assembly, x, a, v, shares), *duals

    found, dual, statics = every(K, M)
    np.testing.assert_allclose(found.forces[1], exact, rtol=1e-8)
    np.testing.assert_allclose(found.forces[0][2:], -exact, rtol=1e-8)
    assert found.residual < 1e-9
    for one, other in zip(found.forces, dual, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(statics[0], [-1.0, -2.0, 1.0, 1.0], rtol=1e-7, atol=1e-7)


@pytest.mark.long
def test_section_forces_over_time():
    """Tip pushed by a ramp that ends, no damping: six modes in each half against all modes of the uncut beam."""
    times = jnp.linspace(0.0, 2.0, 81)
    tip = jnp.zeros((18, 81)).at[16].set(jnp.minimum(times, 1.0))
    left, right = reduce(component(K, M, ENDS), CraigBampton(6)), reduce(component(K, M, (0, 1)), CraigBampton(6))

    def moved(own, load):
        q = modal_motion(own.omega, 0.0, (own.shapes.T @ load).T, times[1])
        return own.shapes @ q.displacement.T, own.shapes @ q.acceleration.T

    @jax.jit
    def both():
        x, a = moved(natural_modes(**kw(WHOLE)), jnp.zeros((32, 81)).at[14:].set(tip))
        assembly, shares = join((left, right), CLAMPED), (None, right.basis.T @ tip)
        xi, xi_ddot = moved(modes(assembly, damped=False), assembly.gather_forces(shares))
        found = interface_reactions(assembly, xi, xi_ddot, None, shares)
        return found.forces[1], (K @ x[14:] + M @ a[14:] - tip)[:2]

    found, exact = both()
    np.testing.assert_allclose(found, exact, atol=5e-3 * np.max(np.abs(exact)))


@pytest.mark.long
def test_reactions_by_the_block_sparse_engine():
    """A frame of five beams with a loop and a bushing, harmonic: reactions are those of the dual assembly."""
    ends = ((-1, 0), (0, 1), (1, 2), (2, 3), (0, 3))
    omega = jnp.asarray(9.0)
    bond = elastic_bond(jnp.array([3.0, 0.2]), jnp.array([0.1, 0.01]), jnp.array([0.2, 0.01]))
    forces = [None, jnp.zeros(18).at[8].set(1.0), None, jnp.zeros(18).at[12].set(2.0), None]
    joints = [[2 * n + k if n >= 0 else -1 for n in pair for k in range(2)] for pair in (*ends, (1, 3))]

    @jax.jit
    def both(K, M):
        parts = [reduce(component((1.0 + 0.1 * i) * K, M, ENDS, 0.001 * K), CraigBampton(3)) for i in range(5)]
        groups = [Components.of(parts, ends, forces, omega), Components.of([bond], [(1, 3)], [None], omega)]
        found = coupled_response(groups, jnp.zeros((4, 2)), "ldl")
        return found, dual_reactions([*parts, bond], joints, [*forces, None], omega)

    found, dual = both(K, M)
    reactions = np.concatenate([np.asarray(r).reshape(-1, 4) for r in found.reactions])
    np.testing.assert_allclose(reactions, np.stack(dual), rtol=1e-8, atol=1e-9)
    assert found.residual < 1e-9


@pytest.mark.slow
def test_elastic_bonds_with_mass():
    """A chain cut at a spring, the spring put back as a bond: the whole chain's frequencies; mass adds up."""
    left, right = (
        reduce(component(*chain(4, 2.0, 1.0, 1), (3,)), Unreduced()),
        reduce(component(*chain(3, 2.0, 1.0, 0), (0,)), Unreduced()),
    )
    spring = elastic_bond(jnp.array([[2.0]]), jnp.array([[0.1]]))
    assembly = join((left, right, spring), ((0,), (1,), (0, 1)))
    exact = scipy.linalg.eigh(*(np.asarray(A) for A in chain(7, 2.0, 1.0, 1)), eigvals_only=True)
    np.testing.assert_allclose(modes(assembly, damped=False).values, exact, rtol=1e-9)
    np.testing.assert_allclose(assembly.damping[:2, :2], [[0.1, -0.1], [-0.1, 0.1]], rtol=1e-12)
    heavy = elastic_bond(jnp.array([[2.0]]), mass=jnp.array([[0.6]]))
    np.testing.assert_allclose(jnp.sum(join((heavy,), ((0, 1),)).mass), 0.6, rtol=1e-12)


def determinacy(parts, **bonds):
    return connect(parts, bonds).determinacy()


@pytest.mark.slow
def test_redundant_bonds_are_counted_and_named():
    """Clamped, propped beam with a free one welded to its end: what holds the free one is determinate."""
    whole, end = (reduce(component(K, M, at), Guyan()) for at in (ENDS, (0, 1)))
    wall, weld = rigid_bond(("a", (0, 1))), rigid_bond(("a", (2, 3)), ("b", (0, 1)))
    held = {"prop": rigid_bond(("a", 2)), "slope": rigid_bond(("a", 3), ("b", 1)), "stay": rigid_bond(("b", 0))}
    report = determinacy({"a": whole, "b": end}, wall=wall, **held)
    assert report.redundant == 1
    assert report.determinate == {"wall": (False, False), "prop": (False,), "slope": (True,), "stay": (True,)}
    report = determinacy({"a": whole, "b": end}, wall=wall, weld=weld)
    assert report.redundant == 0 and all(all(flags) for flags in report.determinate.values())
    parts = {"a": whole, "c": whole, "b": end}
    both = {"wall": wall, "other": rigid_bond(("c", (0, 1))), "between": rigid_bond(("a", (2, 3)), ("c", (2, 3)))}
    report = determinacy(parts, weld=weld, **both)
    assert report.redundant == 2 and all(report.determinate["weld"])
    assert not any(any(report.determinate[name]) for name in both)
    fine = {"a": reduce(component(*beam(40), range(0, 82, 2)), Guyan())}  # slender between its ends, yet no mechanism
    assert determinacy(fine, pin=rigid_bond(("a", 0))).redundant == 0
    assert determinacy(fine, pins=rigid_bond("a")).redundant == 39


@pytest.mark.long
def test_gradient_of_a_reaction():
    """Static section force of a propped beam by the stiffness of its halves, a batch, against differences."""

    def force(t):
        left, right = (
            reduce(component(t[0] * K, M, ENDS), CraigBampton(2)),
            reduce(component(t[1] * K, M, ENDS), CraigBampton(2)),
        )
        load = jnp.zeros(18).at[8].set(1.0)
        joints, shares = ((-1, -1, 0, 1), (0, 1, -1, 2)), (left.basis.T @ load, None)
        assembly = join((left, right), joints)
        xi = jnp.linalg.solve(assembly.stiffness, assembly.gather_forces(shares))
        forces = interface_reactions(assembly, xi, None, shares=shares).forces
        return forces[1][2]

    t = np.array([1.0, 1.4])
    steps = 1e-5 * np.array([[0.0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    value, slope = jax.jit(jax.vmap(jax.value_and_grad(force)))(jnp.asarray(t + steps))
    np.testing.assert_allclose(slope[0], (value[1::2] - value[2::2]) / 2e-5, rtol=1e-6)


@pytest.mark.parametrize(
    ("joints", "said"),
    [
        ((CLAMPED[0],), "2 components, but joints of 1"),
        (((-1, -1, 0), (0, 1)), "component 0 has 4 interface coordinates, its joints are 3"),
        (((-1, -1, 0, 5), (0, 5)), r"numbered 0, 1, 2, \.\.\., not \[0, 5\]"),
    ],
)
def test_bad_input(joints, said):
    with pytest.raises(ValueError, match=said):
        join((reduce(component(K, M, ENDS), Guyan()), reduce(component(K, M, (0, 1)), Guyan())), joints)
