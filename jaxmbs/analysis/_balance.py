"""Balance of efforts and loops at a configuration with its slope, and the Newton search for where it vanishes.

The search, the stiffness and the derivatives of an equilibrium all read one linearisation: a program has it once.
Internal states of force elements are unknowns beside the coordinates (`_unknowns`), their rates vanish as efforts do.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax
from jax.scipy.linalg import block_diag

from ..constraints import _closures as closures
from ..constraints import _constraints as constraints
from ..constraints._kic import independent_columns, motion_map
from ..kinematics._configuration import configuration, with_velocities
from ..kinematics._poses import coordinate_rate, node_parameters
from ..math import _square as square
from ..math._linalg import full_rank_lstsq
from ..model._held_bands import band_places
from ..model._system import System
from ..runtime import lapack
from ..signal_flow._internal_states import internal_rates, internal_scale
from ._linearise import unbalanced_efforts
from ._steep_laws import given_or_own, is_steep, own_stresses, steep_groups, stresses_at, under_stresses
from ._unknowns import after_step, at_unknowns, normalised, rate_of_step

_MOST_STEPS = 200  # trials of the line search included
_SUFFICIENT_DECREASE = 0.1  # share of the decrease that the slope predicts, at which a trial is taken (Armijo)
_AFAR = 1e-6  # steps that rounding alone asks for and that are longer follow a slope that is rounding as well
_STEP_TOLERANCE = {8: 1e-11, 4: 1e-6}  # a trial nearer than this, relative to the coordinates, is the last

_LARGEST_TURN = 0.3  # of a joint between nodes of steep laws in one step, in rad or lengths of the model

_NO_SLOPE = {8: 1e-9, 4: 1e-4}  # of singular values, largest entries one: less holds nothing
_SINGULAR = {8: 1e-12, 4: 1e-5}  # of the singular values, largest entries one: what rounding leaves of a zero


class Balance(NamedTuple):
    """Balance at unknowns with the independent velocities w held constant.

    Attributes:
        efforts: (N + ns,) missing for zero accelerations, and the rates of the internal states over their scales;
            velocities: (nv,) there.
        gap: (position rows,) of the loops.
        slope: (N + ns, N + ns) of the efforts along the admissible directions; of the first N the stiffness.
        closing: (nv + ns,) step of the dependent columns that closes the loops, to first order; drift: (N + ns,) what
            it changes the efforts by.
        Gamma: (nv + ns, N + ns) admissible directions.
        stresses: (n, k) of each group of steep laws; stress_slopes: (n, k, N + ns + 1) of them along the directions
            and `closing`.
    """

    efforts: Array
    velocities: Array
    gap: Array
    slope: Array
    closing: Array
    drift: Array
    Gamma: Array
    stresses: tuple[Array, ...] = ()
    stress_slopes: tuple[Array, ...] = ()


def balance(system: System, psi, t, w, stresses=None) -> Balance:
    """The balance at unknowns psi (nq + ns,), its slope by one linearisation.

    Args: stresses: of each group of steep laws (n, k), with which the slope is taken; NaN, or None, for its own.
    """
    top = system.topology
    P, none = node_parameters(system), jnp.zeros(top.num_velocities + top.num_internal, psi.dtype)
    given = own_stresses(system) if stresses is None else stresses

    def efforts(step, given):
        moved_psi, internal = at_unknowns(system, after_step(system, psi, step))
        at = configuration(system, P, moved_psi, t, internal=internal)
        found, more = _efforts_and_loops(under_stresses(system, given), at, w)
        return (found, stresses_at(system, at)), more

    (found, own), slopes, (gap, u, Gamma, closing) = jax.linearize(efforts, none, given, has_aux=True)
    steps = [Gamma, closing[:, None]]
    if not steep_groups(system):
        along, _ = jax.vmap(lambda step: slopes(step, given), 1, 1)(jnp.concatenate(steps, axis=1))
        return Balance(found, u, gap, along[:, :-1], closing, along[:, -1], Gamma)
    # the efforts are linear in the given stresses: one more direction brings them to those of the own stresses
    steps, number = jnp.concatenate([*steps, none[:, None]], axis=1), w.shape[0] + top.num_internal
    changes = [
        jnp.zeros((*x.shape, number + 2), x.dtype).at[..., -1].set(jnp.where(jnp.isnan(x), 0.0, y - x))
        for x, y in zip(given, own, strict=True)
    ]
    along, stress_slopes = jax.vmap(slopes, (1, -1), (1, -1))(steps, tuple(changes))
    stress_slopes = tuple(x[..., :-1] for x in stress_slopes)
    efforts_of_own = found + along[:, -1]
    return Balance(efforts_of_own, u, gap, along[:, :number], closing, along[:, number], Gamma, own, stress_slopes)


def _efforts_and_loops(system, at, w):
    """The efforts (N + ns,); the gap of the loops, all velocities, `Gamma` and `closing`."""
    at, eye = closures.with_directions(system, at), jnp.eye(w.shape[0] + 1, w.shape[0], dtype=w.dtype)
    move, gap = motion_map(system, at), constraints.residual(system, at)
    efforts, u, _ = unbalanced_efforts(system, at, w, jnp.zeros_like(w), move)
    rows = jnp.zeros((len(eye), system.topology.num_rows), w.dtype).at[-1].set(-_on_all_rows(system, gap))
    found = jax.vmap(move, out_axes=1)(eye, rows)
    Gamma, closing = found[:, :-1], found[:, -1]
    if number := system.topology.num_internal:
        rates = internal_rates(system, with_velocities(system, at, u)) / internal_scale(system)
        efforts, closing = jnp.concatenate([efforts, rates]), jnp.concatenate([closing, jnp.zeros_like(rates)])
        Gamma = block_diag(Gamma, jnp.eye(number, dtype=Gamma.dtype))
    return efforts, (gap, u, Gamma, closing)


def _on_all_rows(system, gap):
    """A gap of the position rows, with zeros for the rows of velocities."""
    top = system.topology
    return jnp.zeros(top.num_rows, gap.dtype).at[top.position_rows].set(gap, unique_indices=True)


class _Trial(NamedTuple):
    """A line search: the configuration taken last, and the one to be tried next.

    `loss` (), `found` and `direction` belong to `psi`; `length` () is the share of the direction that leads to
    `trial`; `moved` (): largest change of a coordinate by the trial before.  `stresses` of steep laws are unknowns of
    their own, `trial_stresses` those of the trial.
    """

    steps: Array
    psi: Array
    found: Balance
    loss: Array
    scale: Array
    direction: "NewtonStep"
    length: Array
    trial: Array
    moved: Array
    stresses: tuple[Array, ...]
    trial_stresses: tuple[Array, ...]


@eqx.filter_custom_jvp
def search_balance(system: System, psi, t, w, moving, weight, least=False):
    """Unknowns near psi at which the loops are closed and no independent velocity but `moving` lacks efforts.

    Newton's method on the independent coordinates and the loops together, with a backtracking line search.  The
    columns `moving` keep their coordinates.  Derivatives of every order by the implicit function theorem.

    Args:
        weight: an effort that is large; with those at psi, it is the scale of what is small.
        least: steps are the shortest ones, without a part along motions that have no stiffness (static).

    Returns: unknowns, `Balance` there, scale and number of steps; the last point taken where none is found.
    """
    top, still, bands = system.topology, still_columns(system, moving, psi.dtype), band_columns(system, moving)
    tolerance = _STEP_TOLERANCE[psi.dtype.itemsize]

    def loss_of(at, scale):
        return 0.5 * (jnp.sum((still * at.efforts / scale) ** 2) + jnp.sum(at.gap**2))

    def once(last):
        new = balance(system, last.trial, t, w, last.trial_stresses)
        first = last.steps == 0
        scale = jnp.where(first, _scale(new.efforts, weight, top.num_internal), last.scale)
        scale = jnp.where(scale > 0.0, scale, 1.0)  # massless, not loaded
        loss = loss_of(new, scale)
        direction = newton_step(new, still, still * new.efforts, bands, least)
        is_rest = _is_rounding(system, still * (new.efforts + new.drift), scale)
        step = jnp.where(is_rest & ~(_largest(direction.step) < _AFAR), new.closing, direction.step)
        direction = direction._replace(step=step)
        if is_steep(system):
            better = first | _is_nearer(direction, last)
        else:
            better = first | (loss <= (1.0 - 2.0 * _SUFFICIENT_DECREASE * last.length) * last.loss)
        whole = share_of_step(system, direction.step) if is_steep(system) else jnp.ones_like(loss)
        taken = (last.trial, new, loss, direction, whole, given_or_own(last.trial_stresses, new.stresses))
        kept = (last.psi, last.found, last.loss, last.direction, 0.5 * last.length, last.stresses)
        psi, found, loss, direction, length, stresses = jax.tree.map(
            lambda a, b: jnp.where(better, a, b), taken, kept
        )
        trial = normalised(system, after_step(system, psi, length * direction.step))
        there = jax.tree.map(lambda a, b: a + length * (b - a), stresses, direction.stresses)
        change = jnp.where(first, jnp.inf, jnp.max(jnp.abs(last.trial - last.psi), initial=0.0))
        return _Trial(last.steps + 1, psi, found, loss, scale, direction, length, trial, change, stresses, there)

    def goes_on(last):  # not where a step is NaN: the slope is singular
        far = last.moved > tolerance * (1.0 + jnp.max(jnp.abs(last.psi), initial=0.0))
        return far & (last.steps < _MOST_STEPS) & jnp.all(jnp.isfinite(last.trial))

    found = lax.while_loop(goes_on, once, _first_trial(system, psi, w))
    return found.psi, found.found, found.scale, found.steps


def share_of_step(system: System, step):
    """Share () of a step (nv + ns,) that turns no joint by more than a third of a radian, or slides it so far."""
    top = system.topology
    unit = jnp.where(np.asarray(top.spins) > 0, 1.0, system.length).astype(step.dtype)
    return _LARGEST_TURN / jnp.max(jnp.abs(step[: top.num_velocities] / unit), initial=_LARGEST_TURN)


def _is_nearer(direction, last):
    """True if the step from a trial is shorter than that from the point taken last.

    It does not depend on the units of the efforts: in a thin beam those of stretch would hide those of bending.
    Source: after Deuflhard, Newton methods for nonlinear problems (2004), 3.3, with the slope of the trial.
    """
    return jnp.sum(direction.step**2) <= (1.0 - last.length / 4.0) ** 2 * jnp.sum(last.direction.step**2)


def _scale(efforts, weight, number):
    """The scale () of the efforts; with internal states (N + ns,), that of their rates beside it."""
    if not number:
        return weight + jnp.max(jnp.abs(efforts), initial=0.0)
    efforts, rates = efforts[:-number], efforts[-number:]
    parts = weight + jnp.max(jnp.abs(efforts), initial=0.0), 1.0 + jnp.max(jnp.abs(rates))
    return jnp.concatenate([jnp.full_like(x, part) for x, part in zip((efforts, rates), parts, strict=True)])


def _first_trial(system, psi, w):
    top, number = system.topology, system.topology.num_internal
    nv, n, N = top.num_velocities, top.num_velocities + number, w.shape[0] + number
    shapes = (N,), (nv,), (len(top.position_rows),), (N, N), (n,), (N,), (n, N)
    own = own_stresses(system)
    slopes = tuple(jnp.full((*x.shape, N + 1), jnp.nan, psi.dtype) for x in own)
    nothing = Balance(*(jnp.full(shape, jnp.nan, psi.dtype) for shape in shapes), own, slopes)
    far, one = jnp.asarray(jnp.inf, psi.dtype), jnp.ones((), psi.dtype)
    scale, still = jnp.ones(N, psi.dtype) if number else one, NewtonStep(jnp.zeros(n, psi.dtype), own)
    return _Trial(jnp.zeros((), int), psi, nothing, far, scale, still, one, psi, far, own, own)


def still_columns(system: System, moving, dtype):
    """1 for each independent velocity and internal state (N + ns,) that is none of the columns `moving`, 0 for
    those."""
    return jnp.asarray(~np.isin(unknown_columns(system), moving), dtype)


def unknown_columns(system: System) -> np.ndarray:
    """Columns of the independent velocities, and of the internal states after all velocities (N + ns,)."""
    top = system.topology
    return np.concatenate([independent_columns(system), top.num_velocities + np.arange(top.num_internal)]).astype(int)


def band_columns(system: System, moving) -> np.ndarray:
    """True (N + ns,) for internal states that rest at any value of a band and are none of the columns `moving`."""
    places = np.concatenate([np.zeros(len(independent_columns(system)), bool), band_places(system)])
    return places & ~np.isin(unknown_columns(system), moving)


def band_rates(system: System, psi, t, moving) -> Array:
    """Slopes (ns, N) of the rates of the internal states, over their scales, by the independent velocities at rest:
    of those in bands, which move along with the mechanism; zero for all others."""
    N = len(independent_columns(system))
    bands = band_columns(system, moving)[N:]
    if not bands.any():
        return jnp.zeros((len(bands), N), psi.dtype)
    coordinates, internal = at_unknowns(system, psi)
    at = configuration(system, node_parameters(system), coordinates, t, internal=internal)
    rates = jax.linearize(lambda w: _efforts_and_loops(system, at, w)[0][N:], jnp.zeros(N, psi.dtype))[1]
    return jnp.where(bands[:, None], jax.vmap(rates, 1, 1)(jnp.eye(N, dtype=psi.dtype)), 0.0)


class NewtonStep(NamedTuple):
    """A step (nv + ns,), and the stresses (n, k) of each group of steep laws after it, to first order."""

    step: Array
    stresses: tuple[Array, ...]


def newton_step(at: Balance, still, efforts, bands, least=False) -> NewtonStep:
    """The step that closes the loops and takes the efforts away; columns with still = 0 stay, or take what their
    entry of `efforts` says.

    Args: bands: of `band_columns`, which change only as far as the others find no balance; least: the shortest such
        step where the slope is singular.
    """
    y = _solution(at.slope, still, -efforts - still * at.drift, bands, least)
    stresses = [
        x + slopes[..., :-1] @ y + slopes[..., -1] for x, slopes in zip(at.stresses, at.stress_slopes, strict=True)
    ]
    return NewtonStep(at.Gamma @ y + at.closing, tuple(stresses))


def _is_rounding(system, efforts, scale):
    """True if efforts are rounding of their scale, at arms as long as the system."""
    return _largest(efforts / scale) <= 16.0 * jnp.finfo(efforts.dtype).eps * (1.0 + system.length)


def _largest(x):
    return jnp.max(jnp.abs(x), initial=0.0)


def _solution(slope, still, right, bands, least=False):
    A = still[:, None] * slope + jnp.diag(1.0 - still)
    if not (least or np.any(bands)):
        return square.solve(A, right)
    # rows and columns count in units of their largest entries
    size = jnp.sqrt(jnp.maximum(jnp.max(jnp.abs(A), axis=0), jnp.max(jnp.abs(A), axis=1)))
    size = jnp.where(size > 0.0, size, 1.0)
    return _least_solution(A / jnp.outer(size, size), right / size, bands) / size


def _least_solution(A, right, bands):
    """The shortest solution, without a part along motions without slope; the columns `bands` take only what the
    others cannot, and of that the shortest."""
    left, values, right_vectors = lapack.svd(A[:, ~bands])
    counts = values > _NO_SLOPE[A.dtype.itemsize] * jnp.max(values, initial=0.0)
    bent = jnp.zeros(0, A.dtype)
    if np.any(bands):
        reach = jnp.where(counts[None, :], left, 0.0)
        apart = A[:, bands] - reach @ (reach.T @ A[:, bands])
        U, s, V = lapack.svd(apart)
        bent = V.T @ _over(U.T @ right, s, s > _NO_SLOPE[A.dtype.itemsize])
        right = right - A[:, bands] @ bent
    others = right_vectors.T @ _over(left.T @ right, values, counts)
    return jnp.concatenate([others, bent])[np.argsort(np.argsort(bands, kind="stable"))]


def _over(shares, values, counts):
    """Shares over singular values where these count, else zero."""
    return jnp.where(counts, shares / jnp.where(counts, values, 1.0), 0.0)


def _is_singular(slope, still, bands):
    """True if the slope of the columns that do not move has no inverse but by rounding, whatever their units.

    Rates of states in bands vanish whatever changes: all others are to be balanced, with those states as well.
    """
    A = lax.stop_gradient(still[:, None] * slope + jnp.diag(1.0 - still))[~bands]
    for axis in (1, 0):
        largest = jnp.max(jnp.abs(A), axis=axis, keepdims=True, initial=0.0)
        A = A / jnp.where(largest > 0.0, largest, 1.0)
    sizes = lapack.svd(A)[1]
    return jnp.min(sizes, initial=jnp.inf) <= _SINGULAR[A.dtype.itemsize] * jnp.max(sizes, initial=0.0)


@search_balance.def_jvp
def _search_balance_jvp(primals, tangents):
    """Implicit function theorem: the step that balances perturbed efforts and closes perturbed loops again.

    NaN where the slope is singular: the equilibrium is one of many, and a perturbation moves it by any amount.
    """
    system, psi0, t, w, moving, _, *_ = primals
    found = search_balance(*primals)
    psi, at = found[:2]
    top, still, bands = system.topology, still_columns(system, moving, psi.dtype), band_columns(system, moving)
    coordinates = psi[: top.num_coordinates]

    def loops(system, t):
        P = node_parameters(system)
        return constraints.residual(system, configuration(system, P, coordinates, t, inertias=False))

    def efforts(system, psi, t, w):
        psi, internal = at_unknowns(system, psi)
        at = configuration(system, node_parameters(system), psi, t, internal=internal)
        return _efforts_and_loops(system, at, w)[0]

    d_system, d_psi0, d_t, d_w = tangents[:4]
    gap = _or_zeros(eqx.filter_jvp(loops, (system, t), (d_system, d_t))[1], at.gap)
    here = closures.with_directions(system, configuration(system, node_parameters(system), coordinates, t))
    closing = motion_map(system, here)(jnp.zeros_like(w), -_on_all_rows(system, gap))
    if top.internal:
        closing = jnp.concatenate([closing, jnp.zeros(top.num_internal, closing.dtype)])
    rate = rate_of_step(system, psi, closing)
    change = _or_zeros(eqx.filter_jvp(efforts, (system, psi, t, w), (d_system, rate, d_t, d_w))[1], at.efforts)
    held = jnp.zeros_like(still) if not moving else _displacement(top, psi0, d_psi0)[unknown_columns(system)]
    step = at.Gamma @ _solution(at.slope, still, (1.0 - still) * held - still * change, bands) + closing
    step = step * jnp.where(_is_singular(at.slope, still, bands), jnp.nan, 1.0)
    d_psi = rate_of_step(system, psi, step)
    d_at = eqx.filter_jvp(balance, (system, psi, t, w), (d_system, d_psi, d_t, d_w))[1]
    return found, (d_psi, d_at, jnp.zeros_like(found[2]), None)


def _or_zeros(tangent, like):
    return jnp.zeros_like(like) if tangent is None else tangent


def _displacement(top, psi, d_psi):
    """Step (nv + ns,) of which the change of the unknowns d_psi (nq + ns,) or None is the rate."""
    if d_psi is None:
        return jnp.zeros(top.num_velocities + top.num_internal, psi.dtype)
    if top.is_simple:
        return d_psi
    psi, end = psi[: top.num_coordinates], top.num_coordinates
    T = jax.vmap(lambda u: coordinate_rate(top, psi, u), 1, 1)(jnp.eye(top.num_velocities, dtype=psi.dtype))
    return jnp.concatenate([full_rank_lstsq(T, d_psi[:end, None])[:, 0], d_psi[end:]])
