"""Registry of names in model files: classes of the library, and functions and classes of users.

A file holds names, never code or places where code lies; what has no name here is refused.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

from ... import (
    blocks,
    contact,
    design,
    elements,
    fem,
    flexible,
    forces,
    friction,
    hydraulics,
    joints,
    linear,
    model,
    reductions,
    vehicles,
)
from ...builder import _declarations as declarations
from ...builder._elastic import ElasticDeclaration
from ...model._elastic import ElasticBody, GeometricStiffening
from ...typing import WordedError
from ..robots._equalities import PolynomialCoupling
from ..robots._servo import ServoActuator, SiteActuator

_ROOMS = (joints, friction, forces, contact, blocks, hydraulics, elements, reductions, vehicles)
_OTHER_CLASSES = (
    *(model.Pose, ElasticBody, GeometricStiffening, linear.LinearSystem, fem.Structure, fem.Group, design.Limit),
    *(joints.Modal, flexible.FloatingFrame, PolynomialCoupling),
    *(ServoActuator, SiteActuator),
)
#: The class of the rows of every table of a builder.
ROWS = {
    "bodies": declarations.Body,
    "frames": declarations.Frame,
    "joints": declarations.Joint,
    "forces": declarations.ForceElement,
    "constraints": declarations.Constraint,
    "elastic": ElasticDeclaration,
    "hydraulics": declarations.Hydraulic,
    "measures": declarations.Measure,
    "blocks": declarations.Block,
    "friction": declarations.Friction,
}
#: What a law declares, and the elements of which the builder makes a cable: no file has them.
_MADE_OF = (forces.InternalState, forces.ElementBond, forces.Attachment, forces.Eyelet, forces.Sheave)
_MADE_OF += (forces.WrapCylinder, forces.WrapSphere)
_MADE_OF += (vehicles.Compression, vehicles.ContactForces, vehicles.Slip, vehicles.SlipSlopes, vehicles.TirFile)
#: Names of classes in files of before.
_EARLIER = {"BristleContact": "Contact", "BristleForce": "FrictionForce"}
_registered: dict[str, Any] = {}


def register(name: str, item: WordedError[Callable]) -> None:
    """Register a function or class under a name for model files; a name used before is replaced.

    A function's own numbers are not in the file: make them fields of an `equinox.Module` class, register the class.

    Raises: ValueError for a name that the library uses; TypeError for what is neither function nor class, and for a
    class that runs foreign code.
    """
    if name in classes():
        raise ValueError(f"the name {name!r} is that of a class of the library")
    if not callable(item) or not (isinstance(item, type) or hasattr(item, "__qualname__")):
        raise TypeError(f"only functions and classes have names in model files, not {type(item).__name__}")
    if getattr(item, "runs_foreign_code", False):
        raise TypeError(f"{item.__qualname__} runs foreign code, which no model file brings")
    _registered[name] = item


@functools.cache
def classes() -> dict[str, type]:
    """Classes of the library by name: what can be declared, and the declarations."""
    found = [getattr(room, name) for room in _ROOMS for name in room.__all__]
    found = [item for item in (*found, *_OTHER_CLASSES) if isinstance(item, type) and _is_record(item)]
    found = [item for item in found if item not in _MADE_OF]
    return {item.__name__: item for item in found if not item.__name__.startswith("Abstract")}


def _is_record(item):
    return dataclasses.is_dataclass(item) or hasattr(item, "_fields")


def class_of(name: str) -> type | None:
    """The class of that name, of the library or registered."""
    item = classes().get(_EARLIER.get(name, name)) or _registered.get(name)
    return item if isinstance(item, type) and _is_record(item) else None


def function_of(name: str) -> Callable | None:
    """The registered function of that name."""
    item = _registered.get(name)
    return None if isinstance(item, type) else item


def name_of(item: Any) -> str | None:
    """The name of a class or function, None where it has none."""
    if isinstance(item, type) and classes().get(item.__name__) is item:
        return item.__name__
    return next((name for name, other in _registered.items() if other is item), None)


def registered_names() -> list[str]:
    """All names of the library and of users."""
    return [*classes(), *_registered]
