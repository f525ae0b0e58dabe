"""Functions known by what they trace: a name for a traced program that its numbers and operations decide."""

import hashlib
import re
from collections.abc import Iterator
from typing import Any

import jax
import numpy as np
from jax.extend.core import ClosedJaxpr, Jaxpr, Literal

_DIGITS = 12  # of constants: the last ones differ between machines


def fingerprint(program: ClosedJaxpr) -> str:
    """A name for what a traced function does, the same in every process.

    Two functions that trace the same operations on the same constants (to twelve digits of the largest of an array)
    have one, whatever they are called; what they call back in Python counts by its name.
    """
    found = hashlib.sha256()
    for token in _tokens(program):
        found.update(token.encode() + b"\n")
    return found.hexdigest()


def _tokens(program: ClosedJaxpr | Jaxpr) -> Iterator[str]:
    jaxpr, numbers = getattr(program, "jaxpr", program), {}

    def place(variable):
        if isinstance(variable, Literal):
            return f"{variable.aval}={_constant(variable.val)}"
        return str(numbers.setdefault(variable, len(numbers)))

    for constant in getattr(program, "consts", ()):
        yield _constant(constant)
    for variable in (*jaxpr.constvars, *jaxpr.invars):
        yield f"{place(variable)}:{variable.aval}"
    for equation in jaxpr.eqns:
        yield f"{equation.primitive} {' '.join(map(place, equation.invars))}"
        for name, param in sorted(equation.params.items()):
            if name != "name":  # of a compiled function
                yield from _parameter(name, param)
        yield " ".join(f"{place(variable)}:{variable.aval}" for variable in equation.outvars)
    yield " ".join(map(place, jaxpr.outvars))


def _parameter(name: str, param: Any) -> Iterator[str]:
    for part in jax.tree.leaves(param, is_leaf=lambda x: isinstance(x, ClosedJaxpr | Jaxpr)):
        if isinstance(part, ClosedJaxpr | Jaxpr):
            yield from _tokens(part)
        elif isinstance(part, np.ndarray | jax.Array):
            yield f"{name} {_constant(part)}"
        elif isinstance(part, set | frozenset):
            yield f"{name} {sorted(map(str, part))}"
        else:
            yield f"{name} {re.sub(r' at 0x[0-9a-f]+', '', repr(part))}"


def _constant(value: Any) -> str:
    """Shape, type and numbers of a constant, rounded."""
    if jax.dtypes.issubdtype(getattr(value, "dtype", np.dtype(object)), jax.dtypes.extended):
        value = jax.random.key_data(value)
    array = np.asarray(value)
    about = f"{array.dtype}{array.shape}"
    if array.dtype.kind not in "fc" or not array.size:
        return f"{about} {hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()}"
    with np.errstate(all="ignore"):
        size = np.max(np.abs(array), initial=0.0, where=np.isfinite(array))
        rounded = np.round(array / (size or 1.0), _DIGITS) + 0.0  # no zero with a sign
    return f"{about} {size:.{_DIGITS}e} {hashlib.sha256(np.ascontiguousarray(rounded).tobytes()).hexdigest()}"
