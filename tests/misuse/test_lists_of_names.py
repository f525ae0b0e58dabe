"""Lists of names: a name given twice, and one text in place of a list, are refused by every question of them."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import experiment, linear, reductions
from jaxmbs.checks import distinct_names, repeated
from jaxmbs.errors import ModelError
from jaxmbs.qualification import Recovery
from jaxmbs.qualification._outputs import named_outputs

from .zoo import Zoo

ZOO = Zoo()


def test_repetitions_in_the_order_of_the_list():
    assert repeated(["b", "a", "b", "c", "a"]) == ["b", "a"]
    assert repeated([["x", "y"], ["x", "y"], ["z"]]) == [["x", "y"]]  # no hashes
    assert distinct_names("names", iter("ab")) == ("a", "b")


def pair():
    return mbs.LinearSystem(mass=np.eye(2), stiffness=2.0 * np.eye(2), coordinates=["a", "b"])


def measured():
    return linear.TransferFunctions([1.0], np.ones((1, 2, 2)), ["a", "b"], ["a", "b"])


#: Questions of a list of names that are there, "a" and "b".
QUESTIONS = {
    "frequency_response into": lambda names: mbs.frequency_response(pair(), [1.0], into=names, out=["a"]),
    "frequency_response out": lambda names: mbs.frequency_response(pair(), [1.0], into=["a"], out=names),
    "LinearSystem interface": lambda names: mbs.LinearSystem(
        mass=np.eye(2), stiffness=np.eye(2), coordinates=["a", "b"], interface=names
    ),
    "LinearSystem coordinates": lambda names: mbs.LinearSystem(
        mass=np.eye(len(names)), stiffness=np.eye(len(names)), coordinates=names
    ),
    "TransferFunctions outputs": lambda names: linear.TransferFunctions(
        [1.0], np.ones((1, len(names), 1)), names, ["a"]
    ),
    "TransferFunctions.at": lambda names: measured().at(names),
    "remove_stiffness": lambda names: experiment.remove_stiffness(
        measured(), names, jnp.ones((1, len(names), len(names)))
    ),
    "support_motions": lambda names: reductions.support_motions(pair(), names),
    "Mirror nodes": lambda names: reductions.Mirror("x", names),
    "random outputs": lambda names: named_outputs(list(names) * (1 + (names == "ab"))),
    "Recovery labels": lambda names: Recovery(jnp.ones((2, 2)), names),
    "FramePath hold": lambda names: mbs.joints.FramePath((0.0, 0.0, 0.0), None, names),
    "modes at": lambda names: mbs.modes(pair()).at(*names, "a"),
}
MECHANISM = {
    "inverse_dynamics": lambda names: mbs.inverse_dynamics(ZOO.hanging, ZOO.near_rest, np.zeros(1), actuators=names),
    "reactions": lambda names: mbs.reactions(ZOO.hanging, ZOO.near_rest, accelerations=np.zeros(1), actuators=names),
    "impending_motion": lambda names: mbs.analysis.impending_motion(ZOO.rubbing, ZOO.near_rest, names),
    "equilibrium moving": lambda names: mbs.equilibrium(ZOO.hanging, ZOO.near_rest, moving=names),
    "linearise inputs": lambda names: mbs.linearise(ZOO.hanging, ZOO.near_rest, inputs=names),
    "linearise outputs": lambda names: mbs.linearise(ZOO.hanging, ZOO.near_rest, outputs=names),
    "linearise loads": lambda names: mbs.linearise(ZOO.hanging, ZOO.near_rest, loads=names),
    "vector_field outputs": lambda names: mbs.motion.vector_field(ZOO.hanging, outputs=names),
    "as_block outputs": lambda names: mbs.adapters.as_block(ZOO.hanging, [], names),
}


@pytest.mark.parametrize("names", [["a", "b", "a"], "ab"], ids=["twice", "letters"])
@pytest.mark.parametrize("question", QUESTIONS)
def test_of_linear_systems(question, names):
    with pytest.raises(ValueError, match="twice|in a list"):
        QUESTIONS[question](names)


@pytest.mark.parametrize("names", [["pin", "pin"], "pin"], ids=["twice", "letters"])
@pytest.mark.parametrize("question", MECHANISM)
def test_of_mechanisms(question, names):
    with pytest.raises(ModelError, match="twice|in a list"):
        MECHANISM[question](names)


def test_a_name_given_twice_halves_no_effort():
    """The effort that holds a pendulum, given once; twice it is refused."""
    (effort,) = mbs.inverse_dynamics(ZOO.hanging, ZOO.near_rest, np.zeros(1), actuators=["pin"]).efforts.values()
    np.testing.assert_allclose(effort, 9.81 * 0.5 * np.cos(-1.25), rtol=1e-12)
