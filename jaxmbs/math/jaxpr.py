"""What a traced program is made of."""

from collections.abc import Iterator

import jax
from jax.extend.core import ClosedJaxpr, Jaxpr, JaxprEqn


def equations(jaxpr: ClosedJaxpr | Jaxpr) -> Iterator[JaxprEqn]:
    """All equations of a jaxpr, those inside of its loops and calls too."""
    for equation in jaxpr.eqns:
        yield equation
        for part in jax.tree.leaves(tuple(equation.params.values()), is_leaf=_is_jaxpr):
            if _is_jaxpr(part):
                yield from equations(part)


def _is_jaxpr(x):
    return isinstance(x, ClosedJaxpr | Jaxpr)
