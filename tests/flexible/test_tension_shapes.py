"""Blades of one elastic body with masses on them: lag and flap against the rotating beam by finite elements."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import eigh

import jaxmbs as mbs
from jaxmbs import fem
from jaxmbs.flexible import floating_frame
from jaxmbs.reductions import CraigBampton
from tests.flexible.test_second_order import blade_structure


def rotating_beam(speed, masses, hub=0.0, setting=0.0, n=120):
    """First two frequencies of a cantilever in units of sqrt(EI / m) / l^2, with masses in units of m l by place:
    `(EI v'')'' - (T v')' - sin^2(setting) m speed^2 v = m w^2 v`, setting 0 across the plane of rotation."""
    h = 1.0 / n
    s, w = np.polynomial.legendre.leggauss(4)
    s, w = (s + 1) / 2, w / 2
    K, M = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros((2 * n + 2, 2 * n + 2))
    v = np.array([1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, h * (s**3 - s**2)])
    tilt = np.array([-6 * s + 6 * s**2, h * (1 - 4 * s + 3 * s**2), 6 * s - 6 * s**2, h * (3 * s**2 - 2 * s)]) / h
    bend = np.array([-6 + 12 * s, h * (-4 + 6 * s), 6 - 12 * s, h * (6 * s - 2)]) / h**2
    for e in range(n):
        x, i = (e + s) * h, slice(2 * e, 2 * e + 4)
        pull = hub * (1 - x) + (1 - x**2) / 2 + sum(m * (hub + at) * (x < at) for at, m in masses.items())
        K[i, i] += h * ((bend * w) @ bend.T + (tilt * w * speed**2 * pull) @ tilt.T)
        M[i, i] += h * (v * w) @ v.T
    for at, m in masses.items():
        M[2 * round(at * n), 2 * round(at * n)] += m
    K -= (speed * np.sin(setting)) ** 2 * M
    return np.sqrt(eigh(K[2:, 2:], M[2:, 2:], eigvals_only=True, subset_by_index=[0, 1]))


def on_a_hub(frame, speed, masses, hub=0.0):
    """The blade on a shaft about z, masses at its other interfaces."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.elastic("blade", frame.body)
    b.joint("shaft", mbs.Revolute("z"), "ground", "blade.0", drive=lambda t: speed * t, child_frame=(-hub, 0, 0))
    for node, mass in zip(frame.body.interfaces[1:], masses.values(), strict=True):
        b.body(f"mass {node}", mass, inertia=(1e-9, 1e-9, 1e-9))
        b.joint(f"weld {node}", mbs.Weld(), f"blade.{node}", f"mass {node}")
    return b.build()


@pytest.mark.long
@pytest.mark.parametrize(
    ("speed", "masses", "hub"), [(6.0, {1.0: 1.0}, 0.0), (12.0, {1.0: 0.2}, 0.5), (8.0, {0.5: 0.7, 1.0: 0.4}, 0.0)]
)
def test_lag_and_flap_of_one_body_with_masses(speed, masses, hub):
    n = 24
    frame = floating_frame(blade_structure(n), ["0", *(str(round(at * n)) for at in masses)], 4, stiffening=True)
    system = on_a_hub(frame, speed, masses, hub)
    rest = mbs.equilibrium(system, mbs.State.at(system))
    assert rest.ok
    found = 2 * np.pi * np.asarray(mbs.modes(system, rest.state).frequencies)
    for setting in (0.0, np.pi / 2):
        for exact in rotating_beam(speed, masses, hub, setting):
            np.testing.assert_allclose(found[np.argmin(np.abs(found - exact))], exact, rtol=2e-3)


def lag_in_basis(shapes, structure, speed, tip, EI=1.0):
    """First lag in a basis (n, m) held at node 0, from the matrices of the structure and its stress."""
    system = fem.assemble(structure)
    held = np.arange(6, system.num_rows)
    x = np.asarray(structure.positions)[:, 0]
    line = np.full(len(x), 1.0 / (len(x) - 1))
    line[[0, -1]] *= 0.5
    load = np.zeros((len(x), 6))
    load[:, 0] = speed**2 * (line * x + tip * (x == 1.0))
    u = np.zeros(system.num_rows)
    K, M = np.asarray(system.stiffness), np.array(system.mass)
    u[held] = np.linalg.solve(K[np.ix_(held, held)], load.reshape(-1)[held])
    M[-6, -6] += tip
    M[-5, -5] += tip
    M[-4, -4] += tip
    total = K + np.asarray(fem.geometric_stiffness(structure, u))
    in_plane = np.zeros(system.num_rows)
    in_plane[1::6] = 1.0
    total = total - speed**2 * M * in_plane[:, None] * in_plane[None, :]
    A, B = (shapes.T @ X @ shapes for X in (total, M))
    return np.sqrt(eigh(A, B, eigvals_only=True, subset_by_index=[0, 0])[0])


@pytest.mark.parametrize("modes", [0, 2, 4])
@pytest.mark.parametrize("speed", [3.0, 8.0])
def test_lag_in_the_basis_of_the_body_is_that_of_the_whole_structure(modes, speed):
    structure = blade_structure(12)
    whole = np.eye(13 * 6)[:, 6:]
    exact = lag_in_basis(whole, structure, speed, 1.0)
    frame = floating_frame(structure, ["0", "12"], modes, stiffening=True)
    found = lag_in_basis(np.asarray(frame.shapes), structure, speed, 1.0)
    assert -1e-5 < found / exact - 1 < {0: 1e-2, 2: 2e-3, 4: 5e-4}[modes]
    plain = floating_frame(structure, ["0", "12"], stiffening=True, method=CraigBampton(modes))
    assert plain.body.num_modes == modes == frame.body.num_modes - 4
    assert modes == 4 or lag_in_basis(np.asarray(plain.shapes), structure, speed, 1.0) / exact - 1 > 5 * (
        found / exact - 1
    )


@pytest.mark.parametrize("elements", [1, 2, 3, 4, 6])
def test_bodies_of_few_nodes_have_independent_shapes(elements):
    frame = floating_frame(blade_structure(elements, EA=1e4), ["0", str(elements)], 0, stiffening=True)
    body = frame.body
    assert body.num_modes == (4 if elements > 2 else 0)
    K, M = np.asarray(body.stiffness), np.asarray(body.inertia[-len(body.stiffness) :, -len(body.stiffness) :])
    size = np.sqrt(np.diag(K))
    assert np.linalg.eigvalsh(K / np.outer(size, size))[0] > 1e-7
    assert np.isfinite(M).all()


@pytest.mark.slow
def test_derivative_by_the_stiffness_is_that_of_differences():
    def energy(EI):
        """Static deflection of the tip under a load across, and a number of the whole basis that no sign changes."""
        frame = floating_frame(blade_structure(6, EI=EI), ["0", "6"], 2, stiffening=True)
        m = frame.body.num_modes
        K, M = frame.body.stiffness[-m:, -m:], frame.body.inertia[-m:, -m:]
        return jnp.log(jnp.trace(jnp.linalg.solve(K, M)))

    slope = jax.jit(jax.grad(energy))(1.1)
    h = 1e-4
    np.testing.assert_allclose(slope, (energy(1.1 + h) - energy(1.1 - h)) / (2 * h), rtol=1e-6)
