"""`Modes`, natural or complex, and the natural modes of a pair of matrices."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Complex, Float, Inexact, Int

from ..checks import distinct_names, is_concrete, place_of
from ..linear._labels import parse_label
from ..linear._massless import condense_massless, massless_rows
from ..linear._rigid_flags import rigid_flags
from ..linear._symmetric import check_mass, require_symmetric
from ..linear._system import LinearSystem
from ..math._eigen import eigh, same
from ..math._nan import nan_where
from ..quantities import Quantity
from ..reports import Report, Reported
from ..runtime import jit
from ..tables import format_number
from ..typing import AnyArray, CoordinateLike, ScalarLike


def _table_rows(modes):
    """Summary line and table of modes; a conjugate pair takes one row."""
    hertz, ratios, rigid, unstable = map(np.asarray, _in_words(modes))
    roots = None if modes.roots is None else np.asarray(modes.roots)
    rows = []
    for k in range(len(hertz)):
        pair = roots is not None and roots[k].imag != 0 and k + 1 < len(roots) and roots[k + 1] == np.conj(roots[k])
        if roots is not None and k and roots[k].imag < 0 and roots[k - 1] == np.conj(roots[k]):
            continue
        mark = "rigid" if rigid[k] else "unstable" if unstable[k] else ""
        rows.append((f"{k}, {k + 1}" if pair else str(k), format_number(hertz[k]), format_number(ratios[k]), mark))
    kind = "natural" if roots is None else "complex"
    summary = f"{len(hertz)} {kind} modes of {modes.shapes.shape[0]} coordinates"
    return summary, [("mode", "frequency [Hz]", "damping ratio", ""), *rows]


@jit
def _in_words(modes):
    return modes.frequencies, modes.damping_ratios, modes.is_rigid, modes.is_unstable


class Modes(Reported, eqx.Module):
    """Modes by rising frequency: natural ones with `shapes^T M shapes = 1`, or complex ones of a damped system.

    Frequencies have derivatives (of repeated ones only the sum over the group); shapes have those of single modes and
    of projectors on groups.  Complex roots and vectors (up to their scale) have derivatives where roots are single or
    their vectors complete; at a defective root (critical damping, free rigid motion) there is none, and zero is
    returned.

    Attributes:
        values: squared angular frequencies (m,) [rad^2/s^2]; of complex modes the squared sizes of the roots.
        shapes: (n, m), of unit modal mass, or complex.
        is_rigid: (m,), values that are zero to the rounding of the stiffness; roots that are zero to rounding;
            without derivative.
        roots: (m,) [rad/s], None of natural modes; a pair of conjugates is side by side, positive imaginary part
            first.
        left: (m, n), None of natural modes, mechanisms: the receptance is `sum_j shapes_j left_j / (s - root_j)`.
        rounding: (m,) [rad/s], None of natural modes: the error that rounding alone makes in a root, at most;
            without derivative.
        coordinates: names of the rows of `shapes` (n, static), `()` where the matrices had none; see `at`.
    """

    values: Float[Array, " m"]
    shapes: Inexact[Array, "n m"]
    is_rigid: Array
    roots: Complex[Array, " m"] | None = None
    left: Complex[Array, "m n"] | None = None
    rounding: Float[Array, " m"] | None = None
    coordinates: tuple[str, ...] = eqx.field(static=True, default=())

    def report(self) -> Report:
        summary, rows = _table_rows(self)
        found = [Quantity("frequency", self.frequencies, "Hz"), Quantity("damping ratio", self.damping_ratios)]
        return Report(found, summary, table=rows)

    @property
    def is_complex(self) -> bool:
        """True for the complex modes of a damped system."""
        return self.roots is not None

    def at(self, *names: str) -> Array:
        """Rows (k, m) of the shapes at named coordinates.

        Args: names: "b x", or "b" for all coordinates of a node; of a mechanism "pin", "ball rx", or "ball" for
            all of a joint, and speeds as "rate of pin".

        Raises: UnknownNameError, with similar names.
        """
        rows: list[int] = []
        for name in distinct_names("names", names):
            own = [k for k, one in enumerate(self.coordinates) if one == name]
            own = own or [k for k, one in enumerate(self.coordinates) if one.rpartition(" ")[0] == name]
            rows += own or [place_of("coordinate", name, self.coordinates)]
        return self.shapes[np.array(rows, int)]

    @property
    def is_unstable(self) -> Array:
        """Flags (m,) of unstable modes: negative values of natural modes, which grow like `e^(sqrt(-value) t)`, or
        roots whose positive real part is more than rounding.  A free rigid motion drifts and is not unstable."""
        if self.roots is None:
            return (self.values < 0) & ~self.is_rigid
        return (self._growth() > 0) & ~self.is_rigid

    def _growth(self) -> Array:
        """Real parts of the roots (m,); those within rounding have the value zero and keep their derivative."""
        assert self.roots is not None
        real = self.roots.real
        least = 0.0 if self.rounding is None else self.rounding
        return jnp.where(jnp.abs(real) <= least, real - lax.stop_gradient(real), real)

    @property
    def omega(self) -> Float[Array, " m"]:
        """Angular frequencies (m,) [rad/s]; zero for rigid modes, NaN for unstable natural ones, which have none.

        Of complex modes the magnitudes of the roots: for proportional damping the undamped frequencies.
        Source: S1 (37).
        """
        return _omega(self.values, self.is_rigid)

    @property
    def frequencies(self) -> Float[Array, " m"]:
        """Frequencies (m,) [Hz]; NaN for unstable natural modes, which do not swing."""
        return self.omega / (2.0 * jnp.pi)

    @property
    def damping_ratios(self) -> Float[Array, " m"]:
        """Damping ratios `-Re(root) / |root|` (m,); zero within rounding, for zero roots and for natural modes, NaN
        where the frequency is."""
        if self.roots is None:
            return jnp.where(jnp.isnan(self.omega), jnp.nan, jnp.zeros_like(self.values))
        size = self.omega
        return jnp.where(size > 0, (0.0 - self._growth()) / jnp.where(size > 0, size, 1.0), 0.0)

    def to_xarray(self, coordinates: Sequence[CoordinateLike] | None = None) -> Any:
        """An `xarray.Dataset` over `mode`: `frequency` [Hz], `damping_ratio`, and `shape` by coordinate.

        Args: coordinates: names of the rows (default: those of `coordinates`, else their numbers).
        """
        import xarray

        shapes = np.asarray(self.shapes)
        rows = (
            list(self.coordinates or map(str, range(len(shapes))))
            if coordinates is None
            else [" ".join(filter(None, parse_label(c))) for c in coordinates]
        )
        data = {
            "frequency": ("mode", np.asarray(self.frequencies), {"units": "Hz"}),
            "damping_ratio": ("mode", np.asarray(self.damping_ratios)),
            "shape": (("coordinate", "mode"), shapes),
        }
        return xarray.Dataset(data, {"mode": np.arange(shapes.shape[1]), "coordinate": rows})

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` by mode: frequency [Hz] and damping ratio."""
        return self.to_xarray()[["frequency", "damping_ratio"]].to_dataframe()

    @property
    def groups(self) -> Int[Array, " m"]:
        """Group number (m,) of each mode: modes of equal values form a group, the rigid modes another."""
        rigid = self.is_rigid
        apart = jnp.where(rigid[1:] | rigid[:-1], rigid[1:] ^ rigid[:-1], ~jnp.diagonal(same(self.values), 1))
        return jnp.concatenate([jnp.zeros(1, int), jnp.cumsum(apart)])

    @property
    def num_rigid(self) -> int:
        """Number of rigid modes; not under tracing."""
        return int(np.sum(np.asarray(self.is_rigid)))

    def select(self, selection: slice | AnyArray) -> "Modes":
        """Some of the modes: `modes.select(slice(modes.num_rigid, None))` are the elastic ones."""
        roots, left, rounding = (None if a is None else a[selection] for a in (self.roots, self.left, self.rounding))
        chosen = self.values[selection], self.shapes[:, selection], self.is_rigid[selection]
        return Modes(*chosen, roots, left, rounding, self.coordinates)

    def acceleration(self, amplitudes: AnyArray, t: ScalarLike) -> Float[Array, " n"]:
        """Acceleration `q''(t) = sum_j root_j^2 shapes_j amplitude_j e^(root_j t)` (n,) over all complex modes.

        Raises: ValueError for natural modes, which have no roots.  Source: S1 (42).
        """
        roots, _ = self._complex()
        return (self.shapes @ (roots**2 * amplitudes * jnp.exp(roots * t))).real

    def amplitudes(
        self, *, M: AnyArray, C: AnyArray, displacement: AnyArray, velocity: AnyArray
    ) -> Complex[Array, " m"]:
        """Amplitudes (m,) of the free motion of all complex modes that starts at a displacement and velocity.

        Raises: ValueError for natural modes, which have no roots.  Source: S1 (42).
        """
        roots, left = self._complex()
        start = [a.astype(roots.dtype) for a in (M @ velocity + C @ displacement, M @ displacement)]
        return left @ start[0] + roots * (left @ start[1])

    def _complex(self) -> tuple[Array, Array]:
        if self.roots is None or self.left is None:
            raise ValueError("natural modes have no roots: use complex_modes")
        return self.roots, self.left


def natural_modes(
    *,
    K: AnyArray,
    M: AnyArray,
    num: int | None = None,
    num_rigid: int | None = None,
    diagonal: AnyArray | None = None,
) -> Modes:
    """The lowest modes of `M x'' + K x = 0`.

    Args:
        K, M: (n, n), M positive definite.
        num: number of modes, default all; it should not cut a group of equal frequencies.
        num_rigid: number of rigid modes, if known: those of the smallest values; by default found from rounding.
        diagonal: (n,) of the stiffness that K was condensed from, whose rounding it has; default K's own.

    Negative stiffness is not an error here: see `Modes.is_unstable`.

    Raises: ValueError for matrices of different shapes or without a row, and more modes than there are; if concrete,
    also for a mass matrix that is not positive definite, and for unsymmetric or non-finite matrices (under tracing
    the modes of unsymmetric ones are NaN).
    Source: S1 (33)-(37).
    """
    K, M = require_symmetric(stiffness=K, mass=M)
    if len(K) == 0:
        raise ValueError("the stiffness of shape (0, 0) has no modes: give at least one coordinate")
    if num is not None and not 0 <= num <= len(K):
        raise ValueError(f"num = {num}: there are {len(K)} modes")
    check_mass(M)
    values, shapes = eigh(K, M)
    _check_finite(values)
    if num_rigid is None:
        rigid = rigid_flags(K, values, shapes, diagonal)
    else:
        rigid = jnp.argsort(jnp.argsort(jnp.abs(values))) < num_rigid
    return Modes(values, shapes, rigid).select(slice(0, num))


@jit
def _omega(values, is_rigid):
    """Angular frequencies from squared ones, as `Modes.omega` has them."""
    still = is_rigid | (values == 0)
    size = jnp.sqrt(jnp.abs(jnp.where(still, 1.0, values)))
    return jnp.where(still, 0.0, nan_where((values < 0) & ~still, size))


def stable_modes(*, K: AnyArray, M: AnyArray, num: int | None = None, num_rigid: int | None = None) -> Modes:
    """Natural modes for reductions: no negative stiffness, motions without mass condensed.

    They follow statically: there are as many modes as the rank of a concrete mass matrix.

    Raises: ValueError for negative stiffness, if concrete; under tracing the shapes are then NaN.
    """
    system = LinearSystem(mass=M, stiffness=K)
    light = massless_rows(system)
    if num is not None and num > len(M) - len(light):
        raise ValueError(f"num = {num}: there are only {len(M) - len(light)} modes, the rank of the mass matrix")
    if 0 < len(light) < len(M):
        whole = condense_massless(system)
        modes = _stable_modes(whole.system.stiffness, whole.system.mass, num, num_rigid, whole.diagonal)
        return eqx.tree_at(lambda m: m.shapes, modes, whole.expand(modes.shapes.T).T)
    return _stable_modes(K, M, num, num_rigid)


def _stable_modes(K, M, num, num_rigid, diagonal=None):
    modes = natural_modes(K=K, M=M, num_rigid=num_rigid, diagonal=diagonal)
    unstable = modes.is_unstable & ~rigid_flags(K, modes.values, modes.shapes, diagonal)
    if not is_concrete(unstable):
        shapes = jnp.where(jnp.any(unstable), jnp.nan, modes.shapes)
        modes = Modes(modes.values, shapes, modes.is_rigid)
    elif np.any(np.asarray(unstable)):
        count, least = int(np.sum(np.asarray(unstable))), float(modes.values[0])
        raise ValueError(
            f"the stiffness is negative: {count} unstable modes, the lowest eigenvalue is {least:.3g} 1/s^2"
        )
    return modes.select(slice(0, num))


def _check_finite(values):
    if is_concrete(values) and not np.all(np.isfinite(np.asarray(values))):
        raise ValueError("the mass matrix is not positive definite")


def complete_group(values: AnyArray, num: int) -> int:
    """Smallest number of modes from `num` on that cuts no group of equal values; not under tracing."""
    values = np.asarray(values)
    with jax.ensure_compile_time_eval():
        together = np.asarray(same(jnp.asarray(values)))
    while 0 < num < len(values) and together[num - 1, num]:
        num += 1
    return num
