"""One verb for two nouns: what a linear system is asked goes to `linear`, all else to the mechanisms' rooms."""

import functools
import inspect
from collections.abc import Callable
from typing import ParamSpec, Protocol, TypeVar, cast, overload, runtime_checkable

from .analysis._equilibrium import equilibrium as mechanism_equilibrium
from .analysis._linearise import frequency_response as state_space_response
from .analysis._mechanism_modes import modes as linearised_modes
from .coupling._measured import MeasuredNetwork
from .coupling._network import reactions as network_reactions
from .errors import ModelError
from .linear._check import check as linear_check
from .linear._system import LinearSystem
from .model._entry_points import check_precision, check_system
from .model._system import System
from .motion._simulate import simulate as mechanism_simulate
from .reaction._solve import reactions as mechanism_reactions
from .vibration._questions import equilibrium as linear_equilibrium
from .vibration._questions import frequency_response as linear_response
from .vibration._questions import modes as linear_modes
from .vibration._transient import simulate as linear_simulate

P = ParamSpec("P")
Q = ParamSpec("Q")
M = TypeVar("M", covariant=True)
L = TypeVar("L", covariant=True)


@runtime_checkable
class Question(Protocol[P, M, Q, L]):
    """What is called like either of two functions."""

    @overload
    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> M: ...
    @overload
    def __call__(self, *args: Q.args, **kwargs: Q.kwargs) -> L: ...


def either(
    of_mechanism: Callable[P, M], of_linear: Callable[Q, L], of_measured: Callable | None = None
) -> Question[P, M, Q, L]:
    """The question by the noun it is asked of; its documentation says what each takes.

    Args: of_measured: of a network with measured components, None where it has no answer.
    """

    @functools.wraps(of_mechanism)
    def ask(system, *args, **options):
        if isinstance(system, MeasuredNetwork):
            if of_measured is None:
                names = ", ".join(map(repr, system.measured))
                raise ModelError(
                    [f"{ask.__name__} cannot be asked: {names} known by measurement; ask frequency_response"]
                )
            return of_measured(system, *args, **options)
        if isinstance(system, LinearSystem):
            check_precision(system.mass)
        return (of_linear if isinstance(system, LinearSystem) else of_mechanism)(system, *args, **options)

    parameters = ", ".join(str(p) for p in list(inspect.signature(of_linear).parameters.values())[1:])
    ask.__doc__ = (
        f"{inspect.getdoc(of_mechanism)}\n\nOf a LinearSystem, with `({parameters})`:\n\n{inspect.getdoc(of_linear)}"
    )
    return cast(Question, ask)


def describe(system: System) -> str:
    """Bodies, joints, loops, freedoms and redundant constraints of a mechanism, as text."""
    check_system(system)
    return system.describe()


modes = either(linearised_modes, linear_modes)
frequency_response = either(state_space_response, linear_response, MeasuredNetwork.frequency_response)
simulate = either(mechanism_simulate, linear_simulate)
reactions = either(mechanism_reactions, network_reactions, MeasuredNetwork.reactions)
equilibrium = either(mechanism_equilibrium, linear_equilibrium)
check = either(describe, linear_check)
check.__name__ = check.__qualname__ = "check"  # type: ignore[attr-defined]
