"""Size of a program before it is compiled: equations of its jaxpr, bytes of its StableHLO.  They do not scatter."""

import jax
import numpy as np
from jax.extend.core import ClosedJaxpr, Jaxpr

#: Equations that make numbers from numbers, one operation each; others move them.
ARITHMETIC = set(
    "add sub mul div neg max min abs sqrt rsqrt integer_pow pow exp sign select_n scatter-add add_any".split()
)


def equations(function, *args) -> int:
    """Equations of the jaxpr with those of all programs inside; loops and branches count once."""
    return _leaves(jax.make_jaxpr(function)(*args).jaxpr)


def loops(function, *args) -> int:
    """Scans and while loops among them."""
    return _loops(jax.make_jaxpr(function)(*args).jaxpr)


def _leaves(jaxpr):
    return sum(sum(map(_leaves, _inside(equation))) or 1 for equation in jaxpr.eqns)


def _loops(jaxpr):
    inner = sum(_loops(part) for equation in jaxpr.eqns for part in _inside(equation))
    return inner + sum(equation.primitive.name in ("scan", "while") for equation in jaxpr.eqns)


def _inside(equation):
    for value in equation.params.values():
        for part in value if isinstance(value, tuple | list) else (value,):
            if isinstance(part, ClosedJaxpr):
                yield part.jaxpr
            elif isinstance(part, Jaxpr):
                yield part


def stablehlo_bytes(function, *args) -> int:
    """Bytes of the text that XLA is given."""
    return len(jax.jit(function).lower(*args).as_text())


def operations(function, *args, rounds: int) -> float:
    """Additions and multiplications of its arithmetic; of a loop `rounds` times, of branches the dearest.

    Args: rounds: what a `while` loop is taken to run.
    """
    return _operations(jax.make_jaxpr(function)(*args).jaxpr, rounds)


def _operations(jaxpr, rounds):
    return sum(_own(equation) or _of_inner(equation, rounds) for equation in jaxpr.eqns)


def _of_inner(equation, rounds):
    inner = [_operations(part, rounds) for part in _inside(equation)]
    if equation.primitive.name == "cond":
        return max(inner, default=0.0)
    times = {"scan": equation.params.get("length", 1), "while": rounds}.get(equation.primitive.name, 1)
    return times * sum(inner)


def _own(equation):
    """Of one equation: two for each term of a product, `n^3 / 3` of a Cholesky factor, one for each number else."""
    name, first = equation.primitive.name, equation.invars[0].aval if equation.invars else None
    size = max((float(np.prod(out.aval.shape)) for out in equation.outvars), default=0.0)
    if name == "dot_general":
        (contracted, _), _ = equation.params["dimension_numbers"]
        return 2 * size * float(np.prod([first.shape[axis] for axis in contracted]))
    if name == "cholesky":
        return size * first.shape[-1] / 3
    if name == "triangular_solve":
        return size * first.shape[-1]
    if name in ("reduce_sum", "reduce_max", "cumsum", "argmax"):
        return float(np.prod(first.shape))
    return size if name in ARITHMETIC else 0.0
