"""Inertias of arms that their joint torques can tell: how many, against Pinocchio's regressor."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.cases.panda_links import LINKS

pytestmark = pytest.mark.long
# Denavit and Hartenberg's a, d [m] and alpha of the Puma 560
PUMA = [
    (0.0, 0.0, np.pi / 2),
    (0.4318, 0.0, 0.0),
    (0.0203, 0.15005, -np.pi / 2),
    (0.0, 0.4318, np.pi / 2),
    (0.0, 0.0, -np.pi / 2),
]
NOISE = 1e-3  # [N m]


def turn_x(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def puma_frames():
    """Positions and rotations of the six joints in the links before them."""
    return [((0.0, 0.0, 0.0), np.eye(3)), *[((a, 0.0, d), turn_x(alpha)) for a, d, alpha in PUMA]]


def panda_frames():
    return [(link["position"], np.array(link["rotation"], float)) for link in LINKS]


def inertias(count):
    """Masses, centres and inertias of links, not special ones."""
    rng = np.random.default_rng(5)
    A = rng.normal(size=(count, 3, 3))
    moments = 0.002 * np.einsum("kij,klj->kil", A, A) + 0.05 * np.eye(3)
    return {
        "mass": 1.0 + rng.uniform(size=count),
        "com": 0.1 * rng.normal(size=(count, 3)),
        "inertia": moments[:, *np.triu_indices(3)],
    }


def symmetric(six):
    xx, xy, xz, yy, yz, zz = six
    return jnp.stack([jnp.stack(row) for row in ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))])


def arm(frames, u, like=None):
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    for k, (position, rotation) in enumerate(frames):
        own = {"mass": u["mass"][k], "com": u["com"][k], "inertia": symmetric(u["inertia"][k])}
        b.body(f"link{k}", **own)
        parent = "ground" if k == 0 else f"link{k - 1}"
        b.joint(f"j{k}", mbs.Revolute("z"), parent, f"link{k}", parent_frame=mbs.Pose(position, rotation))
    return b.build(like=like)


def regressor_rank(frames, samples):
    """Rank of the stacked regressors of the joint torques, Pinocchio."""
    pin = pytest.importorskip("pinocchio")
    model, parent = pin.Model(), 0
    for k, (position, rotation) in enumerate(frames):
        place = pin.SE3(rotation, np.array(position))
        parent = model.addJoint(parent, pin.JointModelRZ(), place, f"j{k}")
    data = model.createData()
    rows = [pin.computeJointTorqueRegressor(model, data, *sample).copy() for sample in samples]
    values = np.linalg.svd(np.vstack(rows), compute_uv=False)
    return int(np.sum(values > 1e-9 * values[0]))


@pytest.mark.parametrize(("frames", "count"), [(puma_frames(), 36), (panda_frames(), 43)], ids=["puma", "panda"])
def test_identifiable_inertias(frames, count):
    n = len(frames)
    rng = np.random.default_rng(1)
    samples = rng.uniform(-2.0, 2.0, (40, 3, n))
    truth = inertias(n)
    first = arm(frames, truth)

    @jax.jit
    def torques(u):
        system = arm(frames, u, first)

        def torque(sample):
            state = mbs.State(jnp.zeros(()), sample[0], sample[1])
            return mbs.inverse_dynamics(system, state, sample[2])

        return jax.vmap(torque)(jnp.asarray(samples))

    data = np.asarray(torques(truth))
    found = mbs.identify(torques, data, truth, deviations=NOISE, largest=1e4)
    assert regressor_rank(frames, samples) == count
    assert found.rank == count and len(found.unseen) == 10 * n - count
    # the first link turns about the vertical: of its inertia only the moment about that axis counts
    assert {"inertia[0,0]"} in [set(direction.coefficients) for direction in found.unseen]
    assert all(np.isinf(direction.deviation) for direction in found.unseen)
    print(*[direction.text for direction in found.unseen], sep="\n")
