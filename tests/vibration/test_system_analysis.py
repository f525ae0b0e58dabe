"""Questions by name to linear systems, in every storage, and through the front door to either noun."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.sparse

import jaxmbs as mbs
from jaxmbs import blocksparse as bs
from jaxmbs.coupling import connect, rigid_bond
from jaxmbs.elements import Beam
from jaxmbs.fem import Structure, assemble
from jaxmbs.linear import LinearSystem
from jaxmbs.reductions import CraigBampton, MacNeal, reduce
from jaxmbs.vibration import complex_modes, natural_modes, rayleigh_damping
from tests.structural_matrices import chain

EI, LENGTH = 7e10 * 2e-8, 2.0


@eqx.filter_jit
def mast(held=("foot",), **options):
    element = Beam(7e10, 2.7e10, 4e-4, 2e-8, 2e-8, 4e-8, 2700.0, reference=(1, 0, 0))
    names = ["foot", "low", "knee", "high", "tip"]
    nodes = {name: (0, 0, LENGTH * k / 4) for k, name in enumerate(names)}
    pairs = list(zip(names[:-1], names[1:], strict=True))
    nodes = {name: np.array(place, float) for name, place in nodes.items()}
    return assemble(
        Structure(nodes, {"tube": (element, pairs)}, {n: "all" for n in held}), interface=["tip"], **options
    )


@pytest.mark.long
def test_rest_by_name():
    """Closed form of a cantilever; two cases at once; a free mast is pushed by its mass."""
    system, force = mast(), 5.0
    found = mbs.equilibrium(system, {"tip x": force})
    (row,) = system.rows("tip x")
    np.testing.assert_allclose(found.displacement[row], force * LENGTH**3 / (3 * EI), rtol=1e-9)
    assert found.ok
    two = mbs.equilibrium(system, {"tip x": jnp.array([force, 0.0]), "knee": jnp.zeros(6).at[1].set(1.0)})
    assert two.displacement.shape == (2, 24) and two.ok.shape == (2,)
    with pytest.raises(ValueError, match="singular"):
        mbs.equilibrium(mast(()), {"tip z": force})
    free = mbs.equilibrium(mast(()), {"tip z": force}, free=True)
    mass = 2700.0 * 4e-4 * LENGTH
    np.testing.assert_allclose(free.acceleration[2], force / mass, rtol=1e-9)
    for forces, told in (({"top x": 1.0}, "no coordinate or node 'top x'"), ({"tip": 1.0}, "forces on 'tip' have")):
        with pytest.raises(ValueError, match=told):
            mbs.equilibrium(system, forces)


@pytest.mark.long
def test_modes_of_damped_and_undamped_systems():
    K, M = chain(5)
    plain = LinearSystem(mass=M, stiffness=K)
    C = rayleigh_damping(K=K, M=M, by_mass=0.1, by_stiffness=0.02)
    damped, real = mbs.modes(plain.with_damping(C), 2), mbs.modes(plain, 2)
    assert damped.is_complex and not real.is_complex
    np.testing.assert_allclose(damped.frequencies[::2], real.frequencies, rtol=1e-9)
    np.testing.assert_allclose(damped.roots, complex_modes(K=K, C=C, M=M).roots[:4])
    w = real.omega
    np.testing.assert_allclose(damped.damping_ratios[::2], 0.1 / (2 * w) + 0.02 * w / 2, rtol=1e-9)
    np.testing.assert_allclose(real.damping_ratios, 0.0)
    again = mbs.modes(plain.with_damping(C), 2, damped=False)
    np.testing.assert_array_equal(again.values, real.values)


@pytest.mark.long
def test_modes_in_every_storage():
    K, M = chain(12)
    pattern = bs.Pattern(6, 2, [(i, i + 1) for i in range(5)])
    at = [slice(2 * i, 2 * i + 2) for i in range(6)]
    blocks = [
        bs.BlockMatrix(pattern, jnp.stack([A[s, s] for s in at]), jnp.stack([A[at[i], at[i + 1]] for i in range(5)]))
        for A in (K, M)
    ]
    exact = natural_modes(K=K, M=M, num=3).frequencies
    for stiffness, mass in (blocks, (scipy.sparse.csr_matrix(K), scipy.sparse.csr_matrix(M))):
        system = LinearSystem(mass=mass, stiffness=stiffness)
        np.testing.assert_allclose(mbs.modes(system, 3).frequencies, exact, rtol=1e-9)
    system, omega = LinearSystem(mass=blocks[1], stiffness=blocks[0]), jnp.array([0.3, 0.9])
    found = mbs.frequency_response(system, omega, into=["11"], out=["0", "5"], loss=0.1)
    other = mbs.frequency_response(system.to_dense(), omega, into=["11"], out=["0", "5"], loss=0.1)
    np.testing.assert_allclose(found.values, other.values, rtol=1e-9)
    with pytest.raises(ValueError, match="only a given number of natural modes"):
        mbs.modes(system)


@pytest.mark.long
def test_a_structure_in_blocks():
    """The same reduced mast, whatever the storage of what it was made of; names are the same."""
    reduced = eqx.filter_jit(lambda blocks: reduce(mast(blocks=blocks), CraigBampton(2)))
    dense, blocks = reduced(False), reduced(True)
    assert dense.coordinates == blocks.coordinates
    np.testing.assert_allclose(mbs.modes(blocks).frequencies, mbs.modes(dense).frequencies, rtol=1e-8)
    omega = jnp.array([3.0])
    found = [
        mbs.frequency_response(s, omega, ["tip x"], ["knee x"]).values for s in (dense, blocks, mast(blocks=True))
    ]
    np.testing.assert_allclose(found[1], found[0], rtol=1e-8)
    np.testing.assert_allclose(found[2], found[0], rtol=1e-3)
    with pytest.raises(ValueError, match="24 coordinates with mass are too few"):
        mbs.modes(mast(blocks=True), 17)


@pytest.mark.long
def test_coordinates_without_mass_are_condensed():
    """MacNeal's interface has no mass: its modes are those of the free chain, nearly."""
    K, M = chain(8, ends=1)
    system = LinearSystem(mass=M, stiffness=K, interface=[7])
    found = mbs.modes(reduce(system, MacNeal(5, num_rigid=0)), 3)
    np.testing.assert_allclose(found.frequencies, natural_modes(K=K, M=M, num=3).frequencies, rtol=1e-6)


@pytest.mark.long
def test_names_of_what_was_reduced():
    """A node inside a reduced mast answers by its name."""
    omega = jnp.array([3.0, 40.0])

    @jax.jit
    def level(scale):
        whole = mast()
        whole = whole.replace(stiffness=scale * whole.stiffness)
        found = mbs.frequency_response(reduce(whole, CraigBampton(18)), omega, into=["tip x"], out=["knee x"])
        exact = mbs.frequency_response(whole, omega, into=["tip x"], out=["knee x"])
        return jnp.sum(jnp.abs(found.values)) / jnp.sum(jnp.abs(exact.values))

    np.testing.assert_allclose(level(1.2), 1.0, atol=1e-6)
    made = mbs.frequency_response(reduce(mast(), CraigBampton(2)), omega, into=["normal 0"], out=["tip"])
    assert made.inputs == ("normal 0",) and made.outputs[0] == "tip x"


@pytest.mark.long
def test_front_door():
    """One verb for a mechanism and for a linear system."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("bob", mass=1.0, com=(0, 0, -1.0))
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    system = b.build()
    rest = mbs.equilibrium(system, mbs.State.at(system, pin=0.1))
    np.testing.assert_allclose(rest.state.coordinates, 0.0, atol=1e-8)
    frequency = mbs.modes(mbs.linearise(system, rest.state)).frequencies[0]
    np.testing.assert_allclose(frequency, np.sqrt(9.81) / (2 * np.pi), rtol=1e-9)
    assert "bob" in mbs.check(system)
    lin = mbs.linearise(system, rest.state)
    spring = LinearSystem(mass=np.eye(1), stiffness=np.eye(1), interface=[0], coordinates=["end"])
    both = connect({"pendulum": lin.system, "absorber": spring}, {"tie": rigid_bond("pendulum.pin", "absorber.end")})
    np.testing.assert_allclose(mbs.modes(both, damped=False).omega, np.sqrt((9.81 + 1) / 2), rtol=1e-9)
    assert mbs.check(mast(())).grounded == "free"


def test_unsymmetric_blocks_are_refused():
    """Before the program that finds the modes: within it no number is known, and they were NaN."""
    pattern = bs.Pattern(6, 2, [(i, i + 1) for i in range(5)])
    own, beside = jnp.stack([4 * jnp.eye(2)] * 6), jnp.stack([-0.5 * jnp.eye(2)] * 5)
    mass, stiffness = bs.BlockMatrix(pattern, own, 0 * beside), bs.BlockMatrix(pattern, own, beside, 0.6 * beside)
    with pytest.raises(ValueError, match="unsymmetric"):
        mbs.modes(LinearSystem(mass=mass, stiffness=stiffness), 2)
