"""`best_excitation`: the periodic motion that tells most about unknowns, under limits."""

import functools
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float, PyTree

from ..checks import number_faults, require_reals
from ..design import Limit, Optimum, minimise
from ..design._variables import read_variables
from ..errors import ModelError
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..tables import format_number
from ..typing import ArrayLike
from ._fourier import FourierMotion
from ._identification import Identification, _sizes
from ._verdict import Direction, spectrum, unseen_directions

#: Times at which stroke, speed and acceleration are held, for each period of the highest harmonic.
SAMPLES = 16
#: Largest number of harmonics.
MOST = 200
#: Largest value at these times of a series whose magnitude is nowhere above one (Ehlich and Zeller 1964).
SHARE = np.cos(np.pi / SAMPLES)


def _table_rows(found):
    rows = [(name, format_number(s)) for name, s in zip(found.names, found.standard_errors, strict=True)]
    return found.summary(), [("unknown", "standard error expected"), *rows]


class Excitation(Reported, eqx.Module):
    """Motion of an experiment, and what it will tell.

    Attributes:
        motion: coordinates over one period.
        names: of the unknowns (p,).
        standard_errors: (p,) to be expected, by this experiment and those known; infinite where nothing is seen.
        information: half the logarithm of the determinant, with a prior of the unknowns' own sizes.
        unseen: directions of the unknowns that stay hidden.
        jacobian: (m, p) of the predictions over the deviations of their noise, as `with_experiment` takes it.
        optimum: history and limits of the search.
    """

    motion: FourierMotion
    names: tuple[str, ...] = eqx.field(static=True)
    standard_errors: np.ndarray
    information: float
    unseen: tuple[Direction, ...]
    jacobian: np.ndarray
    optimum: Optimum

    def report(self) -> Report:
        summary, rows = _table_rows(self)
        unknown = (Axis("unknown", self.names),)
        errors = Quantity("standard error", self.standard_errors, "", unknown)
        return Report([errors, Quantity("information", self.information)], summary, table=rows)

    def summary(self) -> str:
        """The verdict in sentences."""
        count = len(self.names)
        told = [f"search: {self.optimum.reason}; {count - len(self.unseen)} of {count} directions seen"]
        told += [f"{one.text} stays hidden" for one in self.unseen]
        return ". ".join(told)


class _Question(eqx.Module):
    """Weighted derivatives of the predictions by relative changes of the unknowns."""

    predict: Callable = eqx.field(static=True)
    unravel: Callable = eqx.field(static=True)
    values: Float[Array, " p"]
    sizes: Float[Array, " p"]
    known: Float[Array, "m p"]
    deviations: PyTree

    def jacobian(self, motion):
        """(m, p) by relative changes, of this experiment alone."""

        def weighted(x):
            found = self.predict(self.unravel(x), motion)
            noise = self.deviations
            if jax.tree_util.treedef_is_leaf(jax.tree.structure(noise)):
                noise = jax.tree.map(lambda _: noise, found)
            elif jax.tree.structure(noise) != jax.tree.structure(found):
                text = "deviations must be one number, or have the parts of the prediction"
                raise ModelError([text], "best_excitation")
            parts = jax.tree.map(lambda y, s: y / s, found, noise)
            flat, _ = ravel_pytree(parts)
            return jnp.concatenate([flat.real, flat.imag]) if jnp.iscomplexobj(flat) else flat

        return jax.jacfwd(weighted)(self.values) * self.sizes[None, :]

    def information(self, motion, largest):
        """Half the logarithm of the determinant; the prior keeps hidden directions from making it minus infinity."""
        J = jnp.concatenate([self.jacobian(motion), self.known]) * largest
        factor = jnp.linalg.cholesky(jnp.eye(J.shape[1]) + J.T @ J)
        return jnp.sum(jnp.log(jnp.diagonal(factor)))


def best_excitation(
    predict: Callable[[PyTree, FourierMotion], PyTree],
    unknowns: PyTree,
    stroke: tuple[ArrayLike, ArrayLike],
    speed: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    period: float = 10.0,
    harmonics: int = 5,
    limits: Sequence[Limit] | Limit = (),
    deviations: PyTree = 1.0,
    known: Identification | None = None,
    first: FourierMotion | None = None,
    largest: float = 1.0,
    steps: int = 100,
    gradient: str = "reverse",
    progress: bool = True,
    compile: str = "auto",
) -> Excitation:
    """The periodic motion of an experiment that determines unknowns best: D-optimal, under limits.

    Args:
        predict: function of the unknowns and a `FourierMotion` to what would be measured, a pytree of arrays (joint
            efforts of `inverse_dynamics` at `motion.times(...)`, say); it is traced and differentiated by both.
        unknowns: values about which the experiment is to tell, as of `identify`.
        stroke: lowest and highest coordinates (n,), one for each of the n coordinates that move.
        speed, acceleration: largest magnitudes of velocities and accelerations, numbers or (n,).
        period: [s]; harmonics: their number, the highest has the period over it.
        limits: others, of which `value` is a function of the `FourierMotion`: loads, distances.
        deviations: of the noise, like the predictions or one number.
        known: an identification of the same unknowns by experiments that are done.
        first: motion to begin with; by default one of random coefficients within stroke, speed and acceleration.
        largest: relative standard deviation from which on a direction counts as unseen.
        steps, gradient, progress, compile: as of `minimise`.

    Stroke, speed and acceleration hold at all times: they are held at sixteen times in each period of the highest
    harmonic, to 98 percent.  Other limits hold where their values are taken.

    Raises: ModelError, ValueError for limits and noise that do not fit; as `minimise`.
    Source: Swevers et al. (1997).
    """
    if not all(_is_positive(x) for x in jax.tree.leaves(deviations)):
        raise ModelError(["deviations must be positive and finite"], "best_excitation")
    lower, upper = _read_stroke(stroke, period, harmonics, largest)
    period, deviations = float(period), jax.tree.map(lambda s: jnp.asarray(s, float), deviations)
    variables = read_variables(unknowns, None)
    sizes = _sizes(variables.start, variables.lower, variables.upper)
    question = _Question(
        predict,
        variables.unravel,
        jnp.asarray(variables.start),
        jnp.asarray(sizes),
        _known_rows(known, variables),
        deviations,
    )
    ts = np.arange(SAMPLES * harmonics) * (period / (SAMPLES * harmonics))
    bounds = [_magnitude(x, len(lower), name) for x, name in ((speed, "speed"), (acceleration, "acceleration"))]
    motion = _random_motion(lower, upper, bounds, period, harmonics, ts) if first is None else first
    centre, half = 0.5 * (lower + upper), 0.5 * SHARE * (upper - lower)
    holds = [Limit("stroke", functools.partial(_sampled, ts, 0), centre - half, centre + half)]
    for k, (name, bound) in enumerate(zip(("speed", "acceleration"), bounds, strict=True), start=1):
        if bound is not None:
            holds.append(Limit(name, functools.partial(_sampled, ts, k), -SHARE * bound, SHARE * bound))
    own = (limits,) if isinstance(limits, Limit) else tuple(limits)
    best = minimise(
        lambda m: -question.information(m, largest),
        motion,
        limits=[*holds, *own],
        steps=steps,
        gradient=gradient,
        progress=progress,
        compile=compile,
    )
    return _excitation(question, best, variables, sizes, largest)


def _sampled(ts, order, motion):
    return motion.at(ts)[order]


def _excitation(question, best, variables, sizes, largest):
    J = np.asarray(jax.jit(lambda m: question.jacobian(m))(best.design), float) / sizes
    every = spectrum(np.concatenate([J, np.asarray(question.known) / sizes]), sizes)
    unseen = unseen_directions(every, variables.names, largest)
    errors = np.sqrt(np.diagonal(every.covariance))
    return Excitation(best.design, variables.names, errors, -float(best.value), unseen, J, best)


def _known_rows(known: Identification | None, variables) -> Any:
    if known is None:
        return jnp.zeros((0, len(variables.start)))
    if known.names != variables.names:
        raise ModelError([f"the known experiments are of {known.names}, not of {variables.names}"], "best_excitation")
    sizes = _sizes(variables.start, variables.lower, variables.upper)
    return jnp.asarray(known.jacobian / known.noise * sizes)


def _read_stroke(stroke, period, harmonics, largest):
    faults = number_faults("period", period, positive=True) + number_faults("largest", largest, positive=True)
    if isinstance(harmonics, bool) or not isinstance(harmonics, int | np.integer) or not 1 <= harmonics <= MOST:
        faults.append(f"harmonics must be a whole number of 1 to {MOST}, not {harmonics!r}")
    try:
        require_reals(stroke)
        lower, upper = (np.atleast_1d(np.asarray(side, float)) for side in stroke)
        if lower.shape != upper.shape or lower.ndim != 1 or not np.all(np.isfinite(upper - lower) & (upper > lower)):
            faults.append("stroke must be the lowest and the highest coordinates (n,), the first below the second")
    except (TypeError, ValueError):
        faults.append("stroke must be the lowest and the highest coordinates (n,)")
    if faults:
        raise ModelError(faults, "best_excitation")
    return lower, upper


def _is_positive(x):
    try:
        require_reals(x)
        number = np.asarray(x, float)
    except (TypeError, ValueError):
        return False
    return bool(np.all(np.isfinite(number) & (number > 0)))


def _magnitude(x, n, name):
    if x is None:
        return None
    try:
        require_reals(x)
        bound = np.broadcast_to(np.asarray(x, float), (n,))
    except (TypeError, ValueError):
        bound = np.zeros(n)
    if not np.all(np.isfinite(bound) & (bound > 0)):
        raise ModelError([f"{name} must be positive, a number or ({n},)"], "best_excitation")
    return bound


def _random_motion(lower, upper, bounds, period, harmonics, ts):
    """Random coefficients, scaled to nine tenths of the nearest of the limits."""
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, len(lower), harmonics))
    trial = FourierMotion(jnp.zeros(len(lower)), jnp.asarray(a), jnp.asarray(b), period)
    sizes = [np.max(np.abs(np.asarray(x)), axis=0) for x in trial.at(ts)]
    rooms = [0.5 * (upper - lower), *bounds]
    factor = 0.9 * np.min([room / size for room, size in zip(rooms, sizes, strict=True) if room is not None], axis=0)
    a, b = (jnp.asarray(factor[:, None] * part) for part in (a, b))
    return FourierMotion(jnp.asarray(0.5 * (lower + upper)), a, b, period)
