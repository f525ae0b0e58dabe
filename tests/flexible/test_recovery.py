"""From an elastic body back to its mesh, through the rigid nodes that joints attach to."""

import base64

import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import fem, flexible, viz
from jaxmbs.elements import DIRECTIONS
from jaxmbs.reductions import CraigBampton, reduce, rigid_body_motions, rigid_node
from tests.viz.machines import plate

HUB, TIP = ([f"{i}.{j}" for j in range(3)] for i in (0, 4))
pytestmark = pytest.mark.slow

NUDGE = np.array([0.0, 0.0, 1e-3, 0.0, 2e-3, 0.0])  # of the tip, seen from the hub [m, rad]


@pytest.fixture(scope="module")
def body():
    structure = plate(4, 2, held=False)
    free = rigid_node(rigid_node(fem.assemble(structure), "hub", HUB), "tip", TIP)
    return structure, free, flexible.floating_frame(free, ("hub", "tip"), num_modes=2)


def held_by_hand(structure):
    """Displacements (nodes, 6) with the hub at rest and the tip's nodes moved as one, by NumPy."""
    whole = fem.assemble(structure)
    K, labels = np.asarray(whole.stiffness), list(whole.coordinates)
    places = np.array([structure.positions[structure.node(name)] for name in TIP])
    moved = np.asarray(rigid_body_motions(places, places.mean(axis=0))) @ NUDGE
    fixed = [labels.index((name, d)) for name in (*HUB, *TIP) for d in DIRECTIONS]
    x = np.zeros(len(K))
    x[fixed] = np.r_[np.zeros(6 * len(HUB)), moved]
    inner = np.setdiff1d(np.arange(len(K)), fixed)
    x[inner] = -np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, fixed)] @ x[fixed])
    return x


def test_stresses_through_two_rigid_nodes(body):
    structure, free, frame = body
    q = np.r_[NUDGE, 0.0, 0.0]
    x = frame.shapes @ q
    assert x.shape == (free.num_rows,) and free.num_rows < len(structure.labels)
    back = frame.expand(x)
    wanted = held_by_hand(structure)
    np.testing.assert_allclose(back, wanted, atol=1e-9 * np.abs(wanted).max())
    assert frame.whole == structure.labels
    found, other = (fem.element_stresses(structure, v)["plate"] for v in (back, wanted))
    np.testing.assert_allclose(found, other, rtol=1e-6, atol=1e-6 * np.abs(other).max())


def test_displacements_of_what_was_reduced_are_refused(body):
    structure, _, frame = body
    with pytest.raises(ValueError, match="must be expanded by its `expand` first"):
        fem.element_stresses(structure, frame.shapes[:, 0])


def test_a_reduction_after_rigid_nodes_leads_all_the_way_back(body):
    structure, free, _ = body
    small = reduce(free, CraigBampton(3))
    assert small.whole == structure.labels
    tip = np.zeros(small.num_rows)
    tip[list(small.rows("tip z"))] = 1.0
    moved = fem.scatter_rows(structure, small.expand(tip))
    np.testing.assert_allclose(moved[[structure.node(name) for name in TIP], 2], 1.0)


def test_it_bends_in_a_scene(body):
    """An arm on a hinge, its deformation written down: the mesh stands where the interfaces do."""
    structure, _, frame = body
    b = mbs.SystemBuilder()
    b.elastic("arm", frame.body)
    b.joint("hinge", mbs.Revolute("y"), "ground", "arm.hub", parent_frame=(0.0, 0.0, 1.0))
    system = b.build()
    state = mbs.State.at(system, {"arm.tip": (*NUDGE[:3], np.cos(1e-3), 0.0, np.sin(1e-3), 0.0)})
    data = viz.scene(system, state, structures={"arm": (structure, frame)}).data
    (mesh,) = data["objects"][0]["meshes"]
    decode = lambda text, *shape: np.frombuffer(base64.b64decode(text), "<f4").reshape(shape)
    m, n = frame.shapes.shape[1], structure.num_nodes
    moved = np.einsum("m,mnc->nc", decode(mesh["amplitudes"], 1, m)[0], decode(mesh["basis"], m, n, 3))
    wanted = np.asarray(fem.scatter_rows(structure, held_by_hand(structure)))[:, :3]
    np.testing.assert_allclose(moved, wanted, atol=1e-6)
    assert data["objects"][0]["bodies"][mesh["body"]] == "arm.hub"
    hub = decode(mesh["rest"], n, 3)[[structure.node(name) for name in HUB]]
    np.testing.assert_allclose(hub.mean(axis=0), 0.0, atol=1e-7)
    with pytest.raises(mbs.UnknownNameError, match="leg"):
        viz.scene(system, state, structures={"leg": (structure, frame)})
