"""Direct frequency response of a chain of masses: closed forms, dense solves, gradients, chunks."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import blocksparse as bs
from jaxmbs.linear import LinearSystem
from jaxmbs.reductions import CraigBampton, reduce
from jaxmbs.vibration import dense_response, direct_response, frequency_response, receptance
from tests.structural_matrices import beam

N = 30
PATTERN = bs.Pattern(N, 1, [(i, i + 1) for i in range(N - 1)])


def chain(k, m=1.0):
    """Stiffness and mass of N masses in a row between springs k (N,), the first one to a wall."""
    diagonal = k + jnp.append(k[1:], 0.0)
    K = bs.BlockMatrix(PATTERN, diagonal[:, None, None], -k[1:, None, None])
    M = bs.BlockMatrix(PATTERN, m * jnp.ones((N, 1, 1)), jnp.zeros((N - 1, 1, 1)))
    return K, M


@pytest.fixture(scope="module")
def response():
    K, M = chain(jnp.full(N, 40.0))
    load = jnp.zeros((N, 1)).at[-1].set(1.0)
    omega = jnp.linspace(0.05, 14.0, 37)
    solve = jax.jit(
        lambda K, M, chunk: direct_response(K=K, C=0.01 * K, M=M, load=load, omega=omega, chunk=chunk),
        static_argnums=2,
    )
    return K, M, np.asarray(load), omega, solve


@pytest.mark.long
@pytest.mark.parametrize("chunk", [5, 37])
def test_every_frequency_against_a_dense_solve(response, chunk):
    K, M, load, omega, solve = response
    x = solve(K, M, chunk)
    k, m = np.asarray(K.to_dense()), np.asarray(M.to_dense())
    for i in (0, 11, 36):
        w = float(omega[i])
        np.testing.assert_allclose(x[i, :, 0], np.linalg.solve(k * (1 + 0.01j * w) - w**2 * m, load[:, 0]), rtol=1e-9)


@pytest.mark.long
def test_tip_receptance_in_closed_form():
    """A chain driven at its free end: sin and cosine of the phase per cell, `w = 2 sqrt(k/m) sin(theta/2)`."""
    K, M = chain(jnp.full(N, 40.0))
    theta = np.array([0.03, 0.4, 1.7])
    omega = 2 * np.sqrt(40.0) * np.sin(theta / 2)
    load = jnp.zeros((N, 1)).at[-1].set(1.0)
    tip = jax.jit(lambda K, M: direct_response(K=K, C=None, M=M, load=load, omega=omega, select=lambda x: x[-1, 0]))(
        K, M
    )
    exact = np.sin(N * theta) / (2 * 40.0 * np.sin(theta / 2) * np.cos((N + 0.5) * theta))
    np.testing.assert_allclose(tip, exact, rtol=1e-10)


@pytest.mark.long
def test_gradient_of_a_response():
    """Sum of squared tip amplitudes by every spring, against differences; structural damping."""
    load = jnp.zeros((N, 1)).at[-1].set(1.0)
    omega = jnp.linspace(0.3, 2.0, 7)

    @jax.jit
    def level(k):
        K, M = chain(k)
        tip = direct_response(
            K=K.astype(complex) * (1 + 0.05j), C=None, M=M, load=load, omega=omega, select=lambda x: x[-1, 0], chunk=3
        )
        return jnp.sum(jnp.abs(tip) ** 2)

    k = jnp.linspace(30.0, 50.0, N)
    slope = jax.jit(jax.grad(level))(k)
    for i in (0, 13, 29):
        step = 1e-3 * np.eye(N)[i]
        np.testing.assert_allclose(
            slope[i], (level(k + step) - level(k - step)) / 2e-3, atol=2e-6 * np.abs(slope).max()
        )


@eqx.filter_jit
def wing():
    """A free beam of five elements, damped at its tip only."""
    K, M = beam(5)
    labels = [(f"n{k}", d) for k in range(6) for d in ("z", "ry")]
    return LinearSystem(
        mass=M, stiffness=K, damping=jnp.zeros_like(K).at[10, 10].set(0.3), interface=["n0"], coordinates=labels
    )


@pytest.mark.long
def test_transfer_functions_of_components():
    """From a substructure and from it reduced (all modes): the inverse of the dynamic stiffness, channels by name."""
    component, omega = wing(), jnp.array([0.7, 4.0, 21.0])
    K, M, C = (np.asarray(A) for A in (component.stiffness, component.mass, component.damping))
    exact = np.stack([np.linalg.inv(K * (1 + 0.02j) + 1j * w * C - w**2 * M) for w in np.asarray(omega)])
    reduced = reduce(component, CraigBampton(10))
    asked = (["n0", "n5 z"], ["n5 z", ("n2", "ry")])
    for found in (
        frequency_response(component, omega, *asked, loss=0.02),
        frequency_response(reduced, omega, *asked, loss=0.02),
    ):
        assert (found.outputs, found.inputs) == (("n5 z", "n2 ry"), ("n0 z", "n0 ry", "n5 z"))
        np.testing.assert_allclose(found.values, exact[:, [10, 5]][:, :, [0, 1, 10]], rtol=1e-7, atol=1e-12)
    plain = LinearSystem(mass=component.mass, stiffness=component.stiffness, coordinates=component.coordinates)
    direct, modal = (frequency_response(plain, omega, *asked, method=m) for m in ("direct", "modal"))
    np.testing.assert_allclose(modal.values, direct.values, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(
        frequency_response(reduced, omega[:1], ["n0 z"], ["n5 z"]).values[0, 0, 0], exact_undamped(K, M, C)
    )
    for call, told in (
        (lambda: frequency_response(component, omega, ["n0 z"], ["n9 z"]), "n9 z"),
        (lambda: frequency_response(reduced, omega, ["n0 z"], ["n5 y"]), "no coordinate or node 'n5 y'"),
        (lambda: frequency_response(component, omega, ["n5 z"], ["n0 z"], method="fast"), "unknown method 'fast'"),
    ):
        with pytest.raises(ValueError, match=told):
            call()


def exact_undamped(K, M, C):
    return np.linalg.inv(K + 0.7j * C - 0.49 * M)[10, 0]


@pytest.mark.long
def test_memory_does_not_grow_with_frequencies():
    """Room the compiled functions ask for beside their results, at 64 and at 4096 frequencies; gradients too."""
    K, M = beam(5, fixed=2)
    k, m = chain(jnp.full(N, 40.0))
    load = jnp.zeros((N, 1)).at[-1].set(1.0)
    ways = (
        lambda s, w: receptance(K=s * K, M=M, omega=w, out=(8,), into=(8,)),
        lambda s, w: dense_response(K=s * K, M=M, load=jnp.eye(10)[:, :1], omega=w, out=jnp.eye(10)[:1]),
        lambda s, w: direct_response(K=s * k, C=None, M=m, load=load, omega=w, select=lambda x: x[-1]),
    )
    for way in ways:

        def level(s, w, way=way):
            return jnp.sum(jnp.abs(way(s, w)) ** 2)

        def room(count):
            made = jax.jit(jax.grad(level)).lower(1.0, jnp.linspace(0.1, 1.0, count)).compile()
            return made.memory_analysis().temp_size_in_bytes

        assert room(4096) - room(64) < 4032 * 64  # bytes: a result and its derivative at each frequency, no matrix
