"""Designs to the gradient of a reaction in one program, of a row of 24 four-bars: without a matrix of the whole."""

import dataclasses
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.cases import models

LOOPS, DESIGNS = 24, 16


def level_row():
    """The row with level couplers, and its state at -1 rad/s of the cranks."""
    system = models.n_four_bar(LOOPS)
    start, value = mbs.State.at(system), {"A": (-0.4, -1.0), "l": (0.4, 1.0)}
    psi, u = np.array([value[name[0]] for name, *_ in system.topology.structure]).T
    return system, dataclasses.replace(start, coordinates=jnp.array(psi), velocities=jnp.array(u))


def batched_matrices(text, size):
    """Tensors of a lowered program that have for every design two axes of at least `size`."""
    shapes = {tuple(map(int, s[:-1].split("x"))) for s in re.findall(r"tensor<((?:\d+x)+)[a-z]", text)}
    return {s for s in shapes if s[0] == DESIGNS and sum(n >= size for n in s[1:]) > 1}


@pytest.mark.parametrize(
    "method", [pytest.param("frontal", marks=pytest.mark.long), pytest.param("multifrontal", marks=pytest.mark.long)]
)
def test_designs_to_gradient(method):
    """Squared force in a middle pin by all masses, 16 designs at once: dense values, and differences."""
    system, state = level_row()
    assert system.topology.linear_solver == "frontal"

    def load(masses, method):
        heavier = dataclasses.replace(system, mass=masses)
        return jnp.sum(mbs.reactions(heavier, state, method=method)["right_12"].force ** 2)

    masses = np.asarray(system.mass) * (1.0 + np.random.default_rng(0).uniform(size=(DESIGNS, len(system.mass))))
    programs = {
        kind: jax.jit(jax.vmap(jax.value_and_grad(lambda m, kind=kind: load(m, kind)))).lower(masses)
        for kind in ("dense", method)
    }
    bodies = len(system.mass)
    assert (DESIGNS, bodies, bodies) in batched_matrices(programs["dense"].as_text(), bodies)
    # lists of 12 by 12 blocks have rows of 144 numbers: one axis grows with the bodies
    assert {s for s in batched_matrices(programs[method].as_text(), bodies) if s[-1] != 144} == set()
    run = {kind: program.compile() for kind, program in programs.items()}
    (exact, slopes), (values, found) = (run[kind](masses) for kind in ("dense", method))
    np.testing.assert_allclose(values, exact, rtol=1e-10)
    np.testing.assert_allclose(found, slopes, atol=1e-10 * np.abs(slopes).max())
    direction = np.random.default_rng(1).normal(size=masses.shape)
    ahead, behind = (run[method](masses + h * direction)[0] for h in (1e-4, -1e-4))
    secant = (ahead - behind) / 2e-4
    np.testing.assert_allclose(np.sum(found * direction, axis=1), secant, atol=1e-6 * np.abs(secant).max())
