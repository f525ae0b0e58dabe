"""`Equilibrium`: what `equilibrium` finds, with its verdict."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from ..assembly._state import State
from ..assembly._state_report import state_quantities
from ..checks import is_concrete
from ..dynamics._validity import Validity
from ..reports import Note, Report, Reported
from ..runtime import lapack
from ..status import Status
from ..tables import format_number

#: Negative curvature over the largest, rows and columns scaled to one, from which on it is no rounding.
_NEGATIVE = {8: 1e-9, 4: 1e-3}


class Equilibrium(Reported, eqx.Module):
    """Equilibrium or steady motion of a mechanism; questions take it as they take its state.

    Attributes:
        state: the State there; NaN where none was found, as are stiffness and efforts, so that no result is computed
            from a state that is no equilibrium.
        residual: largest effort left on the independent velocities [N, N m] or gap of a loop, over the model's scale,
            without derivative.
        ok: true if the residual is small.
        stable: true if the symmetric part of the stiffness is positive definite on the coordinates that do not move;
            false where some motion is indifferent, as that of a cart on a level track, or negative.
        stiffness: K (N, N) there, all causes, along the admissible directions.  Bristles that stick, metal and tyres
            that stand bend along with the motion; other internal states of force elements do not change: of these
            `modes` has the stability.
        efforts: (N,) that keep the moving joints at their speed; zero when the motion sustains itself.
        steps: number of Newton steps.
        is_negative: true where the stiffness is negative along some direction, of what was found.
        followed: true where the loads were followed from zero, see `equilibrium`.
        share: of the loads, up to which they could be followed; one where they were not.
        validity: margins of its parts to the ends of their models there; None where none has any.
        neutral: coordinates that nothing holds or pushes there, in words; empty within a trace.
        is_steady: true for a steady motion, whose stability the stiffness alone does not tell (static).
    """

    state: State
    residual: Float[Array, ""]
    ok: Bool[Array, ""]
    stable: Bool[Array, ""]
    stiffness: Float[Array, "N N"]
    efforts: Float[Array, " N"]
    steps: Int[Array, ""]
    is_negative: Bool[Array, ""] = eqx.field(default_factory=lambda: np.zeros((), bool))
    followed: Bool[Array, ""] = eqx.field(default_factory=lambda: np.zeros((), bool))
    share: Float[Array, ""] = eqx.field(default_factory=lambda: np.ones(()))
    validity: Validity | None = None
    neutral: Note = eqx.field(static=True, default=Note(""))
    is_steady: bool = eqx.field(static=True, default=False)

    def report(self) -> Report:
        verdict = f"{int(self.steps)} steps, residual {format_number(self.residual)}"
        said = "; ".join([self.reason, verdict, *self.faults()]) if self.ok else verdict
        return Report(state_quantities(self.state, not self.is_steady), said, "" if self.ok else self.reason)

    @property
    def states(self) -> State:
        """The state, by which questions take an equilibrium."""
        return self.state

    @property
    def note(self) -> str:
        """Words for results at an equilibrium that is unstable, otherwise empty; also where it is traced."""
        return "at an UNSTABLE equilibrium" if is_concrete(self.ok) and self.status == Status.UNSTABLE else ""

    def faults(self) -> list[str]:
        """Parts that are beyond the end of their model there, in words (concrete equilibria)."""
        return [] if self.validity is None else self.validity.faults()

    @property
    def is_unstable(self) -> Any:
        """True where the stiffness is negative along some direction, of an equilibrium at rest (traceable)."""
        return np.zeros(np.shape(self.is_negative), bool) if self.is_steady else self.is_negative

    @property
    def result(self) -> Any:
        """Code of the `Status`: SUCCESS, VALIDITY, UNSTABLE or NO_EQUILIBRIUM (traceable)."""
        where = np.where if is_concrete(self) else jnp.where  # known verdicts need no program
        is_outside = False if self.validity is None else self.validity.is_outside
        found = where(is_outside, Status.VALIDITY, Status.SUCCESS)
        found = where(self.is_unstable, Status.UNSTABLE, found)
        return where(self.ok, found, Status.NO_EQUILIBRIUM)

    @property
    def status(self) -> Status:
        """Status, `str` of it in words (concrete equilibria)."""
        return Status(int(np.asarray(self.result)))

    @property
    def reason(self) -> str:
        """The verdict in words, with the way in which it was found (concrete equilibria)."""
        if not bool(self.ok):
            return str(Status.NO_EQUILIBRIUM)
        if self.status == Status.UNSTABLE:
            return f"UNSTABLE: {Status.UNSTABLE}"
        if bool(self.followed):
            return (
                "found by following the loads from zero, as the search from the start alone ends at no stable "
                "equilibrium"
            )
        if self.is_steady:
            return "steady motion found"
        if bool(self.stable):
            return "stable equilibrium found"
        return f"neutral equilibrium found, indifferent to {self.neutral or 'some motion'}"


def has_negative_curvature(K: Array, bands: bool = False) -> Any:
    """True () if K, rows and columns scaled to one, has a curvature that is negative beyond rounding."""
    K = lax.stop_gradient(K)
    symmetric = 0.5 * (K + K.T)
    size = jnp.max(jnp.abs(symmetric), axis=1, initial=0.0)
    scale = 1.0 / jnp.sqrt(jnp.where(size > 0.0, size, 1.0))
    values = curvatures(scale[:, None] * K * scale[None, :], bands)
    largest = jnp.max(jnp.abs(values), initial=0.0)
    least = jnp.min(values, initial=jnp.inf)
    return least < -_NEGATIVE[K.dtype.itemsize] * largest


def curvatures(K: Array, bands: bool = False) -> Array:
    """Curvatures (N,) of a stiffness K (N, N): eigenvalues of its symmetric part.

    Args: bands: real parts of its own eigenvalues in place of these, for what rubs: a tyre bends by its rolling
        radius and pushes at its loaded one, and takes work along some turn of the wheel without leading away.
    """
    K = lax.stop_gradient(K)
    return jnp.real(lapack.eig(K)[0]) if bands else lapack.eigvalsh(0.5 * (K + K.T))
