"""Random trees described once and built three times: here, in MuJoCo and in Pinocchio."""

from dataclasses import dataclass

import jax.numpy as jnp
import mujoco
import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

import jaxmbs as mbs

GRAVITY = (0.3, -0.5, -9.81)


@dataclass
class Link:
    """One body with the joint that carries it; frames are (rotation, position) pairs in body axes."""

    parent: int
    kind: object
    parent_frame: tuple
    child_frame: tuple
    mass: float
    com: np.ndarray
    inertia: np.ndarray


def depth_first_parents(random, n):
    """Random parent numbers of n nodes in depth-first order; -1 is the ground."""
    parents, open_path = [], [-1]
    for k in range(n):
        del open_path[1 + random.integers(0, len(open_path)) :]
        parents.append(open_path[-1])
        open_path.append(k)
    return tuple(parents)


def random_pose(random):
    """(rotation, position) with entries of order one."""
    return Rotation.random(random_state=random).as_matrix(), random.normal(size=3) * 0.4


def random_inertia(random, size=0.1):
    """Inertia (3, 3) of a random box about its centre, in random axes."""
    a, b, c = size * random.uniform(0.5, 1.5, 3)
    R = Rotation.random(random_state=random).as_matrix()
    return R @ np.diag([b + c, c + a, a + b]) @ R.T


def random_links(seed, kinds, parents=None):
    """Links with the joint kinds given, on a random tree unless `parents` says otherwise."""
    random = np.random.default_rng(seed)
    parents = depth_first_parents(random, len(kinds)) if parents is None else parents
    return [
        Link(
            parent,
            kind,
            random_pose(random),
            random_pose(random),
            random.uniform(0.5, 2.0),
            random.normal(size=3) * 0.3,
            random_inertia(random),
        )
        for parent, kind in zip(parents, kinds, strict=True)
    ]


def as_pose(pair):
    """`Pose` of a (rotation, position) pair."""
    return mbs.Pose(pair[1], pair[0])


def after(a, b):
    """Pose pair a, then b given in a."""
    return a[0] @ b[0], a[0] @ b[1] + a[1]


def back(a):
    """Inverse of a pose pair."""
    return a[0].T, -a[0].T @ a[1]


def build(links, gravity=GRAVITY, like=None):
    """The system; body k is "b<k>", its joint "j<k>"."""
    b = mbs.SystemBuilder(gravity=gravity)
    for k, link in enumerate(links):
        b.body(f"b{k}", mass=link.mass, com=link.com, inertia=link.inertia)
    for k, link in enumerate(links):
        parent = "ground" if link.parent < 0 else f"b{link.parent}"
        frames = {"parent_frame": as_pose(link.parent_frame), "child_frame": as_pose(link.child_frame)}
        b.joint(f"j{k}", link.kind, parent, f"b{k}", **frames)
    return b.build(like=like)


def random_state(system, seed, spread=1.0):
    """Random coordinates (unit quaternions) and velocities as a State."""
    random = np.random.default_rng(seed)
    psi = spread * random.normal(size=system.topology.num_coordinates)
    for first in system.topology.balls:
        at = system.topology.node_coordinate[first]
        psi[at : at + 4] = Rotation.random(random_state=random).as_quat()[[3, 0, 1, 2]]
    u = spread * random.normal(size=system.topology.num_velocities)
    return mbs.State(jnp.zeros(()), jnp.asarray(psi), jnp.asarray(u))


def _placement(links, link):
    """Pose of a link's joint in the joint frame of its parent, and its inertia there: the others' body frames."""
    above = (np.eye(3), np.zeros(3)) if link.parent < 0 else back(links[link.parent].child_frame)
    R, p = link.child_frame
    return after(above, link.parent_frame), R.T @ (link.com - p), R.T @ link.inertia @ R


def pinocchio_model(links, gravity=GRAVITY):
    """The same tree of revolute, prismatic and spherical joints in Pinocchio, joints depth first."""
    model = pin.Model()
    model.gravity.linear = np.asarray(gravity, float)
    for k, link in enumerate(links):
        kind = type(link.kind).__name__
        if kind == "Spherical":
            joint = pin.JointModelSpherical()
        else:
            axis = np.array(link.kind.axis) / np.linalg.norm(link.kind.axis)
            joint = {"Revolute": pin.JointModelRevoluteUnaligned, "Prismatic": pin.JointModelPrismaticUnaligned}[
                kind
            ](axis)
        (R, p), com, inertia = _placement(links, link)
        index = model.addJoint(link.parent + 1, joint, pin.SE3(R, p), f"j{k}")
        model.appendBodyToJoint(index, pin.Inertia(link.mass, com, inertia), pin.SE3.Identity())
    return model


def pinocchio_coordinates(links, psi):
    """Coordinates with Pinocchio's order of quaternions (x, y, z, w)."""
    out, at = [], 0
    for link in links:
        size = 4 if type(link.kind).__name__ == "Spherical" else 1
        q = psi[at : at + size]
        out.append(np.roll(q, -1) if size == 4 else q)
        at += size
    return np.concatenate(out)


def _mujoco_joints(kind):
    """MJCF of the joints that make up a kind, in joint axes."""
    name = type(kind).__name__

    def one(what, axis):
        return f'<joint type="{what}" axis="{axis[0]:.17g} {axis[1]:.17g} {axis[2]:.17g}"/>'

    if name == "Free":
        return "<freejoint/>"
    if name == "Spherical":
        return '<joint type="ball"/>'
    if name == "Weld":
        return ""
    if name == "Universal":
        return "".join(one("hinge", np.asarray(axis)) for axis in kind.axes)
    if name == "Planar":  # normal x: the plane's axes are y and z
        assert np.allclose(kind.normal, (1.0, 0.0, 0.0))
        return one("slide", (0.0, 1.0, 0.0)) + one("slide", (0.0, 0.0, 1.0)) + one("hinge", (1.0, 0.0, 0.0))
    axis = np.asarray(kind.axis)
    what = {"Revolute": ("hinge",), "Prismatic": ("slide",), "Cylindrical": ("slide", "hinge")}[name]
    return "".join(one(w, axis) for w in what)


def mujoco_model(links, gravity=GRAVITY):
    """The same tree in MuJoCo; free joints stand on the ground with an identity parent frame."""
    text = {-1: ""}
    children = {k: [j for j, link in enumerate(links) if link.parent == k] for k in range(-1, len(links))}

    def body(k):
        (R, p), com, I = _placement(links, links[k])
        quat = Rotation.from_matrix(R).as_quat()[[3, 0, 1, 2]]
        full = (I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2])
        numbers = {name: " ".join(f"{x:.17g}" for x in v) for name, v in dict(p=p, q=quat, c=com, i=full).items()}
        inner = "".join(body(j) for j in children[k])
        return (
            f'<body name="b{k}" pos="{numbers["p"]}" quat="{numbers["q"]}">{_mujoco_joints(links[k].kind)}'
            f'<inertial pos="{numbers["c"]}" mass="{links[k].mass:.17g}" fullinertia="{numbers["i"]}"/>{inner}</body>'
        )

    text = "".join(body(k) for k in children[-1])
    g = " ".join(f"{x:.17g}" for x in gravity)
    xml = (
        f'<mujoco><compiler angle="radian"/><option gravity="{g}" timestep="0.001"/>'
        f"<worldbody>{text}</worldbody></mujoco>"
    )
    return mujoco.MjModel.from_xml_string(xml)


def mujoco_data(model, state):
    """Data at a state, accelerations computed."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = np.asarray(state.coordinates), np.asarray(state.velocities)
    mujoco.mj_forward(model, data)
    return data
