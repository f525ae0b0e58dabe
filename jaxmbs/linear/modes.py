"""Natural modes, their shares in rigid motions, and how to follow them through a change of the structure."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Int

from ..checks import known
from ..math import lapack
from ..math.eigen import eigh, same


class Modes(eqx.Module):
    """Natural modes by rising value, `shapes^T M shapes = 1`.

    Frequencies have derivatives (a frequency that repeats: only the sum over its group), shapes those that single
    modes and projectors over groups have; `math.eigen.spectral` is the way through sums over modes.

    Attributes:
        values: squared angular frequencies (m,) [rad^2/s^2].
        shapes: (n, m), of unit modal mass.
        is_rigid: (m,), values that are zero to the rounding of the stiffness.
    """

    values: Float[Array, " m"]
    shapes: Float[Array, "n m"]
    is_rigid: Array

    @property
    def is_unstable(self) -> Array:
        """(m,), values below zero: the stiffness is negative in these shapes, and they grow like `e^(|w| t)`."""
        return (self.values < 0) & ~self.is_rigid

    @property
    def omega(self) -> Float[Array, " m"]:
        """[rad/s], zero for rigid modes, `-sqrt(-value)` for unstable ones: a minus stands for the imaginary unit.

        Source: S1 (37).
        """
        still = self.is_rigid | (self.values == 0)
        size = jnp.sqrt(jnp.abs(jnp.where(still, 1.0, self.values)))
        return jnp.where(still, 0.0, jnp.where(self.values < 0, -size, size))

    @property
    def frequencies(self) -> Float[Array, " m"]:
        """[Hz], signs as of `omega`."""
        return self.omega / (2.0 * jnp.pi)

    @property
    def groups(self) -> Int[Array, " m"]:
        """The number of the group of equal values that each mode is in; the rigid modes are one group."""
        rigid = self.is_rigid
        apart = jnp.where(rigid[1:] | rigid[:-1], rigid[1:] ^ rigid[:-1], ~jnp.diagonal(same(self.values), 1))
        return jnp.concatenate([jnp.zeros(1, int), jnp.cumsum(apart)])

    @property
    def num_rigid(self) -> int:
        """How many modes are rigid; not under tracing."""
        return int(np.sum(np.asarray(self.is_rigid)))

    def part(self, selection) -> "Modes":
        """Some of the modes: `modes.part(slice(modes.num_rigid, None))` the elastic ones."""
        return Modes(self.values[selection], self.shapes[:, selection], self.is_rigid[selection])


def natural_modes(*, K, M, num: int | None = None, num_rigid: int | None = None) -> Modes:
    """The lowest modes of `M x'' + K x = 0`.

    Args:
        K, M: (n, n), M positive definite.
        num: how many (default all); with `complete` it should not cut a group.
        num_rigid: how many are rigid, if known: those of the smallest values; else see `rigid_flags`.

    Negative stiffness is no error here: see `Modes.is_unstable`.

    Raises: ValueError for matrices of different shapes or without a row, and more modes than there are; if concrete,
    also for a mass matrix that is not positive definite, and for unsymmetric or non-finite matrices (under tracing
    the modes of unsymmetric ones are NaN).
    Source: S1 (33)-(37).
    """
    K, M = symmetric(stiffness=K, mass=M)
    if len(K) == 0:
        raise ValueError("there are no coordinates, and so no modes: the stiffness is of shape (0, 0)")
    if num is not None and not 0 <= num <= len(K):
        raise ValueError(f"num = {num}: there are {len(K)} modes")
    check_mass(M)
    values, shapes = eigh(K, M)
    _check_finite(values)
    if num_rigid is None:
        rigid = rigid_flags(K, values, shapes)
    else:
        rigid = jnp.argsort(jnp.argsort(jnp.abs(values))) < num_rigid
    return Modes(values, shapes, rigid).part(slice(0, num))


#: A mode is rigid where its value is at most so many times the rounding of the stiffness in its shape or, below zero,
#: at least so many: noise must not pass for an instability.
RIGID, NEGATIVE = 8.0, 200.0


def rigid_flags(K, values, shapes):
    """(m,) which modes strain nothing: values that are rounding of K itself.

    That is of `sum_i K_ii x_i^2`, the energy that the diagonal of K stores in a mode, and what K differs from its
    transpose: products such as those of a reduction show their rounding there.  A soft mount beside a stiff mesh is
    told from a rigid motion by the stiffness where it moves, not by the highest frequency that there is.  A reduced
    matrix made symmetric from outside hides its rounding: give `num_rigid`.
    """
    eps, size = jnp.finfo(values.dtype).eps, jnp.abs(shapes)
    stored = jnp.sum(jnp.abs(jnp.diagonal(K))[:, None] * shapes**2, axis=0)
    uneven = jnp.sum(size * (jnp.abs(K - K.T) @ size), axis=0)
    vectors = eps**1.5 * len(K) * jnp.max(jnp.abs(values))  # the square of their own error
    noise = eps * stored + 10 * (uneven + vectors)
    return lax.stop_gradient((values <= RIGID * noise) & (values >= -NEGATIVE * noise))


def stable_modes(*, K, M, num: int | None = None, num_rigid: int | None = None) -> Modes:
    """`natural_modes` for reductions.

    Raises: ValueError for negative stiffness, if concrete; under tracing the unstable shapes are NaN.
    """
    modes = natural_modes(K=K, M=M, num_rigid=num_rigid)
    unstable = modes.is_unstable & ~rigid_flags(K, modes.values, modes.shapes)
    if not known(unstable):
        shapes = jnp.where(jnp.any(unstable), jnp.nan, modes.shapes)
        modes = Modes(modes.values, shapes, modes.is_rigid)
    elif np.any(np.asarray(unstable)):
        count, least = int(np.sum(np.asarray(unstable))), float(modes.values[0])
        raise ValueError(f"the stiffness is negative: {count} unstable modes, the first of value {least:.3g} 1/s^2")
    return modes.part(slice(0, num))


#: The part of a matrix's largest entry that may be unsymmetric.
UNSYMMETRIC = 1e-5


def symmetric(**matrices) -> tuple:
    """The matrices, in order; under tracing an unsymmetric one is NaN.  Raises: as `check_symmetric`."""
    check_symmetric(**matrices)
    return tuple(A if known(A) else _nan_if_unsymmetric(A) for A in matrices.values())


def _nan_if_unsymmetric(A):
    fixed = lax.stop_gradient(A)
    part, size = jnp.max(jnp.abs(fixed - fixed.T), initial=0.0), jnp.max(jnp.abs(fixed), initial=0.0)
    return A + jnp.where(part > UNSYMMETRIC * size, jnp.nan, 0.0).astype(A.dtype)


def check_symmetric(**matrices) -> None:
    """Raises: ValueError for matrices that are not square and of one size; if concrete, for one that is not finite.

    Also for one that is unsymmetric by more than 1e-5 of its largest entry.
    """
    shapes = {name: tuple(A.shape) for name, A in matrices.items() if A is not None}
    if len(set(shapes.values())) > 1 or any(len(s) != 2 or s[0] != s[1] for s in shapes.values()):
        raise ValueError(f"{', '.join(shapes)} must be square and alike, not of shapes {list(shapes.values())}")
    for name, A in matrices.items():
        if A is None or not known(A):
            continue
        A = np.asarray(A)
        if not np.all(np.isfinite(A)):
            raise ValueError(f"the {name} is not finite")
        part = np.max(np.abs(A - A.T), initial=0.0) / max(np.max(np.abs(A), initial=0.0), 1e-300)
        if part > UNSYMMETRIC:
            raise ValueError(f"the {name} is unsymmetric by {part:.1g} of its largest entry")


def check_mass(M) -> None:
    """Raises: ValueError for coordinates without mass, if concrete."""
    if not known(M) or M.shape[0] == 0:
        return
    M = np.asarray(M)
    bare = np.flatnonzero(np.diagonal(M) <= 0)
    if len(bare):
        raise ValueError(f"coordinates {bare.tolist()} have no mass: condense them first (Guyan)")


def _check_finite(values):
    if known(values) and not np.all(np.isfinite(np.asarray(values))):
        raise ValueError("the mass matrix is not positive definite")


def complete(values, num: int) -> int:
    """The smallest number >= num of lowest modes that cuts no group of equal values; not under tracing."""
    values = np.asarray(values)
    with jax.ensure_compile_time_eval():
        together = np.asarray(same(jnp.asarray(values)))
    while 0 < num < len(values) and together[num - 1, num]:
        num += 1
    return num


def mode_ratios(modes: Modes, coordinate: int = 0) -> Float[Array, "n m"]:
    """Shapes with entry 1 at a coordinate; a mode with a node there is all zero.

    A view: mass-normalised shapes have no such holes.  Raises: ValueError for no such coordinate.  Source: S1 (38).
    """
    if not 0 <= coordinate < len(modes.shapes):
        raise ValueError(f"coordinate {coordinate} is none of 0 ... {len(modes.shapes) - 1}")
    at = modes.shapes[coordinate]
    node = jnp.abs(at) <= 1e3 * jnp.finfo(at.dtype).eps * jnp.max(jnp.abs(modes.shapes), axis=0)
    return jnp.where(node[None, :], 0.0, modes.shapes / jnp.where(node, 1.0, at)[None, :])


def participation(modes: Modes, M, rigid) -> Float[Array, "m directions"]:
    """Participation factors `shapes^T M rigid` for rigid motions (n, directions) of the whole structure."""
    return modes.shapes.T @ M @ rigid


def effective_masses(modes: Modes, M, rigid) -> Float[Array, "m directions"]:
    """Mass that each mode moves with each rigid motion: all modes sum to `diag(rigid^T M rigid)`."""
    return participation(modes, M, rigid) ** 2


def mac(first, second, M=None) -> Float[Array, "m k"]:
    """Modal assurance criterion of shapes (n, m) and (n, k): squared cosines, with M (n, n) as the measure."""
    conj = jnp.conj(first)
    other = second if M is None else M.astype(second.dtype) @ second
    own = first if M is None else M.astype(first.dtype) @ first
    sizes = jnp.sum(conj * own, axis=0).real[:, None] * jnp.sum(jnp.conj(second) * other, axis=0).real[None, :]
    return jnp.abs(conj.T @ other) ** 2 / sizes


def track(reference: Modes, modes: Modes, M=None) -> Modes:
    """The modes in the order and with the signs of the reference: best pairs by `mac` first.

    Two modes that cross keep their own names.  Modes of equal frequency, whose vectors are any of their space, are
    turned among themselves to lie as near to the reference as they can.  The order, signs and turns are constants to
    differentiation.

    Args: reference: of a nearby structure, with as many or fewer modes.

    Raises: ValueError for a reference with more modes.
    """
    if reference.shapes.shape[1] > modes.shapes.shape[1]:
        raise ValueError(f"{reference.shapes.shape[1]} modes cannot be found among {modes.shapes.shape[1]}")
    moved = modes.part(_best_pairs(lax.stop_gradient(mac(reference.shapes, modes.shapes, M))))
    measured = moved.shapes if M is None else M @ moved.shapes
    alike = lax.stop_gradient(jnp.where(same(moved.values), measured.T @ reference.shapes, 0.0))
    least = jnp.finfo(alike.dtype).eps ** 0.5 * jnp.eye(
        len(alike), dtype=alike.dtype
    )  # modes the reference lacks stay
    U, _, V = lapack.svd(alike + least)  # group by group the nearest rotation, a sign for a single mode
    return eqx.tree_at(lambda m: m.shapes, moved, moved.shapes @ (U @ V))


def _best_pairs(likeness):
    """For every row its column, the largest entries first."""

    def step(_, carry):
        left, order = carry
        row, column = jnp.unravel_index(jnp.argmax(left), left.shape)
        return left.at[row, :].set(-1.0).at[:, column].set(-1.0), order.at[row].set(column)

    rows = likeness.shape[0]
    return lax.fori_loop(0, rows, step, (likeness, jnp.zeros(rows, int)))[1]
