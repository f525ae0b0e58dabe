"""The dispatch of a verb on its first argument: a mechanism, a linear system, a network of measured components."""

import functools
import inspect
from collections.abc import Callable
from typing import Any, TypeVar

from ..coupling._measured_network import MeasuredNetwork
from ..errors import ModelError
from ..linear._system import LinearSystem
from ..model._entry_points import check_precision

Verb = TypeVar("Verb", bound=Callable[..., Any])


def dispatch(of_mechanism: Callable, of_linear: Callable, of_measured: Callable | None = None) -> Callable:
    """Decorator of a verb: calls go to the function of the first argument's type, and `help` documents each of them.

    Args: of_measured: of a network with measured components; None where it has no answer.
    """

    def decorate(verb: Verb) -> Verb:
        implementation = functools.singledispatch(of_mechanism)

        @implementation.register(LinearSystem)
        def _(system, *args, **options):
            check_precision(system.mass)
            return of_linear(system, *args, **options)

        @implementation.register(MeasuredNetwork)
        def _(system, *args, **options):
            if of_measured is None:
                names = ", ".join(map(repr, system.measured))
                why = f"{verb.__name__} needs the matrices of {names}, which are known by measurement only"
                raise ModelError([f"{why}: use frequency_response"])
            return of_measured(system, *args, **options)

        @functools.wraps(verb)
        def dispatched(system, *args, **options):
            return implementation(system, *args, **options)

        entries = [_entry("a mechanism", of_mechanism), _entry("a linear system", of_linear)]
        entries += [_entry("a network with measured components", of_measured)] if of_measured else []
        dispatched.__doc__ = "\n\n".join([str(inspect.getdoc(verb)), *entries])
        return dispatched  # type: ignore[return-value]

    return decorate


def _entry(noun: str, function: Callable) -> str:
    """The call of a function without annotations, and below it its documentation."""
    parameters = [p.replace(annotation=p.empty) for p in inspect.signature(function).parameters.values()]
    call = inspect.Signature(parameters)
    return f"Of {noun}: `{function.__name__}{call}`\n\n{inspect.getdoc(function)}"
