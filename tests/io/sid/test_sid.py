"""Standard input data: bodies come back with their mechanics, a mass on one mode in closed form, faults by name."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import flexible, io
from tests.flexible.beams import beam_structure

#: A mass of 2 kg at (1, 0, 0) that one mode moves along y, 50 N/m; written as other programs do.
POINT = """A title that is none of the data
part
new modal
refmod
  mass = 2.0D0
  nelastq = 1
  ielastq(1) = Eigenmode 1 : 0.79 Hz
end refmod
frame
new node = 1
  rframe = body ref
  origin
    order = 0
    nrow = 3
    ncol = 1
    nq = 1
    nqn = 0
    structure = 0
  end origin
  phi
    order = 0
    nrow = 3
    ncol = 1
    structure = 0
  end phi
  psi
    order = 0
    nrow = 3
    ncol = 1
    structure = 0
  end psi
end node
end frame
mdCM
  nrow = 3
  ncol = 1
  m0( 1, 1) = 2.0
end mdCM
J
  nrow = 3
  ncol = 3
  structure = 2
  m0( 2, 2) = 2.0
  m0( 3, 3) = 2.0   ! and no Ixx
  m1( 1, 1, 2) = -2.0
end J
Ct
  nrow = 1
  ncol = 3
  m0( 1, 2) = 2.0
end Ct
Cr
  nrow = 1
  ncol = 3
  m0( 1, 3) = 2.0
end Cr
Me
  nrow = 1
  ncol = 1
  m0( 1, 1) = 2.0
end Me
Oe
  order = 1
  nrow = 1
  ncol = 6
  m0( 1, 4) = 2.0
  m1( 1, 1, 1) = -2.0
  m1( 1, 1, 3) = -2.0
end Oe
Ke
  nrow = 1
  ncol = 1
  m0( 1, 1) = 5.0d+01
end Ke
end modal
end part
"""


def test_a_mass_on_one_mode(tmp_path):
    """Its kinetic energy is that of the point at (1, q, 0)."""
    path = tmp_path / "mass.SID_FEM"
    path.write_text(POINT)
    body = io.read_sid(path, "1")
    assert body.interfaces == ("1",) and body.num_modes == 1 and float(body.stiffness[0, 0]) == 50.0
    q, flow = 0.25, np.array([0.5, -1.0, 2.0, 0.25, 0.5, -0.75, 3.0])
    velocity = flow[3:6] + np.cross(flow[:3], [1.0, q, 0.0]) + [0.0, flow[6], 0.0]
    energy = body.kinetic_energy(jnp.array([q]), jnp.array(flow))
    np.testing.assert_allclose(energy, velocity @ velocity, rtol=1e-12)


def same_mechanics(one, other):
    """Energies, momenta and gyroscopic loads agree at random motions."""
    random = np.random.default_rng(1)
    for _ in range(3):
        q, flow = (jnp.asarray(random.normal(size=n)) for n in (one.num_deformations, 6 + one.num_deformations))
        for name in ("kinetic_energy", "momenta", "gyroscopic_loads", "strain_loads"):
            a, b = (getattr(body, name)(q, flow) for body in (one, other))
            np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9 * float(np.max(np.abs(b))))
        np.testing.assert_allclose(one.first_moment(q), other.first_moment(q), rtol=1e-9, atol=1e-12)


@pytest.mark.long
def test_entries_of_first_order_are_numbered_by_row_mode_and_column(tmp_path):
    """As other programs write them: the axes of a node turn by `m1(2, k, 1) = psi_z` of mode k."""
    frame = flexible.floating_frame(beam_structure(1.0, 2), ("0", "2"), num_modes=1)
    path = tmp_path / "beam.sid"
    io.write_sid(path, frame.body)
    title, *lines = path.read_text().splitlines()
    assert title.split()[:2] == ["2", "7"]  # numbers of nodes and of modes
    text = "\n".join(lines)
    node = text[text.index("new node = 2") : text.index("end frame")]
    axes, psi = (node[node.index(f"\n{name}\n") : node.index(f"end {name}")] for name in ("AP", "psi"))
    assert "m0( 3, 6) = 1" in psi
    assert "m1( 2, 6, 1) = 1" in axes and "m1( 1, 6, 2) = -1" in axes


@pytest.mark.long
@pytest.mark.parametrize("whole", [True, False])
def test_a_body_comes_back(tmp_path, whole):
    frame = flexible.floating_frame(beam_structure(1.0, 3), ("0", "3"), num_modes=2, damping_ratio=0.02)
    path = tmp_path / "beam.sid"
    io.write_sid(path, frame if whole else frame.body)
    again = io.read_sid(path, ("0", "3"))
    assert again.interfaces == ("0", "3")
    np.testing.assert_allclose(again.places, frame.body.places)
    same_mechanics(again, frame.body)
    if whole:  # other interfaces: modes are mixed so that the middle carries coordinates
        middle = io.read_sid(path, ("0", "2"))
        assert middle.num_modes == frame.body.num_modes
        b = mbs.SystemBuilder(gravity=(0, 0, 0))
        frequencies = []
        for body in (frame.body, middle):
            b = mbs.SystemBuilder(gravity=(0, 0, 0))
            b.elastic("arm", body)
            b.joint("pin", mbs.Revolute("z"), "ground", "arm.0", drive=mbs.forces.Constant(0.0))
            system = b.build()
            frequencies.append(mbs.modes(system, mbs.State.at(system)).frequencies)
        np.testing.assert_allclose(*frequencies, rtol=1e-7)


def test_the_first_interface_may_stand_elsewhere(tmp_path):
    """The mass on a body frame half a metre away: places are seen from the first interface."""
    path = tmp_path / "mass.sid"
    moved = POINT.replace("    nqn = 0\n    structure = 0\n", "    structure = 0\n    m0( 2, 1) = 0.5\n")
    path.write_text(moved)
    body = io.read_sid(path, ["1"])
    flow = np.array([0.5, -1.0, 2.0, 0.25, 0.5, -0.75, 3.0])
    velocity = flow[3:6] + np.cross(flow[:3], [1.0, -0.5, 0.0]) + [0.0, flow[6], 0.0]
    np.testing.assert_allclose(body.kinetic_energy(jnp.zeros(1), jnp.array(flow)), velocity @ velocity, rtol=1e-12)


FAULTS = {
    "no node '2'": ("", "", ("1", "2")),
    "line 8: end of 'refmodd', but 'refmod' is open": ("end refmod", "end refmodd", "1"),
    "it has no ke": ("Ke\n", "Kx\n", "1"),
    r"m0\( 1, 9\) is outside of a matrix": ("m0( 1, 4)", "m0( 1, 9)", "1"),
    "modes move the first interface '1'": (
        "  phi\n    order = 0\n",
        "  phi\n    m0( 2, 1) = 1\n",
        "1",
    ),
    "could not convert string to float": ("5.0d+01", "stiff", "1"),
    "it has no section 'part'": ("part", "parts", "1"),
}  # fmt: skip


@pytest.mark.parametrize("message", FAULTS)
def test_faults_are_reported(tmp_path, message):
    old, new, interfaces = FAULTS[message]
    path = tmp_path / "bad.sid"
    text = POINT.replace(old, new)
    path.write_text(text.replace("end Ke", "end Kx") if "Kx" in new else text)
    with pytest.raises(mbs.ModelError, match=message):
        io.read_sid(path, interfaces)


def test_two_interfaces_need_six_modes(tmp_path):
    path = tmp_path / "few.sid"
    node = POINT[POINT.index("new node = 1") : POINT.index("end frame")]
    tip = node.replace("node = 1", "node = 2").replace("  phi\n", "  phi\n    m0( 2, 1) = 1\n")
    path.write_text(POINT.replace(node, node + tip))
    with pytest.raises(mbs.ModelError, match="the modes move '2' in 1 independent ways of 6"):
        io.read_sid(path, ("1", "2"))


def test_what_is_not_written(tmp_path):
    moved = flexible.GeometricStiffening(jnp.zeros((6, 1, 1)), jnp.zeros((6, 3, 1, 1)), jnp.zeros((0, 1, 1)))
    parts = {"inertia": jnp.eye(10), "stiffness": jnp.eye(1), "damping": jnp.eye(1), "places": jnp.zeros((0, 3))}
    body = flexible.ElasticBody(**parts, interfaces=("a",), stiffening=moved)
    with pytest.raises(mbs.ModelError, match="its stiffening is of second order, which is not written"):
        io.write_sid(tmp_path / "x.sid", body)
