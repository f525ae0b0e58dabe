"""Assembled systems: in blocks as dense, within a trace as outside of one."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.elements import Beam
from jaxmbs.fem import Structure, assemble
from jaxmbs.qualification import BaseAcceleration, Coordinates
from jaxmbs.reductions import CraigBampton, reduce

QUESTIONS = {
    "modes": lambda s: mbs.modes(s, num=3).frequencies,
    "frequency response": lambda s: jnp.abs(
        mbs.frequency_response(s, jnp.array([100.0, 500.0]), into=["4 z"], out=["4 z"], loss=0.02).values
    ),
    "rest": lambda s: mbs.equilibrium(s, {"4 z": 1.0}).displacement[-6:],
    "transient": lambda s: mbs.simulate(
        s, ts=jnp.linspace(0.0, 0.01, 5), forces=lambda t: {"4 z": 1.0}
    ).displacement[-1, -6:],
    "reduction": lambda s: mbs.modes(reduce(s.with_interface("4"), CraigBampton(3)), num=3).frequencies,
    "random test": lambda s: mbs.random_response(
        s,
        {"base": BaseAcceleration(mbs.fatigue.psd_table([10.0, 2000.0], [1.0, 1.0], "(m/s^2)^2/Hz"), "z")},
        out={"tip": Coordinates("4 z")},
        ratios=0.02,
    ).rms,
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("question", QUESTIONS)
def test_held_structures_in_blocks_answer_within_a_trace(question):
    """Their held rows have no mass, which a trace does not see."""

    def answer(factor, blocks):
        beam = Beam(2e11 * factor, 8e10, 1e-4, 1e-9, 1e-9, 2e-9, density=7800.0)
        nodes = np.c_[0.1 * np.arange(5), np.zeros((5, 2))]
        structure = Structure(nodes, {"beam": (beam, [(k, k + 1) for k in range(4)])}, held={0: "all"})
        return QUESTIONS[question](assemble(structure, blocks=blocks))

    wanted = answer(jnp.asarray(1.0), False)
    np.testing.assert_allclose(mbs.jit(lambda x: answer(x, True))(1.0), wanted, rtol=1e-6, atol=1e-9 * np.max(wanted))
