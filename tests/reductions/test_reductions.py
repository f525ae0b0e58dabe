"""Every reduction of a free beam whose four interface coordinates hold it more than once, and of a fixed chain."""

from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

from jaxmbs.linear import constraint_modes, interface_basis, partition
from jaxmbs.reductions import (
    CraigBampton,
    CraigChang,
    Guyan,
    Hurty,
    MacNeal,
    Mixed,
    Rubin,
    averaged_motion,
    reduce,
    support_motions,
)
from tests.marks import cases
from tests.structural_matrices import beam, chain, component, double_cross

ELEMENTS, N = 8, 18
INTERFACE = (0, 1, 16, 17)
INNER = partition(N, INTERFACE)[0]
DETERMINATE = (0, 16)
LOAD = 0.3 * jnp.eye(4)

#: name: (reduction, whether its frequencies come from above)
REDUCTIONS = {
    "guyan": (Guyan(), True),
    "craig_bampton": (CraigBampton(5), True),
    "hurty": (Hurty(5, determinate=DETERMINATE), True),
    "macneal": (MacNeal(5, num_rigid=2), False),
    "rubin": (Rubin(5, num_rigid=2), True),
    "craig_chang": (CraigChang(3, determinate=DETERMINATE), True),
    "mixed": (Mixed(5, fixed=(16, 17), num_rigid=0), True),
    "mixed_one_rigid": (Mixed(5, fixed=(0,), num_rigid=1), True),
    "loaded": (Mixed(5, load=LOAD, num_rigid=2), True),
}


def by(method, K, M, C=None, interface=INTERFACE):
    return reduce(component(K, M, interface, C), method)


WHOLE = beam(ELEMENTS)
STATIC = reduce(component(*WHOLE, INTERFACE), Guyan()).stiffness


@cache
def reduced_by(name):
    """Of the free beam, damped in proportion."""
    K, M = WHOLE
    return jax.jit(partial(by, REDUCTIONS[name][0]))(K, M, 0.3 * M + 0.02 * K)


def model(t=(1.0, 1.0, 1.0)):
    """Bending stiffness, mass and length."""
    K, M = beam(ELEMENTS, t[0], t[1])
    s = jnp.tile(jnp.stack([jnp.ones_like(jnp.asarray(t[2])), jnp.asarray(t[2])]), ELEMENTS + 1)
    return K * s[:, None] * s[None, :] / t[2] ** 3, M * s[:, None] * s[None, :] * t[2]


def values(K, M):
    """Squared frequencies, by SciPy."""
    return scipy.linalg.eigh(np.asarray(K), np.asarray(M), eigvals_only=True)


def held(A, coordinates):
    keep = np.setdiff1d(np.arange(A.shape[0]), coordinates)
    return np.asarray(A)[np.ix_(keep, keep)]


@pytest.mark.parametrize("name", REDUCTIONS)
def test_statics_mass_and_frequencies(name):
    """Static interface stiffness and rigid-body mass are exact; frequencies come from above, held or free.

    Damping is reduced as mass and stiffness are.
    """
    (K, M), from_above, reduced = WHOLE, REDUCTIONS[name][1], reduced_by(name)
    b = reduced.num_interface
    assert reduced.coordinates[:b] == tuple((str(i), "") for i in INTERFACE) and reduced.interface == tuple(range(b))
    np.testing.assert_allclose(reduced.basis[np.array(INTERFACE)], np.eye(b, reduced.num_rows), atol=1e-10)
    condensed = np.asarray(reduced.stiffness)
    condensed = condensed[:b, :b] - condensed[:b, b:] @ np.linalg.pinv(condensed[b:, b:]) @ condensed[b:, :b]
    np.testing.assert_allclose(condensed, STATIC, rtol=1e-7, atol=1e-6)
    rigid = np.zeros((N, 2))
    rigid[0::2, 0], rigid[0::2, 1], rigid[1::2, 1] = 1.0, np.arange(9) / 8, 1.0
    rho, residual, *_ = np.linalg.lstsq(np.asarray(reduced.basis), rigid, rcond=None)
    np.testing.assert_allclose(reduced.basis @ rho, rigid, atol=1e-8)
    if not reduced.massless:
        np.testing.assert_allclose(rho.T @ reduced.mass @ rho, rigid.T @ np.asarray(M) @ rigid, rtol=1e-8)
        C = 0.3 * reduced.mass + 0.02 * reduced.stiffness
        np.testing.assert_allclose(reduced.damping, C, atol=1e-9 * np.max(np.abs(C)))
    np.testing.assert_allclose(rho.T @ reduced.stiffness @ rho, 0.0, atol=1e-5)
    if from_above:
        for fixed, exact in (((), (K, M)), ((0, 1), (held(K, INTERFACE[:2]), held(M, INTERFACE[:2])))):
            found = values(held(reduced.stiffness, fixed), held(reduced.mass, fixed))
            exact = values(*exact)[: len(found)]
            assert np.all(found > exact - 1e-5 - 1e-9 * exact)
            if len(found) > 4:
                assert found[2] < 1.2 * exact[2]


@pytest.mark.parametrize(
    "name",
    cases(
        [name for name in REDUCTIONS if name not in ("rubin", "mixed", "loaded")],
        long=["macneal", "craig_chang", "mixed_one_rigid"],
        rest=pytest.mark.slow,
    ),
)
def test_gradient_against_differences(name):
    """A response of the interface at one frequency, by stiffness, mass and length; `mixed` once for all its kinds."""
    method = REDUCTIONS[name][0]

    def response(t):
        reduced = by(method, *model(t))
        Z = reduced.stiffness - 900.0 * reduced.mass
        return jnp.linalg.inv(Z)[0, 2] * 1e3

    t, f = jnp.array([1.0, 1.1, 1.2]), jax.jit(jax.value_and_grad(response))
    slope = f(t)[1]
    for i, e in enumerate(1e-4 * np.eye(3)):
        np.testing.assert_allclose(slope[i], (f(t + e)[0] - f(t - e)[0]) / 2e-4, rtol=5e-5, atol=1e-5)


@jax.jit
def whole_bases(K, M):
    return (
        by(CraigBampton(14), K, M),
        by(Rubin(14, num_rigid=2), K, M),
        by(Hurty(14, determinate=DETERMINATE), K, M),
        by(Mixed(5, fixed=INTERFACE, num_rigid=0), K, M),
    )


@pytest.mark.long
def test_whole_bases_are_exact():
    """With all modes each gives back the whole component."""
    for reduced in whole_bases(*WHOLE)[:3]:
        np.testing.assert_allclose(values(reduced.stiffness, reduced.mass), values(*WHOLE), rtol=1e-6, atol=1e-3)


@pytest.mark.long
def test_spaces_that_are_one():
    """Craig and Chang's is Rubin's, Hurty's is Craig and Bampton's, mixed with all fixed too."""
    base = reduced_by("craig_bampton")
    pairs = (
        (reduced_by("rubin"), reduced_by("craig_chang")),
        (base, reduced_by("hurty")),
        (base, whole_bases(*WHOLE)[3]),
    )
    for pair in pairs:
        np.testing.assert_allclose(*(values(r.stiffness, r.mass) for r in pair), rtol=1e-8, atol=1e-4)


def test_craig_bampton_of_a_chain_in_closed_form():
    """S2: the chain fixed at one end, held at the other by the interface; an end mass."""
    n, k, m, end = 9, 3.0, 2.0, 0.7
    K, M = chain(n + 1, k, m, ends=1)
    M = M.at[n, n].set(end)
    reduced, S = jax.jit(lambda K, M: (reduce(component(K, M, (n,)), CraigBampton(n)), constraint_modes(K, (n,))))(
        K, M
    )
    j = np.arange(1, n + 1)
    angle = j * np.pi / (2 * (n + 1))
    np.testing.assert_allclose(S[:, 0], j / (n + 1), rtol=1e-12)
    np.testing.assert_allclose(reduced.stiffness[0, 0], k / (n + 1), rtol=1e-11)
    np.testing.assert_allclose(reduced.mass[0, 0], m * n * (2 * n + 1) / (6 * (n + 1)) + end, rtol=1e-12)
    coupling = np.sqrt(m / (2 * (n + 1))) / np.tan(angle)
    np.testing.assert_allclose(np.abs(reduced.mass[0, 1:]), coupling, rtol=1e-9)
    np.testing.assert_allclose(np.diagonal(reduced.stiffness)[1:], 4 * k / m * np.sin(angle) ** 2, rtol=1e-9)
    np.testing.assert_allclose(reduced.stiffness[0, 1:], 0.0, atol=1e-12)


def test_hurty_connection():
    """Rigid motions cost nothing, and move the redundant bonds as a rigid beam does."""
    phi = Hurty(5, determinate=DETERMINATE).connection(component(*WHOLE, INTERFACE))
    np.testing.assert_allclose(STATIC @ phi[:, :2], 0.0, atol=1e-8)
    expected = [[1, 0, 0, 0], [-1, 1, 1, 0], [0, 1, 0, 0], [-1, 1, 0, 1]]
    np.testing.assert_allclose(phi, expected, atol=1e-10)


def test_motions_of_supports():
    """A rigid beam with one end lifted by 1 and the other held: straight lines."""
    x = np.linspace(0.0, 1.0, ELEMENTS + 1)
    lifted = np.stack([1.0 - x, -np.ones_like(x)], axis=1).reshape(-1), np.stack([x, np.ones_like(x)], 1).reshape(-1)
    found = support_motions(component(*WHOLE, INTERFACE), DETERMINATE)
    np.testing.assert_allclose(found, np.stack(lifted, axis=1), atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("method", [CraigBampton(16), MacNeal(16, num_rigid=0)], ids=["held", "free"])
def test_derivatives_where_modes_repeat(method):
    """The double cross: each mode of its equal arms many-fold, whole groups kept; a spring on one arm parts them."""
    section = jnp.array([0.125**4 / 12 * 200e9, 0.125**2 * 200e9, 0.125**2 * 8000.0])

    def response(t):
        K, M = double_cross(3, *(t[:3] * section))
        reduced = by(method, K.at[12, 12].add(1e7 * t[3]), M, interface=(0, 1, 2))
        flexibility = jnp.linalg.inv(reduced.stiffness - (2 * jnp.pi * 14.0) ** 2 * reduced.mass)
        return 1e9 * flexibility[2, 2] + 1e13 * flexibility[0, 1]  # two modes of one frequency meet in the second

    t, f = jnp.array([1.0, 1.0, 1.0, 0.0]), jax.jit(jax.value_and_grad(response))
    slope = f(t)[1]
    for i, e in enumerate(1e-5 * np.eye(4)):
        np.testing.assert_allclose(slope[i], (f(t + e)[0] - f(t - e)[0]) / 2e-5, rtol=1e-5, atol=1e-5)


def test_coupling_modes_cost_the_interior_nothing():
    K, _ = WHOLE
    T = interface_basis(K, INTERFACE)
    np.testing.assert_allclose((K @ T)[INNER], 0.0, atol=1e-8)


@pytest.mark.long
def test_single_precision_and_batches():
    stiffness = jnp.array([1.0, 2.0], jnp.float32)
    K, M = (a.astype(jnp.float32) for a in model())
    found = jax.jit(jax.vmap(lambda s: reduce(component(s * K, M, INTERFACE), CraigBampton(3)).stiffness))(stiffness)
    assert found.dtype == jnp.float32
    np.testing.assert_allclose(found[1], 2 * found[0], rtol=1e-3, atol=0.05)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda K, M: reduce(component(K, M, (0, 0)), Guyan()), "stands there twice"),
        (lambda K, M: reduce(component(K, M, (0, 99)), CraigBampton(2)), "no coordinate or node 99"),
        (lambda K, M: by(CraigBampton(15), K, M), "must be between 0 and 14"),
        (
            lambda K, M: reduce(component(K, M[:9, :9], INTERFACE), CraigBampton(2)),
            "mass has 9 rows, not 18",
        ),
        (lambda K, M: reduce(component(K, M, (0,)), Guyan()), "singular with the interface fixed"),
        pytest.param(lambda K, M: by(Rubin(1), K, M), "at least 2: all rigid motions", marks=pytest.mark.long),
        (lambda K, M: reduce(component(K, M, (0,)), Hurty(1)), "cannot support all of the 2 rigid motions"),
        (lambda K, M: reduce(component(K, M, (0, 1)), Hurty(1, determinate=(4,))), "4 are not in the interface"),
        (lambda K, M: reduce(component(K, M, (0, 1)), Mixed(3, fixed=(4,))), "4 are not in the interface"),
        (lambda K, M: averaged_motion(jnp.eye(3)[:1] * jnp.arange(4.0)[:, None], jnp.zeros(3)), "lie on one line"),
        (lambda K, M: reduce(component(K.at[4].set(0.0).at[:, 4].set(0.0), M, INTERFACE), Guyan()), "mechanism"),
        (lambda K, M: jax.jit(lambda K: by(Rubin(5), K, M).mass)(K), "give num_rigid"),
    ],
)
def test_bad_input(wrong, said):
    with pytest.raises(ValueError, match=said):
        wrong(*model())
