"""Modes of a linearised mechanism."""

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np
from jax import lax

from ..assembly._state import State
from ..checks import distinct_names, is_concrete, place_of
from ..errors import ModelError
from ..math._eigen import eig, eig_rounding
from ..math._square import solve
from ..model._system import System
from ..runtime import jit
from ..signal_flow._sampling import refuse_sampled
from ..vibration._modes import Modes
from ._linearisation import Linearisation
from ._linearise import linearise

_CYCLIC_TOLERANCE = {8: 1e-7, 4: 1e-3}  # of the largest entry: what counts as zero


def modes(mechanism: Linearisation | System, state: State | None = None, without: Sequence[str] = ()) -> Modes:
    """Complex modes of the small motions of `linearise(system, state)`, or of a mechanism about a state; on the CPU,
    where LAPACK's general eigenproblem lives.

    Args:
        without: cyclic coordinates, by joint or as `Linearisation.names` has them: a rotor's angle, a free slide.
            Nothing depends on them and their momenta stay: the modes are those at unchanged momenta, without the
            pair of zero roots of each (Routh's).

    Returns: `Modes` by size of the roots, none of a mechanism without freedom; shapes (n + N + ns, m) are
    coordinates, velocities and internal states of each mode, largest entry 1; `Modes.at("pin", "rate of pin")` finds
    rows by name.  Roots have derivatives where they are simple or their vectors complete, shapes where the root is
    simple; at a defective one (a free motion's pair of zeros) none exists, and zero is returned.

    Raises: UnknownNameError; ModelError for a coordinate left out that is not independent or, if that can be seen, on
    which something depends.
    """
    if not isinstance(mechanism, Linearisation):
        if state is None:
            raise TypeError("modes of a mechanism need a state: modes(system, state)")
        refuse_sampled(mechanism, "modes")
        mechanism = linearise(mechanism, state)
    A = routh_reduction(mechanism, tuple(without)) if without else mechanism.state_space.A
    out = set(np.asarray(mechanism.names)[cyclic_columns(mechanism, without)]) if without else set()
    names = tuple(name for name in mechanism.state_names if name.removeprefix("rate of ") not in out)
    if not A.size:  # without freedom there is no mode
        none, dtype = jnp.zeros(0, A.dtype), lax.complex(A, A).dtype
        return Modes(none, jnp.zeros((0, 0), dtype), none > 0.0, none.astype(dtype), rounding=none, coordinates=names)
    values, shapes, is_rigid, roots, rounding = _modes_of(A)
    return Modes(values, shapes, is_rigid, roots, rounding=rounding, coordinates=names)


@jit
def _modes_of(A):
    roots, shapes, left = eig(A)
    rounding = lax.stop_gradient(eig_rounding(A, shapes, left))
    largest = jnp.take_along_axis(shapes, jnp.argmax(jnp.abs(shapes), axis=0)[None], axis=0)
    return roots.real**2 + roots.imag**2, shapes / largest, jnp.abs(roots) <= rounding, roots, rounding


def routh_reduction(lin, without):
    """The state matrix at unchanged momenta of the cyclic velocities, `M_cc v_c = -M_cr v_r - C_cr x_r`; their
    coordinates drop out."""
    out = cyclic_columns(lin, without)
    if lin.positions != lin.velocities:
        raise ModelError(["modes without cyclic coordinates: not where rows of velocity restrict the motion"])
    number = len(lin.velocities)
    rest = np.setdiff1d(np.arange(number), out)
    check_cyclic(lin, out)
    A, internal = lin.state_space.A, 2 * number + np.arange(len(lin.internal_names))
    kept = np.concatenate([rest, number + rest, internal])
    none = jnp.zeros((len(out), len(internal)), A.dtype)
    momenta = jnp.concatenate([lin.damping[np.ix_(out, rest)], lin.mass[np.ix_(out, rest)], none], axis=1)
    return A[np.ix_(kept, kept)] - A[np.ix_(kept, number + out)] @ solve(lin.mass[np.ix_(out, out)], momenta)


def cyclic_columns(lin, without):
    """Places of the coordinates left out."""
    found = []
    for name in distinct_names("without", without):
        of_joint = [k for k, own in enumerate(lin.names) if own.rpartition(" ")[0] == name]
        found += of_joint or [place_of("independent coordinate", name, lin.names)]
    return np.unique(found)


def check_cyclic(lin, out, keeps_momentum=True, is_steady=True):
    """ModelError where something is seen to depend on a coordinate, or to take away a momentum that is kept.

    Args: is_steady: False at a pose that is not the steady one, whose accelerations turn with other coordinates.
    """
    if not is_concrete(lin.stiffness, lin.damping):
        return
    K, C, number = np.asarray(lin.stiffness), np.asarray(lin.damping), len(lin.velocities)
    F = np.asarray(lin.mass) @ np.asarray(lin.state_space.A)[number : 2 * number, 2 * number :]
    least, faults = _CYCLIC_TOLERANCE[K.dtype.itemsize], []
    for k in out:
        name = lin.names[k]
        row = np.abs(K[k]).max() if is_steady else 0.0
        if max(np.abs(K[:, k]).max(), row) > least * max(np.abs(K).max(), 1e-300):
            faults.append(f"{name!r} is not a cyclic coordinate: the stiffness depends on it")
        elif not keeps_momentum:
            continue
        elif np.abs(C[k, out]).max() > least * max(np.abs(C).max(), 1e-300):
            faults.append(f"the momentum of {name!r} is not conserved: the coordinate is damped")
        elif np.any(F[k]):
            faults.append(f"the momentum of {name!r} is not conserved: internal states of force elements act on it")
    if faults:
        raise ModelError(faults)
