"""The library's answers for many drawn mechanisms at once, and how far they are from the judge's."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pinocchio as pin

import jaxmbs as mbs

from . import random_models as rm
from . import reference

ERRORS = ("accelerations", "wrenches", "residual", "open")


@functools.cache
def like(top):
    """The first build of a topology, at the pose that all joints call zero."""
    return rm.build(top, rm.Drawn(top, 0, spread=0.0).numbers)


@functools.cache
def answers_of(top, assembled=True):
    """Function of the numbers of one mechanism to accelerations, wrenches and what the library says of them."""
    first = like(top)

    def answers(numbers):
        system = rm.build(top, numbers, first)
        state = rm.state(system, top, numbers, assembled)
        loads = mbs.reactions(system, state, frame="joint")
        joints = [loads[f"j{k}"] for k in range(len(top.joints))]
        return {
            "accelerations": mbs.forward_dynamics(system, state)[0],
            "wrenches": jnp.stack([jnp.concatenate([j.force, j.moment]) for j in joints]),
            "residual": loads.residual,
            "open": state.residual,
            "ok": state.ok & loads.ok,
            "mass": mbs.mass_matrix(system, state),
        }

    return answers


@functools.cache
def compiled(top, assembled=True):
    """`answers_of` for a batch of designs side by side."""
    return jax.jit(jax.vmap(answers_of(top, assembled)))


def drawn(top, seed, number, setting="plain"):
    """Mechanisms of a topology, and their numbers stacked."""
    found = [rm.Drawn(top, seed + k, setting) for k in range(number)]
    return found, {name: np.stack([d.numbers[name] for d in found]) for name in found[0].numbers}


def rows(tree, k):
    return {name: np.asarray(value)[k] for name, value in tree.items()}


def columns(top, k):
    """Places of the joint's rates among the library's velocities; None for a cut joint."""
    record = like(top).topology.joints[like(top).topology.joint_index[f"j{k}"]]
    return None if record.is_cut else np.arange(*record.velocities.indices(10**6))


def marks(top):
    """What the library calls unique, (joints, 6)."""
    topology = like(top).topology
    found = np.array(topology.analysis.undetermined) if topology.analysis else np.zeros((len(top.joints), 6), bool)
    return ~found[[topology.joint_index[f"j{k}"] for k in range(len(top.joints))]]


def errors(draw, found, in_energy=False):
    """Relative errors of one lane: of accelerations, of wrenches both call unique, the library's own residuals; the
    judge's answer."""
    truth = reference.answer(draw.mechanism, draw.twist)
    wanted = np.zeros_like(found["accelerations"])
    for k, a in enumerate(truth.accelerations):
        place = columns(draw.top, k)
        if place is not None:
            wanted[place] = a
    length = draw.mechanism.size
    gravity = np.linalg.norm(draw.mechanism.gravity)
    fastest = np.max(np.abs(wanted), initial=gravity)
    units = np.r_[np.ones(3), np.full(3, 1.0 / length)]
    weight = np.min(draw.mechanism.mass) * gravity
    largest = max(np.max(np.abs(truth.wrenches * units)), weight)
    both = truth.unique & marks(draw.top)
    gaps = np.abs(found["wrenches"] - truth.wrenches) * units * both
    off = np.max(np.abs(found["accelerations"] - wanted), initial=0.0) / fastest
    if in_energy:
        M, gap = found["mass"], found["accelerations"] - wanted
        off = np.sqrt(gap @ M @ gap / (wanted @ M @ wanted))
    return {
        "accelerations": off,
        "wrenches": np.max(gaps) / largest,
        "residual": found["residual"] / (largest * max(1.0, length)),
        "open": found["open"] / max(1.0, length),
    }, truth


# --------------------------------------------------------------------------------------------- trees in Pinocchio
@functools.cache
def tree_answers(top):
    """Forward and inverse dynamics and mass matrices of a batch of trees."""
    first = like(top)

    def answers(numbers, acceleration):
        system = rm.build(top, numbers, first)
        state = rm.state(system, top, numbers)
        inverse = mbs.inverse_dynamics(system, state, acceleration)
        return {
            "forward": mbs.forward_dynamics(system, state)[0],
            "inverse": inverse,
            "mass": mbs.mass_matrix(system, state),
        }

    return jax.jit(jax.vmap(answers))


def _simple_joints(joint):
    """Pinocchio's joints that make up a joint, in canonical axes."""
    x, y, z = np.eye(3)
    turn, slide = pin.JointModelRevoluteUnaligned, pin.JointModelPrismaticUnaligned
    return {
        "revolute": lambda: [turn(z)],
        "prismatic": lambda: [slide(z)],
        "cylindrical": lambda: [slide(z), turn(z)],
        "universal": lambda: [turn(x), turn(y)],
        "spherical": lambda: [pin.JointModelSpherical()],
        "planar": lambda: [slide(x), slide(y), turn(z)],
        "screw": lambda: [pin.JointModelHelicalUnaligned(z, joint.pitch)],
        "free": lambda: [slide(x), slide(y), slide(z), pin.JointModelSpherical()],
        "weld": lambda: [],
    }[joint.kind]()


def pinocchio_tree(draw):
    """Model, coordinates and rates of a drawn tree in Pinocchio, and for each joint its places and sign there.

    A joint declared towards the ground moves the other way round.
    """
    model, m, at, signs = pin.Model(), draw.mechanism, {-1: (0, rm.IDENTITY)}, []
    model.gravity.linear = m.gravity
    q, u, first = [], [], 0
    numbers = draw.numbers
    for k, joint in enumerate(m.joints):
        inner, outer, near, far, sign = joint.parent, joint.child, joint.parent_frame, joint.child_frame, 1.0
        if inner not in at:
            inner, outer, near, far, sign = outer, inner, far, near, -1.0
        index, place = at[inner]
        turn = (joint.turn, np.zeros(3))
        place = rm.after(rm.after(place, near), turn)
        for part in _simple_joints(joint):
            index = model.addJoint(index, part, pin.SE3(*place), f"{k}_{model.njoints}")
            place = rm.IDENTITY
        at[outer] = index, rm.after(rm.after(place, rm.back(turn)), rm.back(far))
        body = pin.Inertia(m.mass[outer], m.com[outer], m.inertia[outer])
        model.appendBodyToJoint(index, body, pin.SE3(*at[outer][1]))
        nq, nv = reference.num_coordinates(joint.kind), reference.num_rates(joint.kind)
        values = sign * numbers["coordinates"][k, :nq]
        if joint.kind in ("spherical", "free"):
            values = np.r_[values[:-4], np.roll(values[-4:], -1)]
        q.append(values)
        u.append(sign * numbers["rates"][k, :nv])
        signs.append((np.arange(first, first + nv), sign))
        first += nv
    return model, np.concatenate(q), np.concatenate(u), signs


def tree_truth(draw, acceleration):
    """Forward and inverse dynamics and mass matrix of a drawn tree by Pinocchio, in the library's order."""
    model, q, u, signs = pinocchio_tree(draw)
    order, sign = np.zeros(len(u), int), np.zeros(len(u))
    for k, (place, s) in enumerate(signs):
        mine = columns(draw.top, k)
        order[mine], sign[mine] = place, s
    a = np.zeros(len(u))
    a[order] = sign * acceleration
    forward = pin.aba(model, model.createData(), q, u, np.zeros_like(u))
    inverse = pin.rnea(model, model.createData(), q, u, a)
    M = np.triu(pin.crba(model, model.createData(), q))
    M = M + np.triu(M, 1).T
    return {
        "forward": sign * forward[order],
        "inverse": sign * inverse[order],
        "mass": sign[:, None] * sign * M[np.ix_(order, order)],
    }
