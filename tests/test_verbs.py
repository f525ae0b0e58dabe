"""Verbs of either noun: the call that a type checker and `help` see is the call of the function behind it."""

import ast
import inspect

import pytest

import jaxmbs as mbs
from jaxmbs import verbs
from jaxmbs.coupling import MeasuredNetwork

VERBS = {
    "check": (verbs.describe, verbs.linear_check),
    "equilibrium": (verbs.mechanism_equilibrium, verbs.linear_equilibrium),
    "frequency_response": (
        verbs.mechanism_response,
        verbs.linear_response,
        MeasuredNetwork.frequency_response,
    ),
    "modes": (verbs.mechanism_modes, verbs.linear_modes),
    "reactions": (verbs.mechanism_reactions, verbs.network_reactions, MeasuredNetwork.reactions),
    "simulate": (verbs.mechanism_simulate, verbs.linear_simulate),
}


TREE = ast.parse(inspect.getsource(verbs))


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
    written = [n for n in TREE.body if isinstance(n, ast.FunctionDef) and n.name == name and len(n.body) == 1]
    found = [_without_first(_overload(n)) for n in written if ast.unparse(n.body[0]) == "..."]
    assert found == [_without_first(_parameters(f)) for f in VERBS[name]]


@pytest.mark.parametrize("name", VERBS)
def test_help_is_of_both_nouns(name):
    text = inspect.getdoc(getattr(mbs, name))
    assert all(inspect.getdoc(function) in text for function in VERBS[name])
    assert all(parameter in text for function in VERBS[name] for parameter in list(_parameters(function))[1:])
