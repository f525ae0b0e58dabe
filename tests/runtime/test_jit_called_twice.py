"""A question asked again compiles nothing and traces nothing: with the model built again, a lambda typed again."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.forces import Attachment, Sheave
from jaxmbs.runtime import _tape_program, tuning
from tests.compilations import compiled
from tests.models import four_bar_builder


def four_bar(k=1.0, like=None):
    b = four_bar_builder((1.0, 0.3 * k, 0.9, 0.7))
    b.force("spring", mbs.SpringDamper(stiffness=30.0, damping=1.0), joint="D")
    return b.build(like=like)


def begin(system, k=1.0):
    return mbs.State.at(system, A=0.7 * k, velocities={"A": 1.0}, guess={"B": -0.2, "D": 1.2})


def motion(k):
    system = four_bar(k)
    return system, mbs.simulate(system, begin(system, k), t1=0.1)


def at_rest(k):
    system = four_bar(k)
    return system, mbs.equilibrium(system, begin(system, 0.9)).state


def crane():
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    for name, mass, x in (("hook", 800.0, 2.1), ("drum", 50.0, 2.4)):
        b.body(name, mass)
        b.joint(name, mbs.Prismatic("z"), "ground", name, parent_frame=(x, 0, -1.0))
    wheels = Sheave("hook", 0.1, side="-", axis="y"), Sheave(("ground", (2.3, 0, 0)), 0.1, side="+", axis="y")
    path = [Attachment(("ground", (2.0, 0, 0))), *wheels, Attachment("drum")]
    b.cable("hoist", path, stiffness=1e6, free_length=3.6, friction=0.05)
    return b.build()


def linear(k):
    stiffness = np.array([[3.0, -1.0], [-1.0, 2.0]])
    return mbs.linear.LinearSystem(mass=np.diag([1.0, 2.0]) * k, stiffness=stiffness, interface=[0])


def search(k):
    first = four_bar()

    def load(design):
        system = four_bar(design["crank"], like=first)
        return jnp.sum(mbs.reactions(system, begin(system))["A"].force ** 2)

    return mbs.minimise(load, {"crank": k}, {"crank": (0.9, 1.1)}, steps=2, progress=False)


def gradient(k):
    first = four_bar()

    def load(crank):
        system = four_bar(crank, like=first)
        return jnp.sum(mbs.reactions(system, begin(system))["A"].force ** 2)

    return mbs.jit(jax.grad(load))(jnp.asarray(k))


def peak(k):
    first, found = motion(1.0)
    return mbs.motion.peak(first, found, lambda state: jnp.sum(state.velocities**2))


QUESTIONS = {
    "build": four_bar,
    "state": lambda k: begin(four_bar(k), k),
    "simulate": motion,
    "simulate at times": lambda k: mbs.simulate(four_bar(k), begin(four_bar(k)), ts=np.linspace(0.0, 0.1, 4)),
    "reactions along": lambda k: mbs.reactions(*motion(k))["A"].force,
    "reactions": lambda k: mbs.reactions(four_bar(k), begin(four_bar(k)))["A"].force,
    "equilibrium": at_rest,
    "equilibrium from another": lambda k: mbs.equilibrium(*at_rest(k)),
    "linearise": lambda k: mbs.linearise(*at_rest(k)),
    "modes": lambda k: repr(mbs.modes(*at_rest(k))),
    "forward dynamics": lambda k: mbs.forward_dynamics(four_bar(k), begin(four_bar(k))),
    "saved state": lambda k: (motion(k)[1][-1], motion(k)[1][1:3]),
    "state between": lambda k: motion(k)[1].at(motion(k)[0], 0.05 * k),
    "peak": peak,
    "load peaks": lambda k: mbs.motion.load_peaks(*motion(k)),
    "validity": lambda k: mbs.dynamics.validity(*motion(k)),
    "stiffness": lambda k: mbs.stiffness(four_bar(k), begin(four_bar(k))),
    "kic": lambda k: mbs.constraints.kic(four_bar(k), begin(four_bar(k))),
    "mass matrix": lambda k: mbs.dynamics.mass_matrix(four_bar(k), begin(four_bar(k))),
    "cables": lambda k: mbs.dynamics.cable_states(crane(), mbs.State.at(crane(), velocities={"hook": 0.1 * k})),
    "minimise": search,
    "gradient": gradient,
    "function": lambda k: mbs.jit(lambda x: jnp.sin(x) * 2.0)(jnp.asarray(k)),
    "batch": lambda k: mbs.batch(lambda design: {"y": design["x"] ** 2}, {"x": np.arange(3.0) * k}, progress=False),
    "linear modes": lambda k: mbs.modes(linear(k)).frequencies,
    "linear response": lambda k: mbs.frequency_response(linear(k), np.array([1.0, 2.0]) * k, into=[0], out=[1]),
    "linear motion": lambda k: mbs.simulate(linear(k), ts=np.linspace(0.0, 1.0, 5)),
    "linear equilibrium": lambda k: mbs.equilibrium(linear(k), np.array([1.0, k])),
}


@pytest.mark.slow  # without the checks of types in the quick tests, whose wrappers have no content
@pytest.mark.parametrize("question", QUESTIONS.values(), ids=QUESTIONS)
def test_a_question_asked_again_makes_no_program(question, monkeypatch):
    traced, trace = [], _tape_program.TapeFunction._trace

    def counted(self, *args):
        traced.append(self)
        return trace(self, *args)

    monkeypatch.setattr(_tape_program.TapeFunction, "_trace", counted)
    monkeypatch.setattr(tuning, "EAGER_CALLS", 10**9)  # whatever other tests have called
    question(1.0)
    traced.clear()
    assert not compiled(lambda: question(1.01)) and not traced


def eager_programs(question):
    """Programs that XLA compiles for a question in a process that has asked nothing before."""
    jax.clear_caches()
    return len(compiled(lambda: question(1.0)))


#: Programs that XLA compiles at the first call: single operations outside of any program of the library's.
FIRST = {
    "build": 0,
    "state": 0,
    "simulate": 2,
    "reactions": 3,
    "equilibrium": 0,
    "linearise": 0,
    "saved state": 2,
    "state between": 2,
    "cables": 9,
    "batch": 0,
    "linear modes": 1,
    "linear equilibrium": 2,
    "linear motion": 4,
}


@pytest.mark.slow
@pytest.mark.parametrize("name, most", FIRST.items())
def test_the_first_answer_is_one_program(name, most):
    assert eager_programs(QUESTIONS[name]) <= most
