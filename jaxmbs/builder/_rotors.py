"""Rotors behind a gear: a body that turns about the axis of a joint, coupled to its coordinate."""

import jax.numpy as jnp
import numpy as np

from ..checks import any_concrete, no_such, not_positive
from ..joints import Coupler, Prismatic, Revolute
from ..runtime import as_array
from ._declarations import Body, Constraint, Joint


def rotor_faults(joint: str, inertia, ratio, joints: dict[str, Joint]) -> list[str]:
    """Faults of a rotor on a joint of the joints declared so far."""
    if joint not in joints:
        return [f"rotor: {no_such('joint', joint, joints)}; declare the joint first"]
    where, kind, found = f"rotor of joint {joint!r}", joints[joint].kind, []
    if not isinstance(kind, Revolute | Prismatic):
        found.append(f"{where}: its joint must be Revolute or Prismatic, not {type(kind).__name__}")
    for name, value in (("inertia", inertia), ("ratio", ratio)):
        if np.shape(value) != ():
            found.append(f"{where}: {name} must be one number, got shape {np.shape(value)}")
        elif any_concrete(lambda x: ~np.isfinite(x), value):
            found.append(f"{where}: {name} must be finite")
    if not found and not_positive(inertia):
        found.append(f"{where}: inertia must be positive [kg m^2]")
    if not found and any_concrete(lambda x: x == 0.0, ratio):
        found.append(f"{where}: ratio must not be zero")
    return found


def rotor_parts(joint: Joint, inertia, ratio) -> tuple[Body, Joint, Constraint]:
    """Body and joint "joint.rotor", coupler "joint.gear" of a rotor, whose angle is `ratio` times the coordinate."""
    name, axis = f"{joint.name}.rotor", joint.kind.axis
    tensor = as_array(inertia) * jnp.outer(axis, axis)
    body = Body(name, 0.0, (0.0, 0.0, 0.0), tensor, None, any_inertia=True)
    turning = Joint(name, Revolute(axis), joint.parent, name, joint.parent_frame, None, joint.at)
    return body, turning, Constraint(f"{joint.name}.gear", Coupler({joint.name: ratio, name: -1.0}), None)
