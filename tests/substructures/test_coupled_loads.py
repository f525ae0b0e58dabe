"""S14: the payload of pyYeti's coupled loads analysis (its test files, BSD-3), event TOES; units mm, kg, mN."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.io import read_op4
from jaxmbs.structures.modes import natural_modes
from jaxmbs.structures.transient import modal_motion
from jaxmbs.substructures import interface_forces

pyyeti = pytest.importorskip("pyyeti")
FILES = Path(pyyeti.__file__).parent / "tests" / "cla_test_data"
NUM_BOUNDARY = 24
#: The world's x at the four interface nodes; the second one's own frame is turned, its z is the world's x.
AXIAL = (0, 6 + 2, 12, 18)
#: Largest net axial interface force of the first three load cases [mN], from pyYeti 1.4.7.
NET_FORCE = (7371.73, 7135.02, 7113.12)

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not FILES.exists(), reason="pyYeti without its test files")]


@pytest.fixture(scope="module")
def payload():
    return read_op4(FILES / "outboard.op4", interface=range(NUM_BOUNDARY))


def test_frequencies_of_the_payload(payload):
    inner = np.array(payload.interior)
    fixed = natural_modes(payload.stiffness[inner][:, inner], payload.mass[inner][:, inner], 4).frequencies
    np.testing.assert_allclose(fixed, [1.65000, 1.65025, 1.67426, 1.67469], atol=5.1e-6)
    free = natural_modes(payload.stiffness, payload.mass, 9)
    assert free.num_rigid == 6
    np.testing.assert_allclose(free.frequencies[6:], [1.7577, 1.7929, 3.6493], atol=5.1e-5)


def system():
    """Modes of payload on carrier, the payload's coordinates in them, and those of the four forces."""
    from pyyeti.nastran import op2

    data = op2.rdnas2cam(str(FILES / "nas2cam"))
    values = np.where(np.arange(68) < data["nrb"], 0.0, data["lambda"][0])
    rows = [list(data["uset"][0].index).index(c) for c in ((8, 1), (8, 2), (24, 1), (24, 3))]
    return values, data["ulvs"][101], data["phg"][0][rows], int(data["rfmodes"][0][0])


def test_net_interface_force_of_three_load_cases(payload):
    """2 % damping from a static start; the last ten vectors, of residual flexibility, follow statically."""
    from scipy.io import loadmat

    values, shapes, at_forces, num = (jnp.asarray(a) if np.ndim(a) else a for a in system())
    event = loadmat(FILES / "toes" / "toes_ffns.mat", squeeze_me=True)
    step, elastic = 2 / event["sr"], values > 0
    stiffness = jnp.where(elastic, values, 1.0)
    for force, expected in zip(event["ffns"][:3, ::2], NET_FORCE, strict=True):
        loads = jnp.asarray(force[:, None] * np.array([1.0, 0.1, 1.0, 0.1])) @ at_forces
        static = jnp.where(elastic[None], loads / stiffness[None], 0.0)
        motion = modal_motion(jnp.sqrt(values[:num]), 0.02, loads[:, :num], step, static[0, :num])
        q = jnp.concatenate([motion.displacement, static[:, num:]], axis=1)
        q_ddot = jnp.concatenate([motion.acceleration, jnp.zeros_like(loads[:, num:])], axis=1)
        forces = interface_forces(payload.stiffness, payload.mass, payload.interface, shapes @ q.T, shapes @ q_ddot.T)
        np.testing.assert_allclose(jnp.max(jnp.sum(forces[np.array(AXIAL)], axis=0)), expected, rtol=1e-4)
