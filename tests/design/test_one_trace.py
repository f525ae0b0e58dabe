"""What takes a function of a design runs its Python once, values and derivatives together."""

import jax.numpy as jnp
import numpy as np
import optax
import pytest

import jaxmbs as mbs
from jaxmbs import design, studies

AT, DEVIATIONS = {"x": 0.3, "y": 0.5}, {"x": 0.1, "y": 0.1}
BOUNDS = {"x": (0.0, 2.0), "y": (-1.0, 1.0)}
FEW, MANY = ({"x": np.linspace(0.0, 1.0, n), "y": np.linspace(0.0, 1.0, n)} for n in (3, 120))
QUIET = {"progress": False}


def limited(function):
    return mbs.minimise(lambda d: d["x"], AT, BOUNDS, limits=[design.Limit("one", function, upper=0.5)], **QUIET)


ASKED = {
    "minimise": lambda f: mbs.minimise(f, AT, BOUNDS, **QUIET),
    "minimise from many starts": lambda f: mbs.minimise(f, AT, BOUNDS, starts=3, **QUIET),
    "minimise by optax": lambda f: mbs.minimise(f, AT, BOUNDS, optimiser=optax.adam(0.1), steps=3, **QUIET),
    "limit": lambda f: mbs.minimise(
        lambda d: d["x"], AT, BOUNDS, limits=[design.Limit("one", f, upper=0.5)], **QUIET
    ),
    "pareto": lambda f: design.pareto(f, lambda d: d["x"] ** 2, AT, BOUNDS, points=3, **QUIET),
    "batch": lambda f: mbs.batch(f, FEW, **QUIET),
    "batch of many": lambda f: mbs.batch(f, MANY, **QUIET),
    "sweep": lambda f: mbs.sweep(lambda d: {"f": f(d)}, studies.grid(x=[0.0, 1.0], y=[0.0, 0.5]), **QUIET),
    "deviations": lambda f: design.propagate_uncertainty(f, AT, DEVIATIONS),
    "deviations in reverse": lambda f: design.propagate_uncertainty(f, AT, DEVIATIONS, gradient="reverse"),
    "samples": lambda f: design.propagate_uncertainty(f, AT, DEVIATIONS, samples=4),
    "tolerances": lambda f: design.tolerances(f, AT, DEVIATIONS),
    "sensitivities": lambda f: design.sensitivities(f, BOUNDS, samples=4),
    "sensitivities forward": lambda f: design.sensitivities(f, BOUNDS, samples=4, gradient="forward"),
    "identify": lambda f: mbs.identify(lambda d: f(d) * jnp.arange(1.0, 4.0), np.array([0.1, 0.2, 0.3]), {"x": 0.3}),
}


@pytest.mark.parametrize("ask", ASKED.values(), ids=ASKED)
def test_a_function_is_traced_once(ask):
    calls = []

    def function(design):
        calls.append(design)
        return (design["x"] - 1.0) ** 2 + jnp.sin(design.get("y", 0.0)) ** 2

    ask(function)
    assert len(calls) == 1
