"""Errors carry what they found, and survive a trip between processes."""

import pickle

import pytest

from jaxmbs.errors import (
    AssemblyError,
    BatchError,
    ModelError,
    ModelFileError,
    SimulationError,
    UnknownNameError,
    printable,
)


def test_model_error_lists_every_fault():
    error = pickle.loads(pickle.dumps(ModelError(["no body", "no joint"])))
    assert error.faults == ["no body", "no joint"]
    assert str(error) == "the model has 2 faults:\n  1. no body\n  2. no joint"


def test_assembly_error_names_the_joints():
    error = pickle.loads(pickle.dumps(AssemblyError("loops stay open", {"wrist": 0.25})))
    assert error.residuals == {"wrist": 0.25}
    assert str(error) == "loops stay open\n  wrist: 0.25"


def test_simulation_error_keeps_the_motion():
    error = pickle.loads(pickle.dumps(SimulationError("step limit", motion=[1.0])))
    assert (str(error), error.motion) == ("step limit", [1.0])


def test_batch_error():
    error = pickle.loads(pickle.dumps(BatchError("interrupted", batch=[1.0])))
    assert error.batch == [1.0] and "interrupted" in str(error)


CONTROL = "a\x1b]0;owned\x07b\x9b31m\u202e\r\x08\u2028c"


@pytest.mark.parametrize(
    "error",
    [
        *(ModelError([CONTROL]), ModelFileError(CONTROL, ["x"]), UnknownNameError(CONTROL), AssemblyError(CONTROL)),
        *(AssemblyError("x", {CONTROL: 1.0}), SimulationError(CONTROL), BatchError(CONTROL)),
    ],
)
def test_names_do_not_steer_a_terminal(error):
    """Escape sequences, bells, carriage returns, reversed writing; letters of all languages stay."""
    for text in (str(error), str(pickle.loads(pickle.dumps(error)))):
        assert text.replace("\n", "").isprintable() and "\\x1b]0;owned\\x07b" in text
    assert printable("Größe\n\t机 \u00a0") == "Größe\n\t机 \u00a0"
