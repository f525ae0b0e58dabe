"""Ride: covariances of a linearised vehicle on a random road, exactly, with the delay of its wheelbase.

The road's heights r under the wheels are accelerations of driven joints in the linearisation, `x' = A x + B r''`.  On
a road of waviness 2 their rates are white noise w, and with `x = z + B w` no derivative of noise is left:
`z' = A z + A B w`.  What follows a wheel later sees the same noise: E[w(t) w(t - delay)] adds `exp(A delay)` to the
Lyapunov equation.  Source: Bendat and Piersol (2010) for the spectra; Elishakoff (1983) for delays.
"""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import jax.scipy.linalg
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..analysis import Linearisation
from ..checks import any_concrete, faults_if, is_concrete, no_such, not_positive, shape_of
from ..errors import ModelError
from ..forces._fields import number
from ..math._lyapunov import lyapunov
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..typing import ScalarLike, WordedError
from ._random_road import RandomRoad
from ._weighting import weighting

_TINY = 1e-9  # relative size of what rounding leaves of a feedthrough


class Ride(Reported, eqx.Module):
    """Stationary motion on a random road; numbers in SI units.

    Attributes:
        covariance: (outputs, outputs), of outputs that follow the noise itself infinite.
        names: of the outputs, then those that are weighted, "seat Wk" (static).
    """

    covariance: Float[Array, "outputs outputs"]
    names: tuple[str, ...] = eqx.field(static=True)

    @property
    def rms(self) -> Float[Array, " outputs"]:
        """Roots of the mean squares (outputs,)."""
        variance = jnp.diagonal(self.covariance)
        positive = variance > 0.0
        return jnp.where(positive, jnp.sqrt(jnp.where(positive, variance, 1.0)), variance)

    def report(self) -> Report:
        return Report([Quantity("rms", self.rms, "SI", (Axis("output", self.names),))], f"{len(self.names)} outputs")


def ride(
    linearisation: WordedError[Linearisation],
    road: WordedError[RandomRoad],
    speed: ScalarLike,
    wheels: Mapping[str, tuple[ScalarLike, str]] | None = None,
    coherence: ScalarLike = 0.0,
    weightings: Mapping[str, str] | None = None,
) -> Ride:
    """Root mean squares of a linearised vehicle on a random road of waviness 2, over all frequencies.

    Args:
        linearisation: `linearise(system, state, inputs=[...], outputs=...)`; inputs are driven joints, the heights of
            the road under the wheels.  Coordinates are counted from the road: joint "tyre" between road and wheel.
        road: its spectrum.
        speed: > 0 [m/s].
        wheels: by name of input, its place along the vehicle [m], forwards, and its track, any word: wheels of a
            track follow each other exactly.  By default all are in one place.
        coherence: of different tracks, from 0 (independent) to 1, one number at all frequencies; for the coherence of
            a surface use `random_response` with `wheel_inputs`.
        weightings: by name of an output, "Wk" or another weighting of ISO 2631-1: one more output of each.

    Raises: ModelError with every fault; if concrete, where the heights of the road themselves move the vehicle.
    """
    _check(linearisation, road, speed, coherence)
    places = _places(linearisation, wheels)
    model = _driven_by_noise(linearisation, len(places))
    names = linearisation.output_names
    for name, kind in (weightings or {}).items():
        if name not in linearisation.output_names:
            raise ModelError([no_such("output", name, linearisation.output_names)], "the question")
        model = _weighted(model, linearisation.output_names.index(name), kind)
        names = (*names, f"{name} {kind}")
    return Ride(_covariance(model, places, road.speed_level(speed) / 2.0, speed, coherence), names)


def wheel_inputs(
    road: RandomRoad,
    speed: ScalarLike,
    wheels: Mapping[str, tuple[ScalarLike, ScalarLike]],
    lowest: ScalarLike = 0.1,
    highest: ScalarLike = 100.0,
) -> tuple[dict[str, Any], dict[tuple[str, str], Any]]:
    """Inputs and coherence of `random_response` for wheels on a random road: delays exactly, tracks by the surface.

    Args:
        speed: > 0 [m/s].
        wheels: by name of input, its place along the vehicle and to the side [m].
        lowest, highest: frequencies [Hz].

    Returns: inputs by name, and coherence by pair of names: `random_response(linear, *wheel_inputs(...))`.
    Raises: ModelError for a speed that is not positive.
    """
    from ..qualification import BaseAcceleration

    _check_wheels(wheels, "{'front left': (1.2, 0.8)}: places along the vehicle and to the side")
    faults = [f for name, pair in wheels.items() for f in _place_faults(f"the track of wheel {name!r}", pair[1])]
    if faults:
        raise ModelError(faults, "the question")
    table, v = road.acceleration_table(speed, lowest, highest), number(speed)
    inputs = {name: BaseAcceleration(table) for name in wheels}
    found = {}
    names = list(wheels)
    for k, first in enumerate(names):
        for second in names[k + 1 :]:
            ahead, aside = (number(wheels[first][i]) - number(wheels[second][i]) for i in (0, 1))
            found[first, second] = _Coherence(road, v, ahead, jnp.abs(aside))
    return inputs, found


class _Coherence(eqx.Module):
    """Coherence of two wheels: that of their tracks, turned by the delay."""

    road: RandomRoad
    speed: Array
    ahead: Array
    aside: Array

    def __call__(self, f):
        angle, size = 2.0 * np.pi * f * self.ahead / self.speed, self.road.coherence(f / self.speed, self.aside)
        return lax.complex(size * jnp.cos(angle), size * jnp.sin(angle))


def _check(linearisation, road, speed, coherence):
    if not isinstance(linearisation, Linearisation):
        raise ModelError(["a vehicle rides about a state: linearise it first"], "the question")
    if not isinstance(road, RandomRoad):
        raise ModelError([f"road must be a RandomRoad, got {type(road).__name__}"], "the question")
    faults = faults_if(
        (np.shape(speed) != (), "speed must be one number"),
        (not_positive(speed), "speed must be positive"),
        (any_concrete(lambda w: np.abs(w - 2.0) > 1e-12, road.waviness), "the road must have waviness 2"),
        (shape_of(coherence) != () or np.iscomplexobj(coherence), "coherence must be one real number"),
        (any_concrete(lambda c: ~((c >= 0.0) & (c <= 1.0)), coherence), "coherence must be from 0 to 1"),
        (not linearisation.output_names, "it has no outputs: linearise(..., outputs=[...])"),
        (not linearisation.input_names, "it has no inputs: linearise(..., inputs=[...])"),
    )
    if faults:
        raise ModelError(faults, "the question")


def _check_wheels(wheels, wanted):
    """Raise a ModelError unless each wheel has a pair whose first is a number."""
    if not isinstance(wheels, Mapping):
        raise ModelError([f"wheels must be {wanted}"], "the question")
    wrong = [name for name, pair in wheels.items() if not isinstance(pair, tuple | list) or len(pair) != 2]
    faults = [f"wheel {name!r} must be like {wanted}" for name in wrong]
    for name in [name for name in wheels if name not in wrong]:
        faults += _place_faults(f"the place of wheel {name!r}", wheels[name][0])
    if faults:
        raise ModelError(faults, "the question")


def _place_faults(what, value):
    """A sentence unless the value is one finite number."""
    is_number = not isinstance(value, str | bytes | None) and shape_of(value) == () and not np.iscomplexobj(value)
    if not is_number or any_concrete(lambda x: ~np.isfinite(x), value):
        return [f"{what} must be one finite number, not {value!r}"]
    return []


def _places(linearisation, wheels):
    """(place, track) of each input."""
    names = linearisation.input_names
    if wheels is None:
        return [(0.0, "")] * len(names)
    _check_wheels(wheels, "{'front left': (1.2, 'left')}: a place along the vehicle and a word for the track")
    faults = [no_such("input", name, names) for name in wheels if name not in names]
    faults += [f"wheels has no place of input {name!r}" for name in names if name not in wheels]
    if faults:
        raise ModelError(faults, "the question")
    return [wheels[name] for name in names]


def _driven_by_noise(linearisation, count):
    """A, G, C of `z' = A z + G w`, `y = C z`, and flags of the outputs that follow w itself."""
    A, B, C, D = linearisation.state_space
    names = linearisation.state_names
    roads = [k for k, name in enumerate(names) if name in linearisation.input_names]
    rates = [k for k, name in enumerate(names) if name in {f"rate of {n}" for n in linearisation.input_names}]
    order = {name: k for k, name in enumerate(linearisation.input_names)}
    if len(roads) != count or len(rates) != count:
        raise ModelError(["inputs must be driven joints, whose drives are the heights of the road"], "the question")
    keep = np.array([k for k in range(len(names)) if k not in {*roads, *rates}])
    roads = np.array(sorted(roads, key=lambda k: order[names[k]]))
    rates = np.array(sorted(rates, key=lambda k: order[names[k].removeprefix("rate of ")]))
    A_keep, B_keep, C_keep = A[np.ix_(keep, keep)], B[keep], C[:, keep]
    _refuse_heights(A, C, keep, roads, names)
    G = A_keep @ B_keep + A[np.ix_(keep, rates)]
    through = C_keep @ B_keep + C[:, rates]
    reach = (
        jnp.sum(jnp.abs(C_keep), axis=1) * jnp.max(jnp.abs(B_keep)) + jnp.sum(jnp.abs(C[:, rates]), axis=1) + 1e-300
    )
    follows = jnp.max(jnp.abs(through), axis=1) > _TINY * reach
    follows = follows | (jnp.max(jnp.abs(D), axis=1) > _TINY * (1.0 + jnp.sum(jnp.abs(C), axis=1)))
    return A_keep, G, C_keep, follows


def _refuse_heights(A, C, keep, roads, names):
    """Raise a ModelError where heights of the road themselves move the vehicle or its outputs, if concrete."""
    if not is_concrete(A, C):
        return
    A, C = np.asarray(A), np.asarray(C)
    rows, scale = np.abs(A[np.ix_(keep, roads)]).sum(axis=1), np.abs(A[np.ix_(keep, keep)]).sum(axis=1)
    moved = [names[k] for k, row, size in zip(keep, rows, scale, strict=True) if row > _TINY * (size + 1e-300)]
    if moved or np.any(np.abs(C[:, roads]) > _TINY * np.abs(C).max()):
        what = ", ".join(map(repr, moved[:5])) or "the outputs"
        raise ModelError(
            [f"heights of the road move {what}: count from the road, whose height has no end"],
            "the question",
        )


def _weighted(model, row, kind):
    """The model with one more output, a weighted one."""
    A, G, C, follows = model
    a, b, c, d = weighting(kind).state_space()
    n, m = len(A), len(a)
    A = jnp.block([[A, jnp.zeros((n, m))], [b @ C[row][None], a]])
    G = jnp.concatenate([G, jnp.zeros((m, G.shape[1]))])
    last = jnp.concatenate([(d @ C[row][None])[0], c[0]])
    C = jnp.concatenate([jnp.concatenate([C, jnp.zeros((len(C), m))], axis=1), last[None]])
    return A, G, C, jnp.append(follows, follows[row])


def _covariance(model, places, intensity, speed, coherence):
    """Covariance of the outputs; intensity: of the noise, two-sided."""
    A, G, C, follows = model
    N = jnp.zeros_like(A)
    for i, (first, track) in enumerate(places):
        N = N + 0.5 * jnp.outer(G[:, i], G[:, i])
        for j, (second, other) in enumerate(places[:i]):
            common = 1.0 if track == other else coherence
            delay = (jnp.asarray(first, A.dtype) - second) / speed  # of the second behind the first
            ahead, behind = jnp.where(delay >= 0.0, 1.0, 0.0), jnp.where(delay >= 0.0, 0.0, 1.0)
            spread = jax.scipy.linalg.expm(A * jnp.abs(delay))
            N = N + common * ahead * jnp.outer(spread @ G[:, i], G[:, j])
            N = N + common * behind * jnp.outer(spread @ G[:, j], G[:, i])
    P = C @ lyapunov(A, intensity * (N + N.T)) @ C.T
    endless = jnp.where(follows, jnp.inf, 0.0)
    return jnp.where(jnp.diag(follows), jnp.diag(endless), P)
