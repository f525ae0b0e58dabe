"""Samples of a motion: at instants of a fixed rhythm a part of y gets other values, which it keeps until the next.

The instants are `start + n * period`; steps end on them.  The sample of the start is taken before the first step, and
none at the end, so that a state saved at a sample is that before it, and a motion may be continued from there.
"""

from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float, Int, PyTree

from ..runtime import any_in_batch

if TYPE_CHECKING:
    from ._problem import LoopState, OdeProblem

#: Instants nearer than this part of the least period, or than so many roundings of the time, are one.
_TOGETHER, _ROUNDINGS = 1e-9, 16.0


class SampleClock(eqx.Module):
    """The instants `start + n * period` of several periods.

    Attributes:
        start: () [s]; periods: (m,) [s], positive.
        first: (m,) numbers of the samples that come first after the begin of a later part of the motion; None from
            the start on.
    """

    start: Float[Array, ""]
    periods: Float[Array, " m"]
    first: Int[Array, " m"] | None = None

    def instants(self, numbers: Int[Array, " m"]) -> Float[Array, " m"]:
        """Times of the samples of these numbers."""
        return self.start + numbers.astype(self.periods.dtype) * self.periods

    def tolerance(self, t: Array) -> Array:
        """Difference (...) of two times near t that are one instant."""
        rounding = _ROUNDINGS * jnp.spacing(jnp.maximum(jnp.abs(t), jnp.abs(self.start)))
        return _TOGETHER * jnp.min(self.periods) + rounding

    def next_numbers(self, t: Float[Array, ""]) -> Int[Array, " m"]:
        """Numbers of the samples that come first after a time."""
        return jnp.floor((t + self.tolerance(t) - self.start) / self.periods).astype(jnp.int32) + 1

    def is_sample(self, t: Float[Array, ""]) -> Bool[Array, " m"]:
        """True for the periods with a sample at a time."""
        numbers = self.next_numbers(t) - 1
        return (jnp.abs(self.instants(numbers) - t) <= self.tolerance(t)) & (numbers >= 0)

    def following(self, t: Float[Array, ""], number: int) -> Float[Array, " n"]:
        """The instants that follow a time, so many."""
        steps = jnp.arange(number, dtype=jnp.int32)
        return jnp.sort(jax.vmap(lambda k: self.instants(self.next_numbers(t) + k))(steps).reshape(-1))[:number]

    def just_before(self, times: Float[Array, " T"]) -> Float[Array, " T"]:
        """The times, those of samples moved before them, so that states interpolated there are those before."""

        def of_one(t):
            numbers, near = jnp.round((t - self.start) / self.periods), self.tolerance(t)
            instants = self.start + numbers * self.periods
            is_sample = (jnp.abs(t - instants) <= near) & (numbers >= 1.0)
            return jnp.min(jnp.where(is_sample, instants - near, t))

        return jax.vmap(of_one)(times)


def first_numbers(problem: "OdeProblem") -> Int[Array, " m"] | None:
    """Numbers of the samples that come first after the start; None without samples."""
    if problem.clock is None:
        return None
    first = problem.clock.first
    return jnp.ones(problem.clock.periods.shape, jnp.int32) if first is None else first


def limit_length(problem: "OdeProblem", t: Array, t_next: Array) -> Array:
    """The end of the next step; one of fixed steps is counted from the last sample, not from the start."""
    if problem.clock is None or not problem.has_fixed_steps:
        return t_next
    return jnp.minimum(t_next, t + problem.restart)  # type: ignore[operator]


def land_on_sample(problem: "OdeProblem", t_next: Array, keep: Array, numbers: Any, save_time: Any) -> Array:
    """The end of the next step, not beyond the next sample; one that ends just before is stretched to it.

    Args: keep: False for a step that is retried, which is not stretched; save_time: the next one to save.
    """
    if problem.clock is None:
        return t_next
    sample, near = jnp.min(problem.clock.instants(numbers)), problem.clock.tolerance(t_next)
    if problem.lands_on_times:
        sample = jnp.where(jnp.abs(save_time - sample) <= near, save_time, sample)
    sample = jnp.where(_is_before_end(problem, sample), sample, jnp.inf)
    return jnp.where(keep & (t_next > sample - near), sample, jnp.minimum(t_next, sample))


def due_samples(problem: "OdeProblem", state: "LoopState", keep: Array, ends: Array) -> Bool[Array, " m"] | None:
    """True for the periods with a sample at the end of a step, where the motion goes on; None without samples."""
    if problem.clock is None:
        return None
    t = state.t_next
    is_here = problem.clock.instants(state.sampled) <= t + problem.clock.tolerance(t)  # type: ignore[arg-type]
    return is_here & keep & ~ends & _is_before_end(problem, t)


def _is_before_end(problem, t):
    end = problem.samples_end  # that of the motion: the adjoint takes parts of it again, which end sooner
    return t < end - problem.clock.tolerance(end)


def after_samples(problem: "OdeProblem", t: Array, y: PyTree, args: PyTree, due: Any, numbers: Any) -> PyTree:
    """y at the time t after the samples that are due."""
    if problem.clock is None:
        return y
    happens = jnp.any(due)
    take = lambda: problem.sample(t, y, args, due, numbers)  # type: ignore[misc]
    sampled = lax.cond(any_in_batch(happens), take, lambda: y)
    return jax.tree.map(lambda new, old: jnp.where(happens, new, old), sampled, y)


def with_start(state: "LoopState", y0: PyTree, problem: "OdeProblem", t0: Array) -> "LoopState":
    """The loop's final state with the start before its sample in the rows of the start, and at the end if no step was
    taken."""
    if problem.clock is None:
        return state
    early = problem.times <= t0
    rows = jax.tree.map(lambda ys, y: jnp.where(early.reshape(-1, *[1] * y.ndim), y[None], ys), state.ys, y0)
    end = jax.tree.map(lambda y, start: jnp.where(state.t > t0, y, start), state.y, y0)
    return eqx.tree_at(lambda s: (s.ys, s.y), state, (rows, end))
