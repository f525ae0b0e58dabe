"""Gradients of modes, receptances and recovered loads at special places: repeated and zero eigenvalues, critical
damping, no damping, zero frequency, sections alike in both directions."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jax import lax

import jaxmbs as mbs
from jaxmbs.elements import Beam
from jaxmbs.fem import Structure, assemble_dense, element_forces
from jaxmbs.linear import LinearSystem
from jaxmbs.reductions import element_loads, interface_forces, mode_acceleration
from jaxmbs.vibration import receptance, viscous_receptance
from jaxmbs.vibration._damping import rayleigh_damping

from .slopes import Slopes
from .test_special_motions import changed

SEEDS = st.integers(0, 2**30)
FEW = settings(max_examples=3, deadline=None, derandomize=True)

# -------------------------------------------------------------------------------- two pendulums, linearised
# numbers: two masses, two levers, two torsion springs, the spring between them, two dampers
TWINS = np.array([1.0, 1.3, 0.5, 0.7, 2.0, 3.0, 4.0, 0.1, 0.2])
ALIKE = np.array([1.0, 1.0, 0.5, 0.5, 2.0, 2.0, 0.0, 0.1, 0.1])


def pendulums(p):
    """Eigenvalues of two hanging pendulums side by side."""
    b = mbs.SystemBuilder()
    for k, name in enumerate(("left", "right")):
        b.body(name, mass=p[k], com=(0.0, 0.0, -p[2 + k]), inertia=0.01)
        b.joint(name, mbs.Revolute("y"), "ground", name, parent_frame=(float(k), 0.0, 0.0))
        b.force(name, mbs.SpringDamper(p[4 + k], p[7 + k]), joint=name)
    low = np.array([0.0, 0.0, -0.4])
    b.force("between", mbs.SpringDamper(p[6], free_length=1.0), between=(("left", low), ("right", low)))
    system = b.build()
    return mbs.modes(mbs.linearise(system, mbs.State(jnp.zeros(()), jnp.zeros(2), jnp.zeros(2))))


def sum_of_frequencies(p):
    """Symmetric in the modes: smooth where they repeat."""
    found = pendulums(p)
    return jnp.sum(found.frequencies) + 0.3 * jnp.sum(found.roots.real)


@functools.cache
def pendulum_slopes():
    return Slopes(sum_of_frequencies, len(TWINS))


@pytest.mark.long
def test_modes_that_repeat():
    """Two pendulums alike: what does not tell them apart has its derivative."""
    pendulum_slopes().check({"regular": TWINS, "alike": ALIKE})


@pytest.mark.long
@FEW
@given(seed=SEEDS)
def test_modes_drawn(seed):
    drawn = TWINS * np.random.default_rng(seed).uniform(0.5, 2.0, len(TWINS))
    same = drawn.copy()
    same[[1, 3, 5, 8]], same[6] = drawn[[0, 2, 4, 7]], 0.0
    pendulum_slopes().check({"drawn": drawn, "alike": same})


def oscillator(p):
    """Eigenvalues of a mass p[0] on a spring p[1] and a damper p[2]."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("mass", mass=p[0], inertia=0.1)
    b.joint("slide", mbs.Prismatic("x"), "ground", "mass")
    b.force("mount", mbs.SpringDamper(p[1], p[2]), joint="slide")
    system = b.build()
    linear = mbs.linearise(system, mbs.State(jnp.zeros(()), jnp.zeros(1), jnp.zeros(1)), ("slide",), ("slide",))
    return linear, mbs.modes(linear).roots


PLACES = {"critical damping": (1.0, 1.0, 2.0), "free": (1.0, 0.0, 0.0), "regular": (1.0, 1.0, 0.3)}


@functools.cache
def real_slopes():
    """Slopes of the real parts of both eigenvalues at `PLACES`."""
    slopes = jax.jit(jax.vmap(jax.jacrev(lambda p: oscillator(p)[1].real)))
    return dict(zip(PLACES, np.asarray(slopes(jnp.array(list(PLACES.values())))), strict=True))


@pytest.mark.long
def test_the_pair_of_zeros_has_no_derivative():
    """Zero is returned there, as documented."""
    np.testing.assert_allclose(real_slopes()["regular"], [[0.15, 0.0, -0.5]] * 2, atol=1e-12)
    np.testing.assert_allclose(real_slopes()["free"], 0.0, atol=1e-12)


@pytest.mark.long
def test_critically_damped_modes_have_no_derivative():
    """Zero is documented, also where the vectors are parallel to the last bit."""
    np.testing.assert_allclose(real_slopes()["critical damping"], 0.0, atol=1e-12)


@pytest.mark.long
def test_responses_at_defective_eigenvalues():
    """The matrices have their derivatives, and so has the response."""

    def response(p):
        found = mbs.frequency_response(oscillator(p)[0].state_space, jnp.array([0.7]))[0, 0, 0]
        return found.real + 2.0 * found.imag

    Slopes(response, 3).check(PLACES)


# -------------------------------------------------------------------------------------------------------- receptances
# numbers: what parts the pairs of a square lattice, stiffness, mass of a corner, two dampings, loss, frequency
LATTICE = np.array([0.2, 1.3, 0.4, 0.05, 0.01, 0.02, 1.1])
OUT, INTO = (0, 2, 3), (1, 3)


def lattice(p):
    T = jnp.array([[2.0, -1.0], [-1.0, 2.0]])
    I = jnp.eye(2)
    return p[1] * (jnp.kron(T, I) + (1.0 + p[0]) * jnp.kron(I, T)), jnp.eye(4).at[0, 0].add(p[2])


def weighted(*arrays):
    """A real number from complex arrays."""
    random = np.random.default_rng(4)
    return sum(jnp.sum(a.real * random.normal(size=a.shape) + a.imag * random.normal(size=a.shape)) for a in arrays)


def recovered(K, M, omega, x, C):
    """Loads of an element, of the interface, and the shape by mode acceleration, under a force at 3."""
    load = jnp.zeros(4, x.dtype).at[3].set(1.0)
    rate = lax.complex(jnp.zeros_like(omega), omega)
    edge = jnp.array([[1.0, -1.0, 0.0, 0.0]])
    system, motion = LinearSystem(mass=M, stiffness=K, damping=C, interface=(0,)), (rate**2 * x, load, rate * x)
    forces = interface_forces(system, x, *motion)
    better = mode_acceleration(system, x, *motion)
    return element_loads(K[0, 1] * jnp.eye(1), edge, x), forces, better


def lattice_response(p):
    """Receptances by all modes and by three of four with residuals, and loads recovered from them."""
    K, M = lattice(p)
    C, omega = rayleigh_damping(K=K, M=M, by_mass=p[3], by_stiffness=p[4]), p[6]
    whole = receptance(K=K, M=M, omega=omega[None], out=OUT, into=INTO, C=C, loss=p[5])
    some = receptance(K=K, M=M, omega=omega[None], out=OUT, into=INTO, C=C, loss=p[5], num=3)
    x = receptance(K=K, M=M, omega=omega[None], out=range(4), into=(3,), C=C)[0, :, 0]
    return weighted(whole, some, *recovered(K, M, omega, x, C))


LATTICES = {
    "regular": LATTICE,
    "repeated": changed(LATTICE, _0=0.0, _2=0.0),
    "repeated, undamped": changed(LATTICE, _0=0.0, _2=0.0, _3=0.0, _4=0.0, _5=0.0),
    "static": changed(LATTICE, _6=0.0),
    "repeated, static": changed(LATTICE, _0=0.0, _2=0.0, _6=0.0),
}


@functools.cache
def lattice_slopes():
    return Slopes(lattice_response, len(LATTICE))


@pytest.mark.long
def test_receptances_and_loads_where_modes_repeat():
    lattice_slopes().check(LATTICES)


@pytest.mark.long
@FEW
@given(seed=SEEDS)
def test_receptances_drawn(seed):
    random = np.random.default_rng(seed)
    rows = [row * np.r_[random.uniform(0.5, 1.5, 6), 1.0] for row in LATTICES.values()]
    lattice_slopes().check(dict(zip(LATTICES, rows, strict=True)))


# numbers: two masses, two springs to the ground, the spring between them, three dampers alike, frequency
VISCOUS = np.array([1.0, 1.5, 1.0, 2.0, 0.5, 0.1, 0.3, 0.2, 0.7])


def viscous(p):
    """Receptances of two masses with any damping."""
    couple = jnp.array([[1.0, -1.0], [-1.0, 1.0]])
    K, C = jnp.diag(p[2:4]) + p[4] * couple, jnp.diag(p[5:7]) + p[7] * couple
    return viscous_receptance(K=K, M=jnp.diag(p[:2]), omega=p[8][None], out=(0, 1), into=(0, 1), C=C)


def inverse(p):
    couple = jnp.array([[1.0, -1.0], [-1.0, 1.0]])
    K, C = jnp.diag(p[2:4]) + p[4] * couple, jnp.diag(p[5:7]) + p[7] * couple
    return jnp.linalg.inv(lax.complex(K - p[8] ** 2 * jnp.diag(p[:2]), p[8] * C))[None]


@functools.cache
def viscous_slopes():
    return [Slopes(lambda p, f=f: weighted(f(p)), len(VISCOUS)) for f in (viscous, inverse)]


CRITICAL = np.array([1.0, 1.0, 1.0, 4.0, 0.0, 2.0, 4.0, 0.0, 0.7])


def check_viscous(places):
    """Values and gradients are those of the inverse."""
    rows = jnp.asarray(np.array(list(places.values())))
    found, wanted = viscous_slopes()
    np.testing.assert_allclose(found.values(rows), wanted.values(rows), rtol=1e-8)
    found.check(places)
    for a, b in zip(found.gradients(rows), wanted.gradients(rows), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-7, atol=1e-8)


@pytest.mark.long
def test_viscous_receptances():
    check_viscous(
        {
            "regular": VISCOUS,
            "repeated": changed(CRITICAL, _3=1.0, _5=0.3, _6=0.3),
            "undamped": changed(VISCOUS, _5=0.0, _6=0.0, _7=0.0),
            "static": changed(VISCOUS, _8=0.0),
            "overdamped": changed(VISCOUS, _5=5.0, _6=9.0),
        }
    )


@pytest.mark.long
def test_viscous_receptances_of_a_free_component():
    check_viscous({str(k): changed(VISCOUS, _2=0.0, _3=0.0, _5=0.0, _6=0.0, _8=0.7 + 0.1 * k) for k in range(5)})


@pytest.mark.long
def test_viscous_receptances_at_critical_damping():
    near = changed(CRITICAL, _5=2.0 + 1e-9)
    check_viscous({"one": changed(CRITICAL, _6=0.5), "both": CRITICAL, "beside": near})


# -------------------------------------------------------------------------------- forces in a beam's section
# numbers: Young's modulus, the two second moments of area, torsion constant, density, length, frequency
BEAM = np.array([2.0, 0.4, 0.3, 0.5, 0.7, 1.2, 0.4])


def beam_forces(p):
    """Section forces of a cantilever of two elements shaken at its tip in both directions."""
    nodes = jnp.zeros((3, 3)).at[:, 0].set(jnp.array([0.0, 0.5, 1.0]) * p[5])
    element = Beam(p[0], 0.8, 1.1, p[1], p[2], p[3], p[4], reference=(0.0, 1.0, 0.0))
    structure = Structure(nodes, {"beam": (element, [(0, 1), (1, 2)])}, held={0: "all"})
    K, M = assemble_dense(structure)
    x = receptance(K=K, M=M, omega=p[6][None], out=range(12), into=(7, 8), loss=0.05)[0] @ jnp.array(
        [1.0, 0.5], complex
    )
    return weighted(element_forces(structure, x)["beam"])


@pytest.mark.long
def test_section_forces_of_a_beam_alike_in_both_directions():
    places = {"regular": BEAM, "alike": changed(BEAM, _1=0.3), "static": changed(BEAM, _1=0.3, _6=0.0)}
    Slopes(beam_forces, len(BEAM)).check(places)
