"""S14: the payload of pyYeti's coupled loads analysis (its test files, BSD-3), event TOES; units mm, kg, mN."""

from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.coupling import connect, reactions, rigid_bond
from jaxmbs.coupling._primal_assembly import interface_reactions
from jaxmbs.elements import Beam
from jaxmbs.fem import Structure, assemble, assemble_dense
from jaxmbs.io import read_op4
from jaxmbs.qualification import LoadCase, load_envelope
from jaxmbs.vibration import ModalSuperposition, modes, simulate
from jaxmbs.vibration._modes import natural_modes

pyyeti = pytest.importorskip("pyyeti")
FILES = Path(pyyeti.__file__).parent / "tests" / "cla_test_data"
NUM_BOUNDARY = 24
#: Area, second moment both ways and torsion constant of the wide bars [mm^2, mm^4].
WIDE = (201.06, 3217.0, 6434.0)
#: The world's x at the four interface nodes; the second one's own frame is turned, its z is the world's x.
AXIAL = (0, 6 + 2, 12, 18)
#: Largest net axial interface force of the first three load cases [mN], from pyYeti 1.4.7.
NET_FORCE = (7371.73, 7135.02, 7113.12)

pytestmark = [pytest.mark.long, pytest.mark.skipif(not FILES.exists(), reason="pyYeti without its test files")]


@pytest.fixture(scope="module")
def payload():
    return read_op4(FILES / "outboard.op4", interface=range(NUM_BOUNDARY))


def test_frequencies_of_the_payload(payload):
    inner = np.array(payload.interior)
    fixed = natural_modes(K=payload.stiffness[inner][:, inner], M=payload.mass[inner][:, inner], num=4).frequencies
    np.testing.assert_allclose(fixed, [1.65000, 1.65025, 1.67426, 1.67469], atol=5.1e-6)
    free = natural_modes(K=payload.stiffness, M=payload.mass, num=9)
    assert free.num_rigid == 6
    np.testing.assert_allclose(free.frequencies[6:], [1.7577, 1.7929, 3.6493], atol=5.1e-5)


@pytest.fixture(scope="module")
def carrier():
    """The launcher's side from its own deck, bars between 28 free nodes; Nastran's have no inertia in torsion."""
    from pyyeti.nastran import bulk

    path = str(FILES / "inboard.blk")
    grids, bars = bulk.rdgrids(path), bulk.rdcards(path, "cbar")
    nodes, own = {str(int(g[0])): g[2:5] for g in grids}, {}
    for number, section in {100: (12.566, 12.566, 25.133), 101: WIDE, 102: WIDE}.items():
        pairs = [(str(int(b[2])), str(int(b[3]))) for b in bars if b[1] == number]
        own[str(number)] = pairs, section

    def bars_of(area):
        groups = {
            name: (Beam(6.894e7, 2.62e7, A * area, I, I, J, density=2.74e-6), pairs)
            for name, (pairs, (A, I, J)) in own.items()
        }
        return Structure(nodes, groups)

    (one,), (two,) = (assemble_dense(bars_of(area), ("mass",)) for area in (1.0, 2.0))
    torsion = 2.0 * one - two  # what does not grow with the area
    whole = assemble(bars_of(1.0), interface=["3", "11", "19", "27"])
    return eqx.tree_at(lambda s: s.mass, whole, whole.mass - torsion)


@pytest.fixture(scope="module")
def coupled(payload, carrier):
    """Joined at four nodes; the payload's second one has its own frame, whose x y z are the world's y z x."""
    own = np.arange(24).reshape(4, 2, 3)
    own[1] = own[1][:, [1, 2, 0]]
    bolts = rigid_bond(("payload", range(24)), ("carrier", own.ravel().tolist()))
    return connect({"carrier": carrier, "payload": payload}, {"bolts": bolts})


def test_system_frequencies_of_our_coupling(coupled):
    """Rigid modes and the 52 elastic ones up to 150 Hz, against those that Nastran found for the same decks."""
    from pyyeti.nastran import op2

    data = op2.rdnas2cam(str(FILES / "nas2cam"))
    count = int(data["rfmodes"][0][0])
    exact, found = np.sqrt(data["lambda"][0][6:count]) / (2 * np.pi), modes(coupled, count, damped=False)
    assert found.num_rigid == 6 and count == 58
    np.testing.assert_allclose(found.frequencies[6:], exact, rtol=1e-5)
    np.testing.assert_allclose(found.frequencies[6:26], exact[:20], rtol=1e-7)


def test_net_interface_force_of_three_load_cases(carrier, coupled):
    """2 % damping from a static start; what lies above the first 58 modes follows statically."""
    from scipy.io import loadmat

    event = loadmat(FILES / "toes" / "toes_ffns.mat", squeeze_me=True)
    rows, share = np.array(carrier.rows("8 x", "8 y", "24 x", "24 z")), np.array([1.0, 0.1, 1.0, 0.1])
    cases = []
    for force, expected in zip(event["ffns"][:3, ::2], NET_FORCE, strict=True):
        ts = 2 / event["sr"] * np.arange(len(force))
        load = jnp.zeros((len(force), carrier.num_rows)).at[:, rows].set(force[:, None] * share[None])
        motion = simulate(
            coupled, ts=ts, forces={"carrier": load}, solver=ModalSuperposition(0.02, 58, static_start=True)
        )
        shares = [None if s is None else s.T for s in coupled.component_forces(motion.forces[0])]
        found = interface_reactions(coupled, motion.displacement.T, motion.acceleration.T, None, shares).forces[1]
        net = jnp.sum(found[np.array(AXIAL)], axis=0)
        np.testing.assert_allclose(jnp.max(net), expected, rtol=1e-6)
        cases.append(LoadCase(f"TOES {len(cases) + 1}", net[:, None], ["net axial"], ts))
        loads = reactions(coupled, motion)  # with the payload's share of the damping
        assert loads.residual < 2e-6  # as exact as the modes: on the edge of `ok`, on some processors beyond
        bolts = loads["bolts"].on_first[:, np.array(AXIAL)]
        np.testing.assert_allclose(jnp.max(jnp.sum(bolts, axis=1)), expected, rtol=1e-3)
    envelope = load_envelope(cases)
    np.testing.assert_allclose(envelope.highest, NET_FORCE[0], rtol=1e-6)
    assert envelope.cases[int(envelope.case_highest[0])] == "TOES 1"
