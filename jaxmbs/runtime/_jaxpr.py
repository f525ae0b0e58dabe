"""Traced programs: their equations, the same program with other equations, and as functions."""

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import jax
from jax.extend.core import ClosedJaxpr, Jaxpr, JaxprEqn, jaxpr_as_fun
from jax.interpreters import partial_eval

Program = TypeVar("Program", ClosedJaxpr, Jaxpr)


def jaxpr_function(jaxpr: ClosedJaxpr) -> Callable[..., list]:
    """The function of arrays that was traced."""
    return jaxpr_as_fun(jaxpr)


def without_unused(jaxpr: ClosedJaxpr) -> ClosedJaxpr:
    """The same program without equations whose results nothing needs: what derives it passes them by.

    XLA drops them too, but after they were traced, derived and lowered.
    """
    program: Any = jaxpr
    kept, _ = partial_eval.dce_jaxpr(program.jaxpr, [True] * len(program.jaxpr.outvars), instantiate=True)
    return program.replace(jaxpr=kept)


def equations(jaxpr: ClosedJaxpr | Jaxpr) -> Iterator[JaxprEqn]:
    """All equations of a jaxpr, those inside of its loops and calls too."""
    for equation in jaxpr.eqns:
        yield equation
        for part in jax.tree.leaves(tuple(equation.params.values()), is_leaf=_is_jaxpr):
            if _is_jaxpr(part):
                yield from equations(part)


def rewrite(jaxpr: Program, change: Callable[[JaxprEqn], JaxprEqn], whole: Callable[[JaxprEqn], bool]) -> Program:
    """The same program with `change` of all its equations, those inside of its loops and calls too.

    Args: whole: equations that stay as they are, and all that is inside of them.

    What derives it afterwards may meet the old ones: custom rules keep theirs.
    """
    program: Any = jaxpr
    if getattr(program, "jaxpr", program) is not program:  # closed; from JAX 0.12 on there is one kind only
        return program.replace(jaxpr=rewrite(program.jaxpr, change, whole))

    def inside(part):
        return rewrite(part, change, whole) if _is_jaxpr(part) else part

    def changed(equation):
        if whole(equation):
            return equation
        params = {name: jax.tree.map(inside, x, is_leaf=_is_jaxpr) for name, x in equation.params.items()}
        return change(equation.replace(params=params))

    return program.replace(eqns=[changed(equation) for equation in program.eqns])


def _is_jaxpr(x):
    return isinstance(x, ClosedJaxpr | Jaxpr)
