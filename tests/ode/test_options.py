"""Every solver of diffrax either runs or is refused by name before anything is traced."""

import inspect

import diffrax
import numpy as np
import optimistix
import pytest

import jaxmbs as mbs
from tests.models import bar, four_bar

ORDINARY = set(
    "Bosh3 Dopri5 Dopri8 Euler HalfSolver Heun ImplicitEuler Kvaerno3 Kvaerno4 Kvaerno5 LeapfrogMidpoint Midpoint "
    "Ralston ReversibleHeun Tsit5".split()
)
FOUND = {
    name: value
    for name, value in vars(diffrax).items()
    if inspect.isclass(value)
    and issubclass(value, diffrax.AbstractSolver)
    and not inspect.isabstract(value)
    and not name.startswith("Abstract")
}


def make(name):
    if name == "ImplicitEuler":  # whose root finder has no tolerances at fixed steps
        return diffrax.ImplicitEuler(root_finder=optimistix.Newton(1e-10, 1e-10))
    return diffrax.HalfSolver(diffrax.Heun()) if name == "HalfSolver" else FOUND[name]()


@pytest.fixture(scope="module")
def swing():
    system = bar()
    return system, mbs.State.at(system, pin=0.3)


def test_every_ordinary_solver_is_there():
    assert set(FOUND) >= ORDINARY


@pytest.mark.parametrize("name", sorted(set(FOUND) - ORDINARY))
@pytest.mark.parametrize("loop", ["jaxmbs", "diffeqsolve"])
def test_solvers_of_other_equations_are_refused(swing, name, loop):
    words = "jaxmbs.ode.SemiImplicitEuler" if name == "SemiImplicitEuler" else f"{name} is for stochastic or split"
    with pytest.raises(ValueError, match=words):
        mbs.simulate(*swing, t1=0.1, dt=0.01, solver=make(name), loop=loop)


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(ORDINARY))
@pytest.mark.parametrize("loop", ["jaxmbs", "diffeqsolve"])
def test_solvers_of_ordinary_equations_run(swing, name, loop):
    exact = mbs.simulate(*swing, ts=[0.1]).end.coordinates
    motion = mbs.simulate(*swing, ts=[0.1], dt=0.001, solver=make(name), loop=loop)
    np.testing.assert_allclose(motion.end.coordinates, exact, atol=1e-3)


@pytest.mark.parametrize("name", ["LeapfrogMidpoint", "ReversibleHeun"])
def test_solvers_with_a_second_state_are_refused_where_it_would_not_move(swing, name):
    system = four_bar()
    with pytest.raises(ValueError, match=f"{name} keeps a second state.*the projection"):
        mbs.simulate(system, mbs.State.at(system, A=0.6), t1=0.1, dt=0.01, solver=make(name))
    event = mbs.motion.Event(lambda s: s.coordinates[0], lambda s: s)
    with pytest.raises(ValueError, match=f"{name} keeps a second state.*the action"):
        mbs.simulate(*swing, t1=0.1, dt=0.01, solver=make(name), event=event)


@pytest.mark.parametrize("name", ["Euler", "LeapfrogMidpoint"])
def test_solvers_without_an_error_need_fixed_steps(swing, name):
    with pytest.raises(ValueError, match=f"{name} has no error estimate: give dt="):
        mbs.simulate(*swing, t1=0.1, solver=make(name))
