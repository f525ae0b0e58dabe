"""Imported models beside MuJoCo and Pinocchio at random states: mass matrix, bias efforts, poses; and loops beside a
hard constraint solved in NumPy."""

import dataclasses
import xml.etree.ElementTree as ET

import equinox as eqx
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

import jaxmbs as mbs
from jaxmbs.io.robots._imported import UniqueNames
from jaxmbs.io.robots._mjcf import _joint_names
from jaxmbs.kinematics._poses import frame_poses, node_parameters, node_poses
from jaxmbs.model._internal_states import InternalStates

ACTIVATION = 0.15  # of all actuators that have one


@jax.jit
def ours(system, state):
    """Mass matrix of the tree, efforts at no acceleration, rotation and position of every frame."""
    rest = jnp.zeros(system.topology.num_velocities)
    W = node_poses(system.topology, node_parameters(system), state.coordinates)
    poses = frame_poses(system.topology, system.frames, W)
    return mbs.mass_matrix(system, state), mbs.inverse_dynamics(system, state, rest), *poses


def random_values(system, seed, spread=1.0, imported=None):
    """Coordinates and velocities by joint, about the start of what was imported; none of followers."""
    random, q, v = np.random.default_rng(seed), {}, {}
    start = {} if imported is None else imported.start
    for joint in system.topology.joints:
        if joint.is_cut or joint.name in _followers(system, imported) or not joint.num_velocities:
            continue
        q[joint.name] = start.get(joint.name, 0.0) + spread * random.normal(size=joint.num_coordinates)
        if joint.num_coordinates > joint.num_velocities:
            q[joint.name][-4:] = Rotation.random(random_state=random).as_quat()[[3, 0, 1, 2]]
        v[joint.name] = spread * random.normal(size=joint.num_velocities)
    return q, v


def _followers(system, imported):
    """Coefficients by joint of rotors and fixed tendons, coordinates that follow joints: a name each."""
    declared = {} if imported is None else imported.builder.declared.constraints
    laws = [item.law for item in declared.values() if item.name.endswith((".gear", ".coupler"))]
    return {
        law.joints[0]: {joint: -float(c) for joint, c in zip(law.joints[1:], law.coefficients[1:], strict=True)}
        for law in laws
    }


def state_of(system, q, v, imported=None):
    """The state of these coordinates and velocities, no loops closed."""
    top = system.topology
    psi, u = np.zeros(top.num_coordinates), np.zeros(top.num_velocities)
    for joint in top.joints:
        if not joint.is_cut:
            psi[joint.coordinates], u[joint.velocities] = q.get(joint.name, 0.0), v.get(joint.name, 0.0)
    for name, leaders in _followers(system, imported).items():
        joint = top.joints[top.joint_index[name]]
        psi[joint.coordinates] = sum(c * q[leader] for leader, c in leaders.items())
        u[joint.velocities] = sum(c * v[leader] for leader, c in leaders.items())
    s = InternalStates(np.full(top.num_internal, ACTIVATION), top.internal) if top.num_internal else None
    return mbs.State(0.0, psi, u, internal=s)


def without_followers(system, imported, M, bias):
    """Mass matrix and bias on the joints' velocities alone, followers moving with them; names of the columns."""
    top, followers = system.topology, _followers(system, imported)
    first = {joint.name: joint.first_velocity for joint in top.joints}
    T = np.eye(len(M))
    for name, leaders in followers.items():
        for leader, c in leaders.items():
            T[first[name], first[leader]] += c
    kept = [joint for joint in top.joints if not joint.is_cut and joint.name not in followers]
    columns = [(joint.name, k) for joint in kept for k in range(joint.num_velocities)]
    T = T[:, [joint.first_velocity + k for joint in kept for k in range(joint.num_velocities)]]
    return T.T @ M @ T, T.T @ bias, columns


def relative(found, wanted):
    """The largest difference over the largest entry, or over one where all are smaller."""
    found, wanted = np.asarray(found), np.asarray(wanted)
    return float(np.max(np.abs(found - wanted), initial=0.0) / max(1.0, np.max(np.abs(wanted), initial=0.0)))


def against_mujoco(imported, model, seeds=(0, 1, 2), controls=None, spread=1.0):
    """Largest relative errors {"mass", "bias", "poses"} over random states; joints, bodies and sites by name.

    The bias has springs, dampers, friction, tendons and actuators.  What is left out here is switched off there.
    """
    _leave_out(model, imported)
    _slide(imported)
    system, data = imported.builder.build(), mujoco.MjData(model)
    numbers = {name: j for j, name in enumerate(joint_names(model))}
    errors = {"mass": 0.0, "bias": 0.0, "poses": 0.0}
    for name, value in (controls or {}).items():
        data.ctrl[model.actuator(name).id] = value
    for seed in seeds:
        q, v = random_values(system, seed, spread, imported)
        M, bias, R, x = map(np.asarray, ours(system, state_of(system, q, v, imported)))
        M, bias, columns = without_followers(system, imported, M, bias)
        for name in q:
            data.qpos[model.jnt_qposadr[numbers[name]] :][: len(q[name])] = q[name]
            data.qvel[model.jnt_dofadr[numbers[name]] :][: len(v[name])] = v[name]
        data.act[:] = ACTIVATION
        mujoco.mj_forward(model, data)
        order = [model.jnt_dofadr[numbers[name]] + k for name, k in columns]
        forces = data.qfrc_bias - data.qfrc_passive - data.qfrc_actuator - data.qfrc_constraint
        errors["mass"] = max(errors["mass"], relative(M, full_mass(model, data)[np.ix_(order, order)]))
        errors["bias"] = max(errors["bias"], relative(bias, forces[order]))
        errors["poses"] = max(errors["poses"], _poses(system, model, data, R, x))
    return errors


def _slide(imported):
    """Friction without a transition, at any speed that is not zero."""
    forces = imported.builder.declared.forces
    for name, item in forces.items():
        if name.endswith(".friction"):
            law = eqx.tree_at(
                lambda law: getattr(law, "law", law).friction.transition_speed, item.law, jnp.array(1e-12)
            )
            forces[name] = dataclasses.replace(item, law=law)


def joint_names(model):
    """Names of the joints as they are read."""
    names = UniqueNames()
    bodies = [model.body(k).name or f"body{k}" for k in range(model.nbody)]
    return [names(name) for name in _joint_names(model, bodies)]


def _leave_out(model, imported):
    """Contacts, limits, the fluid, tendons and actuators that are not there; friction is that of sliding at once."""
    bits = mujoco.mjtDisableBit
    model.opt.disableflags |= bits.mjDSBL_CONTACT | bits.mjDSBL_LIMIT | bits.mjDSBL_EQUALITY
    if not any(name.endswith(".friction") for name in imported.builder.declared.forces):
        model.opt.disableflags |= bits.mjDSBL_FRICTIONLOSS
    model.dof_solref[:], model.dof_solimp[:, :2], model.opt.timestep = (2e-9, 1.0), 0.9999, 1e-9
    model.tendon_solref_fri[:], model.tendon_solimp_fri[:, :2] = (2e-9, 1.0), 0.9999
    model.opt.density = model.opt.viscosity = 0.0
    model.body_sameframe[:] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE  # centres of mass within 1e-6 of frames count
    declared = imported.builder.declared
    for k in range(model.ntendon):
        name = model.tendon(k).name or f"tendon{k}"
        if not any(one in declared.forces for one in (f"{name}.spring", f"{name}.damper")):
            model.tendon_stiffness[k] = model.tendon_damping[k] = 0.0
        if f"{name}.friction" not in declared.forces:
            model.tendon_frictionloss[k] = 0.0
        if f"{name}.disc" not in declared.bodies:
            model.tendon_armature[k] = 0.0
    for a in range(len(model.actuator_trntype)):
        if (model.actuator(a).name or f"actuator{a}") not in declared.forces:
            model.actuator_gainprm[a] = model.actuator_biasprm[a] = 0.0


def full_mass(model, data):
    """(nv, nv), whichever way this release of MuJoCo hands it out.

    Where a free body alone has its centre of mass within a millionth of its frame, MuJoCo's matrix has it in the
    frame: columns are then efforts of unit accelerations, which have it where it is.
    """
    if np.any(model.body_ipos[model.body_simple > 0]):
        return _mass_by_efforts(model, data)
    M = np.zeros((model.nv, model.nv))
    try:
        mujoco.mj_fullM(model, M, data.qM)
    except (TypeError, AttributeError):
        mujoco.mj_fullM(model, data, M)
    return M


def _mass_by_efforts(model, data):
    M, still = np.diag(model.dof_armature), np.zeros(model.nv)
    mujoco.mj_rne(model, data, 0, still)
    for k, own in enumerate(np.eye(model.nv)):
        data.qacc[:], column = own, np.zeros(model.nv)
        mujoco.mj_rne(model, data, 1, column)
        M[:, k] += column - still
    return M


def _poses(system, model, data, R, x):
    worst, index = 0.0, system.topology.frame_index
    things = [(model.body(k).name, data.xmat[k], data.xpos[k]) for k in range(1, model.nbody)]
    things += [(model.site(k).name, data.site_xmat[k], data.site_xpos[k]) for k in range(model.nsite)]
    seen = set()
    for name, turned, place in things:
        if name and name in index and name not in seen:
            seen.add(name)
            worst = max(worst, relative(R[index[name]], turned.reshape(3, 3)), relative(x[index[name]], place))
    assert seen or not any(name for name, _, _ in things)
    return worst


def against_pinocchio(imported, path, seeds=(0, 1, 2)):
    """The same errors of a URDF on a fixed base whose joints have one coordinate each."""
    system, model = imported.builder.build(), pin.buildModelFromUrdf(str(path))
    model.gravity.linear = np.asarray(system.gravity)
    data, errors = model.createData(), {"mass": 0.0, "bias": 0.0, "poses": 0.0}
    for seed in seeds:
        q, v = random_values(system, seed)
        M, bias, R, x = map(np.asarray, ours(system, state_of(system, q, v)))
        M, bias, columns = without_followers(system, imported, M, bias)
        psi, u = pin.neutral(model), np.zeros(model.nv)
        for name, (angle,) in q.items():
            own = model.joints[model.getJointId(name)]
            psi[own.idx_q : own.idx_q + own.nq] = angle if own.nq == 1 else (np.cos(angle), np.sin(angle))
            u[own.idx_v] = v[name][0]
        order = [model.joints[model.getJointId(name)].idx_v for name, _ in columns]
        theirs = np.triu(pin.crba(model, data, psi))
        theirs = theirs + np.triu(theirs, 1).T
        errors["mass"] = max(errors["mass"], relative(M, theirs[np.ix_(order, order)]))
        errors["bias"] = max(errors["bias"], relative(bias, pin.rnea(model, data, psi, u, 0.0 * u)[order]))
        pin.framesForwardKinematics(model, data, psi)
        for name, k in system.topology.frame_index.items():
            if model.existBodyName(name):
                place = data.oMf[model.getFrameId(name, pin.FrameType.BODY)]
                worst = max(relative(R[k], place.rotation), relative(x[k], place.translation))
                errors["poses"] = max(errors["poses"], worst)
    return errors


def mujoco_of_urdf(path):
    """MuJoCo's own reading of a URDF without its shapes; None where it refuses the inertias."""
    root = ET.fromstring(path.read_text(encoding="utf-8"))
    for link in root.findall("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", fusestatic="false", discardvisual="false")
    try:
        return mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
    except ValueError:
        return None


def mujoco_without_meshes(text):
    """MuJoCo's own reading of an MJCF text whose bodies have inertias, without shapes of meshes and tendons; its free
    joints are named as ours."""
    root = ET.fromstring(text)
    for k, body in enumerate(root.iter("body"), start=1):
        for joint in body.findall("freejoint"):
            joint.set("name", joint.get("name", f"{body.get('name', f'body{k}')}.free"))
    for parent in list(root.iter()):
        for child in list(parent):
            shape = child.tag == "mesh" or (child.tag == "geom" and child.get("mesh"))
            tendon = child.tag == "tendon" or child.get("tendon") or child.get("tendon1")
            if shape or tendon:
                parent.remove(child)
    return mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))


def against_hard_constraint(imported, model, q, v, guess):
    """Relative errors {"closing", "accelerations"} of a model with loops in the state of some joints' values: how far
    MuJoCo's equalities are from zero there, and our accelerations beside `hard_accelerations`."""
    system = imported.builder.build()
    state = mbs.State.at(system, q, v, guess=guess)
    assert state.ok
    _leave_out(model, imported)
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_EQUALITY)
    data = mujoco.MjData(model)
    q, v = system.coordinates(state), system.velocities(state)
    order, own = [], []
    u_dot = np.asarray(mbs.forward_dynamics(system, state)[0])
    for joint in system.topology.joints:
        if joint.is_cut or joint.name in _followers(system, imported) or not joint.num_velocities:
            continue
        theirs = model.joint(joint.name)
        data.qpos[theirs.qposadr[0] :][: np.size(q[joint.name])] = q[joint.name]
        data.qvel[theirs.dofadr[0] :][: np.size(v[joint.name])] = v[joint.name]
        order += range(theirs.dofadr[0], theirs.dofadr[0] + joint.num_velocities)
        own += [*u_dot[joint.velocities]]
    mujoco.mj_forward(model, data)
    residuals = data.efc_pos[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
    accelerations = relative(own, hard_accelerations(model, data)[order])
    return {"closing": relative(residuals, 0.0 * residuals), "accelerations": accelerations}


def hard_accelerations(model, data):
    """Accelerations (nv,) of MuJoCo's tree with its equalities held exactly: `M a + bias = J^T f`, `J a = gamma`."""
    nv = model.nv
    rows = [_rows(model, data, e) for e in range(model.neq) if model.eq_active0[e]]
    J, gamma = np.concatenate([r[0] for r in rows]), np.concatenate([r[1] for r in rows])
    M = full_mass(model, data)
    K = np.block([[M, J.T], [J, np.zeros((len(J), len(J)))]])
    load = data.qfrc_passive + data.qfrc_actuator - data.qfrc_bias
    return np.linalg.lstsq(K, np.concatenate([load, gamma]), rcond=1e-12)[0][:nv]


def _rows(model, data, e):
    """Jacobian (m, nv) and right-hand side (m,) of one equality."""
    kind, one, two, parts = model.eq_type[e], model.eq_obj1id[e], model.eq_obj2id[e], model.eq_data[e]
    if kind == mujoco.mjtEq.mjEQ_JOINT:
        return _coupled(model, data, one, two, parts)
    weld = kind == mujoco.mjtEq.mjEQ_WELD
    if model.eq_objtype[e] == mujoco.mjtObj.mjOBJ_SITE:
        ends = [(model.site_bodyid[site], data.site_xpos[site]) for site in (one, two)]
    else:
        points = (parts[3:6], parts[:3]) if weld else (parts[:3], parts[3:6])
        ends = [(k, data.xpos[k] + data.xmat[k].reshape(3, 3) @ x) for k, x in zip((one, two), points, strict=True)]
    J, rates = [], []
    for body, point in ends:
        own = np.zeros((2, 3, model.nv))
        mujoco.mj_jac(model, data, own[0], own[1], point, body)
        moved = np.zeros((2, 3, model.nv))
        mujoco.mj_jacDot(model, data, moved[0], moved[1], point, body)
        J.append(own)
        rates.append(moved @ data.qvel)
    kept = slice(0, 2 if weld else 1)
    return (J[0] - J[1])[kept].reshape(-1, model.nv), (rates[1] - rates[0])[kept].reshape(-1)


def _coupled(model, data, one, two, parts):
    J, gamma = np.zeros((1, model.nv)), np.zeros(1)
    J[0, model.jnt_dofadr[one]] = 1.0
    if two >= 0:
        x = data.qpos[model.jnt_qposadr[two]] - model.qpos0[model.jnt_qposadr[two]]
        curve = np.polynomial.Polynomial(parts[:5])
        J[0, model.jnt_dofadr[two]] = -curve.deriv()(x)
        gamma[0] = curve.deriv(2)(x) * data.qvel[model.jnt_dofadr[two]] ** 2
    return J, gamma
