"""What one process has asked is answered in the next one without a trace: questions on machines and structures."""

import pytest

import jaxmbs as mbs
from tests.zoo.test_tapes import QUESTIONS as OF_STRUCTURES
from tests.zoo.test_tapes import SPRINGS

from .test_jit_called_twice import QUESTIONS, begin, four_bar, motion
from .test_store import process, store  # noqa: F401  (fixtures)

MORE = {
    "inverse dynamics": lambda k: mbs.inverse_dynamics(four_bar(k), begin(four_bar(k), k), actuators=["A"]),
    "energy": lambda k: mbs.dynamics.kinetic_energy(*motion(k)),
    "bond powers": lambda k: mbs.bondgraph.bond_powers(*motion(k)),
    "second order kic": lambda k: mbs.constraints.kic_second(four_bar(k), begin(four_bar(k), k)),
}
MORE |= {name: lambda k, asked=asked: asked(k * SPRINGS) for name, asked in OF_STRUCTURES.items()}


@pytest.mark.slow
@pytest.mark.parametrize("question", [*QUESTIONS.values(), *MORE.values()], ids=[*QUESTIONS, *MORE])
def test_the_next_process_traces_nothing(question, process):  # noqa: F811
    process(lambda: question(1.0))
    assert process(lambda: question(1.01))[1] == 0
