"""Campbell diagrams: roots of the small motions about steady rotation, over the speed."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Complex, Float

from ..assembly._state import State
from ..checks import any_concrete, is_concrete, no_such
from ..errors import ModelError, SimulationError, UnknownNameError
from ..friction._joint_friction import refuse_friction
from ..math._eigen import eig
from ..math._square import solve
from ..model._entry_points import check_single_state
from ..model._system import System
from ..quantities import Axis, Quantity, numbered
from ..reports import Report, Reported, failures
from ..runtime import as_dtype, jit
from ..signal_flow._sampling import refuse_sampled
from ..typing import ArrayLike
from ..vibration._mode_shapes import best_pairs, mac
from ._equilibrium import equilibrium
from ._linearise import linearise
from ._mechanism_modes import check_cyclic, cyclic_columns, routh_reduction


class CampbellDiagram(Reported, eqx.Module):
    """Roots over the speed of rotation, a column for each mode along all speeds.

    Attributes:
        speeds: (S,) [rad/s].
        roots: (S, m) [rad/s], of each conjugate pair the one with positive imaginary part; that of a root without
            oscillation is zero.
        shapes: (S, n, m), largest entry 1.
        ok: (S,) true where a steady motion was found; roots and shapes are NaN where none was.
        coordinates: names of the rows of the shapes (n, static).
    """

    speeds: Float[Array, " S"]
    roots: Complex[Array, "S m"]
    shapes: Complex[Array, "S n m"]
    ok: Bool[Array, " S"]
    coordinates: tuple[str, ...] = eqx.field(static=True)

    def report(self) -> Report:
        speed = Axis("speed", np.asarray(self.speeds), "rad/s")
        mode = numbered("mode", self.roots.shape[1])
        shapes = (speed, Axis("coordinate", self.coordinates), mode)
        return Report(
            [
                Quantity("frequency", self.frequencies, "Hz", (speed, mode)),
                Quantity("damping ratio", self.damping_ratios, "", (speed, mode)),
                Quantity("critical speed", self.critical_speeds(), "rad/s", (mode,)),
                Quantity("shape", self.shapes, "", shapes, in_table=False),
            ],
            f"{len(speed.labels)} speeds, {len(mode.labels)} modes",
            failures(self.ok, "speeds without a steady motion"),
        )

    @property
    def frequencies(self) -> Float[Array, "S m"]:
        """Frequencies [Hz] in the axes in which coordinates are counted: for a blade, those that turn with it."""
        return self.roots.imag / (2 * np.pi)

    @property
    def damping_ratios(self) -> Float[Array, "S m"]:
        """Negative real part over the size of each root; negative where the motion grows."""
        size = jnp.abs(self.roots)
        return -self.roots.real / jnp.where(size > 0, size, 1.0)

    def whirl(self, first: str, second: str) -> Float[Array, "S m"]:
        """Sense of the orbits in the plane of two coordinates: 1 is a circle from the first axis towards the second,
        -1 one against it, 0 a straight line.

        Raises: UnknownNameError.
        """
        rows = [self._row(name) for name in (first, second)]
        a, b = (self.shapes[:, row] for row in rows)
        size = jnp.abs(a) ** 2 + jnp.abs(b) ** 2
        return 2 * (a * b.conj()).imag / jnp.where(size > 0, size, 1.0)

    def critical_speeds(self, order: ArrayLike = 1.0) -> Float[Array, " m"]:
        """The lowest speed (m,) [rad/s] at which the frequency of each mode is `order` times the speed, whether it
        crosses that line from above or from below; NaN where there is none.  See `crossings`."""
        found = self.crossings(order)
        first = jnp.argmin(jnp.where(jnp.isnan(found), jnp.inf, found), axis=0)
        return jnp.take_along_axis(found, first[None], axis=0)[0]

    def crossings(self, order: ArrayLike = 1.0) -> Float[Array, "steps m"]:
        """All speeds (S - 1, m) [rad/s] at which the frequency of each mode is `order` times the speed, one between
        each two speeds given, by a straight line between them; NaN where there is none.

        A mode that meets the line at one of the speeds, crossing or touching it, has that speed.  One that touches it
        between two speeds is not seen, nor one that does not oscillate at standstill.
        """
        over = self.roots.imag - as_dtype(order, self.speeds.dtype) * self.speeds[:, None]
        before, after = over[:-1], over[1:]
        met = before.at[1:].set(jnp.nan) == 0  # at the first speed; at others it is the end of the interval before
        crosses = (before * after < 0) | (after == 0) & (self.roots.imag[1:] > 0) | met & (self.roots.imag[:-1] > 0)
        crosses = crosses & ~jnp.isnan(before + after)
        low, high = self.speeds[:-1, None], self.speeds[1:, None]
        share = before / jnp.where(crosses & (before != after), before - after, 1.0)
        return jnp.where(crosses, jnp.where(before == after, high, low + share * (high - low)), jnp.nan)

    def _row(self, name):
        if name not in self.coordinates:
            raise UnknownNameError(no_such("coordinate", name, self.coordinates))
        return self.coordinates.index(name)


def campbell(
    system: System, speeds: ArrayLike, spin: str, state: State | None = None, keep: str = "speed"
) -> CampbellDiagram:
    """Campbell diagram of a mechanism in steady rotation, gyroscopic terms and stiffening included.

    Args:
        speeds: (S,) [rad/s], at least two, in order.
        spin: joint of one free coordinate that turns: all else is at rest in coordinates.  Its name must be
            independent, and nothing may depend on its angle.
        state: a first guess of the pose (default: `State.at(system)`).
        keep: "speed" where a motor keeps it, "momentum" where the rotor runs free.

    Each speed has its own steady motion, by `equilibrium`.  Modes keep their column where their frequencies cross, by
    their shapes; columns are ordered by the frequency at the first speed.  Frequencies have derivatives by whatever
    the system depends on, of equal ones the sum.

    Raises: ModelError for a joint that is unknown, driven, slides or is not independent, for a system without other
    freedoms or with joints that rub, where something depends on the angle of the spin, or for another `keep`;
    ValueError for speeds that are no row in order; SimulationError where no speed has a steady motion (of single
    speeds `ok` tells).
    Source: Genta, Dynamics of rotating systems (2005).
    """
    refuse_sampled(system, "campbell")
    refuse_friction(system, "campbell", "take it out, or simulate a run through the speeds")
    if keep not in ("speed", "momentum"):
        raise ModelError([f"keep = {keep!r} must be 'speed' or 'momentum'"])
    state = State.at(system) if state is None else state
    check_single_state(system, state)
    speeds = as_dtype(speeds, state.coordinates.dtype)
    if speeds.ndim != 1 or len(speeds) < 2 or any_concrete(lambda x: ~(np.diff(x) > 0), speeds):
        raise ValueError(f"speeds must be a row of at least two in order, got shape {speeds.shape}")
    column = _spin_column(system, spin)
    linear = linearise(system, _turning(system, state, column, speeds[0]))
    if len(linear.velocities) < 2:
        raise ModelError([f"a Campbell diagram: nothing is free to vibrate beside the spin {spin!r}"])
    # before the program, where numbers are known
    check_cyclic(linear, cyclic_columns(linear, (spin,)), keep == "momentum", is_steady=False)
    names = linear.state_names
    out = [k for k, name in enumerate(names) if name.removeprefix("rate of ") == spin]
    kept = tuple(name for k, name in enumerate(names) if k not in out)
    roots, shapes, ok = _roots(system, speeds, state, spin, column, keep)
    if is_concrete(ok) and not np.any(np.asarray(ok)):
        raise SimulationError(
            "no steady motion was found at any of the speeds; start from a state that is closer, and see what "
            f"equilibrium(system, state, moving=[{spin!r}]) says"
        )
    return CampbellDiagram(speeds, roots, shapes, ok, kept)


def _spin_column(system, spin):
    top = system.topology
    if spin not in top.joint_index:
        raise ModelError([f"spin: {no_such('joint', spin, top.joint_names)}"])
    joint = top.joints[top.joint_index[spin]]
    if joint.labels == ("distance",):
        raise ModelError([f"spin: joint {spin!r} slides, a rotor turns"])
    columns = range(*joint.velocities.indices(top.num_velocities))
    if len(columns) != 1:
        raise ModelError([f"spin: joint {spin!r} has {len(columns)} velocities, a rotor has one"])
    return columns[0]


def _turning(system, state, column, speed):
    velocities = jnp.zeros_like(state.velocities).at[column].set(speed)
    return eqx.tree_at(lambda s: s.velocities, state, velocities)


@jit
def _roots(system, speeds, state, spin, column, keep):
    """Roots (S, m), shapes (S, n, m) and success (S,)."""

    def at(speed):
        steady = equilibrium(system, _turning(system, state, column, speed), moving=(spin,), throw=False)
        lin = linearise(system, steady.state)
        A = routh_reduction(lin, (spin,)) if keep == "momentum" else _held_reduction(lin, spin)
        roots, shapes, _ = eig(jnp.where(steady.ok, A, 0.0))
        order = _upper_half(roots)
        return roots[order], shapes[:, order], steady.ok

    roots, shapes, ok = lax.map(at, speeds)
    order = lax.stop_gradient(_tracks(lax.stop_gradient(shapes), lax.stop_gradient(roots)))
    roots = jnp.take_along_axis(roots, order, axis=1)
    shapes = jnp.take_along_axis(shapes, order[:, None], axis=2)
    place = jnp.argmax(jnp.abs(shapes), axis=1, keepdims=True)
    shapes = shapes / jnp.take_along_axis(shapes, place, axis=1)
    lost = jnp.asarray(complex(np.nan, np.nan), roots.dtype)  # both parts: the imaginary one is the frequency
    return jnp.where(ok[:, None], roots, lost), jnp.where(ok[:, None, None], shapes, lost), ok


def _held_reduction(lin, spin):
    """The state matrix where a coordinate keeps its speed: its acceleration is none, whatever effort that takes."""
    out, number = cyclic_columns(lin, (spin,)), len(lin.velocities)
    if lin.positions != lin.velocities:
        raise ModelError(["a Campbell diagram: not where rows of velocity restrict the motion"])
    rest = np.setdiff1d(np.arange(number), out)
    A, M = lin.state_space.A, lin.mass
    kept = np.concatenate([rest, number + rest, 2 * number + np.arange(len(lin.internal_names))])
    efforts = (M @ A[number : 2 * number])[np.ix_(rest, kept)]
    lower = solve(M[np.ix_(rest, rest)], efforts)
    return jnp.concatenate([A[np.ix_(rest, kept)], lower, A[np.ix_(kept[2 * len(rest) :], kept)]])


def _upper_half(roots):
    """Places (m,) of one of each pair, by rising frequency."""
    falling = jnp.argsort(-lax.stop_gradient(roots).imag, stable=True)
    return falling[: len(roots) // 2][::-1]


def _tracks(shapes, roots):
    """Columns (S, m) of the same modes at all speeds: each as near as can be to those of the next higher speed."""
    first = jnp.arange(shapes.shape[2])

    def step(following, shapes):
        order = best_pairs(jnp.nan_to_num(mac(following, shapes)))
        return shapes[:, order], order

    _, orders = lax.scan(step, shapes[-1], shapes[:-1], reverse=True)
    orders = jnp.concatenate([orders, first[None]])
    lowest = jnp.argsort(roots[0].imag[orders[0]], stable=True)
    return orders[:, lowest]
