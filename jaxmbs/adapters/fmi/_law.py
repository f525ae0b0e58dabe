"""`Fmu`: a Functional Mock-up Unit as a force law."""

import functools
from collections.abc import Mapping
from os import PathLike
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from ...errors import ModelError
from ...forces import AbstractScalarLaw, InternalState
from ...forces._internal_state import States
from ...runtime import host_call
from ...typing import Scalar, ScalarLike
from ._foreign import Interface, instance_of, read_interface


class Fmu(AbstractScalarLaw):
    """An FMU of model exchange (FMI 3.0) as a law between two points or on a joint, through the package fmpy.

    **An FMU is a program of whoever made it, and runs with all your rights from the first evaluation of the law on.**
    To make the law reads its description alone; no model file has it, and no check runs it.

    Its continuous states are internal states of the element.  Derivatives are the FMU's own directional derivatives,
    of the first order, in both modes; numbers inside of the FMU are no leaves.  It is evaluated by the host, one
    instance for all of a process: in `batch` and under `vmap` it is refused.

    Args:
        path: of the file.
        effort: output [N or N m] that acts along increasing x.
        displacement, velocity: inputs that get x [m or rad] and v, where it has them.
        parameters: values by name, set once.
        start: values of states whose description has none, or others than it has.

    Raises: ModelError with all faults by name: another version or kind, event indicators, names that are not there.
    OSError where the file cannot be read; ImportError without fmpy.
    """

    interface: Interface = eqx.field(static=True)
    is_source: ClassVar[bool] = True
    runs_foreign_code: ClassVar[bool] = True  # no model file has it

    def __init__(
        self,
        path: str | PathLike,
        effort: str,
        displacement: str | None = None,
        velocity: str | None = None,
        parameters: Mapping[str, float] | None = None,
        start: Mapping[str, float] | None = None,
    ) -> None:
        self.interface = read_interface(
            path, effort, displacement, velocity, dict(parameters or {}), dict(start or {})
        )

    @property
    def internal_states(self) -> dict[str, InternalState]:
        one = self.interface
        return {
            name: InternalState((), unit, scale)
            for name, unit, scale in zip(one.states, one.units, one.scales, strict=True)
        }

    def start(self, x: ScalarLike, v: ScalarLike, t: ScalarLike) -> States:
        """The start values of the FMU."""
        return {name: jnp.asarray(x) for name, x in zip(self.interface.states, self.interface.starts, strict=True)}

    def rate(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> States:
        """Rates of the FMU's states."""
        return dict(zip(self.interface.states, self._values(x, v, s, t), strict=False))

    def effort(self, x: ScalarLike, v: ScalarLike, s: States, t: ScalarLike) -> Scalar:  # type: ignore[override]
        """The FMU's output [N or N m]."""
        return self._values(x, v, s, t)[-1]

    def _values(self, x, v, s, t):
        parts = jnp.stack(
            [jnp.asarray(part, float) for part in (t, x, v, *(s[name] for name in self.interface.states))]
        )
        return _call(self.interface)(parts)


@functools.cache
def _call(interface):
    """The traceable function of z = (t, x, v, states) to (rates, effort)."""

    def refuse(what):
        if what == "batch":
            fault = (
                f"the FMU {interface.path} is one running program, and has no batch of designs: neither `batch` nor "
                "`vmap` evaluates it; run its designs one after the other"
            )
        elif what == "derivative":
            fault = f"the FMU {interface.path} gives no directional derivatives, and has no gradient"
        else:
            fault = f"the FMU {interface.path} has derivatives of the first order alone"
        return ModelError([fault], "Fmu")

    def slopes(z):
        return instance_of(interface).slopes(z)

    evaluate = lambda z: instance_of(interface).values(z)
    given = slopes if interface.has_derivatives else None
    return host_call(evaluate, given, len(interface.states) + 1, refuse)
