"""From a traced program to one list of operations: calls are inlined, and what nothing needs is left out."""

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np
from jax.extend.core import ClosedJaxpr, Literal

from ._refusals import refusing_program

#: Calls that are replaced by what they call.
CALLS = {
    *("jit", "pjit", "closed_call", "core_call", "core_closed_call", "custom_jvp_call", "custom_vjp_call"),
    *("custom_vjp_call_jaxpr", "checkpoint", "remat", "remat2", "custom_vmap_call", "custom_lin", "composite"),
    "eval_jaxpr",  # of JAX 0.12, in derivatives of what is not kept
}
#: Primitives of equinox that are a small program of their own.
_SMALL_PROGRAMS = {"maybe_set", "select_if_vmap", "vprim"}


def _horner(x, *coefficients):
    return functools.reduce(lambda sum_, c: c + x * sum_, coefficients[-2::-1], coefficients[-1])


#: Operations of JAX 0.12 that are formulas of others.
FORMULAS: dict[str, Callable] = {"polynomial": _horner, "one_minus_square": lambda x: (1.0 + x) * (1.0 - x)}
#: Types of the numbers of tapes.
DTYPES = tuple(map(np.dtype, ("bool", "int32", "uint32", "int64", "float64")))


LONG_INTEGERS = "whole numbers beyond 2^53"


class UnsupportedError(Exception):
    """An operation or a type of number that the tape does not have."""


class TooLargeError(UnsupportedError):
    """A program with more numbers, or with a larger instruction, than its tape may have."""


class Limits(NamedTuple):
    """Most doubles of the arena, and whole numbers of the tables; most multiplications of one instruction."""

    doubles: float = math.inf
    work: float = math.inf


def has_long_integers(numbers: Any, dtype: np.dtype) -> bool:
    """True for integers that a double does not have; the least and largest of their type, which bound others, are
    none of them."""
    if dtype != np.int64:
        return False
    numbers, ends = np.asarray(numbers), np.iinfo(np.int64)
    beyond = (numbers > 2**53) | (numbers < -(2**53))
    return bool(np.any(beyond & (numbers != ends.max) & (numbers != ends.min)))


class Atom:
    """An array of the program: its shape and type, and its numbers if they are known."""

    __slots__ = ("shape", "dtype", "size", "constant")

    def __init__(self, aval: Any, constant: Any = None):
        dtype = np.dtype(bool) if aval.dtype == jax.dtypes.float0 else aval.dtype  # a tangent of whole numbers: none
        if dtype not in DTYPES:
            raise UnsupportedError(f"numbers of type {dtype}")
        self.shape, self.dtype, self.constant = tuple(aval.shape), np.dtype(dtype), constant
        if constant is not None and has_long_integers(constant, self.dtype):
            raise UnsupportedError(LONG_INTEGERS)
        self.size = int(np.prod(self.shape, dtype=np.int64))


class Operation(NamedTuple):
    """A primitive of JAX with its parameters, and the arrays that it takes and makes."""

    name: str
    params: dict
    inputs: list[Atom]
    outputs: list[Atom]


def flatten(program: Any, inputs: Sequence[Atom]) -> tuple[list[Operation], list[Atom]]:
    """The operations of a jaxpr in order, without those that nothing needs, and its results.

    Raises: UnsupportedError for numbers of single precision and other types that the tape does not have.
    """
    operations: list[Operation] = []
    results = _inline(program, inputs, operations)
    needed, kept = {id(atom) for atom in results}, []
    for operation in reversed(operations):
        if any(id(atom) in needed for atom in operation.outputs):
            kept.append(operation)
            needed.update(id(atom) for atom in operation.inputs)
    return kept[::-1], results


def parts_of_scan(params: dict) -> tuple[int, int]:
    """Numbers of arrays that a scan knows, and of those that it carries; its stacks come after them.

    JAX 0.10 counts them; later releases keep the structures of the three.

    Raises: UnsupportedError for releases that do otherwise: the compiler has their programs.
    """
    if "num_carry" in params:
        return params["num_consts"], params["num_carry"]
    if "ft_in" not in params:
        raise UnsupportedError("scans of this release of JAX")
    known, carried, _ = params["ft_in"].unpack()
    return len(known), len(carried)


def _inline(program, inputs, operations):
    jaxpr, constants = (program.jaxpr, program.consts) if isinstance(program, ClosedJaxpr) else (program, ())
    if any("Callback" in type(effect).__name__ or "Debug" in type(effect).__name__ for effect in jaxpr.effects):
        raise UnsupportedError("a callback")
    env = dict(zip(jaxpr.invars, inputs, strict=True))
    env |= {variable: _constant(value) for variable, value in zip(jaxpr.constvars, constants, strict=True)}

    def read(variable):
        return (
            _constant(np.asarray(variable.val, variable.aval.dtype))
            if isinstance(variable, Literal)
            else env[variable]
        )

    for equation in jaxpr.eqns:
        args = [read(variable) for variable in equation.invars]
        inner = called(equation, args)
        if _has_key(equation) and all(_numbers(x) is not None for x in args):
            results = _computed(equation, args)
        elif inner is not None:
            results = _inline(*inner, operations)
        else:
            results = [Atom(variable.aval) for variable in equation.outvars]
            operations.append(Operation(_name(equation), equation.params, args, results))
        env |= zip(equation.outvars, results, strict=True)
    return [read(variable) for variable in jaxpr.outvars]


def _has_key(equation):
    """True for a call or an operation with a key of random numbers."""
    return any(_is_key(v.aval) for v in (*equation.invars, *equation.outvars))


def _is_key(x):
    return jax.dtypes.issubdtype(x.dtype, jax.dtypes.extended)


def _numbers(x):
    """The numbers of an array or a key, if they are known."""
    return x.constant if isinstance(x, Atom) else x


def _computed(equation, args):
    """Results of an equation whose arguments are known: random numbers of a constant key."""
    found = equation.primitive.bind(*map(_numbers, args), **equation.params)
    return [_constant(x) for x in (found if equation.primitive.multiple_results else [found])]


def _constant(value):
    if _is_key(value):
        return value
    value = np.asarray(value)
    if value.dtype == jax.dtypes.float0:
        value = np.zeros(value.shape, bool)
    if value.dtype.kind in "iu" and value.size and np.max(np.abs(value.astype(np.float64))) > 2.0**53:
        raise UnsupportedError(LONG_INTEGERS)
    return Atom(value, value)


def _name(equation):
    return "signbit" if _is_signbit(equation) else equation.primitive.name


def _is_signbit(equation):
    """True for `jnp.signbit`, which looks at the bits of a number; a user's function may have its name."""
    if equation.params.get("name") != "signbit" or [x.aval.dtype for x in equation.invars] != [np.float64]:
        return False
    return "bitcast_convert_type" in (inner.primitive.name for inner in equation.params["jaxpr"].jaxpr.eqns)


def called(equation: Any, args: Sequence[Any]) -> tuple[Any, list] | None:
    """The program that an equation calls and its arguments, or None if it is no call."""
    name, params = equation.primitive.name, equation.params
    if name in CALLS and not _is_signbit(equation):
        program = next((params[key] for key in ("jaxpr", "call_jaxpr", "fun_jaxpr", "call") if key in params), None)
        if program is None:  # tangents of what has a reverse derivative alone
            raise UnsupportedError(name)
        return program, list(args)
    if name in ("custom_linear_solve", "linear_solve") and "const_lengths" in params:  # not the one of lineax
        lengths = params["const_lengths"]
        first = lengths.matvec + lengths.vecmat
        sides = first + lengths.solve + lengths.transpose_solve
        return params["jaxprs"].solve, [*args[first : first + lengths.solve], *args[sides:]]
    if name == "pure_callback" and (refusing := refusing_program(equation)) is not None:
        return refusing, list(args)
    if name == "call_hi_primitive":  # of JAX 0.12: an operation that says itself of which others it is made
        shapes = [jax.ShapeDtypeStruct(atom.shape, atom.dtype) for atom in args]
        own = params["_prim"]
        return jax.make_jaxpr(lambda *x: jax.tree.leaves(own.expand(*jax.tree.unflatten(own.in_tree, x))))(
            *shapes
        ), list(args)
    if name in FORMULAS:
        shapes = [jax.ShapeDtypeStruct(atom.shape, atom.dtype) for atom in args]
        return jax.make_jaxpr(FORMULAS[name])(*shapes), list(args)
    if name in _SMALL_PROGRAMS:
        shapes = [jax.ShapeDtypeStruct(atom.shape, atom.dtype) for atom in args]
        return jax.make_jaxpr(lambda *x: equation.primitive.impl(*x, **params))(*shapes), list(args)
    return None
