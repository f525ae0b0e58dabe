"""Run-up and coast-down of a rotor: its whirl while the speed passes resonances."""

from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jaxtyping import Float

from ..checks import any_concrete, check_count
from ..errors import ModelError
from ..math import _square as square
from ..quantities import Axis, Quantity
from ..reports import Report, Reported, failures
from ..runtime import as_array, jit, lapack
from ..typing import ArrayLike
from ._rotor import Rotor
from ._unbalance import unbalance_places
from ._validity import BearingValidity, bearing_validity, fault_of, tell

_MOST = 10_000  # substeps


class RunUp(Reported, eqx.Module):
    """Whirl of a rotor whose speed changes.

    Attributes:
        ts: (T,) [s]; speeds: (T,) [rad/s]; deflections: (T, N, 2) [m] of all stations along x and y.
        validity: of the bearings' models.
    """

    ts: Float[Array, " T"]
    speeds: Float[Array, " T"]
    deflections: Float[Array, "T N 2"]
    validity: BearingValidity | None = None

    def report(self) -> Report:
        time, plane = Axis("time", np.asarray(self.ts), "s"), Axis("axis", ("x", "y"))
        station = Axis("station", tuple(map(str, range(self.deflections.shape[1]))))
        return Report(
            [
                Quantity("speed", self.speeds, "rad/s", (time,)),
                Quantity("deflection", self.deflections, "m", (time, station, plane)),
            ],
            fault=failures(jnp.all(jnp.isfinite(self.deflections), axis=(-2, -1)), "instants without an answer")
            or fault_of(self.validity),
        )

    def amplitude(self, station: int) -> Float[Array, " T"]:
        """Distance (T,) [m] of a station from the axis."""
        return jnp.sqrt(jnp.sum(self.deflections[:, station] ** 2, axis=-1))


def run_up(
    rotor: Rotor,
    speed: Callable[[Any], Any],
    unbalance: Mapping[int, ArrayLike | complex],
    ts: ArrayLike,
    substeps: int = 1,
    modes: int | None = None,
) -> RunUp:
    """Whirl of a rotor from rest while its speed changes, under unbalance.

    The angle is the integral of the speed; unbalance pulls outward by the square of the speed, and across it by the
    angular acceleration.  Gyroscopic terms and bearings are those of the speed of each instant.

    Args:
        speed: function of time [s] to the speed [rad/s], rising or falling: `lambda t: 30.0 * t`.
        unbalance: as of `unbalance_response`.
        ts: (T,) times [s] at equal steps, about twenty in a turn of the highest speed.
        substeps: steps of the integration between two of them.
        modes: number of natural modes of the undamped rotor, on bearings as at the first speed, with which it moves;
            default all.

    Steps are those of the trapezoidal rule, which damps nothing by itself; their error falls with the square of the
    step.

    Warns of bearings beyond the ends of their models.
    Raises: ModelError for stations, numbers or times that are none.
    Source: Genta, Dynamics of rotating systems (2005); Newmark (1959).
    """
    ts = as_array(ts)
    places, values = unbalance_places(rotor, unbalance)
    check_count("substeps", substeps, 1)
    if substeps > _MOST:
        raise ModelError([f"substeps must be at most {_MOST}"], "the run-up")
    if ts.ndim != 1 or ts.size < 2 or any_concrete(lambda t: ~_is_even(t), ts):
        raise ModelError(["ts must be a row of rising times at equal steps"], "the run-up")
    if modes is not None:
        check_count("modes", modes, 1)
        if modes > rotor.num_coordinates:
            raise ModelError([f"modes must be at most {rotor.num_coordinates}, of all coordinates"], "the run-up")
    found = _run(rotor, speed, places, values, ts, substeps, modes)
    tell("run_up", found.validity)
    return found


def _is_even(t):
    steps = np.diff(t)
    return np.all(steps > 0) and np.all(np.abs(steps - steps[0]) <= 1e-6 * steps[0])


@jit
def _run(rotor, speed, places, values, ts, substeps, modes):
    M, G, K = rotor.inertias()
    T = _basis(rotor, M, K, speed(ts[0]), modes)
    at = np.array([[rotor.column(k, axis) for axis in "xy"] for k in places])
    loaded, inner = T[at], lambda A: T.T @ A @ T  # (p, 2, m)
    M, G, K = inner(M), inner(G), inner(K)
    h = (ts[1] - ts[0]) / substeps
    rate = jax.grad(lambda t: speed(t) * 1.0)

    def matrices(w):
        stiffness, damping = rotor.supports(w)
        return inner(damping) + w * G, K + inner(stiffness)

    def force(t, angle):
        w, faster = speed(t), rate(t)
        turned = values * jnp.exp(lax.complex(jnp.zeros_like(angle), angle))
        whole = lax.complex(w**2, -faster) * turned  # towards x + i y
        return jnp.einsum("p,pm->m", whole.real, loaded[:, 0]) + jnp.einsum("p,pm->m", whole.imag, loaded[:, 1])

    def step(s, _):
        t, angle, q, v, a = s
        late = t + h
        angle = angle + h / 6.0 * (speed(t) + 4.0 * speed(t + 0.5 * h) + speed(late))
        C, S = matrices(speed(late))
        ahead, faster = q + h * v + 0.25 * h**2 * a, v + 0.5 * h * a
        new = square.solve(M + 0.5 * h * C + 0.25 * h**2 * S, force(late, angle) - C @ faster - S @ ahead)
        return (late, angle, ahead + 0.25 * h**2 * new, faster + 0.5 * h * new, new), None

    def between(s, _):
        s, _ = lax.scan(step, s, None, length=substeps)
        return s, s[2]

    zero, none = jnp.zeros_like(ts[0]), jnp.zeros(M.shape[0], ts.dtype)
    begin = square.solve(M, force(ts[0], zero))
    moved = lax.scan(between, (ts[0], zero, none, none, begin), None, length=ts.shape[0] - 1)[1]
    columns = np.array([[rotor.column(k, axis) for axis in "xy"] for k in range(rotor.shaft.stations.size)])
    q = jnp.concatenate([none[None], moved]) @ T.T
    speeds = jax.vmap(speed)(ts)
    return RunUp(ts, speeds, q[:, columns], bearing_validity(rotor.bearings, speeds))


def _basis(rotor, M, K, speed, modes):
    """Directions (n, m) in which the rotor moves: all, or its lowest modes."""
    if modes is None:
        return jnp.eye(M.shape[0], dtype=M.dtype)
    stiffness = K + rotor.supports(speed)[0]
    L = jnp.linalg.cholesky(M)
    inverse = jax.scipy.linalg.solve_triangular(L, jnp.eye(M.shape[0], dtype=M.dtype), lower=True)
    A = inverse @ (0.5 * (stiffness + stiffness.T)) @ inverse.T
    return lax.stop_gradient(inverse.T @ lapack.eigh(A)[1][:, :modes])
