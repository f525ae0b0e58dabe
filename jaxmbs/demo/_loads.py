"""Joint loads and shaking force of the driven slider-crank over one turn."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from .. import reactions, simulate
from ._mechanism import GAS, START, TURN, slider_crank, start
from ._reference import TIMES

QUANTITIES = ("main", "crank_pin", "wrist", "guide", "torque", "shaking")


class EngineLoads(NamedTuple):
    """Loads at the times t (T,) [s]: pin forces and shaking force (T, 2) in x, y, guide force (T, 1) along y [N],
    driving torque (T, 1) [N m].  Joint forces act from the joint's parent on its child."""

    t: jax.Array
    main: jax.Array
    crank_pin: jax.Array
    wrist: jax.Array
    guide: jax.Array
    torque: jax.Array
    shaking: jax.Array


def crank_grid(size):
    """Times (T,) of `size` equal crank angles over one turn, and those of the reference: all times, rows of each."""
    even = np.arange(size) * TURN / size
    every = np.unique(np.r_[even, TIMES])
    return every, np.searchsorted(every, even), np.searchsorted(every, TIMES)


def simulate_drive(design, ts, like=None):
    """System, motion and loads of a design at the times ts."""
    system = slider_crank(design, like=like)
    # without freedom the constraints determine the motion: steps need to follow their branch, and no more
    motion = simulate(system, start(system, design), ts=ts, rtol=1e-3, atol=1e-3, gradient="forward")
    found = reactions(system, motion)
    x_y = {name: found[name].force[:, :2] for name in ("main", "crank_pin", "wrist")}
    guide, torque = found["slide"].force, found["main"].effort
    loads = EngineLoads(motion.ts, **x_y, guide=guide[:, 1:2], torque=torque, shaking=_shaking(system, found))
    return system, motion, loads


def _shaking(system, found):
    """Minus the sum of mass times acceleration (T, 2): by Newton's law, minus all outer forces on the bodies."""
    ground = found["main"].force + found["slide"].force
    outer = ground + (jnp.sum(system.mass) * system.gravity + jnp.asarray(GAS))[None, :]
    return -outer[:, :2]


def select_times(loads, rows):
    """The loads at some of the times, in NumPy."""
    return EngineLoads(*(np.asarray(value)[rows] for value in loads))


def rms(force):
    """Root mean square over a turn of the size of a force (T, 2)."""
    return jnp.sqrt(jnp.mean(jnp.sum(force**2, axis=1)))


def smooth_peak(force, power=16):
    """A smooth stand-in for the largest size of a force (T, 2): its mean of high power, a little below the peak."""
    squares = jnp.sum(force**2, axis=1)
    largest = jax.lax.stop_gradient(jnp.max(squares))
    return jnp.sqrt(largest) * jnp.mean((squares / largest) ** (power // 2)) ** (1.0 / power)


def crank_angle(t):
    """Crank angle [rad] at times t [s], counted from that at t = 0."""
    return START + 2 * np.pi * np.asarray(t) / TURN
