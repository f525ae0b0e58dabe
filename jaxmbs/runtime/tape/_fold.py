"""Operations on constants, done while a tape is written."""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np

from .. import _tuning as tuning
from ._extremes import larger, smaller
from ._flatten import LONG_INTEGERS, Operation, UnsupportedError, has_long_integers

_FUNCTIONS: dict[str, Callable] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "max": larger,
    "min": smaller,
    "and": np.bitwise_and,
    "or": np.bitwise_or,
    "eq": np.equal,
    "ne": np.not_equal,
    "lt": np.less,
    "le": np.less_equal,
    "gt": np.greater,
    "ge": np.greater_equal,
    "neg": np.negative,
    "abs": np.abs,
    "sqrt": np.sqrt,
    "copy": np.asarray,
    "copy_p": np.asarray,
    "stop_gradient": np.asarray,
}


def folded(operation: Operation, constants: list[np.ndarray]) -> np.ndarray | None:
    """The result of an operation on constants, or None if it is left to the machine.

    Raises: UnsupportedError for whole numbers that a double does not have.
    """
    if len(operation.outputs) != 1 or operation.outputs[0].size > tuning.FOLDED_CONSTANT:
        return None
    with np.errstate(all="ignore"):
        found = _evaluate(operation, constants)
    if found is None:
        return None
    found = np.asarray(found).astype(operation.outputs[0].dtype)
    if has_long_integers(found, found.dtype):
        raise UnsupportedError(LONG_INTEGERS)
    return found


def _evaluate(operation: Operation, constants: list[np.ndarray]) -> Any:
    name, params, out = operation.name, operation.params, operation.outputs[0]
    if name in _FUNCTIONS and params.get("out_dtype") is None:
        return _FUNCTIONS[name](*constants)
    if name == "div" and out.dtype.kind == "f":
        return np.divide(*constants)
    if name == "not" and out.dtype.kind == "b":
        return np.logical_not(*constants)
    if name == "convert_element_type" and (constants[0].dtype.kind in "biu" or out.dtype.kind in "bf"):
        return constants[0].astype(out.dtype)
    if name == "select_n" and len(constants) == 3:
        return np.where(*operator.itemgetter(0, 2, 1)(constants))
    if name in ("reshape", "squeeze", "expand_dims"):
        order = reshape_order(operation)
        return (constants[0] if order is None else np.transpose(constants[0], order)).reshape(out.shape)
    if name == "broadcast_in_dim":
        return np.broadcast_to(spread_axes(constants[0], params["broadcast_dimensions"], len(out.shape)), out.shape)
    if name == "concatenate":
        return np.concatenate(constants, params["dimension"])
    if name == "transpose":
        return np.transpose(constants[0], params["permutation"])
    if name == "iota":
        return iota(params["dimension"], out.shape)
    return None


def reshape_order(operation: Operation) -> tuple[int, ...] | None:
    """Order of the axes in which a reshape reads its operand, as `jnp.stack` of one array has it; None: their own."""
    return operation.params.get("dimensions") if operation.name == "reshape" else None


def spread_axes(array: np.ndarray, dimensions: Any, rank: int) -> np.ndarray:
    """An array of more axes, its own at `dimensions`, the others of length one."""
    shape = [1] * rank
    for axis, length in zip(dimensions, array.shape, strict=True):
        shape[axis] = length
    return array.reshape(shape)


def iota(dimension: int, shape: tuple[int, ...]) -> np.ndarray:
    """Numbers 0, 1, 2 ... along one axis."""
    return np.broadcast_to(spread_axes(np.arange(shape[dimension]), (dimension,), len(shape)), shape)
