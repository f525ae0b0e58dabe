"""Elastic bodies: inertia, energy of the nodes, statics, small vibrations, reactions and recovery, all against the
finite elements themselves."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

import jaxmbs as mbs
from jaxmbs.dynamics import _hamilton as hamilton
from jaxmbs.dynamics.paper._ports import resistance_field
from jaxmbs.elements import Hexahedron
from jaxmbs.fem import Structure, assemble, element_forces
from jaxmbs.flexible import deformations, displacements, floating_frame, interface_loads
from jaxmbs.kinematics._configuration import at_state, configuration, with_velocities
from jaxmbs.kinematics._poses import coordinate_rate
from jaxmbs.linear import LinearSystem
from jaxmbs.math._rotation import quaternion_exp
from jaxmbs.reductions import CraigBampton, reduce, rigid_node
from jaxmbs.viz._drawable import body_frames
from tests.models import slopes

from .beams import beam_structure, elastic_beam, random_state

RIGID_ROWS = 6


@pytest.fixture(scope="module")
def whole():
    """A beam of two elements with all its modes: nothing is lost by the reduction."""
    return elastic_beam(elements=2, num_modes=6, damping_ratio=0.02)


@pytest.fixture(scope="module")
def flying(whole):
    """It flies, a rigid body hinged to its tip."""
    b = mbs.SystemBuilder(gravity=(0.3, -0.5, -9.81))
    b.elastic("arm", whole.body)
    b.body("tool", 0.5, com=(0.02, 0.01, 0.0), inertia=(1e-3, 2e-3, 2.5e-3))
    b.joint("float", mbs.Free(), "ground", "arm.0")
    b.joint("wrist", mbs.Revolute("y"), "arm.2", "tool", child_frame=(-0.1, 0.0, 0.0))
    return b.build()


@pytest.fixture(scope="module")
def state(flying):
    return random_state(flying, size=1e-3, speed=2.0)


@pytest.mark.long
def test_rigid_inertia_is_that_of_a_rod(whole):
    mass, length = 2700 * 4e-4, 1.0
    inertia = np.asarray(whole.body.inertia[:6, :6])
    expected = np.zeros((6, 6))
    expected[1, 1] = expected[2, 2] = mass * length**2 / 3
    expected[3:, 3:] = mass * np.eye(3)
    expected[2, 4] = expected[4, 2] = mass * length / 2
    expected[1, 5] = expected[5, 1] = -mass * length / 2
    expected[0, 0] = 2700 * (1.2e-8 + 1.5e-8) * length
    np.testing.assert_allclose(inertia, expected, atol=1e-12)


@pytest.mark.long
def test_kinetic_energy_is_that_of_the_nodes(whole, flying, state):
    """World positions of all nodes by hand, their velocities by jvp, the element's mass matrix in floating axes."""
    s = whole.system
    q, q_dot = deformations(flying, state, "arm")
    places = s.positions - s.positions[:1]

    def nodes(R, x, q):
        moved = (whole.shapes @ q).reshape(-1, 6)[:, :3]
        return x[None] + (places + moved) @ R.T

    R, x = mbs.rotation(flying, state, "arm.0"), mbs.position(flying, state, "arm.0")
    omega, v = mbs.kinematics.angular_velocity(flying, state, "arm.0"), mbs.velocity(flying, state, "arm.0")
    speeds = jax.jvp(nodes, (R, x, q), (jnp.cross(omega[None], R.T).T, v, q_dot))[1] @ R
    turning = (R.T @ omega)[None] + (whole.shapes @ q_dot).reshape(-1, 6)[:, 3:]
    y = np.concatenate([speeds, turning], axis=1).reshape(-1)
    tool = 0.5, mbs.velocity(flying, state, ("tool", (0.02, 0.01, 0.0)))
    spin = mbs.rotation(flying, state, "tool").T @ mbs.kinematics.angular_velocity(flying, state, "tool")
    rigid = 0.5 * tool[0] * tool[1] @ tool[1] + 0.5 * spin @ (jnp.array([1e-3, 2e-3, 2.5e-3]) * spin)
    expected = 0.5 * y @ np.asarray(s.mass) @ y + rigid
    np.testing.assert_allclose(mbs.dynamics.kinetic_energy(flying, state), expected, rtol=1e-12)
    M, u = mbs.mass_matrix(flying, state), state.velocities
    np.testing.assert_allclose(0.5 * u @ M @ u, expected, rtol=1e-12)


@pytest.mark.long
def test_reactions_are_what_the_elements_feel(whole, flying, state):
    """The wrist from the multibody equations against the equilibrium of the finite elements under their inertia."""
    loads = mbs.reactions(flying, state)
    R = mbs.rotation(flying, state, "arm.0")
    felt = interface_loads(flying, state, "arm", whole)
    at_tip = mbs.reactions(flying, state, side="parent")["wrist"]
    np.testing.assert_allclose(felt[1, :3], R.T @ at_tip.force, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(felt[1, 3:], R.T @ at_tip.moment, rtol=1e-9, atol=1e-6)
    assert np.abs(felt[0]).max() < 1e-9 * np.abs(felt[1]).max()  # it flies: nothing holds its root
    for name in ("float", "arm.2"):  # what is inside the elastic body is no joint's load
        assert np.abs(loads[name].force).max() < 1e-9 * np.abs(loads["wrist"].force).max()
    assert loads.residual < 1e-8


@pytest.mark.long
def test_recovery_by_accelerations_is_that_by_displacements(whole, flying, state):
    """Nothing was reduced away, so both agree and the elements' end forces with them."""
    by_force = displacements(flying, state, "arm", whole)
    by_shape = displacements(flying, state, "arm", whole, method="displacement")
    np.testing.assert_allclose(by_force, by_shape, atol=1e-9 * np.abs(by_shape).max())
    structure = beam_structure(1.0, 2)
    tip = np.asarray(element_forces(structure, by_force)["beam"])[1, 6:]
    assert np.all(np.isfinite(tip)) and np.abs(tip).max() > 1.0


@pytest.mark.long
def test_power_of_the_loads_is_the_change_of_energy(whole, flying, state):
    """Along the motion of the accelerations, kinetic and potential energy lose what the damping takes."""
    u_dot, _ = mbs.forward_dynamics(flying, state)
    psi_dot = coordinate_rate(flying.topology, state.coordinates, state.velocities)

    def energy(psi, u):
        here = mbs.State(state.t, psi, u)
        return mbs.dynamics.kinetic_energy(flying, here) + mbs.dynamics.potential_energy(flying, here)

    moving = (state.coordinates, state.velocities), (psi_dot, u_dot)
    rate = jax.jvp(energy, *moving)[1]
    parts = jax.jvp(lambda psi: energy(psi, 0 * state.velocities), (state.coordinates,), (psi_dot,))[1]
    q_dot = deformations(flying, state, "arm")[1]
    lost = q_dot @ whole.body.damping @ q_dot
    assert lost > 1.0
    np.testing.assert_allclose(rate, -lost, atol=1e-10 * abs(parts))


@pytest.mark.long
def test_rates_of_momenta_are_those_of_the_accelerations(whole, flying, state):
    """Hamilton's equations against the derivative of the momenta along Newton's; the power of the damping."""
    (psi, u), at = (state.coordinates, state.velocities), at_state(flying, state)
    u_dot, _ = mbs.forward_dynamics(flying, state)

    def momenta(psi, u):
        return hamilton.momenta(flying, with_velocities(flying, configuration(flying, at.P, psi, state.t), u))

    @jax.jit
    def both(psi, u):
        psi_dot = coordinate_rate(flying.topology, psi, u)
        here = with_velocities(flying, at_state(flying, state), u)
        return jax.jvp(momenta, (psi, u), (psi_dot, u_dot))[1], hamilton.tree_momentum_rate(flying, here)

    expected, (found, powers) = both(psi, u)
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.max(np.abs(expected)))
    q_dot = deformations(flying, state, "arm")[1]
    np.testing.assert_allclose(powers, [-q_dot @ whole.body.damping @ q_dot], rtol=1e-12)


@jax.jit
def _matrices(system, state):
    return mbs.mass_matrix(system, state), mbs.stiffness(system, state).total, resistance_field(system, state)


@pytest.mark.long
def test_frequencies_of_a_cantilever_are_those_of_its_elements():
    frame = elastic_beam(elements=4, num_modes=18, damping_ratio=0.02)
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.elastic("arm", frame.body)
    b.joint("clamp", mbs.Weld(), "ground", "arm.0")
    system = b.build()
    state = mbs.State.at(system)
    M, K, C = _matrices(system, state)
    values, shapes = scipy.linalg.eigh(K, M)
    s = frame.system
    held = (np.asarray(A)[RIGID_ROWS:, RIGID_ROWS:] for A in (s.stiffness, s.mass))
    np.testing.assert_allclose(values, scipy.linalg.eigh(*held, eigvals_only=True), rtol=1e-8)
    damped = shapes.T @ C @ shapes
    np.testing.assert_allclose(damped, np.diag(0.04 * np.sqrt(values)), rtol=1e-6, atol=1e-6 * damped.max())


@pytest.mark.long
def test_sag_and_clamping_moment_of_a_cantilever():
    """Closed forms `q L^4 / 8 E I` and `q L^2 / 2`."""
    frame = elastic_beam(elements=4, num_modes=0)
    b = mbs.SystemBuilder()
    b.elastic("arm", frame.body)
    b.joint("clamp", mbs.Weld(), "ground", "arm.0")
    system = b.build()
    load = frame.body.gravity_loads(jnp.zeros(6), jnp.array([0.0, 0.0, -9.81]))
    q = jnp.linalg.solve(frame.body.stiffness, load[6:])
    rest = mbs.State.at(system, {"arm.4": jnp.concatenate([q[:3], quaternion_exp(q[3:])])})
    weight = 2700 * 4e-4 * 9.81
    sag = mbs.position(system, rest, "arm.4")[2]
    np.testing.assert_allclose(sag, -weight / (8 * 7e10 * 1.2e-8), rtol=1e-4)
    clamp = mbs.reactions(system, rest)["clamp"]
    np.testing.assert_allclose(clamp.force, [0, 0, weight], atol=1e-6)
    np.testing.assert_allclose(clamp.moment[1], -weight / 2, rtol=1e-4)
    middle = displacements(system, rest, "arm", frame).reshape(-1, 6)[1:3, 2]
    x = np.array([0.25, 0.5])
    exact = -weight * x**2 * (6 - 4 * x + x**2) / (24 * 7e10 * 1.2e-8)
    np.testing.assert_allclose(middle, exact, rtol=2e-3)  # element loads are lumped on the nodes' shapes


@pytest.mark.long
def test_stiffness_of_a_bent_body_by_its_parts():
    """A cantilever whose tip hangs on a rod: `G^T K G`, and what strains make of the circle that the tip moves on."""
    body = elastic_beam(elements=1, num_modes=0).body
    K, anchor = np.asarray(body.stiffness), np.array([0.6, -0.5])  # from the tip, undeformed
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.elastic("arm", body, motions={"1": mbs.Planar("z")})
    b.joint("root", mbs.Weld(), "ground", "arm.0")
    b.constraint(
        "rod",
        mbs.joints.Distance(np.hypot(*anchor)),
        between=(("ground", (1.0 + anchor[0], anchor[1], 0.0)), "arm.1"),
    )
    system = b.build()
    state = mbs.State.at(system, guess={"arm.1": (0.02, -0.03, 0.05)})
    chosen = list(mbs.constraints.kic(system, state).independent)

    def bent(phi):
        tip = np.zeros(3)
        tip[chosen] = phi
        free = int(0 in chosen)  # x or y follows
        sign = np.sign(anchor[free])
        tip[free] = anchor[free] - sign * np.sqrt(anchor @ anchor - (tip[1 - free] - anchor[1 - free]) ** 2)
        return np.array([tip[0], tip[1], 0.0, 0.0, 0.0, tip[2]])

    phi = np.asarray(state.coordinates)[chosen]
    G = slopes(bent, phi)
    hessian = slopes(lambda phi: slopes(lambda phi: bent(phi) @ K @ bent(phi) / 2, phi, 1e-3), phi, 1e-3)
    found, scale = mbs.stiffness(system, state), np.max(np.abs(hessian))
    np.testing.assert_allclose(found.elastic, G.T @ K @ G, atol=1e-8 * scale)
    np.testing.assert_allclose(found.antagonistic, hessian - G.T @ K @ G, atol=1e-6 * scale)
    assert np.max(np.abs(found.antagonistic)) > 1e-3 * scale
    np.testing.assert_allclose(mbs.dynamics.potential_energy(system, state), bent(phi) @ K @ bent(phi) / 2, rtol=1e-9)


@pytest.mark.long
def test_a_component_known_by_its_reduced_matrices_alone():
    """Interface and modal coordinates only, as delivered by a partner: small vibrations are those of the full one."""
    full = elastic_beam(elements=4, num_modes=3)
    s = full.system
    ends = tuple(i for i, (node, _) in enumerate(s.coordinates) if node in ("0", "4"))
    reduced = reduce(s.with_interface(*ends), CraigBampton(3))
    labels = [*(s.coordinates[i] for i in ends), *(f"mode {k}" for k in range(3))]
    places = {"0": s.positions[0], "4": s.positions[4]}
    delivered = LinearSystem(
        mass=reduced.mass,
        stiffness=reduced.stiffness,
        damping=None,
        interface=labels[:12],
        coordinates=labels,
        positions=places,
    )
    frame = floating_frame(delivered, ("0", "4"), 3)
    for part in ("stiffness", "places"):
        np.testing.assert_allclose(getattr(frame.body, part), getattr(full.body, part), rtol=1e-8, atol=1e-3)
    m = frame.body.num_deformations
    for rows in (slice(0, 6), slice(-m, None)):
        a, b = (np.abs(np.asarray(f.body.inertia)[rows, -m:]) for f in (frame, full))  # signs of modes are free
        np.testing.assert_allclose(a, b, atol=1e-9)


@pytest.mark.long
def test_a_block_of_solids_held_by_its_faces():
    """Eight bricks between two rigid faces: mass, centre and inertia of the box; it stretches as `E A / l` says."""
    x, y, z = np.meshgrid([0.0, 0.3, 0.6], [-0.1, 0.0, 0.1], [-0.05, 0.0, 0.05], indexing="ij")
    number = np.arange(27).reshape(3, 3, 3)
    bricks = [
        number[i : i + 2, j : j + 2, k : k + 2].ravel()[[0, 4, 6, 2, 1, 5, 7, 3]] for i, j, k in np.ndindex(2, 2, 2)
    ]
    nodes = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    block = assemble(Structure(nodes, {"solid": (Hexahedron(7e10, 0.0, 2700.0), bricks)}))
    for name, face in (("left", number[0]), ("right", number[2])):
        block = rigid_node(block, name, face.ravel())
    body = floating_frame(block, ("left", "right"), 2).body
    mass, (a, b, c) = 2700 * 0.6 * 0.2 * 0.1, (0.6, 0.2, 0.1)
    spin = mass / 12 * np.array([b**2 + c**2, a**2 + c**2, a**2 + b**2]) + mass * 0.3**2 * np.array([0, 1, 1])
    np.testing.assert_allclose(np.diag(body.inertia)[:6], [*spin, mass, mass, mass], rtol=1e-9)
    np.testing.assert_allclose(body.places, [[0.6, 0.0, 0.0]], atol=1e-15)
    np.testing.assert_allclose(body.stiffness[0, 0], 7e10 * 0.02 / 0.6, rtol=1e-9)
    with pytest.raises(mbs.ModelError, match="another node has this name"):
        rigid_node(block, "left", ["right"])


@pytest.mark.long
def test_pictures_leave_the_modes_out(flying):
    shown = body_frames(flying.topology)
    assert shown[flying.topology.body_names.index("arm.modes")] == []
    assert len(shown[flying.topology.body_names.index("arm.0")]) >= 2


@pytest.mark.long
def test_faults_are_said():
    frame = elastic_beam(elements=2, num_modes=0)
    with pytest.raises(mbs.ModelError, match="no such node"):
        floating_frame(frame.system, ("0", "9"))
    held = LinearSystem(mass=frame.system.mass, stiffness=frame.system.stiffness + jnp.eye(18) * 1e6)
    with pytest.raises(mbs.ModelError, match="positions"):
        floating_frame(held, ("0",))
    s = frame.system
    sprung = LinearSystem(
        mass=s.mass,
        stiffness=s.stiffness + jnp.eye(18) * 1e6,
        damping=None,
        interface=(),
        coordinates=s.coordinates,
        positions=(s.nodes, s.positions),
    )
    with pytest.raises(mbs.ModelError, match="must be free"):
        floating_frame(sprung, ("0", "2"))
    b = mbs.SystemBuilder()
    b.elastic("arm", frame.body, motions={"5": mbs.Planar("z")})
    b.elastic("leg", "frame")
    with pytest.raises(mbs.ModelError, match="(?s)other interfaces are.*ElasticBody"):
        b.build()
    b = mbs.SystemBuilder()
    b.elastic("arm", frame.body)
    b.joint("clamp", mbs.Weld(), "ground", "arm.2")
    with pytest.raises(mbs.ModelError, match="name that interface first"):
        b.build()
    with pytest.raises(mbs.UnknownNameError, match="there is no elastic body"):
        deformations(clamped(frame), mbs.State.at(clamped(frame)), "leg")


def clamped(frame):
    b = mbs.SystemBuilder()
    b.elastic("arm", frame.body)
    b.joint("clamp", mbs.Weld(), "ground", "arm.0")
    return b.build()
