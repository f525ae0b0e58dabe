"""Tapes run what the library asks of every mechanism and structure, and compute what XLA does.

Where a room brings an operation that tapes do not have, `UnsupportedError` names it here.
"""

import inspect

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.fatigue import SN, psd_table, spectral_damage
from jaxmbs.qualification import BaseAcceleration, stress_spectrum
from jaxmbs.runtime import compile_kind, jaxpr_function, without_tricks
from jaxmbs.runtime.tape import Tape

from . import of_all, probes

ROOMS = {name: inspect.unwrap(getattr(probes, name)) for name in "kinematics motion fields variations bonds".split()}
OMEGA, MASS = np.linspace(1.0, 40.0, 5), np.diag([1.0, 2.0, 0.5])
PSD = psd_table([20.0, 50.0, 800.0, 2000.0], [0.026, 0.16, 0.16, 0.026], "g^2/Hz")
STRESS = psd_table([20.0, 50.0, 800.0, 2000.0], [2.6, 16.0, 16.0, 2.6], unit=None)


def structure(springs):
    """Three masses in a row, the first one held by the first spring."""
    D = np.array([[1.0, 0, 0], [-1, 1, 0], [0, -1, 1]])
    K, C = (jnp.asarray(D.T) @ jnp.diag(s) @ D for s in (springs, 0.01 * springs))
    names = [f"{name} z" for name in "abc"]
    positions = {name: (0.0, 0.0, float(k)) for k, name in enumerate("abc")}
    return mbs.LinearSystem(mass=jnp.asarray(MASS), stiffness=K, damping=C, coordinates=names, positions=positions)


def _matrices(springs):
    system = structure(springs)
    return {"K": system.stiffness, "C": system.damping, "M": system.mass}


def _random(springs):
    return mbs.random_response(structure(springs), {"base": BaseAcceleration(PSD, "z")}, ["c z"])


#: Questions about structures.
QUESTIONS = {
    "natural modes": lambda s: mbs.modes(structure(s), damped=False).values,
    "complex modes": lambda s: mbs.modes(structure(s)).roots,
    "frequency response": lambda s: mbs.frequency_response(structure(s), OMEGA, ["a z"], ["c z"]).values,
    "receptance": lambda s: mbs.vibration.viscous_receptance(**_matrices(s), omega=OMEGA, out=[0, 2], into=[1]),
    "transfer matrix": lambda s: mbs.vibration.transfer_matrix(**_matrices(s), s=-0.2 + 1j * OMEGA),
    "random vibration": lambda s: _random(s).rms,
    "fatigue": lambda s: spectral_damage(stress_spectrum(_random(s), "c z"), SN(1e12, 5.0)),
    "fatigue of a kinked curve": lambda s: spectral_damage(STRESS, SN(1e3, s[0] / 100, 2.0, 9.0), "narrowband"),
    "slopes of roots": lambda s: jax.jacfwd(lambda s: jnp.abs(mbs.modes(structure(s)).roots))(s),
}


DEAR = ("natural modes", "random vibration", "fatigue", "receptance")
SPRINGS = jnp.array([300.0, 200.0, 150.0])


def traced_for_tapes(function, *args):
    with compile_kind("tape"):
        return jax.make_jaxpr(lambda *x: jax.tree.leaves(eqx.filter(function(*x), eqx.is_array)))(*args)


def same_on_both(function, *args, rtol=1e-12):
    """Results of both, to a share of the largest number, beside which what is left of energies is small."""
    traced = traced_for_tapes(function, *args)
    found = Tape(traced)(*jax.tree.leaves(args))
    with without_tricks("tape"):
        want = jax.jit(jaxpr_function(traced))(*jax.tree.leaves(args))
    scale = max((np.max(np.abs(b), initial=1.0) for b in map(np.asarray, want)), default=1.0)
    for a, b in zip(found, map(np.asarray, want), strict=True):
        np.testing.assert_allclose(a, b, rtol=rtol, atol=rtol * scale)


@of_all(quick=(), slow=())
@pytest.mark.parametrize("room", ROOMS)
def test_a_mechanism(specimen, room):
    if specimen.system.elastic and room in ("fields", "variations"):
        pytest.skip("the paper's fields are those of rigid bodies")
    same_on_both(ROOMS[room], specimen.system, specimen.state)


@of_all(quick=(), slow=())
def test_a_motion(specimen):
    """Steps are chosen by what rounding moves, so that the digits are those of the tolerance."""

    def simulated(system, state):
        motion = mbs.simulate(system, state, ts=state.t + jnp.linspace(0.0, 0.05, 3))
        found = mbs.reactions(system, motion)
        return motion.states.coordinates, [found[name].force for name in system.topology.joint_names]

    same_on_both(simulated, specimen.system, specimen.state, rtol=1e-7)


@pytest.mark.parametrize(
    "question", [pytest.param(q, marks=[pytest.mark.slow] if q in DEAR else []) for q in QUESTIONS]
)
def test_a_structure_has_a_tape(question):
    Tape(traced_for_tapes(QUESTIONS[question], SPRINGS))


@pytest.mark.long
@pytest.mark.parametrize("question", QUESTIONS)
def test_a_structure(question):
    same_on_both(QUESTIONS[question], SPRINGS, rtol=1e-11)
