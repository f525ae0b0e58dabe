"""Transfer functions of a linear system from inputs to outputs in its modes, with the derivatives of the inverse."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array

from ..blocksparse import BlockMatrix
from ..checks import is_concrete, may_be_nonzero
from ..errors import ModelError
from ..linear._condensation import interface_basis, partition
from ..linear._massless import condense_massless
from ..linear._symmetric import check_mass, require_symmetric
from ..linear._system import LinearSystem
from ..math._eigen import eigh, spectral
from ..runtime import lapack
from ..typing import ArrayLike
from ..vibration import _refined_solve as refined_solve
from ..vibration._damping import is_coupling_modes, modal_damping, modal_lag
from ._inputs import BaseAcceleration, RandomForce
from ._outputs import Output, Terms, output_rows


class ModalModel(eqx.Module):
    """Equations of a system in its modes, and rows of outputs.

    The modes are constants; at them the matrices are diagonal, or damping couples them.  Derivatives appear off the
    diagonals, so that they are right where frequencies repeat.

    Attributes:
        stiffness, mass, damping: (m, m); of modes that are left out only the stiffness remains.
        loss: () loss factor of the stiffness.
        loads: (m, inputs) for a unit of each input and, second, of its integral over time, or None.
        rows: (3, outputs, m) of displacement, velocity and acceleration of the modes.
        direct: (3, outputs, inputs) of the input, its integral and its second integral.
        static: (3, outputs, inputs) of the static displacement, its rate and acceleration: rows without mass.
        names, inputs: of outputs and inputs (static).
        is_coupled: True if damping couples the modes.
        num: modes that move.
    """

    stiffness: Array
    mass: Array
    damping: Array | None
    loss: Array
    loads: tuple[Array, Array | None]
    rows: Array
    direct: Array
    static: Array
    names: tuple[str, ...] = eqx.field(static=True)
    inputs: tuple[str, ...] = eqx.field(static=True)
    is_coupled: bool = eqx.field(static=True)
    num: int = eqx.field(static=True)

    def poles(self) -> tuple[Array, Array]:
        """Resonances and halfwidths [Hz] of the modes that move; constants."""
        K = lax.stop_gradient(self.stiffness)
        C = None if self.damping is None else lax.stop_gradient(self.damping)
        k = jnp.diagonal(K)[: self.num]
        if self.is_coupled and C is not None:
            M = lax.stop_gradient(self.mass)[: self.num, : self.num]
            K, C = (jnp.linalg.solve(M, A[: self.num, : self.num]) for A in (K, C))
            eye = jnp.eye(self.num, dtype=K.dtype)
            roots = lapack.eig(jnp.block([[jnp.zeros_like(K), eye], [-K, -C]]))[0]
            return jnp.abs(roots.imag) / (2 * jnp.pi), jnp.abs(roots.real) / (2 * jnp.pi)
        half = jnp.zeros_like(k) if C is None else jnp.diagonal(C)[: self.num] / 2
        elastic = lax.complex(k - half**2, k * lax.stop_gradient(self.loss))
        root = jnp.sqrt(elastic)
        width = jnp.abs(half) + jnp.abs(root.imag)
        return jnp.abs(root.real) / (2 * jnp.pi), width / (2 * jnp.pi)

    def amplitudes(self, frequencies: ArrayLike) -> Array:
        """Displacements (frequencies, m, inputs) of the modes for unit inputs."""
        s = _rate(frequencies, self.rows.real.dtype)
        load = jnp.broadcast_to(self.loads[0].astype(s.dtype), (len(s), *self.loads[0].shape))
        if self.loads[1] is not None:
            load = load + self.loads[1].astype(s.dtype)[None] / s[:, None, None]
        return _solve(self, s, load)

    def transfer(self, frequencies: ArrayLike) -> Array:
        """Outputs (frequencies, outputs, inputs) for unit inputs at frequencies [Hz].

        One product of the rows by the modes with their rates, and by the inputs with theirs.
        """
        s = _rate(frequencies, self.rows.real.dtype)
        q, rate = self.amplitudes(frequencies), s[:, None, None]
        one, first, second = self.direct
        still, rates, accelerations = self.static
        rows = [*self.rows, one + still, first, second, rates, accelerations]
        terms = [q, rate * q, rate**2 * q, _input_terms(s.imag, len(self.inputs))]
        return _recovered(jnp.concatenate(rows, axis=1), jnp.concatenate(terms, axis=1))

    def modal_rows(self, s: Array) -> Array:
        """Rows (frequencies, outputs, m) of the displacements of the modes at rates s = i w."""
        a, b, c = (part.astype(s.dtype)[None] for part in self.rows)
        s = s[:, None, None]
        return a + s * (b + s * c)

    def unbounded_parts(self) -> tuple:
        """Parts that must be zero under white noise: integrals of inputs, rows without mass, a loss factor."""
        return tuple(A for A in (self.loads[1], self.direct[1:], self.static, self.loss) if A is not None)

    def state_space(self) -> tuple[Array, Array, Array, Array]:
        """Matrices A, B, C, D of all modes, without the `unbounded_parts`."""
        K, C = self.stiffness, self.damping
        C = jnp.zeros_like(K) if C is None else C
        K, C, P = (jnp.linalg.solve(self.mass, part) for part in (K, C, self.loads[0]))
        eye, zero = jnp.eye(len(K), dtype=K.dtype), jnp.zeros_like(K)
        A = jnp.block([[zero, eye], [-K, -C]])
        B = jnp.concatenate([jnp.zeros_like(P), P])
        x, v, a = self.rows
        return A, B, jnp.concatenate([x - a @ K, v - a @ C], axis=1), a @ P + self.direct[0]


def _rate(frequencies, dtype):
    w = 2 * jnp.pi * jnp.asarray(frequencies, dtype)
    return lax.complex(jnp.zeros_like(w), w)


def _solve(model, s, load):
    """Solutions (frequencies, m, inputs) of `(K (1 + i loss) + s C + s^2 M) q = load`."""
    K, M, C = (None if A is None else A.astype(s.dtype) for A in (model.stiffness, model.mass, model.damping))
    one = lax.complex(jnp.ones_like(model.loss), model.loss).astype(s.dtype)
    if model.is_coupled:
        Z = one * K[None] + s[:, None, None] * C[None] + (s**2)[:, None, None] * M[None]
        return jax.vmap(refined_solve.solve)(Z, load)
    own = [jnp.zeros((1, len(K)), s.dtype) if A is None else jnp.diagonal(A)[None] for A in (K, C, M)]
    z = lax.stop_gradient(one * own[0] + s[:, None] * own[1] + (s**2)[:, None] * own[2])

    def product(q):
        found = one * _times(K, q) + (s**2)[:, None, None] * _times(M, q)
        return found if C is None else found + s[:, None, None] * _times(C, q)

    return lax.custom_linear_solve(product, load, lambda _, r: r / z[:, :, None], symmetric=True)


def _input_terms(w, num):
    """Unit inputs, their first and second integrals, rates and second rates (frequencies, 5 num, num)."""
    one, none = jnp.ones_like(w), jnp.zeros_like(w)
    even, odd = (one, none, -1.0 / w**2, none, -(w**2)), (none, -1.0 / w, none, w, none)
    powers = lax.complex(jnp.stack(even, axis=1), jnp.stack(odd, axis=1))
    return jnp.einsum("wp,ij->wpij", powers, jnp.eye(num, dtype=powers.dtype)).reshape(len(w), -1, num)


def _recovered(rows, q):
    """Products (frequencies, outputs, inputs) of rows (outputs, m) and q (frequencies, m, inputs): one product of
    matrices for all frequencies, of real ones where the rows are."""
    columns = jnp.swapaxes(q, 0, 1).reshape(q.shape[1], -1)
    if jnp.iscomplexobj(rows):
        found = rows @ columns
    else:
        real, imag = jnp.split(rows @ jnp.concatenate([columns.real, columns.imag], axis=1), 2, axis=1)
        found = lax.complex(real, imag)
    return jnp.swapaxes(found.reshape(len(rows), len(q), -1), 0, 1)


def _times(A, q):
    return jnp.einsum("ij,wjk->wik", A, q)


class _Excitation(NamedTuple):
    """Motion of the base per input, and forces.

    Attributes: base: rows that are moved; carried: (n, inputs) motion with the base; elastic: as in `Terms`; forces:
    (n, inputs); given: forces by name of each input.
    """

    base: tuple[int, ...]
    carried: Array
    elastic: bool
    forces: Array
    given: tuple


def modal_model(
    system: LinearSystem,
    inputs: Mapping[str, BaseAcceleration | RandomForce],
    outputs: Mapping[str, Output],
    ratios: ArrayLike | None = None,
    loss: ArrayLike = 0.0,
    num: int | None = None,
) -> ModalModel:
    """Transfer functions of a linear system in its modes, those with the base fixed.

    Args: as of `random_response`.

    Raises: ModelError with every fault.
    """
    faults = _faults(system, inputs, ratios)
    if faults:
        raise ModelError(faults, "the question")
    system = system.to_dense() if isinstance(system.stiffness, BlockMatrix) else system
    excitation = _excitation(system, inputs)
    inner, outer = partition(system.num_rows, excitation.base)
    names = [system.coordinates[k] for k in inner]
    place = {int(k): i for i, k in enumerate(inner)}
    cut = lambda A: None if A is None else A[np.ix_(inner, inner)]  # noqa: E731
    own = LinearSystem(
        mass=cut(system.mass),
        stiffness=cut(system.stiffness),
        damping=cut(system.damping),
        coordinates=names,
        massless=[place[k] for k in system.massless if k in place],
    )
    whole = condense_massless(own)
    first, second = _loads(system, excitation, inner)
    K, M = require_symmetric(stiffness=whole.system.stiffness, mass=whole.system.mass)
    check_mass(M)
    C = whole.system.damping if ratios is None else modal_damping(K=K, M=M, ratios=ratios)
    matrices, X, coupled = _modal_matrices(K, M, C, num, ratios is not None)
    expand = lambda x: _embed(whole.expand(x.T), inner, system.num_rows)  # noqa: E731
    whole_load = lambda P: whole.load(P.T).T  # noqa: E731
    light = _embed(whole.expand(jnp.zeros((first.shape[1], len(K)), K.dtype), first.T), inner, system.num_rows)
    lag = None if ratios is None else expand(modal_lag(K=K, M=M, ratios=ratios, velocity=X.T).T)
    is_lossy = may_be_nonzero(loss)  # of the number as given: an array made while tracing is not known
    loss = jnp.asarray(loss, K.dtype)
    rows, labels = _rows(system, outputs, excitation, expand(X), light, lag, loss if is_lossy else None)
    return ModalModel(
        **matrices,
        loss=loss,
        loads=(X.T @ whole_load(first), None if second is None else X.T @ whole_load(second)),
        **rows,
        names=labels,
        inputs=tuple(inputs),
        is_coupled=coupled,
        num=len(K) if num is None else num,
    )


def _faults(system, inputs, ratios):
    """Faults of the inputs and the damping."""
    faults = [] if inputs else ["no input is given"]
    wrong = [name for name, given in inputs.items() if not isinstance(given, BaseAcceleration | RandomForce)]
    faults += [f"input {name!r} must be a BaseAcceleration or a RandomForce" for name in wrong]
    bases = {given.at for given in inputs.values() if isinstance(given, BaseAcceleration)}
    if len(bases) > 1:
        faults.append("the accelerations must have the same `at`: one base, whose directions are the inputs")
    if ratios is not None and system.damping is not None:
        faults.append("the system has damping of its own: leave out `ratios`, or `system.with_damping(None)`")
    return faults


def _excitation(system, inputs):
    moved = [given for given in inputs.values() if isinstance(given, BaseAcceleration)]
    n, dtype = system.num_rows, system.dtype
    base = _moved_rows(system, moved[0].at) if moved and moved[0].at is not None else ()
    T = interface_basis(system.stiffness, base) if base else None
    carried, forces, given = [], [], []
    for one in inputs.values():
        pattern = jnp.zeros(n, dtype)
        if isinstance(one, BaseAcceleration):
            pattern = one.pattern(system)
            pattern = pattern if T is None else T @ pattern[np.array(base)]
        carried.append(pattern)
        is_force = isinstance(one, RandomForce)
        forces.append(system.load(one.pattern) if is_force else jnp.zeros(n, dtype))
        given.append(one.pattern if is_force else None)
    return _Excitation(base, jnp.stack(carried, 1), bool(base), jnp.stack(forces, 1), tuple(given))


def _moved_rows(system, at):
    """Rows of the coordinates that are moved.  Raises: ModelError where names do not stand for single rows."""
    if at == ("interface",) and system.num_interface:
        return tuple(system.interface)
    with jax.ensure_compile_time_eval():  # names are known, also where the matrices are traced
        rows = system.outputs(*at)[0]
    if not is_concrete(rows):
        raise ModelError(["the moved coordinates must be known before tracing"], "the inputs")
    rows = np.asarray(rows)
    if not np.all((np.sum(rows != 0, axis=1) == 1) & (np.sum(rows, axis=1) == 1)):
        raise ModelError(
            ["`at` must name coordinates that move by themselves, not ones of rigid bodies"], "the inputs"
        )
    return tuple(np.argmax(rows, axis=1).tolist())


def _loads(system, excitation, inner):
    """Loads (inner, inputs) of unit inputs, and of their integrals or None."""
    first = (excitation.forces - system.mass @ excitation.carried)[inner]
    if system.damping is None or not excitation.elastic:
        return first, None
    second, size = system.damping @ excitation.carried, jnp.abs(system.damping) @ jnp.abs(excitation.carried)
    tiny = jnp.abs(second) <= 1e3 * jnp.finfo(second.dtype).eps * size
    return first, -jnp.where(tiny, second - lax.stop_gradient(second), second)[inner]


def _embed(x, inner, n):
    """Columns (n, k) of rows (k, inner); zero on the base."""
    return jnp.zeros((n, len(x)), x.dtype).at[inner].set(x.T)


def _modal_matrices(K, M, C, num, is_modal):
    """Matrices in the modes, the modes (n, n), and whether damping couples them."""
    values, X = lax.stop_gradient(eigh(K, M))
    if num is not None:
        if not 0 < num <= len(K):
            raise ModelError([f"num = {num}: there are {len(K)} modes"], "the question")
        flags = (jnp.arange(len(K)) < num).astype(K.dtype)
        P = spectral(_projector, K, M, flags) @ M
        M, C = (None if A is None else P.T @ A @ P for A in (M, C))
    K, M, C = (None if A is None else X.T @ A @ X for A in (K, M, C))
    coupled = C is not None and not is_modal
    if coupled and is_concrete(C):
        coupled = bool(is_coupling_modes(C))
    return {"stiffness": K, "mass": M, "damping": C}, X, coupled


def _projector(values, flag):
    return flag * jnp.ones_like(values)


def _rows(system, outputs, excitation, shapes, light, lag, loss):
    """Rows of outputs by modes, static parts and inputs, from their values for unit motions of each."""
    sets = [shapes.T, light.T, excitation.carried.T]
    sizes = [len(part) for part in sets]
    count, n, i = 3 * sum(sizes) + sizes[-1], system.num_rows, sizes[-1]
    zero = jnp.zeros((count, n), shapes.dtype)
    at = np.cumsum([0, *np.repeat(sizes, 3), i])
    relative, carried = [], []
    for power in range(3):
        x = zero.at[at[power] : at[power + 1]].set(sets[0]).at[at[3 + power] : at[4 + power]].set(sets[1])
        relative.append(x)
        carried.append(zero.at[at[6 + power] : at[7 + power]].set(sets[2]))
    forces = zero.at[at[9] :].set(excitation.forces.T)
    terms = Terms(tuple(relative), tuple(carried), excitation.elastic, zero, forces, (), excitation.base)
    terms = terms._replace(given=_given_forces(excitation.given, at[9], count))
    late = zero if lag is None else zero.at[at[1] : at[2]].set(lag.T)
    if loss is not None:
        late = lax.complex(late, loss * terms.strained(0))
    values, names = output_rows(outputs, system, terms._replace(lag=late))
    parts = [values[a:b].T for a, b in zip(at[:-1], at[1:], strict=True)]
    direct = jnp.stack([parts[8] + parts[9], parts[7], parts[6]])
    return {"rows": jnp.stack(parts[:3]), "static": jnp.stack(parts[3:6]), "direct": direct}, names


def _given_forces(given, start, count):
    """Forces by name for all cases: those of input k in the case start + k."""
    found: list[Any] = []
    for k, pattern in enumerate(given):
        if isinstance(pattern, dict):
            case = jnp.zeros(count).at[start + k].set(1.0)
            found.append({name: jnp.multiply.outer(case, jnp.asarray(f)) for name, f in pattern.items()})
    return tuple(found)
