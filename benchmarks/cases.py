"""The mechanisms of the reference cases, from the tests: `models.chain_10()` and so on."""

import importlib.util
from pathlib import Path

_FILE = Path(__file__).parent.parent / "tests" / "cases" / "models.py"


def load(file=_FILE):
    """The module of the models, by its path: the tests are not installed."""
    spec = importlib.util.spec_from_file_location("case_models", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


models = load()
