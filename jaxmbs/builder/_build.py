"""Build of a `System` from a declared model: spanning tree, bodies split where loops need it, mobility."""

import dataclasses
import functools
from collections.abc import Iterable

import jax.numpy as jnp

from ..checks import is_concrete
from ..constraints._linear_solver import with_linear_solver
from ..constraints._mobility import with_mobility
from ..errors import ModelError, warn
from ..joints import AbstractRows, Weld
from ..model._internal_states import replace_field
from ..model._open_friction import open_friction, warn_of_open_friction
from ..model._pose import Pose
from ..model._scale import warn_of_scale
from ..model._system import System
from ._arrays import reference_poses
from ._assemble_system import assemble_system
from ._block_connections import with_placeholders
from ._block_groups import block_items
from ._declarations import Body, Joint, Model
from ._laws_in_place import with_laws_in_place
from ._mobility import analyse_mobility, check_closure_and_inertia
from ._signal_shapes import with_blocks
from ._spanning_tree import spanning_tree
from ._user_rows import row_faults
from ._validation import system_law_faults


def build_system(
    model: Model, like: System | None, independent: Iterable[str] | None, cut: set[str], guess, linear_solver: str
) -> System:
    """The system of a model without faults; see `SystemBuilder.build`."""
    guess = {name: joint.guess for name, joint in model.joints.items() if joint.guess is not None} | guess
    model = dataclasses.replace(model, bodies=dict(model.bodies), joints=dict(model.joints))
    if model.blocks:
        model = with_placeholders(model)
    system = with_laws_in_place(assemble_system(model, _cut_loops(model, cut), guess))
    if like is not None and linear_solver == "auto":
        linear_solver = like.topology.linear_solver
    system = with_linear_solver(system, linear_solver)
    found = system_law_faults(model.forces.values(), system.topology)
    if model.measures or model.blocks:
        system, more = with_blocks(system, block_items(model), model.forces)
        found += more
    if found:
        raise ModelError(found)
    if like is not None:
        return _with_mobility_like(system, like)
    if found := row_faults(system):
        raise ModelError(found)
    traced = not is_concrete(system)
    if traced and system.has_constraints:
        raise ModelError(["a traced model with constraints needs build(like=system) with a concrete build of it"])
    _warn_single_precision()
    if traced:
        return system
    system = analyse_mobility(system, independent)
    warn_of_scale(system)
    if system.friction is not None:
        warn_of_open_friction(system)
        system = _with_shared_loads(system, bool(open_friction(system)))
    return system


def _with_shared_loads(system, is_shared):
    """The system with the flag that compliances share loads of its rubbing joints."""
    if system.friction.is_shared == is_shared:
        return system
    return replace_field(system, "friction", replace_field(system.friction, "is_shared", is_shared))


def _cut_loops(model, cut):
    """Spanning tree of a model; a loop whose joints must all keep their coordinates is cut inside a body."""
    keep = _joints_in_tree(model)
    tree = spanning_tree(model.bodies, model.joints, keep, cut)
    split = [name for name in tree.cuts if name in keep]
    if split:
        _split_bodies(split, model)
        tree = spanning_tree(model.bodies, model.joints, keep, {f"{n}.weld" for n in split} | (cut - keep))
    loose = [name for name in tree.cuts if model.joints[name].kind.num_rows == 0]
    if loose:
        raise ModelError([f"joint {n!r} (Free) leaves all motions free, so it cannot close a loop" for n in loose])
    return tree


def _joints_in_tree(model):
    """Names of the joints that must keep their coordinate, for a law, a drive, a coupler or an elastic body."""
    names = {n for e in model.elastic.values() for n in e.joints}
    names |= {f.joint for f in model.forces.values() if f.joint is not None}
    names |= {j.name for j in model.joints.values() if j.drive is not None}
    names |= {m.joint for m in model.measures.values() if m.joint is not None}
    for item in model.constraints.values():
        if isinstance(item.law, AbstractRows):
            names |= set(item.law.joints)
    return names


def _split_bodies(names, model):
    """Cut loops whose every joint is needed inside a body: a massless twin of the child, welded to it."""
    bodies, joints = model.bodies, model.joints
    world = reference_poses(bodies, joints, model.frames) if any(j.at is not None for j in joints.values()) else {}
    for name in names:
        joint = joints[name]
        twin = f"{joint.child}.{name}"
        place = world.get(joint.child)
        pose = None if place is None else Pose(place[1], place[0])
        bodies[twin] = Body(twin, 0.0, (0.0, 0.0, 0.0), 0.0, pose)
        frame = joint.child_frame
        joints[name] = dataclasses.replace(joint, child=twin)
        joints[f"{name}.weld"] = Joint(f"{name}.weld", Weld(), joint.child, twin, None, None, None, is_hidden=True)
        if isinstance(frame, str):
            raise ModelError([f"joint {name!r}: give child_frame as a point or Pose, its body must be split"])


@functools.cache
def _warn_single_precision():
    if jnp.result_type(float).itemsize == 4:
        warn(
            "building in single precision: loops close to 1e-4 and stiff systems lose all digits; "
            "call jax.config.update('jax_enable_x64', True) first"
        )


def _with_mobility_like(system, like):
    """The system with the mobility of `like`; closed loops and inertia are checked where its numbers are concrete."""
    guess = system.topology.guess or like.topology.guess
    joints = _labelled_like(system.topology.joints, like.topology.joints)
    system = dataclasses.replace(system, topology=dataclasses.replace(system.topology, guess=guess, joints=joints))
    if system.topology != dataclasses.replace(like.topology, analysis=None, guess=guess):
        raise ModelError(
            ["build(like=system): the topology differs; names, joints and their order must be those of `like`"]
        )
    if like.topology.analysis is None:
        return system
    if is_concrete(system):
        check_closure_and_inertia(system)
    if system.friction is not None and like.friction is not None:
        system = _with_shared_loads(system, like.friction.is_shared)
    return with_mobility(system, like.topology.analysis, like.length)


def _labelled_like(joints, others):
    """Joints with the labels of those of another system: a direction that is traced, or another, has no name."""
    if len(joints) != len(others):
        return joints
    pairs = zip(joints, others, strict=True)
    return tuple(dataclasses.replace(j, labels=o.labels) if len(o.labels) == len(j.labels) else j for j, o in pairs)
