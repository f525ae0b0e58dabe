"""Loads of bonds where stiff components hang on soft ones: right answers are ok, over many decades."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.coupling import connect, rigid_bond
from tests.structural_matrices import beam_element, component


def parts(stiffness):
    """Beams of unit length, one element each, in a row."""
    return [component(*map(jnp.asarray, beam_element(EI, 1.0, 1.0)), (0, 1, 2, 3)) for EI in stiffness]


def network(stiffness, linear_solver="dense"):
    ends = {"wall": (("near", 0),), "middle": (("near", 2), ("far", 0)), "seam": (("far", 2), ("end", 0))}
    bonds = {
        f"{name} {k}": rigid_bond(*(f"{c}.{row + k}" for c, row in tied))
        for name, tied in ends.items()
        for k in (0, 1)
    }
    return connect(
        dict(zip(("near", "far", "end"), parts(stiffness), strict=True)), bonds, linear_solver=linear_solver
    )


@pytest.mark.parametrize("decades", [0, 3, 5, 6, 7, 8])
@pytest.mark.parametrize("soft", [0, 1])
@pytest.mark.parametrize("linear_solver", ["dense", "multifrontal"])
def test_right_answers_are_ok(decades, soft, linear_solver):
    """A cantilever under a force at its end: shear 1 and moments 3, 2, 1 by statics."""
    stiffness = [10.0**decades] * 3
    stiffness[soft] = 1.0
    net = network(stiffness, linear_solver)
    rest = mbs.equilibrium(net, {"end.2": 1.0})
    loads = mbs.reactions(net, rest)
    exact = {"wall 0": -1.0, "middle 0": 1.0, "seam 0": 1.0, "wall 1": -3.0, "middle 1": 2.0, "seam 1": 1.0}
    for name, force in exact.items():
        np.testing.assert_allclose(loads[name].on_first, force, atol=max(1e-9, 10 * float(loads.rounding)))
    assert loads.ok
    other = dataclasses.replace(rest, displacement=rest.displacement.at[1].multiply(1.01))
    assert not mbs.reactions(net, other).ok  # no equilibrium


def test_no_digits_is_not_ok():
    """Over sixteen decades nothing is left of the small difference of large forces."""
    net = network([1.0, 1e16, 1e16])
    rest = mbs.linear.StaticResponse(
        jnp.asarray(np.linspace(0.1, 1.0, net.num_rows)), jnp.zeros(0), jnp.zeros((net.num_rows, 0))
    )
    assert not mbs.reactions(net, rest).ok
