"""What results show of themselves: short tables, and shapes where numbers are not known."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.assembly._state import State
from jaxmbs.motion import Diagnostics
from jaxmbs.reaction import JointReaction, Reactions
from jaxmbs.statics._indeterminacy import Redundancy
from jaxmbs.statics._network import BodyNetwork
from jaxmbs.tables import aligned, shortened
from tests.models import pendulum


def motion():
    ts, zeros = jnp.linspace(0.0, 2.0, 5), jnp.zeros(5)
    structure = (("pin", "Revolute", 1, 1, ("angle",)), ("ball", "Spherical", 4, 3, ("w", "x", "y", "z")))
    psi = jnp.concatenate([jnp.sin(ts)[:, None], jnp.tile(jnp.eye(4)[0], (5, 1))], axis=1)
    states = State(ts, psi, jnp.zeros((5, 4)), zeros, structure)
    accounts = Diagnostics(zeros, zeros, {}, zeros + 2e-9, zeros, zeros, jnp.asarray(17), jnp.asarray(0))
    end = jax.tree.map(lambda x: x[-1], states)
    return mbs.Motion(ts, states, jnp.asarray(0), accounts, end)


def loads():
    wave = jnp.linspace(0.0, 1.0, 5)[:, None] * jnp.array([[3.0, 4.0, 0.0]])
    none, every = jnp.zeros((5, 0)), jnp.ones((5, 3), bool)
    one = JointReaction(wave, 0.1 * wave, none, none, every.at[:, 2].set(False), every)
    return Reactions({"pin": one, "seam": one}, jnp.zeros((5, 0)), jnp.zeros(5), jnp.ones(5, bool), ("seam",))


def redundancy():
    network = BodyNetwork.from_names(("one",), {"a": ("ground", "one"), "b": ("ground", "one")})
    return Redundancy(network, 5, 1, 0, ((False,) * 6, (True, *(False,) * 5)), None, "svd")


def modes():
    roots = jnp.array([-0.1 + 6.2j, -0.1 - 6.2j, 0.0 + 0.0j])
    return mbs.vibration.Modes(jnp.abs(roots) ** 2, jnp.eye(3, dtype=complex), roots == 0, roots)


MADE = [motion, loads, modes, redundancy, pendulum]


@pytest.mark.parametrize("made", MADE)
def test_it_is_short(made):
    shown = repr(made())
    assert shown.startswith(type(made()).__name__) and len(shown.splitlines()) < 12 and len(shown) < 700
    html = made()._repr_html_()
    assert "<table>" in html and "Array(" not in shown + html


def test_numbers_are_those_of_the_result():
    (pin,) = [line.split() for line in repr(motion()).splitlines() if line.startswith("pin")]
    assert pin == ["pin", "0", "0.9093", "0", "0.9975", "rad"]
    assert "ball rz" in repr(motion()) and "success" in repr(motion())
    (row,) = [line.split() for line in repr(loads()).splitlines() if line.startswith("pin")]
    assert row == ["pin", "5", "0.5", "-", "force", "z"] and "seam" not in repr(loads())
    pair, rigid = repr(modes()).splitlines()[2:]
    assert pair.split()[:4] == ["0,", "1", "0.9869", "0.01613"] and rigid.split()[-1] == "rigid"
    assert repr(redundancy()).splitlines()[-1].split() == ["b", "force", "x"]
    assert "1 bodies, 1 joints" in repr(pendulum())


@pytest.mark.parametrize("made", [motion, loads, modes, pendulum])
def test_traced_and_batched_ones_show_shapes(made):
    seen = []

    def look(value):
        seen.extend([repr(value), value._repr_html_()])
        return 0.0

    jax.make_jaxpr(look)(made())
    batch = jax.tree.map(lambda x: jnp.stack([x, x]), made())
    seen.extend([repr(batch), batch._repr_html_()])
    assert all(seen)
    if made is not pendulum:
        assert "f64[5" in seen[0] or "c128[3" in seen[0]


def test_half_made_values_show_something():
    broken = motion()
    object.__setattr__(broken, "diagnostics", None)
    assert "Motion" in repr(broken) and "Motion" in broken._repr_html_()


def test_many_rows_are_cut():
    rows = [("name", "x"), *((f"row {k}", str(k)) for k in range(100))]
    text = aligned(shortened(rows)).splitlines()
    assert len(text) == 14 and text[-1] == "... 88 more" and text[1].endswith(" 0")
    assert shortened(rows[:14]) == rows[:14]
    assert np.all([len(line) <= len(text[0]) + 8 for line in text])
