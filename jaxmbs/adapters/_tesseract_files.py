"""Texts of the files of a Tesseract's folder."""

FIELD = "    {name}: {type} = Field(description={label})"

CONFIG = """name: {name}
version: "1.0.0"
description: {about}
build_config:
  package_data:
    - [question.zip, question.zip]
"""

REQUIREMENTS = """jax=={jax}
numpy
"""

API = '''"""{name}: a stored question of a multibody model.  The program and its derivatives are in question.zip."""

import zipfile
from pathlib import Path
from typing import Any

import jax

jax.config.update("jax_enable_x64", True)

import jax.export
import jax.numpy as jnp
import numpy as np
from pydantic import BaseModel, Field
from tesseract_core.runtime import {kinds}


class InputSchema(BaseModel):
{inputs}


class OutputSchema(BaseModel):
{outputs}


INPUTS = {input_names}
OUTPUTS = {output_names}


def _load():
    with zipfile.ZipFile(Path(__file__).parent / "question.zip") as file:
        stored = {{name: file.read(name) for name in file.namelist()}}
    programs = [stored.get(name) for name in ("program.bin", "forward.bin")]
    return [part and jax.export.deserialize(bytearray(part)) for part in programs]


PROGRAM, FORWARD = _load()
IS_REAL_IN = [np.issubdtype(x.dtype, np.floating) for x in PROGRAM.in_avals]
IS_REAL_OUT = [np.issubdtype(x.dtype, np.floating) for x in PROGRAM.out_avals]
REAL_IN = [name for name, real in zip(INPUTS, IS_REAL_IN) if real]
REAL_OUT = [name for name, real in zip(OUTPUTS, IS_REAL_OUT) if real]


@jax.jit
def _values(leaves):
    return PROGRAM.call(*leaves)


@jax.jit
def _pull_back(leaves, cotangents):
    def of_real(*numbers):
        numbers = iter(numbers)
        whole = [next(numbers) if real else leaf for leaf, real in zip(leaves, IS_REAL_IN)]
        return [x for x, real in zip(PROGRAM.call(*whole), IS_REAL_OUT) if real]

    return jax.vjp(of_real, *[leaf for leaf, real in zip(leaves, IS_REAL_IN) if real])[1](cotangents)


@jax.jit
def _push_forward(leaves, tangents):
    if FORWARD is not None:
        return FORWARD.call(leaves, tangents)
    shapes = [x for x, real in zip(PROGRAM.out_avals, IS_REAL_OUT) if real]
    zero = [jnp.zeros(x.shape, x.dtype) for x in shapes]
    found = []
    for k, shape in enumerate(shapes):

        def row(entry, k=k, shape=shape):
            seed = jnp.zeros(shape.size, shape.dtype).at[entry].set(1.0).reshape(shape.shape)
            pulled = _pull_back(leaves, [*zero[:k], seed, *zero[k + 1 :]])
            return sum(jnp.vdot(a, b) for a, b in zip(pulled, tangents))

        found.append(jax.lax.map(row, jnp.arange(shape.size)).reshape(shape.shape))
    return found


def _leaves(inputs):
    return [jnp.asarray(getattr(inputs, name), x.dtype) for name, x in zip(INPUTS, PROGRAM.in_avals)]


def _filled(given, names, every, avals):
    """The given vectors, zeros for the other names."""
    kinds = dict(zip(every, avals))
    chosen = {{name: given[name] for name in names}}
    wanted = REAL_IN if every is INPUTS else REAL_OUT
    return [jnp.broadcast_to(jnp.asarray(chosen.get(n, 0.0), kinds[n].dtype), kinds[n].shape) for n in wanted]


def apply(inputs: InputSchema) -> OutputSchema:
    """The answer."""
    return OutputSchema(**dict(zip(OUTPUTS, map(np.asarray, _values(_leaves(inputs))))))


def jacobian_vector_product(
    inputs: InputSchema, jvp_inputs: set[str], jvp_outputs: set[str], tangent_vector: dict[str, Any]
):
    """Derivatives of the outputs in a direction of the inputs."""
    found = _push_forward(_leaves(inputs), _filled(tangent_vector, jvp_inputs, INPUTS, PROGRAM.in_avals))
    return {{name: np.asarray(x) for name, x in zip(REAL_OUT, found) if name in jvp_outputs}}


def vector_jacobian_product(
    inputs: InputSchema, vjp_inputs: set[str], vjp_outputs: set[str], cotangent_vector: dict[str, Any]
):
    """Gradient by the inputs of the outputs weighted by a vector."""
    found = _pull_back(_leaves(inputs), _filled(cotangent_vector, vjp_outputs, OUTPUTS, PROGRAM.out_avals))
    return {{name: np.asarray(x) for name, x in zip(REAL_IN, found) if name in vjp_inputs}}


def abstract_eval(abstract_inputs):
    """Shapes and types of the outputs, which the inputs do not change."""
    return {{n: {{"shape": list(x.shape), "dtype": x.dtype.name}} for n, x in zip(OUTPUTS, PROGRAM.out_avals)}}
'''
