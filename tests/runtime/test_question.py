"""What is told of programs names what the user asked."""

import jax.numpy as jnp

import jaxmbs as mbs
from jaxmbs.runtime._question import current_question, name_of, question


def test_the_outermost_question_is_named():
    assert current_question() == ""
    with question("minimise"):
        with question("simulate"):
            assert current_question() == "minimise"
        assert current_question() == "minimise"
    assert current_question() == ""


def test_verbs_and_functions_of_the_user_are_named():
    names = []

    def law(x, v, t):
        names.append(current_question())
        return -2.0 * x

    b = mbs.SystemBuilder()
    b.body("bob", 1.0, (0.1, 0.0, 0.0))
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    b.force("spring", mbs.Actuator(law), joint="pin")
    system = b.build()
    state = mbs.State.at(system, pin=0.3)
    names.clear()
    mbs.forward_dynamics(system, state)
    assert set(names) == {"forward_dynamics"}
    mbs.jit(lambda x: names.append(current_question()) or 2.0 * x)(jnp.ones(2))
    assert names[-1].startswith("the lambda in test_question.py, line ")
    assert name_of(law) == "law"


def test_an_error_ends_the_question():
    try:
        with question("modes"):
            raise ValueError
    except ValueError:
        assert current_question() == ""
