"""Motion of a linear system: its state, laws between coordinates, and the result of `simulate`."""

from collections.abc import Mapping
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..checks import flag
from ..forces import AbstractScalarLaw
from ..linear._massless import condense_massless
from ..linear._system import LinearSystem
from ..quantities import Quantity, numbered
from ..reports import Report, Reported, reported
from ..runtime import as_array
from ..status import Status, succeeded
from ..tables import fields_repr
from ..typing import AnyArray, ScalarLike
from ._damping import modal_lag


class CoordinateLaw(eqx.Module):
    """A force law on `x = sum coefficient * displacement` of coordinates by name.

    `CoordinateLaw(BumpStop(k, upper=gap), {"wing.tip z": 1.0, "store.nose z": -1.0})` is a stop between two
    components of a network, `CoordinateLaw(law, {"tip z": 1.0})` a law between a coordinate and the ground.

    Attributes:
        law: a scalar law of `jaxmbs.forces`, or a custom one: the effort along increasing x.
        coefficients: (k,), by name.

    Raises: ValueError without a coordinate, or for coefficients that are no numbers; TypeError for what is no law.
    """

    law: AbstractScalarLaw
    coefficients: Float[Array, " k"]
    names: tuple = eqx.field(static=True)

    __repr__ = fields_repr

    def __init__(self, law: AbstractScalarLaw, row: Mapping[str | tuple, ScalarLike]) -> None:
        if not row:
            raise ValueError("a CoordinateLaw needs at least one coordinate")
        if not isinstance(law, AbstractScalarLaw) or law.internal_states:
            raise TypeError(
                "the law of a CoordinateLaw is a scalar law without internal states such as BumpStop(...), "
                f"got {law!r}"
            )
        self.law, self.names = law, tuple(row)
        self.coefficients = jnp.stack([as_array(value) for value in row.values()])
        if self.coefficients.ndim != 1:
            raise ValueError(f"coefficients of a CoordinateLaw are numbers, got shapes {self.coefficients.shape[1:]}")

    def forces(self, efforts: AnyArray) -> dict[str | tuple, Array]:
        """Forces (...) by name of efforts (...)."""
        return {
            name: c.astype(efforts.dtype) * efforts for name, c in zip(self.names, self.coefficients, strict=True)
        }


class ModalSuperposition(eqx.Module):
    """The motion in natural modes, in place of an integrator: exact for loads that are straight between samples.

    Attributes:
        ratios: damping of the modes, one number or one for each; None takes the system's own damping matrix, which
            must not couple the modes.
        num: modes that move; those above follow the load statically.  It must not part equal frequencies.
        static_start: elastic modes start at rest in balance with the first load.

    Derivatives are those of `modal_response`.  Source: S1 (30)-(31), (42)-(43).
    """

    ratios: Float[Array, "..."] | float | None = None
    num: int | None = eqx.field(static=True, default=None)
    static_start: bool = eqx.field(static=True, converter=flag("static_start"), default=False)


@reported
class LinearState(NamedTuple):
    """A linear system at a time t () [s]: displacement and velocity, each (n,)."""

    t: Array
    displacement: Array
    velocity: Array

    def report(self) -> Report:
        own = numbered("coordinate", np.shape(self.displacement)[-1])
        found = [
            Quantity("t", self.t, "s"),
            Quantity("displacement", self.displacement, "m or rad", (own,)),
            Quantity("velocity", self.velocity, "m/s or rad/s", (own,)),
        ]
        return Report(found if np.ndim(self.t) != 1 else found[1:], t=self.t)


class LinearMotion(Reported, eqx.Module):
    """A motion of a linear system; `system.expand(motion.displacement)` is that of the reduced or joined components.

    Of a motion that failed the rows before are kept; those after it are NaN, and so is every derivative that follows
    from them.

    Attributes:
        ts: (T,) [s]; with an event one more than asked for.
        displacement, velocity, acceleration: (T, n).
        efforts: (T, laws) of the laws between coordinates.
        forces: on the system at these times, those of the laws after those given.
        result: () the code of its `status`.
        end: the state that the integrator reached, that of the event if it ended the motion.
        num_steps, num_rejected: of the integrator (), zero in modes.
        ratios: damping of the natural modes, where `ModalSuperposition(ratios)` took it in place of the system's own.
    """

    ts: Float[Array, " T"]
    displacement: Float[Array, "T n"]
    velocity: Float[Array, "T n"]
    acceleration: Float[Array, "T n"]
    efforts: Float[Array, "T laws"]
    forces: tuple
    result: Int[Array, ""]
    end: LinearState
    num_steps: Int[Array, ""]
    num_rejected: Int[Array, ""]
    ratios: Float[Array, "..."] | None = None

    def report(self) -> Report:
        fault = "" if self.ok else str(self.status)
        own, laws = (numbered(n, x.shape[-1]) for n, x in (("coordinate", self.displacement), ("law", self.efforts)))
        found = [
            Quantity("effort", self.efforts, "N or N m", (laws,)),
            Quantity("displacement", self.displacement, "m or rad", (own,)),
            Quantity("velocity", self.velocity, "m/s or rad/s", (own,)),
            Quantity("acceleration", self.acceleration, "m/s^2 or rad/s^2", (own,)),
            Quantity("steps", self.num_steps),
            Quantity("rejected steps", self.num_rejected),
        ]
        return Report(found, fault=fault, t=self.ts)

    @property
    def status(self) -> Status:
        """Status of the end of the motion, `str` of it in words (one concrete motion)."""
        return Status(int(np.asarray(self.result)))

    @property
    def ok(self) -> Array:
        """True if the motion ended as asked (traceable)."""
        return succeeded(self.result)

    def terms(self, system: LinearSystem) -> tuple:
        """Factors (T, n) of the stiffness, the damping (None: no force) and the mass of the system's components.

        Damping by ratios is shared out to the components as their stiffness is: it acts inside of them and does not
        hold them back in space.
        """
        if self.ratios is None:
            return self.displacement, self.velocity, self.acceleration
        whole = condense_massless(system.to_dense(), damped=False)
        K, M, velocity = whole.system.stiffness, whole.system.mass, whole.heavy_part(self.velocity)
        lag = whole.expand(modal_lag(K=K, M=M, ratios=self.ratios, velocity=velocity))
        return self.displacement + lag, None, self.acceleration
