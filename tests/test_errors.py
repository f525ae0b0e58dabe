"""Errors carry what they found, and survive a trip between processes."""

import pickle

from jaxmbs.errors import AssemblyError, BatchError, ModelError, SimulationError


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
