"""Natural modes, their shares in rigid motions, and how to follow them through a change of the structure."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Int

from ..math import lapack
from ..math.eigen import eigh, same


class Modes(eqx.Module):
    """Natural modes by rising frequency, `shapes^T M shapes = 1`.

    Frequencies have derivatives (a frequency that repeats: only the sum over its group), shapes those that single
    modes and projectors over groups have; `math.eigen.spectral` is the way through sums over modes.

    Attributes:
        values: squared angular frequencies (m,) [rad^2/s^2].
        shapes: (n, m), of unit modal mass.
        is_rigid: (m,), values that are zero to rounding.
    """

    values: Float[Array, " m"]
    shapes: Float[Array, "n m"]
    is_rigid: Array

    @property
    def angular_frequencies(self) -> Float[Array, " m"]:
        """[rad/s], zero for rigid modes.  Source: S1 (37)."""
        return jnp.where(self.is_rigid, 0.0, jnp.sqrt(jnp.where(self.is_rigid, 1.0, self.values)))

    @property
    def frequencies(self) -> Float[Array, " m"]:
        """[Hz]."""
        return self.angular_frequencies / (2.0 * jnp.pi)

    @property
    def groups(self) -> Int[Array, " m"]:
        """The number of the group of equal values that each mode is in; the rigid modes are one group."""
        apart = ~jnp.diagonal(same(self.values), 1) & ~self.is_rigid[1:]
        apart = apart | (self.is_rigid[:-1] & ~self.is_rigid[1:])
        return jnp.concatenate([jnp.zeros(1, int), jnp.cumsum(apart)])

    @property
    def num_rigid(self) -> int:
        """How many modes are rigid; not under tracing."""
        return int(np.sum(np.asarray(self.is_rigid)))

    def part(self, selection) -> "Modes":
        """Some of the modes: `modes.part(slice(modes.num_rigid, None))` the elastic ones."""
        return Modes(self.values[selection], self.shapes[:, selection], self.is_rigid[selection])


def natural_modes(K, M, num: int | None = None, num_rigid: int | None = None) -> Modes:
    """The lowest modes of `M x'' + K x = 0`.

    Args:
        M: positive definite (n, n).
        num: how many (default all); with `complete` it should not cut a group.
        num_rigid: how many are rigid, if known; else those below rounding of the highest value.

    Raises: ValueError for matrices of different shapes and more modes than there are; if concrete, also for a mass
    matrix that is not positive definite, and for unsymmetric or non-finite matrices.
    Source: S1 (33)-(37).
    """
    check_symmetric(stiffness=K, mass=M)
    if num is not None and not 0 <= num <= len(K):
        raise ValueError(f"num = {num}: there are {len(K)} modes")
    check_mass(M)
    values, shapes = eigh(K, M)
    _check_finite(values)
    floor = 200 * jnp.finfo(values.dtype).eps * jnp.max(jnp.abs(values))
    rigid = values <= floor if num_rigid is None else jnp.arange(values.shape[0]) < num_rigid
    return Modes(values, shapes, rigid).part(slice(0, num))


def check_symmetric(**matrices) -> None:
    """Raises: ValueError for matrices that are not square and of one size; if concrete, for one that is not finite.

    Also for one that is unsymmetric by more than 1e-5 of its largest entry.
    """
    shapes = {name: tuple(A.shape) for name, A in matrices.items() if A is not None}
    if len(set(shapes.values())) > 1 or any(len(s) != 2 or s[0] != s[1] for s in shapes.values()):
        raise ValueError(f"{', '.join(shapes)} must be square and alike, not of shapes {list(shapes.values())}")
    for name, A in matrices.items():
        if A is None or isinstance(A, jax.core.Tracer):
            continue
        A = np.asarray(A)
        if not np.all(np.isfinite(A)):
            raise ValueError(f"the {name} is not finite")
        part = np.max(np.abs(A - A.T), initial=0.0) / max(np.max(np.abs(A), initial=0.0), 1e-300)
        if part > 1e-5:
            raise ValueError(f"the {name} is unsymmetric by {part:.1g} of its largest entry")


def check_mass(M) -> None:
    """Raises: ValueError for coordinates without mass, if concrete."""
    if isinstance(M, jax.core.Tracer) or M.shape[0] == 0:
        return
    M = np.asarray(M)
    bare = np.flatnonzero(np.diagonal(M) <= 0)
    if len(bare):
        raise ValueError(f"coordinates {bare.tolist()} have no mass: condense them first (guyan)")


def _check_finite(values):
    if not isinstance(values, jax.core.Tracer) and not np.all(np.isfinite(np.asarray(values))):
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
