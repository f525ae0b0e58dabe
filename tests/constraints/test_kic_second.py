"""Second-order KIC of every joint: `jax.jacfwd` against the vector form and differences of the first order."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.constraints import kic_second_vector
from jaxmbs.kinematics._poses import step_coordinates
from tests import random_systems as rs
from tests.joints.test_joints import CLOSING, EXAMPLES

ARM = mbs.Universal()


def _links():
    return dict(zip(EXAMPLES, rs.random_links(7, list(EXAMPLES.values()), (-1,) * len(EXAMPLES)), strict=True))


def _bodies(b, links):
    b.body("arm", 1.0, inertia=0.1)
    b.joint("shoulder", ARM, "ground", "arm")
    for name, link in links.items():
        b.body(name, link.mass, link.com, link.inertia)


@pytest.fixture(scope="module")
def tree():
    """An arm that turns about two axes, and on it a body by every joint."""
    b, links = mbs.SystemBuilder(), _links()
    _bodies(b, links)
    for name, link in links.items():
        places = rs.as_pose(link.parent_frame), rs.as_pose(link.child_frame)
        b.joint(f"{name} joint", link.kind, "arm", name, *places)
    system = b.build()
    return answers(system, rs.random_state(system, 5))


@jax.jit
def _tensors(system, state):
    return (
        mbs.constraints.kic(system, state),
        mbs.constraints.kic_second(system, state),
        kic_second_vector(system, state),
    )


def answers(system, state):
    """First-order KIC a little further and back along every independent velocity, and the tensors by two ways."""

    @jax.jit
    def further(h):
        steps = h * jnp.eye(system.topology.num_velocities)

        def kic(step):
            psi = step_coordinates(system.topology, state.coordinates, step)
            return mbs.constraints.kic(system, mbs.State(state.t, psi, state.velocities))

        ends = jax.vmap(kic)(steps), jax.vmap(kic)(-steps)
        return jax.tree.map(lambda a, b: jnp.moveaxis((a - b) / (2 * h), 0, -1), *ends)

    return further(1e-6), *_tensors(system, state)[1:]


@pytest.mark.long
@pytest.mark.parametrize("joint", EXAMPLES)
def test_in_a_tree(tree, joint):
    differences, jacfwd, vector = tree
    for kind in ("rotational", "translational"):
        H = getattr(jacfwd, kind)[joint]
        np.testing.assert_allclose(H, np.swapaxes(getattr(differences, kind)[joint], 0, 1), atol=1e-8)
        np.testing.assert_allclose(H, getattr(vector, kind)[joint], atol=1e-12)
        assert np.max(np.abs(H)) > 0.1


@pytest.fixture(scope="module")
def loops():
    """Bodies that float, and joints from the arm that close loops."""
    b, links = mbs.SystemBuilder(), {name: link for name, link in _links().items() if name in CLOSING}
    _bodies(b, links)
    for name in links:
        b.joint(f"{name} floats", mbs.Free(), "ground", name)
    for name, link in links.items():
        places = rs.as_pose(link.parent_frame), rs.as_pose(link.child_frame)
        b.joint(f"{name} joint", link.kind, "arm", name, *places)
    system = b.build(cut=[f"{name} joint" for name in links])
    return _tensors(system, mbs.State.at(system, shoulder=(0.4, -0.7)))[1:]


@pytest.mark.long
@pytest.mark.parametrize("joint", CLOSING)
def test_as_closure_of_a_loop(loops, joint):
    jacfwd, vector = loops
    for kind in ("rotational", "translational"):
        H = getattr(jacfwd, kind)[joint]
        np.testing.assert_allclose(H, getattr(vector, kind)[joint], atol=1e-10 * np.max(np.abs(H)))
        assert np.max(np.abs(H)) > 0.1
