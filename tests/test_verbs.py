"""Verbs of either noun: `help` shows the call of each function behind one; `test_typing.py` has what types see."""

import inspect

import pytest

import jaxmbs as mbs
from jaxmbs.coupling import MeasuredNetwork
from jaxmbs.verbs import _check, _equilibrium, _frequency_response, _modes, _random_response, _reactions, _simulate

VERBS = {
    "check": (_check.describe, _check.linear_check),
    "equilibrium": (_equilibrium.mechanism_equilibrium, _equilibrium.linear_equilibrium),
    "frequency_response": (
        _frequency_response.mechanism_response,
        _frequency_response.linear_response,
        MeasuredNetwork.frequency_response,
    ),
    "modes": (_modes.mechanism_modes, _modes.linear_modes),
    "random_response": (
        _random_response.random_response_of_mechanism,
        _random_response.linear_random,
        _random_response.random_response_of_measured,
    ),
    "reactions": (_reactions.mechanism_reactions, _reactions.network_reactions, MeasuredNetwork.reactions),
    "simulate": (_simulate.mechanism_simulate, _simulate.linear_simulate),
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
