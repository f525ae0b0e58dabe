"""FR2, a driven slider-crank whose pins and guide rub under their own reactions; Newton on the closed equations."""

import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs

CASE = json.loads((Path(__file__).parent / "FR2_slider_crank_reaction_friction.json").read_text(encoding="utf-8"))
VALUES = {row["quantity"]: (row["value"], row["tol"]) for row in CASE["outputs"]}
CRANK, ROD, SPEED, MU = 0.1, 0.3, 20.0, 0.12


def slider_crank(mu=MU, like=None):
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    b.body("crank", mass=1e-9, inertia=(1e-12, 1e-12, 1e-12))
    b.body("rod", mass=1.0, com=(0.12, 0, 0), inertia=(1e-4, 0.01, 0.01))
    b.body("slider", mass=2.0, inertia=(1e-3, 1e-3, 1e-3))
    b.joint("A", mbs.Revolute("z"), "ground", "crank", drive=mbs.Ramp(0.0, SPEED))
    b.joint("B", mbs.Revolute("z"), "crank", "rod", parent_frame=(CRANK, 0, 0))
    b.joint("guide", mbs.Prismatic("x"), "ground", "slider")
    # a plane loop has redundant rows, which leave the force of the guide across the plane open, with a ball here too
    b.joint("C", mbs.Revolute("z"), "rod", "slider", parent_frame=(ROD, 0, 0))
    b.force("load", mbs.Force((-400.0, 0, 0)), on="slider")
    for name, radius in (("A", 0.02), ("B", 0.015), ("C", 0.012), ("guide", None)):
        b.friction(f"friction {name}", name, mbs.friction.SmoothCoulomb(mu, transition_speed=0.01), radius=radius)
    return b.build(like=like)


def loads(mu, system, angle):
    """Torque of the drive, loads of pins and guide, its friction, and True where only the guide's load is open."""
    system, lean = slider_crank(mu, system), -jnp.arcsin(CRANK * jnp.sin(angle) / ROD)
    guess = {"A": angle, "B": lean - angle, "guide": CRANK * jnp.cos(angle) + ROD * jnp.cos(lean)}
    state = mbs.State.at(system, t=angle / SPEED, guess=guess)
    found = mbs.reactions(system, state)
    rub = mbs.dynamics.joint_friction(system, state)
    forces = jnp.stack(
        [jnp.linalg.norm(found["A"].force), jnp.linalg.norm(found["C"].force), found["guide"].force[1]]
    )
    unique = jnp.all(jnp.stack([rub.unique[name] for name in "ABC"])) & ~rub.unique["guide"] & found.ok
    return found["A"].effort[0], (forces, rub.efforts["guide"][0], unique)


@pytest.mark.long
def test_every_row_of_the_case():
    system = slider_crank()
    with_slope = mbs.jit(jax.value_and_grad(loads, has_aux=True))
    for degrees in range(15, 360, 30):
        (torque, (forces, rub, unique)), slope = with_slope(MU, system, np.deg2rad(degrees))
        plain, _ = with_slope(0.0, system, np.deg2rad(degrees))[0]
        found = {
            "driving torque N m": torque,
            "driving torque without friction N m": plain,
            "|force| of pin A = of pin B N": forces[0],
            "|force| of pin C N": forces[1],
            "guide force y on the slider N": forces[2],
            "guide friction on the slider N": rub,
            "d torque / d mu N m": slope,
        }
        assert unique
        for name, value in found.items():
            expected, tolerance = VALUES[f"crank {degrees} deg: {name}"]
            assert value == pytest.approx(expected, abs=tolerance), (degrees, name)
