"""References to bodies: joints may be declared between frames, and frames on frames."""

import dataclasses

from ._declarations import GROUND, Frame, Model, resolve_frame


def resolve_references(model: Model) -> Model:
    """The model with every frame on a body and every joint between bodies.

    Invalid references are left unchanged; `_validation` reports them.
    """
    frames = {name: _frame_on_body(frame, model) for name, frame in model.frames.items()}
    joints = {}
    for name, joint in model.joints.items():
        parent, parent_frame = _joint_end(joint.parent, joint.parent_frame, model.bodies, frames)
        child, child_frame = _joint_end(joint.child, joint.child_frame, model.bodies, frames)
        joints[name] = dataclasses.replace(
            joint, parent=parent, parent_frame=parent_frame, child=child, child_frame=child_frame
        )
    return dataclasses.replace(model, frames=frames, joints=joints)


def _frame_on_body(frame, model):
    """The frame with its pose in the body that carries it, through other frames."""
    pose, on, passed = frame.pose, frame.body, {frame.name}
    while on in model.frames and on not in passed:
        passed.add(on)
        pose, on = model.frames[on].pose @ pose, model.frames[on].body
    return frame if on in passed else Frame(frame.name, on, pose)


def _joint_end(reference, place, bodies, frames):
    """Body of one end of a joint, and the joint's frame there."""
    if place is not None or isinstance(reference, str) and (reference == GROUND or reference in bodies):
        return reference, place
    try:
        return resolve_frame(reference, bodies, frames)
    except (KeyError, TypeError, ValueError):
        return reference, place
