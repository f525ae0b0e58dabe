"""Complex numbers as pairs of real ones: a traced program is traced again, with two arrays for every complex one."""

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np
from jax import lax
from jax.extend.core import ClosedJaxpr, Literal

from ._batched_loop import batched_loop, is_batched
from ._flatten import UnsupportedError, called, parts_of_scan
from ._pair import Pair, is_complex, pair_of, parts
from ._pair_rules import HOST_PRIMITIVES, PAIR_RULES


def has_complex(program: Any) -> bool:
    """True if a jaxpr or one inside of it has complex numbers, or decompositions that are done by pairs."""
    given = (*program.jaxpr.invars, *program.jaxpr.constvars)
    if any(is_complex(v.aval) for v in given if hasattr(v.aval, "dtype")):
        return True
    return any(_is_by_pairs(equation) for equation in program.jaxpr.eqns)


def _is_by_pairs(equation):
    if any(is_complex(v.aval) for v in equation.outvars if hasattr(v.aval, "dtype")):
        return True
    if equation.primitive.name in HOST_PRIMITIVES:
        return True
    return any(map(has_complex, _inner(equation.params)))


def _inner(params):
    leaves = jax.tree.leaves(tuple(params.values()), is_leaf=lambda x: hasattr(x, "eqns") or hasattr(x, "jaxpr"))
    return [_Closed(x) for x in leaves if hasattr(x, "eqns")]


class _Closed:
    """A jaxpr, closed or open, as one that has it."""

    def __init__(self, program):
        self.jaxpr = getattr(program, "jaxpr", program)


def real_program(program: ClosedJaxpr) -> ClosedJaxpr:
    """The same program of real arrays, two in place of each complex input and result.

    Raises: UnsupportedError for an operation on complex numbers that tapes do not have.
    """
    avals = [variable.aval for variable in program.jaxpr.invars for _ in parts(variable.aval)]
    shapes = [jax.ShapeDtypeStruct(aval.shape, np.float64 if is_complex(aval) else aval.dtype) for aval in avals]

    def run(*arrays):
        rest = iter(arrays)
        given = [_joined([next(rest) for _ in parts(v.aval)]) for v in program.jaxpr.invars]
        found = evaluate(program, given)
        return [part for x in found for part in (x if isinstance(x, Pair) else (x,))]

    try:
        with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
            return jax.make_jaxpr(run)(*shapes)
    except (TypeError, ValueError, AssertionError) as error:  # forms of operations that the rules do not foresee
        raise UnsupportedError(f"complex numbers: {error}") from error


def _joined(arrays):
    return Pair(*arrays) if len(arrays) == 2 else arrays[0]


def evaluate(program: Any, args: Sequence[Any]) -> list:
    """Results of a jaxpr, complex arrays as pairs."""
    jaxpr, constants = (program.jaxpr, program.consts) if isinstance(program, ClosedJaxpr) else (program, ())
    env = dict(zip(jaxpr.invars, args, strict=True))
    env |= {variable: pair_of(value) for variable, value in zip(jaxpr.constvars, constants, strict=True)}

    def read(variable):
        if isinstance(variable, Literal):
            return pair_of(np.asarray(variable.val, variable.aval.dtype))
        return env[variable]

    for equation in jaxpr.eqns:
        found = _equation(equation, [read(variable) for variable in equation.invars])
        env |= zip(equation.outvars, found, strict=True)
    return [read(variable) for variable in jaxpr.outvars]


def _equation(equation, args):
    name = equation.primitive.name
    inner = called(equation, args)
    if inner is not None:
        return evaluate(*inner)
    if not _is_by_pairs(equation) and not any(isinstance(x, Pair) for x in args):
        found = equation.primitive.bind(*args, **equation.params)
        return list(found) if equation.primitive.multiple_results else [found]
    if name in CONTROL:
        return CONTROL[name](equation.params, args)
    if name not in PAIR_RULES:
        raise UnsupportedError(f"{name} of complex numbers")
    found = PAIR_RULES[name](equation, args)
    return found if isinstance(found, list) else [found]


def _fixed(values):
    """Without weak types, so that a loop carries what it began with."""
    return jax.tree.map(lambda x: lax.convert_element_type(x, np.result_type(x)), list(values))


def _while(params, args):
    first, second = params["cond_nconsts"], params["cond_nconsts"] + params["body_nconsts"]
    known, of_body, start = args[:first], args[first:second], args[second:]
    goes_on = lambda carried: evaluate(params["cond_jaxpr"], [*known, *carried])[0]
    move = lambda carried: _fixed(evaluate(params["body_jaxpr"], [*of_body, *carried]))
    return lax.while_loop(*(batched_loop(goes_on, move) if is_batched(params) else (goes_on, move)), _fixed(start))


def _scan(params, args):
    number, carried = parts_of_scan(params)
    known, start, stacks = args[:number], args[number : number + carried], args[number + carried :]

    def turn(values, rows):
        found = _fixed(evaluate(params["jaxpr"], [*known, *values, *rows]))
        return found[:carried], found[carried:]

    options = {"length": params["length"], "reverse": params["reverse"]}
    last, results = lax.scan(turn, _fixed(start), _fixed(stacks), **options)
    return [*last, *results]


def _cond(params, args):
    index, *given = args
    branches = [lambda *x, branch=branch: _fixed(evaluate(branch, x)) for branch in params["branches"]]
    return lax.switch(index, branches, *_fixed(given))


CONTROL = {"while": _while, "scan": _scan, "cond": _cond}
