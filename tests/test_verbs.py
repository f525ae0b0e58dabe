"""Verbs of either noun: the call that a type checker and `help` see is the call of the function behind it."""

import ast
import inspect

import pytest

import jaxmbs as mbs
from jaxmbs.coupling import MeasuredNetwork
from jaxmbs.verbs import _check, _equilibrium, _frequency_response, _modes, _reactions, _simulate

VERBS = {
    "check": (_check.describe, _check.linear_check),
    "equilibrium": (_equilibrium.mechanism_equilibrium, _equilibrium.linear_equilibrium),
    "frequency_response": (
        _frequency_response.mechanism_response,
        _frequency_response.linear_response,
        MeasuredNetwork.frequency_response,
    ),
    "modes": (_modes.mechanism_modes, _modes.linear_modes),
    "reactions": (_reactions.mechanism_reactions, _reactions.network_reactions, MeasuredNetwork.reactions),
    "simulate": (_simulate.mechanism_simulate, _simulate.linear_simulate),
}
FILES = (_check, _equilibrium, _frequency_response, _modes, _reactions, _simulate)
WRITTEN = [node for file in FILES for node in ast.parse(inspect.getsource(file)).body]


def _parameters(function):
    return {p.name: p.default for p in inspect.signature(function).parameters.values()}


def _overload(node):
    """Parameters and defaults of an overload as it is written."""
    args = [*node.args.posonlyargs, *node.args.args]
    defaults = [inspect.Parameter.empty] * (len(args) - len(node.args.defaults)) + node.args.defaults
    pairs = [*zip(args, defaults, strict=True), *zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True)]
    rest = {node.args.kwarg.arg: inspect.Parameter.empty} if node.args.kwarg else {}
    return {
        a.arg: ast.literal_eval(d) if isinstance(d, ast.AST) else inspect.Parameter.empty for a, d in pairs
    } | rest


def _without_first(parameters):
    return list(parameters.items())[1:]


@pytest.mark.parametrize("name", VERBS)
def test_overloads_are_the_calls_of_the_implementations(name):
    written = [n for n in WRITTEN if isinstance(n, ast.FunctionDef) and n.name == name and len(n.body) == 1]
    found = [_without_first(_overload(n)) for n in written if ast.unparse(n.body[0]) == "..."]
    assert found == [_without_first(_parameters(f)) for f in VERBS[name]]


@pytest.mark.parametrize("name", VERBS)
def test_help_is_of_both_nouns(name):
    text = inspect.getdoc(getattr(mbs, name))
    assert all(inspect.getdoc(function) in text for function in VERBS[name])
    assert all(parameter in text for function in VERBS[name] for parameter in list(_parameters(function))[1:])
