"""The dispatch of a verb on its first argument: a mechanism, a linear system, a network of measured components."""

import functools
import inspect
from collections.abc import Callable
from typing import ParamSpec, Protocol, TypeVar, overload

from ..coupling._measured_network import MeasuredNetwork
from ..errors import ModelError
from ..linear._system import LinearSystem
from ..model._entry_points import check_precision

# the calls of a mechanism, of a linear system and of a measured network, and what they return
M = ParamSpec("M")
L = ParamSpec("L")
N = ParamSpec("N")
X = TypeVar("X", covariant=True)
Y = TypeVar("Y", covariant=True)
Z = TypeVar("Z", covariant=True)


class _OfTwo(Protocol[M, X, L, Y]):
    """Either call of a verb, as type checkers see it."""

    @overload
    def __call__(self, *args: M.args, **options: M.kwargs) -> X: ...

    @overload
    def __call__(self, *args: L.args, **options: L.kwargs) -> Y: ...


class _OfThree(Protocol[M, X, L, Y, N, Z]):
    """Each call of a verb that networks of measured components have too."""

    @overload
    def __call__(self, *args: M.args, **options: M.kwargs) -> X: ...

    @overload
    def __call__(self, *args: L.args, **options: L.kwargs) -> Y: ...

    @overload
    def __call__(self, *args: N.args, **options: N.kwargs) -> Z: ...


@overload
def dispatch(of_mechanism: Callable[M, X], of_linear: Callable[L, Y]) -> Callable[[Callable], _OfTwo[M, X, L, Y]]:
    """Of verbs of mechanisms and of linear systems."""


@overload
def dispatch(
    of_mechanism: Callable[M, X], of_linear: Callable[L, Y], of_measured: Callable[N, Z]
) -> Callable[[Callable], _OfThree[M, X, L, Y, N, Z]]:
    """Of verbs that networks of measured components have too."""


def dispatch(of_mechanism: Callable, of_linear: Callable, of_measured: Callable | None = None) -> Callable:
    """Decorator of a verb: calls go to the function of the first argument's type, whose signature type checkers see,
    and `help` documents each of them.

    Args: of_measured: of a network with measured components; None where it has no answer.
    """

    def decorate(verb: Callable) -> Callable:
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

        nouns = [of_mechanism, of_linear] + ([of_measured] if of_measured else [])
        dispatched.__signature__ = _common_signature(nouns)  # type: ignore[attr-defined]
        entries = [_entry("a mechanism", of_mechanism), _entry("a linear system", of_linear)]
        entries += [_entry("a network with measured components", of_measured)] if of_measured else []
        dispatched.__doc__ = "\n\n".join([str(inspect.getdoc(verb)), *entries])
        return dispatched

    return decorate


def _common_signature(functions: list[Callable]) -> inspect.Signature:
    """Signature of a verb in `help` and editors: the arguments of the first noun, by name those of others.

    Without types, which are long; type checkers see each call with its own.  What only some nouns need is `...`.
    """
    calls = [inspect.signature(function).parameters for function in functions]
    found: dict[str, inspect.Parameter] = {}
    for k, call in enumerate(calls):
        for p in [*call.values()][1:]:
            name = "**" if p.kind is p.VAR_KEYWORD else p.name
            needed_by_some = p.default is p.empty and p.kind < p.VAR_KEYWORD and any(name not in c for c in calls)
            kind = p.KEYWORD_ONLY if k and p.kind is p.POSITIONAL_OR_KEYWORD else p.kind
            default = ... if needed_by_some else p.default
            found.setdefault(name, p.replace(kind=kind, default=default, annotation=p.empty))
    system = inspect.Parameter("system", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    return inspect.Signature([system, *sorted(found.values(), key=lambda p: p.kind)])


def _entry(noun: str, function: Callable) -> str:
    """The call of a function without annotations, and below it its documentation."""
    parameters = [p.replace(annotation=p.empty) for p in inspect.signature(function).parameters.values()]
    call = inspect.Signature(parameters)
    return f"Of {noun}: `{function.__name__}{call}`\n\n{inspect.getdoc(function)}"
