"""Internal states that may rest at any value: those whose rates vanish at rest, whatever they are."""

import inspect

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import contact as C
from jaxmbs import forces as F
from jaxmbs.friction import LuGre
from tests.forces.test_element_bonds import CYLINDER, SIZES

# a sphere pressed 0.01 m into a plane, at rest
TOUCHING = tuple(jnp.asarray(x) for x in (np.eye(3), np.array([0.0, 0.0, 0.09]), np.zeros(3), np.zeros(3)))
LAWS = {  # a law, the motion at rest, and the states that may rest at any value
    "Maxwell": (F.Maxwell(300.0, 20.0), ()),
    "Zener": (F.Zener(300.0, 20.0, 50.0, 0.1), ()),
    "Prony": (F.Prony(10.0, [50.0, 30.0], [0.1, 0.5]), ()),
    "PronyBushing": (F.PronyBushing((1e3, 10.0), [(5e2, 5.0)], [0.1]), ()),
    "FrictionForce": (F.FrictionForce(LuGre(0.3, 1e3, 5.0, 0.3), 10.0, 0.2), ("bristle",)),
    "ElastoPlastic": (F.ElastoPlastic(200.0, 4.0, 0.1), ("elastic",)),
    "Motor": (F.Motor(12.0, 1.5, 0.05, 0.3), ()),
    "HydraulicCylinder": (F.HydraulicCylinder(*SIZES, 0.1, **(CYLINDER | {"supply": 2e5})), ()),
    "Contact": (
        C.Contact(C.SphereOnPlane(0.1), C.HuntCrossley(1e5), LuGre(0.3, 1e3)),
        ("bristle",),
    ),
    "a shut cylinder": (F.HydraulicCylinder(*SIZES, 0.0, **(CYLINDER | {"leakage": 1e-9})), ("p0", "p1")),
}


def test_every_law_with_states_is_here():
    rooms = [vars(room).values() for room in (F, C) if [getattr(room, name) for name in room.__all__]]
    found = {law.__name__ for room in rooms for law in room if inspect.isclass(law)}
    kinds = {n: getattr(F, n, None) or getattr(C, n) for n in found}
    kinds = {n: kind for n, kind in kinds.items() if issubclass(kind, F.AbstractLaw)}
    laws = {n for n, kind in kinds.items() if kind.internal_states is not F.AbstractLaw.internal_states}
    of_their_law = {"PathForce"}  # which has the states of the law over its path
    assert {name for name in laws if not name.startswith("Abstract")} - of_their_law <= set(LAWS)


@pytest.mark.parametrize("name", LAWS)
def test_states_that_hold_have_no_rate_at_rest(name):
    law, holds = LAWS[name]
    assert law.holds == holds
    is_pose = isinstance(law, F.AbstractPoseLaw)
    rest = TOUCHING if is_pose else (jnp.asarray(0.4), jnp.asarray(0.0))
    rng = np.random.default_rng(1)
    s = {
        key: jnp.asarray(np.asarray(one.scale) * rng.uniform(0.1, 0.5, one.shape))
        for key, one in law.internal_states.items()
    }
    if name == "Contact":
        s["bristle"] = s["bristle"].at[..., 2].set(0.0)
    if name == "a shut cylinder":
        s["p1"] = s["p0"]  # leakage has made both equal
    rates = mbs.jit(lambda rest, s: law.rate(*rest, s, 0.0))(rest, s)
    still = tuple(key for key, rate in rates.items() if np.all(np.abs(rate) <= 1e-9 * np.abs(s[key]).max()))
    assert still == holds


@pytest.mark.long
def test_a_search_that_fails_names_them():
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("block", 1.0)
    b.joint("lift", mbs.Prismatic("z"), "ground", "block")
    b.force("brake", F.FrictionForce(LuGre(0.3, 1e3), 10.0), joint="lift")
    system = b.build()
    with pytest.raises(mbs.SimulationError, match="nothing holds|brake.bristle"):
        mbs.equilibrium(system, mbs.State.at(system))


def hung(law):
    """A block of 1 kg on a vertical slide, with a law."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    b.body("block", 1.0)
    b.joint("lift", mbs.Prismatic("z"), "ground", "block")
    b.force("brake", law, joint="lift")
    return b.build()


@pytest.mark.parametrize(
    ("law", "holds", "slips"),
    [
        pytest.param(lambda load: F.FrictionForce(LuGre(0.3, 1e5), load), 33.0, 32.0, marks=pytest.mark.slow),
        pytest.param(lambda force: F.ElastoPlastic(1e4, force), 9.9, 9.7, marks=pytest.mark.long),
    ],
    ids=["bristles", "metal"],
)
def test_nothing_rests_beyond_what_holds_it(law, holds, slips):
    """Above the breakaway load of 9.81 N / 0.3, and the yield force of 9.81 N: below there is no rest, though the
    states might balance."""
    system, state = hung(law(holds)), mbs.State.at(hung(law(holds)))
    assert mbs.equilibrium(system, state).ok
    with pytest.raises(mbs.SimulationError, match="no equilibrium"):
        mbs.equilibrium(hung(law(slips)), state)
    assert not mbs.jit(lambda state: mbs.equilibrium(hung(law(slips)), state, throw=False).ok)(state)
