"""Random chains and trees of revolute joints, and the same tree for this library and for Pinocchio."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

import jaxmbs as mbs


@dataclass(frozen=True)
class Links:
    """A random tree, numbered depth first: parents (-1 ground), joint placements, masses, centres and inertias."""

    parent: tuple[int, ...]
    rotation: np.ndarray
    position: np.ndarray
    mass: np.ndarray
    com: np.ndarray
    inertia: np.ndarray


def random_parents(n, rng):
    """Parents of a tree in which each new body hangs on any earlier one, renumbered depth first."""
    parent = [-1] + [int(rng.integers(k)) for k in range(1, n)]
    children = {k: [j for j in range(n) if parent[j] == k] for k in range(-1, n)}
    order, stack = [], children[-1][::-1]
    while stack:
        k = stack.pop()
        order.append(k)
        stack.extend(children[k][::-1])
    new = {-1: -1} | {k: i for i, k in enumerate(order)}
    return tuple(new[parent[k]] for k in order)


def random_links(shape, n, seed=0):
    """A "chain" or a "tree" of n bodies, about 0.3 m apart."""
    rng = np.random.default_rng(seed)
    parent = tuple(range(-1, n - 1)) if shape == "chain" else random_parents(n, rng)
    rotation = np.stack([_rotation(rng) for _ in range(n)])
    spread = rng.uniform(0.01, 0.03, (n, 3))
    principal = spread.sum(axis=1, keepdims=True) - spread  # of a body spread along three axes: A + B >= C
    axes = np.stack([_rotation(rng) for _ in range(n)])
    inertia = np.einsum("nij,nj,nkj->nik", axes, principal, axes)
    position, com = rng.normal(size=(n, 3)) * 0.2, rng.normal(size=(n, 3)) * 0.1
    return Links(parent, rotation, position, rng.uniform(0.5, 2.0, n), com, inertia)


def _rotation(rng):
    return Rotation.from_quat(rng.normal(size=4)).as_matrix()


def our_system(links):
    """The tree through `SystemBuilder`."""
    b = mbs.SystemBuilder()
    for k, parent in enumerate(links.parent):
        b.body(f"body_{k}", mass=links.mass[k], com=links.com[k], inertia=links.inertia[k])
        pose = mbs.Pose(links.position[k], links.rotation[k])
        on = "ground" if parent < 0 else f"body_{parent}"
        b.joint(f"joint_{k}", mbs.Revolute(axis="z"), parent=on, child=f"body_{k}", parent_frame=pose)
    system = b.build()
    if system.topology.nodes.parent != links.parent:
        raise RuntimeError("the tree was renumbered: states would not correspond to Pinocchio's")
    return system


def pinocchio_model(links):
    """The tree in Pinocchio, joints added depth first (its composite algorithms are silently wrong otherwise)."""
    import pinocchio as pin

    model = pin.Model()
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    for k, parent in enumerate(links.parent):
        placement = pin.SE3(links.rotation[k], links.position[k])
        joint = model.addJoint(parent + 1, pin.JointModelRZ(), placement, f"joint_{k}")
        model.appendBodyToJoint(joint, pin.Inertia(links.mass[k], links.com[k], links.inertia[k]), pin.SE3.Identity())
    return model
