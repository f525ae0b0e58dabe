"""Verbs of either noun: `help` shows the call of each function behind one; `test_typing.py` has what types see."""

import copy
import inspect
import pickle
import pydoc

import pytest

import jaxmbs as mbs
from jaxmbs import analysis, coupling, linear, motion, qualification, reaction, vibration
from jaxmbs.verbs._check import describe

VERBS = {
    "check": (describe, linear.check),
    "equilibrium": (analysis.equilibrium, linear.equilibrium),
    "frequency_response": (
        analysis.frequency_response,
        vibration.frequency_response,
        coupling.MeasuredNetwork.frequency_response,
    ),
    "modes": (analysis.modes, vibration.modes),
    "random_response": (
        qualification._state_response.random_response_of_mechanism,
        qualification.random_response,
        qualification._state_response.random_response_of_measured,
    ),
    "reactions": (reaction.reactions, coupling.reactions, coupling.MeasuredNetwork.reactions),
    "simulate": (motion.simulate, vibration.simulate),
}


@pytest.mark.parametrize("name", VERBS)
def test_help_is_of_both_nouns(name):
    text = inspect.getdoc(getattr(mbs, name))
    assert all(inspect.getdoc(function) in text for function in VERBS[name])
    assert all(
        parameter in text
        for function in VERBS[name]
        for parameter in list(inspect.signature(function).parameters)[1:]
    )


@pytest.mark.parametrize("name", VERBS)
def test_signatures_show_the_arguments_of_every_noun_by_name(name):
    shown = inspect.signature(getattr(mbs, name)).parameters
    assert next(iter(shown)) == "system" and not any(p.annotation is not p.empty for p in shown.values())
    for function in VERBS[name]:
        for parameter in [*inspect.signature(function).parameters.values()][1:]:
            assert parameter.kind is parameter.VAR_KEYWORD or parameter.name in shown


def test_completion_of_simulate_shows_times():
    shown = str(inspect.signature(mbs.simulate))
    assert shown.startswith("(system, state=Ellipsis, t1=None, ts=None, dt=None, solver=None")


@pytest.mark.parametrize("name", VERBS)
def test_tools_of_python_take_verbs_as_functions(name):
    verb = getattr(mbs, name)
    assert inspect.isroutine(verb) and verb.__name__ == name and copy.deepcopy(verb) is verb
    assert pickle.loads(pickle.dumps(verb)) is verb
    text = pydoc.plain(pydoc.render_doc(verb))
    assert f"{name}(system" in text and inspect.getdoc(VERBS[name][1]).splitlines()[0] in text
