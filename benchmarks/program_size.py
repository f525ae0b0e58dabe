"""Size of a program before it is compiled: equations of its jaxpr, bytes of its StableHLO.  They do not scatter."""

import jax
from jax.extend.core import ClosedJaxpr, Jaxpr


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
