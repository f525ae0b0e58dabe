"""The model file of the library: JSON that a person can read, exact in every number, without code in it."""

from ._files import load_model, save_model
from ._registry import register
from ._schema import model_schema

__all__ = ["load_model", "model_schema", "register", "save_model"]
