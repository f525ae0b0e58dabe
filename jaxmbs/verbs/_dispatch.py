"""The dispatch of a verb on its first argument: a mechanism, a linear system, a network of measured components."""

import functools
import inspect
from collections.abc import Callable
from typing import Any, ParamSpec, Protocol, TypeVar, overload

from ..arguments import as_public_call
from ..errors import ModelError
from ..lazy import is_instance
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


class Verb:
    """A verb, which imports the function of a noun when it is first asked about one, or its documentation is read.

    For Python's tools it is a function of its module: `help`, `inspect.signature` and pickles take it as one.
    """

    __name__: str

    def __init__(self, verb: Callable, nouns: dict[str, Callable[[], Callable]]):
        functools.update_wrapper(self, verb, ("__module__", "__name__", "__qualname__"), ())
        self._text, self._nouns = inspect.getdoc(verb), nouns

        @functools.wraps(verb)
        def dispatched(system, *args, **options):
            return self._of(system)(system, *args, **options)

        self._call = as_public_call(dispatched, verb.__name__)

    def __call__(self, *args: Any, **options: Any) -> Any:
        return self._call(*args, **options)

    def _of(self, system):
        """The function of a noun."""
        if is_instance(system, "jaxmbs.coupling._measured_network", "MeasuredNetwork"):
            if MEASURED not in self._nouns:
                names = ", ".join(map(repr, system.measured))
                why = f"{self.__name__} needs the matrices of {names}, which are known by measurement only"
                raise ModelError([f"{why}: use frequency_response"])
            return self._nouns[MEASURED]()
        if is_instance(system, "jaxmbs.linear._system", "LinearSystem"):
            check_precision(system.mass)
            return self._nouns[LINEAR]()
        return self._nouns[MECHANISM]()

    @property
    def __signature__(self) -> inspect.Signature:
        return _common_signature([function() for function in self._nouns.values()])

    @property
    def __doc__(self) -> str:  # type: ignore[override]
        entries = [_entry(noun, function()) for noun, function in self._nouns.items()]
        return "\n\n".join([str(self._text), *entries])

    def __get__(self, instance: Any, owner: type | None = None) -> "Verb":
        return self  # what has this is a routine for `help`

    def __reduce__(self) -> str:
        return self.__name__

    def __content__(self) -> list:
        return [self.__module__, self.__name__]


MECHANISM, LINEAR, MEASURED = "a mechanism", "a linear system", "a network with measured components"


@overload
def dispatch(
    of_mechanism: Callable[[], Callable[M, X]], of_linear: Callable[[], Callable[L, Y]]
) -> Callable[[Callable], _OfTwo[M, X, L, Y]]:
    """Of verbs of mechanisms and of linear systems."""


@overload
def dispatch(
    of_mechanism: Callable[[], Callable[M, X]],
    of_linear: Callable[[], Callable[L, Y]],
    of_measured: Callable[[], Callable[N, Z]],
) -> Callable[[Callable], _OfThree[M, X, L, Y, N, Z]]:
    """Of verbs that networks of measured components have too."""


def dispatch(of_mechanism: Callable, of_linear: Callable, of_measured: Callable | None = None) -> Callable:
    """Decorator of a verb: calls go to the function of the first argument's type, whose signature type checkers see,
    and `help` documents each of them.

    Args:
        of_mechanism, of_linear: functions without arguments that return those of the nouns, which are imported then.
        of_measured: of a network with measured components; None where it has no answer.
    """
    nouns = {MECHANISM: of_mechanism, LINEAR: of_linear} | ({MEASURED: of_measured} if of_measured else {})
    return lambda verb: Verb(verb, nouns)


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
