"""Motion of a linear system: what starts it, what drives it, and what `simulate` returns."""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..forces import AbstractScalarLaw
from ..linear._massless import condense_massless
from ..linear._system import LinearSystem
from ..runtime import as_array
from ..typing import AnyArray, ScalarLike
from ._damping import modal_lag


class Link(eqx.Module):
    """A law of forces on `x = sum coefficient * displacement` of coordinates by name.

    `Link(BumpStop(k, upper=gap), {"wing.tip z": 1.0, "store.nose z": -1.0})` is a stop between two components of a
    network, `Link(law, {"tip z": 1.0})` one to the ground.

    Attributes:
        law: `jaxmbs.forces`' scalar laws, or one of your own: the effort along increasing x.
        coefficients: (k,), by name.

    Raises: ValueError without a coordinate, or for coefficients that are no numbers; TypeError for what is no law.
    """

    law: AbstractScalarLaw
    coefficients: Float[Array, " k"]
    names: tuple = eqx.field(static=True)

    def __init__(self, law: AbstractScalarLaw, row: Mapping[str | tuple, ScalarLike]) -> None:
        if not row:
            raise ValueError("a link needs at least one coordinate")
        if not isinstance(law, AbstractScalarLaw):
            raise TypeError(f"the law of a link is a scalar law such as BumpStop(...), got {law!r}")
        self.law, self.names = law, tuple(row)
        self.coefficients = jnp.stack([as_array(value) for value in row.values()])
        if self.coefficients.ndim != 1:
            raise ValueError(f"coefficients of a link are numbers, got shapes {self.coefficients.shape[1:]}")

    def forces(self, efforts: AnyArray) -> dict[str | tuple, Array]:
        """Forces (...) by name of efforts (...)."""
        return {
            name: c.astype(efforts.dtype) * efforts for name, c in zip(self.names, self.coefficients, strict=True)
        }


class Modal(eqx.Module):
    """The motion in natural modes, in place of an integrator: exact for loads that are straight between samples.

    Attributes:
        ratios: damping of the modes, one number or one for each; None takes the system's own damping matrix, which
            must not couple the modes.
        num: modes that move; those above follow the load statically.  It cuts no group of equal frequencies.
        static_start: elastic modes start at rest in balance with the first load.

    Derivatives are those of `modal_response`.  Source: S1 (30)-(31), (42)-(43).
    """

    ratios: Float[Array, "..."] | float | None = None
    num: int | None = eqx.field(static=True, default=None)
    static_start: bool = eqx.field(static=True, default=False)


class LinearMotion(eqx.Module):
    """A motion of a linear system; `system.expand(motion.displacement)` is that of what was reduced or joined.

    Attributes:
        ts: (T,) [s].
        displacement, velocity, acceleration: (T, n).
        efforts: (T, links) of the laws.
        forces: what was put on the system at these times, those of the links after those given.
        ok: () whether the motion came to its end.
        ratios: damping of the natural modes, where `Modal(ratios)` took it in place of the system's own.
    """

    ts: Float[Array, " T"]
    displacement: Float[Array, "T n"]
    velocity: Float[Array, "T n"]
    acceleration: Float[Array, "T n"]
    efforts: Float[Array, "T links"]
    forces: tuple
    ok: Bool[Array, ""]
    ratios: Float[Array, "..."] | None = None

    def terms(self, system: LinearSystem) -> tuple:
        """What stiffness, damping (None: nothing) and mass of the system's parts act on, each (T, n).

        A part has a share of the damping by ratios as it has one of the stiffness: such damping is inside of the
        parts, so that it does not hold them back in space.
        """
        if self.ratios is None:
            return self.displacement, self.velocity, self.acceleration
        whole = condense_massless(system.to_dense(), damped=False)
        K, M, velocity = whole.system.stiffness, whole.system.mass, whole.heavy_part(self.velocity)
        lag = whole.expand(modal_lag(K=K, M=M, ratios=self.ratios, velocity=velocity))
        return self.displacement + lag, None, self.acceleration
