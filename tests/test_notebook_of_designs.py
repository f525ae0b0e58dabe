"""What the library is for, designs to better designs: the notebook's two pages."""

import runpy
from pathlib import Path

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest

FOLDER = Path(__file__).parent.parent
NOTEBOOK = FOLDER / "notebooks" / "13_designs_in_batches.py"


@pytest.fixture(scope="module")
def page():
    plt.switch_backend("Agg")
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield runpy.run_path(str(NOTEBOOK))
    plt.close("all")


def differences(function, design, h):
    """Central differences of a compiled function in all directions."""
    value = jax.jit(jax.vmap(function))
    shifts = h * jnp.eye(len(design))
    return (value(design + shifts) - value(design - shifts)) / (2.0 * h)


@pytest.mark.long
@pytest.mark.parametrize("name", ["pin_load", "arm_load"])
def test_twenty_steps_improve_all_eight_designs(page, name):
    values = page[f"{name}s"]
    assert values.shape == (20, 8) and np.all(np.isfinite(values))
    assert np.all(values[-1] < 0.98 * values[0])


@pytest.mark.long
@pytest.mark.parametrize("name, designs, h", [("pin_load", "linkages", 1e-4), ("arm_load", "better_arms", 1e-6)])
def test_the_slopes_are_those_of_differences(page, name, designs, h):
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        slope = jax.jit(jax.grad(page[name]))(page[designs][0])
        found = differences(page[name], page[designs][0], h)
    np.testing.assert_allclose(slope, found, rtol=1e-4, atol=1e-4 * np.abs(found).max())


@pytest.mark.long
def test_bonds_of_the_elements_carry_the_reactions_of_the_mechanism(page):
    assert page["difference"] < 1e-7 * np.abs(page["both"]).max()
