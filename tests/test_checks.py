"""Names that are not there: the question is at fault, not the model, and the near ones are told."""

import pytest

import jaxmbs as mbs
from jaxmbs.checks import no_such, place_of
from tests.models import four_bar, four_bar_state


@pytest.fixture(scope="module")
def bars():
    system = four_bar()
    return system, four_bar_state(system)


QUESTIONS = {
    "position": lambda system, state: mbs.position(system, state, "cranc"),
    "linearise": lambda system, state: mbs.linearise(system, state, inputs=["cranc"]),
    "reactions": lambda system, state: mbs.reactions(system, state)["cranc"],
    "compliance": lambda system, state: mbs.reactions(system, state, compliance={"cranc": 1.0}),
    "bond graph": lambda system, state: mbs.bondgraph.bond_graph(system)["cranc"],
    "network": lambda system, state: mbs.statics.bond_reactions(*mbs.reaction.reaction_bonds(system, state))["cranc"],
    "elastic body": lambda system, state: mbs.flexible.deformations(system, state, "cranc"),
}


@pytest.mark.long
@pytest.mark.parametrize("question", QUESTIONS)
def test_the_question_is_at_fault(bars, question):
    with pytest.raises(mbs.UnknownNameError, match="cranc") as caught:
        QUESTIONS[question](*bars)
    assert isinstance(caught.value, ValueError) and isinstance(caught.value, KeyError)


def test_near_names_are_told():
    assert no_such("joint", "pinn", ["pin", "slider"]) == "there is no joint 'pinn': did you mean 'pin'?"
    assert no_such("joint", "x", ["pin", "slider"]) == "there is no joint 'x'; there are: pin, slider"
    assert no_such("joint", 7, []) == "there is no joint 7; there are: none"
    assert place_of("joint", "slider", ["pin", "slider"]) == 1
