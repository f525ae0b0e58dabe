"""Loads that are asked for by name: what they show of their times."""

import jax.numpy as jnp

from jaxmbs.reaction._result import DriveLoad, JointReaction, LawForce, Reactions, RowLoad


def test_a_load_of_one_name_says_its_times():
    """Extremes are at a time in seconds, as in the table of all loads."""
    ts, known = jnp.array([0.0, 0.25, 0.5]), jnp.ones((3, 3), bool)
    force, effort = jnp.zeros((3, 3)), jnp.array([[1.0], [7.0], [3.0]])
    joint = JointReaction(force, force, effort, effort, known, known)
    law, drive = LawForce(effort, None, None), DriveLoad(effort, known[:, :1])
    row = RowLoad(effort, {"a": effort}, known[:, :1])
    loads = Reactions(
        {"a": joint}, effort, jnp.zeros(3), known[:, 0], laws={"b": law}, rows={"c": row}, drives={"a": drive}, t=ts
    )
    for load in (loads["a"], loads.law("b"), loads.drive("a"), loads.row("c")):
        assert "0.25 s" in str(load) and "instant" not in str(load)
        assert load.to_pandas().index.name == "time" or "time" in load.to_xarray().dims
