"""Verbs that take either noun: each dispatches on its first argument, a mechanism or a linear system."""

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeVar, overload

from .analysis._equilibrium import equilibrium as mechanism_equilibrium
from .analysis._equilibrium_result import Equilibrium
from .analysis._linearise import Linearisation, StateSpace
from .analysis._linearise import frequency_response as mechanism_response
from .analysis._mechanism_modes import modes as mechanism_modes
from .coupling._bond_loads import BondLoads
from .coupling._measured_network import MeasuredNetwork
from .coupling._network import reactions as network_reactions
from .errors import ModelError
from .kinematics._state import HasStates, State
from .linear._check import Check
from .linear._check import check as linear_check
from .linear._static_response import StaticResponse
from .linear._static_response import equilibrium as linear_equilibrium
from .linear._system import LinearSystem
from .linear._transfer import TransferFunctions
from .model._entry_points import check_precision, check_system
from .model._system import System
from .motion._event import EventLike
from .motion._formulation import Formulation
from .motion._motion import Motion
from .motion._simulate import simulate as mechanism_simulate
from .qualification._random_response import RandomResponse
from .qualification._random_response import random_response as linear_random
from .qualification._state_response import random_response_of_measured, random_response_of_mechanism
from .reaction._result import Reactions
from .reaction._solve import reactions as mechanism_reactions
from .typing import AnyArray, ArrayLike, CoordinateLike, WordedError
from .vibration._harmonic_response import HarmonicResponse
from .vibration._linear_motion import CoordinateLaw, LinearMotion, LinearState
from .vibration._modes import Modes
from .vibration._system_analysis import frequency_response as linear_response
from .vibration._system_analysis import modes as linear_modes
from .vibration._transient import simulate as linear_simulate

Verb = TypeVar("Verb", bound=Callable[..., Any])


def _dispatch(of_mechanism: Callable, of_linear: Callable, of_measured: Callable | None = None) -> Callable:
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


def describe(system: System) -> str:
    """Bodies, joints, loops, freedoms and redundant constraints of a mechanism, as text."""
    check_system(system)
    return system.describe()


@overload
def check(system: System) -> str: ...
@overload
def check(
    system: LinearSystem, about: ArrayLike = (0.0, 0.0, 0.0), tolerance: float = 1e-6, throw: bool = False
) -> Check: ...
@_dispatch(describe, linear_check)
def check(system: Any, *args: Any, **options: Any) -> Any:
    """Report on a model: the freedoms and constraints of a mechanism, or the faults of a linear system's matrices."""


@overload
def equilibrium(
    system: System,
    state: State,
    moving: Iterable[str] = (),
    throw: bool = True,
    held: Iterable[str] = (),
    follow: bool | None = None,
) -> Equilibrium: ...
@overload
def equilibrium(system: LinearSystem, forces: Mapping | ArrayLike, free: bool = False) -> StaticResponse: ...
@_dispatch(mechanism_equilibrium, linear_equilibrium)
def equilibrium(system: Any, *args: Any, **options: Any) -> Any:
    """Static equilibrium: of a mechanism near a state, or of a linear system under forces."""


@overload
def frequency_response(
    space: StateSpace | Linearisation,
    omega: ArrayLike,
    into: Iterable[CoordinateLike] | None = None,
    out: Iterable[CoordinateLike] | None = None,
) -> AnyArray | TransferFunctions: ...
@overload
def frequency_response(
    system: LinearSystem,
    omega: ArrayLike,
    into: Iterable[CoordinateLike],
    out: Iterable[CoordinateLike],
    method: str = "direct",
    loss: ArrayLike = 0.0,
    **options: Any,
) -> TransferFunctions: ...
@overload
def frequency_response(
    network: MeasuredNetwork, omega: ArrayLike, into: Sequence, out: Sequence, loss: ArrayLike = 0.0, **regular: Any
) -> TransferFunctions: ...
@_dispatch(mechanism_response, linear_response, MeasuredNetwork.frequency_response)
def frequency_response(system: Any, *args: Any, **options: Any) -> Any:
    """Response to harmonic inputs by frequency: of a linearised mechanism, or of a linear system."""


@overload
def modes(mechanism: Linearisation | System, state: State | None = None, without: Sequence[str] = ()) -> Modes: ...
@overload
def modes(system: LinearSystem, num: int | None = None, damped: bool | None = None) -> Modes: ...
@_dispatch(mechanism_modes, linear_modes)
def modes(system: Any, *args: Any, **options: Any) -> Any:
    """Modes of vibration: of a mechanism about a state, or of a linear system."""


@overload
def reactions(
    system: System,
    motion: State | HasStates,
    frame: str = "world",
    side: str = "child",
    compliance: Mapping | None = None,
    method: str = "auto",
    accelerations: ArrayLike | Mapping[str, ArrayLike] | None = None,
    actuators: Sequence[str] | None = None,
) -> Reactions: ...
@overload
def reactions(network: LinearSystem, answer: LinearMotion | StaticResponse | HarmonicResponse) -> BondLoads: ...
@overload
def reactions(
    network: MeasuredNetwork, response: TransferFunctions, loss: ArrayLike = 0.0, **regular: Any
) -> BondLoads: ...
@_dispatch(mechanism_reactions, network_reactions, MeasuredNetwork.reactions)
def reactions(system: Any, *args: Any, **options: Any) -> Any:
    """Reactions: of a mechanism's joints at states or along a motion, or of the bonds of a network of components."""


@overload
def simulate(
    system: System,
    state: State,
    t1: ArrayLike | None = None,
    ts: ArrayLike | None = None,
    dt: ArrayLike | None = None,
    solver: Any = None,
    controller: Any = None,
    rtol: ArrayLike | None = None,
    atol: ArrayLike | None = None,
    gradient: Any = "reverse",
    formulation: str | type[Formulation] | None = None,
    event: WordedError[EventLike | Sequence[EventLike] | None] = None,
    interpolate: bool = False,
    loop: str = "jaxmbs",
    max_steps: int = 100_000,
    max_events: int = 64,
    progress: bool = False,
    throw: bool = True,
) -> Motion: ...
@overload
def simulate(
    system: LinearSystem,
    start: StaticResponse | LinearState | tuple | None = None,
    t1: ArrayLike | None = None,
    ts: ArrayLike | None = None,
    *,
    forces: Mapping | Callable | AnyArray | None = None,
    laws: Sequence[CoordinateLaw] = (),
    dt: ArrayLike | None = None,
    solver: Any = None,
    controller: Any = None,
    rtol: ArrayLike | None = None,
    atol: ArrayLike | None = None,
    gradient: Any = "reverse",
    event: WordedError[Callable | None] = None,
    interpolate: bool = False,
    max_steps: int = 100_000,
    progress: bool = False,
    throw: bool = True,
) -> LinearMotion: ...
@_dispatch(mechanism_simulate, linear_simulate)
def simulate(system: Any, *args: Any, **options: Any) -> Any:
    """Motion in time: of a mechanism from a state on, or of a linear system under forces."""


@overload
def random_response(
    system: LinearSystem,
    inputs: Mapping[str, Any],
    out: Any,
    coherence: Mapping | None = None,
    ratios: ArrayLike | None = None,
    loss: ArrayLike = 0.0,
    num: int | None = None,
    order: int = 24,
) -> RandomResponse: ...
@overload
def random_response(
    linearisation: Linearisation, inputs: Mapping[str, Any], coherence: Mapping | None = None, order: int = 24
) -> RandomResponse: ...
@overload
def random_response(
    network: MeasuredNetwork,
    inputs: Mapping[str, Any],
    out: Any,
    coherence: Mapping | None = None,
    loss: ArrayLike = 0.0,
    tolerance: float = 0.02,
    **regular: Any,
) -> RandomResponse: ...
@_dispatch(random_response_of_mechanism, linear_random, random_response_of_measured)
def random_response(system: Any, *args: Any, **options: Any) -> Any:
    """Response to stationary random inputs: RMS, spectra and rates of motions and loads, by name."""
