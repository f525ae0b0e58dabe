"""A06: loads of long rows of four-bars, every loop closed by a spatial pin, so that three rows of each are redundant;
closed form."""

import json
from pathlib import Path

import numpy as np
import pytest

import jaxmbs as mbs

from .models import n_four_bar
from .reading import check

CASE = json.loads((Path(__file__).parent / "A06_four_bar_row_loads.json").read_text())


@pytest.mark.parametrize(
    "n, method",
    [
        pytest.param(40, "dense", marks=pytest.mark.long),
        pytest.param(40, "block-sparse", marks=pytest.mark.long),
        pytest.param(160, "dense", marks=pytest.mark.long),
        pytest.param(160, "block-sparse", marks=pytest.mark.long),
    ],
)
def test_loads_of_every_pin(n, method):
    system = n_four_bar(n)
    held = {f"A{i}": -0.3 for i in range(n + 1)}
    guess = {name: 0.3 for name in system.topology.joint_names if not name.startswith("A")}
    guess = {name: value for name, value in guess.items() if name not in system.topology.cut_joints}
    state = mbs.State.at(system, guess=guess | held, A0=-0.3, velocities={"A0": 1.0})
    loads = mbs.reactions(system, state, method=method)
    for output in (o for o in CASE["outputs"] if o["quantity"].startswith(f"N = {n}, pose b")):
        for ends, name in (
            ("ground on crank i", "A{}"),
            ("crank i on coupler", "left_{}"),
            ("crank i+1 on coupler", "right_{}"),
        ):
            if ends in output["quantity"]:
                sign = -1.0 if name == "right_{}" else 1.0  # declared from the coupler to the crank
                found = [sign * loads[name.format(i)].force[:2] for i in output["value"]]
                check(found, list(output["value"].values()), output["tol"])
    for _, load in loads.items():
        np.testing.assert_allclose(np.asarray(load.moment)[2], 0.0, atol=1e-9)  # a free hinge
        assert load.unique_force[:2].all()
