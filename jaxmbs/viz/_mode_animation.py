"""Animate a mode shape as a motion, for all functions that draw motions."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ..analysis._linearise import independent_positions
from ..assembly._state import State
from ..constraints._kic import position_map, velocity_map
from ..constraints._mobility import with_mobility_at
from ..errors import ModelError
from ..kinematics._configuration import at_state
from ..kinematics._poses import step_coordinates
from ..linear._system import LinearSystem
from ..model._changes import with_changes
from ..model._system import System
from ..runtime import jit
from ..typing import ScalarLike
from ..vibration._modes import Modes
from ._mesh import moving_meshes
from .scenes._trajectory import frame_trajectory

AMPLITUDE = 0.08  # of the extent, the default amplitude: clearly visible, and still small beside the shape


class ModeAnimation(NamedTuple):
    """One period of a mode: times ts (T,) [s], and states of a mechanism or displacements (T, n) of a linear system;
    `frequency` [Hz], zero for a rigid mode, which gets a period of 1 s."""

    ts: np.ndarray
    states: State | None
    displacement: np.ndarray | None
    frequency: float


def animate_mode(
    system: System | LinearSystem,
    modes: Modes,
    number: int = 0,
    state: State | None = None,
    amplitude: ScalarLike | None = None,
    frames: int = 33,
) -> ModeAnimation:
    """One period of a mode, for `scene`, `animate` and the plots.

    Args:
        number: index of the mode.
        state: for a mechanism the state that was linearised about; its loops close to first order.
        amplitude: factor of the shape (default: the largest displacement is 8 % of the extent; without positions the
            largest entry is one).
        frames: number of instants, the last equal to the first.

    Raises: ValueError for no such mode; ModelError for a mechanism without a state, or shapes of another system.
    """
    if not -modes.shapes.shape[1] <= number < modes.shapes.shape[1]:
        raise ValueError(f"mode {number} does not exist: there are {modes.shapes.shape[1]} modes")
    if modes.roots is None:
        omega = float(np.sqrt(np.maximum(np.asarray(modes.values)[number], 0.0)))
    else:
        omega = float(np.abs(np.asarray(modes.roots)[number].imag))
    ts = np.linspace(0.0, 2 * np.pi / omega if omega > 0 else 1.0, frames)
    phase = np.exp(2j * np.pi * np.linspace(0.0, 1.0, frames))
    shape, frequency = np.asarray(modes.shapes)[:, number], omega / (2 * np.pi)
    if isinstance(system, System):
        system = system if state is None else with_mobility_at(with_changes(system, state), state)
        shape = _position_shape(system, state, shape)
    waves = np.real(phase[:, None] * _align_phase(shape))
    if isinstance(system, System):
        return ModeAnimation(ts, _mode_states(system, state, waves, ts, amplitude), None, frequency)
    if waves.shape[1] != system.num_rows:
        raise ModelError(
            [f"the mode shapes have {waves.shape[1]} rows, but the system has {system.num_rows} coordinates"]
        )
    if amplitude is None:
        amplitude = _default_amplitude(system, waves)
    return ModeAnimation(ts, None, amplitude * waves, frequency)


def _position_shape(system, state, shape):
    """Coordinates (n,) of a mode of coordinates and velocities."""
    n = len(independent_positions(system))
    if state is None:
        raise ModelError(
            ["the modes of a mechanism need the state they belong to: animate_mode(system, modes, number, state)"]
        )
    if len(shape) <= n:
        raise ModelError([f"the mode shapes have {len(shape)} rows, those of this mechanism have more than {n}"])
    return shape[:n]


def _align_phase(shape):
    """Shift the phase so that the largest entry is real: the animation starts where it is largest."""
    largest = shape[np.argmax(np.abs(shape))]
    return shape * np.conj(largest) / np.abs(largest) if np.abs(largest) > 0 else shape


def _default_amplitude(system, waves):
    if system.positions is None:
        return 1.0 / (np.max(np.abs(waves)) or 1.0)
    meshes = moving_meshes(system, waves).values()
    seen = max((np.max(np.linalg.norm(u, axis=-1), initial=0.0) for _, u in meshes), default=0.0)
    return AMPLITUDE * max((mesh.extent for mesh, _ in meshes), default=1.0) / (seen or 1.0)


def _mode_states(system, state, waves, ts, amplitude):
    def at(scale):
        moved = _displaced_coordinates(system, state, jnp.asarray(scale * waves))
        still = jnp.zeros((len(ts), state.velocities.shape[-1]), moved.dtype)
        return State(jnp.asarray(ts, moved.dtype), moved, still, structure=system.topology.structure)

    if amplitude is None:
        small = 1e-6 / (np.max(np.abs(waves)) or 1.0)
        seen = frame_trajectory(system, at(small))
        away = np.max(np.linalg.norm(seen.x - seen.x[:1], axis=-1)) / 2 or 1.0
        amplitude = small * AMPLITUDE * seen.extent / away
    return at(amplitude)


@jit
def _displaced_coordinates(system, state, waves):
    """Coordinates (T, nq) of displacements (T, n) of the independent coordinates."""
    at = at_state(system, state, inertias=False)
    Z = position_map(system, at) if system.topology.slip_rows else velocity_map(system, at)[0]
    return jax.vmap(lambda wave: step_coordinates(system.topology, state.coordinates, Z @ wave))(waves)
