"""Elastic bodies that stiffen: rotating blades, spin-up, beams under load; energy and momenta; what is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import elements, fem
from jaxmbs.flexible import floating_frame, stiffening
from jaxmbs.kinematics._poses import coordinate_rate
from jaxmbs.linear import LinearSystem
from tests.flexible.beams import beam_structure, random_state

#: First three frequencies of a cantilever at speed 12 about its root, in units of sqrt(EI / m) / l^2, exact and in as
#: many of the modes of rest (case B1; Wright, Smith, Thresher and Wang 1982).
FLAP, LAG = 13.170150487608216, 5.427049278037461
RITZ = {2: 13.27966198, 3: 13.2035626, 4: 13.1829201}


def blade_structure(n=24, length=1.0, EI=1.0, EA=1e8, line_mass=1.0):
    """Slender beam from "0" to the tip along x, whose rotary inertia does not count."""
    inertia = 1e-8 * length**2
    young, area = EI / inertia, EA * inertia / EI
    section = elements.Beam(young, 0.4 * young, area, inertia, inertia, 2 * inertia, line_mass / area)
    x = np.linspace(0.0, length, n + 1)
    nodes = np.stack([x, 0 * x, 0 * x], axis=1)
    return fem.Structure(nodes, {"beam": (section, [(k, k + 1) for k in range(n)])})


def on_a_hub(frame, drive, like=None):
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.elastic("blade", frame.body)
    b.joint("hub", mbs.Revolute("z"), "ground", "blade.0", drive=drive)
    return b.build(like=like)


@pytest.mark.long
@pytest.mark.parametrize("flaps", list(RITZ))
def test_frequencies_of_a_rotating_blade_of_one_body(flaps):
    frame = floating_frame(blade_structure(48), ["0"], 2 * flaps, stiffening=True)
    system = on_a_hub(frame, lambda t: 12.0 * t)
    omega = 2 * np.pi * np.sort(np.asarray(mbs.modes(system, mbs.State.at(system)).frequencies))
    found = omega[np.argmin(np.abs(omega - RITZ[flaps]))]
    np.testing.assert_allclose(found, RITZ[flaps], rtol=1e-4)
    np.testing.assert_allclose(found, FLAP, rtol={2: 1e-2, 3: 3e-3, 4: 1e-3}[flaps])
    np.testing.assert_allclose(omega[0], np.sqrt(found**2 - 144.0), rtol=1e-3)  # lag is flap less the speed


@pytest.mark.long
def test_spin_up_of_kane_ryan_and_banerjee():
    """Case B3: one body lags 0.5738 m at 6.76 s and comes to rest stretched; without stiffening it would fly off."""
    L, speed, T = 10.0, 6.0, 15.0
    structure = blade_structure(16, L, EI=14000.0, EA=28e6, line_mass=1.2)
    frame = floating_frame(structure, ["0"], 6, stiffening=True)

    def angle(t):
        rising = speed / T * (t**2 / 2 + (T / 2 / jnp.pi) ** 2 * (jnp.cos(2 * jnp.pi * t / T) - 1))
        return jnp.where(t < T, rising, speed * (t - T / 2))

    system = on_a_hub(frame, angle)
    motion = mbs.simulate(system, mbs.State.at(system), ts=np.linspace(0.0, 17.5, 701), rtol=1e-6, atol=1e-8)
    tip = frame.system.rows(("16", "y"))[0]
    across = np.asarray(motion.states.coordinates[:, 1:] @ frame.shapes[tip])
    np.testing.assert_allclose(across.min(), -0.5737867965794187, rtol=1e-2)
    np.testing.assert_allclose(across[[100, 200, 300]], [-0.1512737, -0.4684420, -0.5590392], rtol=1e-2)
    assert np.abs(across[-100:]).max() < 0.006


@pytest.fixture(scope="module")
def flying():
    """A beam with both ends as interfaces, and with modes, free in space."""
    frame = floating_frame(beam_structure(1.0, 6), ["0", "6"], 2, stiffening=True)
    b = mbs.SystemBuilder(gravity=(0.3, -0.5, -9.81))
    b.elastic("beam", frame.body)
    b.joint("root", mbs.Free(), "ground", "beam.0")
    return b.build()


@pytest.mark.long
@pytest.mark.parametrize("size", [0.003, 0.02])
def test_energy_is_kept_by_the_accelerations(flying, size):
    """Also where deformations are larger than the terms of second order describe."""
    state = random_state(flying, size=size)
    a = mbs.forward_dynamics(flying, state)[0]
    rates = coordinate_rate(flying.topology, state.coordinates, state.velocities), a

    def energies(psi, u):
        at = mbs.State(state.t, psi, u)
        return mbs.dynamics.kinetic_energy(flying, at), mbs.dynamics.potential_energy(flying, at)

    kinetic, potential = jax.jvp(energies, (state.coordinates, state.velocities), rates)[1]
    np.testing.assert_allclose(kinetic, -potential, rtol=1e-9)
    M = mbs.dynamics.mass_matrix(flying, state)
    assert np.linalg.eigvalsh(M)[0] > 0
    np.testing.assert_allclose(
        0.5 * state.velocities @ M @ state.velocities, energies(state.coordinates, state.velocities)[0], rtol=1e-10
    )


@pytest.mark.long
@pytest.mark.parametrize("share", [-0.5, 5.0])
def test_a_pinned_beam_under_tension(share):
    """One body between a pin and a slide that is pulled: `w = pi sqrt(pi^2 + T)` in units of the beam (case B6)."""
    structure = blade_structure(12)
    frame = floating_frame(structure, ["0", "12"], 4, stiffening=True)
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.elastic("beam", frame.body)
    b.joint("pin", mbs.Revolute("z"), "ground", "beam.0")
    b.body("end", 1e-6, inertia=(1e-9, 1e-9, 1e-9))
    b.joint("slide", mbs.Prismatic("x"), "ground", "end", parent_frame=(1.0, 0.0, 0.0))
    b.joint("far pin", mbs.Revolute("z"), "end", "beam.12")
    b.force("pull", mbs.Actuator(lambda x, v, t: share * np.pi**2), joint="slide")
    system = b.build()
    state = mbs.equilibrium(system, mbs.State.at(system)).state
    omega = 2 * np.pi * np.sort(np.asarray(mbs.modes(system, state).frequencies))
    expected = {-0.5: 6.978864199638879, 5.0: 24.17549474579609}[share]
    assert np.min(np.abs(omega / expected - 1)) < 2e-3, omega


@pytest.mark.long
def test_gradient_of_a_frequency_of_a_blade_is_that_of_differences():
    drive = mbs.forces.Ramp(0.0, 3.0)
    like = on_a_hub(floating_frame(blade_structure(8), ["0"], 4, stiffening=True), drive)

    def first(EI, like=None):
        frame = floating_frame(blade_structure(8, EI=EI), ["0"], 4, stiffening=True)
        system = on_a_hub(frame, drive, like)
        return mbs.modes(system, mbs.State.at(system)).frequencies[2]

    slope = jax.jit(jax.grad(lambda EI: first(EI, like)))(1.1)
    np.testing.assert_allclose(slope, (first(1.1 + 1e-4) - first(1.1 - 1e-4)) / 2e-4, rtol=1e-5)


@pytest.mark.long
def test_no_warning_of_what_is_there():
    frame = floating_frame(blade_structure(4), ["0"], 2, stiffening=True)
    system = on_a_hub(frame, lambda t: 6.0 * t)
    assert stiffening(system, mbs.State.at(system)) == {}


@pytest.mark.long
def test_bad_input():
    structure, other = beam_structure(1.0, 2), beam_structure(1.0, 3)
    with pytest.raises(mbs.ModelError, match="stiffening needs the finite elements"):
        floating_frame(fem.assemble(structure), ["0"], stiffening=True)
    with pytest.raises(mbs.ModelError, match="not that of the substructure, which has no 3 x"):
        floating_frame(fem.assemble(structure), ["0"], stiffening=other)
    K = np.array([[1.0, -1.0], [-1.0, 1.0]])
    measured = LinearSystem(mass=np.eye(2), stiffness=K, coordinates=["a x", "b x"])
    with pytest.raises(mbs.ModelError, match="stiffening needs the finite elements"):
        floating_frame(measured, ["a"], stiffening=True)
