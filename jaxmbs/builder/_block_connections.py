"""Connections of declared blocks: what they read and drive, and the periods at which they are sampled."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ..checks import is_concrete, no_such
from ..forces._signals import Driven
from ..model._internal_states import replace_field
from ._declarations import Model


def reads_of(item) -> tuple:
    """Signals that a block reads, one after another."""
    return tuple(item.reads) if isinstance(item.reads, tuple | list) else (item.reads,)


def drives_of(item) -> tuple:
    """Names of the fields that a block drives."""
    if item.drives is None:
        return ()
    return tuple(item.drives) if isinstance(item.drives, tuple | list) else (item.drives,)


def field_of(name, model):
    """(the full name "motor.voltage" of a driven field, None), or (None, fault)."""
    if not isinstance(name, str):
        return None, f"drives= takes names of force elements and their fields, got {name!r}"
    owners = {key: item.block for key, item in model.blocks.items()}
    owners |= {key: item.law for key, item in model.forces.items()}
    element, _, field = (name, "", "") if name in owners else name.rpartition(".")
    if element not in owners:
        return None, f"drives {name!r}: {no_such('force or block', element or name, owners)}"
    inputs = getattr(owners[element], "inputs", ())
    kind = type(owners[element]).__name__
    if not inputs:
        return None, f"drives {name!r}: {kind} has no field that can be driven; those of Motor, Actuator, Force can"
    if not field and len(inputs) > 1:
        return None, f"drives {name!r}: name one of its fields, {' or '.join(f'{element}.{one}' for one in inputs)}"
    if field and field not in inputs:
        return None, f"drives {name!r}: {no_such('field to drive', field, inputs)}"
    return f"{element}.{field or inputs[0]}", None


def driven_fields(model: Model) -> dict[str, str]:
    """The block that drives each field."""
    return {field_of(name, model)[0]: item.name for item in model.blocks.values() for name in drives_of(item)}


def with_placeholders(model: Model) -> Model:
    """The model whose driven fields are placeholders."""
    forces, blocks = dict(model.forces), dict(model.blocks)
    for field in driven_fields(model):
        element, _, name = field.rpartition(".")
        if element in forces:
            law = replace_field(forces[element].law, name, Driven())
            forces[element] = dataclasses.replace(forces[element], law=law)
        else:
            block = replace_field(blocks[element].block, name, Driven())
            blocks[element] = dataclasses.replace(blocks[element], block=block)
    return dataclasses.replace(model, forces=forces, blocks=blocks)


def is_real(value: Any) -> bool:
    """True for one real number."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.number | np.ndarray | jax.Array):
        return False
    return np.shape(value) == () and np.dtype(jnp.result_type(value)).kind in "iuf"


def rhythms(model) -> dict[str, int]:
    """Number of its period among the different ones, of each sampled block."""
    found: dict[str, int] = {}
    keys: list[Any] = []
    for item in model.blocks.values():
        if item.every is not None and is_real(item.every):
            key = float(item.every) if is_concrete(item.every) else id(item.every)
            keys += [] if key in keys else [key]
            found[item.name] = keys.index(key)
    return found
