"""Structures that are held on a moving ground: the mass between held and other coordinates, against full matrices."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import eigh

from jaxmbs import elements, fem
from jaxmbs.coupling import connect, rigid_bond
from jaxmbs.qualification import BaseAcceleration, Coordinates, RandomForce
from jaxmbs.qualification._modal_model import modal_model
from jaxmbs.reductions import CraigBampton, reduce

FREQUENCIES = np.array([5.0, 20.0, 61.0, 140.0])
RATIO = 0.03


def beam(n=4, held=None, density=7800.0):
    """A beam along x, held at its root, with consistent masses."""
    section = elements.Beam(2.1e11, 8e10, 4e-4, 1.2e-8, 1.5e-8, 2e-8, density, reference=(0.0, 1.0, 0.0))
    x = np.linspace(0.2, 1.2, n + 1)
    nodes = np.stack([x, 0.1 * x, 0 * x], axis=1)
    return fem.Structure(nodes, {"beam": (section, [(k, k + 1) for k in range(n)])}, held)


def moved(structure, held, direction, frequencies):
    """Absolute accelerations (frequencies, free) of the free coordinates per unit acceleration of the ground, by the
    matrices of the whole structure with the ground prescribed; relative damping is modal."""
    whole = fem.assemble(structure)
    K, M = np.asarray(whole.stiffness), np.asarray(whole.mass)
    outer = np.array([k for k, (node, _) in enumerate(whole.coordinates) if node in held])
    inner = np.setdiff1d(np.arange(len(K)), outer)
    x = np.asarray(structure.positions)
    about = x.mean(axis=0)
    axis = "x y z rx ry rz".split().index(direction)
    motion = np.zeros((len(x), 6))
    if axis < 3:
        motion[:, axis] = 1.0
    else:
        motion[:, :3], motion[:, axis] = np.cross(np.eye(3)[axis - 3], x - about), 1.0
    r = motion.reshape(-1)
    k, m = K[np.ix_(inner, inner)], M[np.ix_(inner, inner)]
    values, shapes = eigh(k, m)
    load = -(M @ r)[inner]
    found = []
    for w in 2 * np.pi * frequencies:
        q = shapes.T @ load / (values - w**2 + 2j * RATIO * np.sqrt(values) * w)
        found.append(-(w**2) * (shapes @ q) + r[inner])
    return np.array(found), [whole.coordinates[i] for i in inner]


def response(system, direction, names):
    """Absolute accelerations (frequencies, outputs) per acceleration of the ground."""
    source = {"base": BaseAcceleration(None, direction)}
    model = modal_model(system, source, {"a": Coordinates(names)}, RATIO)
    return np.asarray(model.transfer(FREQUENCIES))[:, :, 0]


@pytest.mark.parametrize("direction", ["x", "y", "z", "rx", "ry", "rz"])
@pytest.mark.parametrize("blocks", [False, True])
def test_held_structure_is_that_of_the_whole_matrices(direction, blocks):
    exact, labels = moved(beam(), ["0"], direction, FREQUENCIES)
    system = fem.assemble(beam(held={"0": "all"}), blocks=blocks)
    found = response(system, direction, [f"{node} {d}" for node, d in labels])
    np.testing.assert_allclose(found, exact, rtol=1e-8, atol=1e-9 * np.abs(exact).max())


@pytest.mark.long
def test_two_feet_and_single_directions_held():
    """The ends are held in translation only; what turns there has mass with what is held."""
    whole, held = beam(), {"0": "x y z rx", "4": "y z"}
    exact = full_response(whole, held, "y")
    system = fem.assemble(beam(held=held))
    found = response(system, "y", ["2 y", "0 rz"])
    np.testing.assert_allclose(found, exact[:, [1, 0]], rtol=1e-8)


def full_response(structure, held, direction):
    """Absolute accelerations of "0 rz" and "2 y" by the whole matrices."""
    whole = fem.assemble(structure)
    outer = [k for k, (node, d) in enumerate(whole.coordinates) if d in held.get(node, "").split()]
    inner = np.setdiff1d(np.arange(whole.num_rows), outer)
    r = np.array([float(d == direction) for _, d in whole.coordinates])
    K, M = (np.asarray(A)[np.ix_(inner, inner)] for A in (whole.stiffness, whole.mass))
    values, shapes = eigh(K, M)
    load = shapes.T @ -(np.asarray(whole.mass) @ r)[inner]
    w = 2 * np.pi * FREQUENCIES[:, None]
    q = load / (values - w**2 + 2j * RATIO * np.sqrt(values) * w)
    found = -(w**2) * (q @ shapes.T) + r[inner]
    return found[:, [list(inner).index(whole.rows(name)[0]) for name in ("0 rz", "2 y")]]


@pytest.mark.slow
@pytest.mark.parametrize("direction", ["y", "z"])
def test_reduced_components_on_the_ground(direction):
    """A held component reduced to its tip, and one whose interface is tied to the ground by `connect`."""
    structure = beam()
    exact, labels = moved(structure, ["0"], direction, FREQUENCIES)
    at = [labels.index(("4", d)) for d in ("y", "z")] + [labels.index(("2", d)) for d in ("y", "z")]
    held = reduce(fem.assemble(beam(held={"0": "all"}), ["4"]), CraigBampton(18))
    found = response(held, direction, ["4 y", "4 z", "2 y", "2 z"])
    np.testing.assert_allclose(found, exact[:, at], rtol=1e-7, atol=1e-9)
    free = reduce(fem.assemble(structure, ["0"]), CraigBampton(24))
    network = connect({"arm": free}, {"bolts": rigid_bond("arm.0", "ground")})
    found = response(network, direction, ["arm.4 y", "arm.4 z", "arm.2 y", "arm.2 z"])
    np.testing.assert_allclose(found, exact[:, at], rtol=1e-7, atol=1e-9)


def test_ground_moved_by_named_coordinates_is_the_same():
    """`at=` names the coordinates of the foot; the mean of the nodes is the same place."""
    source = BaseAcceleration(None, "y", at=["0"])
    system = fem.assemble(beam())
    model = modal_model(system, {"base": source}, {"a": Coordinates(["4 y", "3 y"])}, RATIO)
    found = response(fem.assemble(beam(held={"0": "all"})), "y", ["4 y", "3 y"])
    np.testing.assert_allclose(model.transfer(FREQUENCIES)[:, :, 0], found, rtol=1e-8)


@pytest.mark.long
def test_translated_structures_and_derivatives():
    system = fem.assemble(beam(held={"0": "all"}))
    shifted = system.translate((0.3, -0.2, 0.5))
    np.testing.assert_allclose(response(shifted, "rz", ["4 y"]), response(system, "rz", ["4 y"]), rtol=1e-9)

    @jax.jit
    def size(density):
        system = fem.assemble(beam(held={"0": "all"}, density=density))
        model = modal_model(system, {"base": BaseAcceleration(None, "y")}, {"a": Coordinates(["4 y"])}, RATIO)
        return jnp.abs(model.transfer(FREQUENCIES[1:2])[0, 0, 0])

    slope = jax.grad(size)(7800.0)
    np.testing.assert_allclose(slope, (size(7801.0) - size(7799.0)) / 2.0, rtol=1e-6)


@pytest.mark.slow
def test_forces_beside_the_ground_are_as_before():
    system = fem.assemble(beam(held={"0": "all"}))
    sources = {"base": BaseAcceleration(None, "y"), "push": RandomForce(None, {"4 y": 1.0})}
    model = modal_model(system, sources, {"a": Coordinates(["4 y"])}, RATIO)
    alone = modal_model(system, {"push": sources["push"]}, {"a": Coordinates(["4 y"])}, RATIO)
    np.testing.assert_allclose(model.transfer(FREQUENCIES)[:, 0, 1], alone.transfer(FREQUENCIES)[:, 0, 0], rtol=1e-12)
