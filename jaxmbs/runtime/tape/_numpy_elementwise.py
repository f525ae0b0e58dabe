"""Operations number by number, of the NumPy machine."""

from typing import Any

import numpy as np

from ._extremes import larger, smaller
from ._flatten import LONG_INTEGERS, UnsupportedError
from ._numpy_memory import binding
from ._opcodes import NAMES, OPERANDS


def whole(x: np.ndarray) -> np.ndarray:
    """Numbers as whole ones: 2^63, which no whole one is, stands for the largest."""
    found = np.clip(np.nan_to_num(x, nan=0.0), -(2.0**63), 2.0**63 - 1024).astype(np.int64)
    return np.where(x >= 2.0**63, np.iinfo(np.int64).max, found)


def _in_order(x):
    """Whole numbers in the order of all doubles: -NaN, -inf, ... -0, 0, ... inf, NaN."""
    bits = np.ascontiguousarray(x).view(np.int64)
    return np.where(bits < 0, np.iinfo(np.int64).max ^ bits, bits)


def _wrapped(x, bits):
    return x.astype({32: np.int32, -32: np.uint32}.get(bits, np.int64))


def _to_integer(x, low, high):
    return np.where(np.isnan(x), 0.0, np.trunc(np.clip(x, low, high)) + 0.0)


def _round_away(x):
    nearest = np.trunc(x)
    return np.where(np.abs(x - nearest) >= 0.5, nearest + np.copysign(1.0, x), nearest)


def _special(name):
    def function(x):
        from scipy import special

        return getattr(special, name)(x)

    return function


def _power(x, y):
    """By squares, as the machine in C."""
    left, result = abs(y), np.ones_like(x)
    while left:
        if left & 1:
            result = result * x
        x, left = x * x, left >> 1
    return 1.0 / result if y < 0 else result


#: Functions with a place for their result.
_UFUNCS: dict[str, Any] = {
    **{"COPY": np.positive, "NEG": np.negative, "SIN": np.sin, "COS": np.cos, "TAN": np.tan, "ASIN": np.arcsin},
    **{"ACOS": np.arccos, "ATAN": np.arctan, "SINH": np.sinh, "COSH": np.cosh, "TANH": np.tanh, "ASINH": np.arcsinh},
    **{"ACOSH": np.arccosh, "ATANH": np.arctanh, "SQRT": np.sqrt, "CBRT": np.cbrt, "EXP": np.exp, "EXP2": np.exp2},
    **{"EXPM1": np.expm1, "LOG": np.log, "LOG1P": np.log1p, "ABS": np.abs, "FLOOR": np.floor, "CEIL": np.ceil},
    **{"ROUND_EVEN": np.rint, "SQUARE": np.square},
    **{
        "ADD": np.add,
        "SUB": np.subtract,
        "MUL": np.multiply,
        "DIV": np.divide,
    },
    **{"POW": np.power, "REM": np.fmod, "ATAN2": np.arctan2, "NEXTAFTER": np.nextafter},
}
#: Functions whose result is copied.
_FUNCTIONS: dict[str, Any] = {
    "RSQRT": lambda x: 1.0 / np.sqrt(x),
    "LOGISTIC": lambda x: 1.0 / (1.0 + np.exp(-x)),
    "ERF": _special("erf"),
    "ERFC": _special("erfc"),
    "LGAMMA": lambda x: _special("gammaln")(np.where(x == -np.inf, np.inf, x)),
    "SIGN": lambda x: np.copysign(np.sign(x), x),
    "ROUND_AWAY": _round_away,
    "ISFINITE": np.isfinite,
    "SIGNBIT": np.signbit,
    "NOT": lambda x: x == 0.0,
    "TRUTH": lambda x: x != 0.0,
    "TO_INT32": lambda x: _to_integer(x, -(2.0**31), 2.0**31 - 1),
    "TO_INT64": lambda x: _to_integer(x, -(2.0**63), 2.0**63),
    "TO_UINT32": lambda x: _to_integer(x, 0.0, 2.0**32 - 1),
    "WRAP_INT32": lambda x: _wrapped(whole(x), 32),
    "WRAP_UINT32": lambda x: _wrapped(whole(x), -32),
    "EQ": np.equal,
    "NE": np.not_equal,
    "LT": np.less,
    "LE": np.less_equal,
    "GT": np.greater,
    "GE": np.greater_equal,
    "EQ_TO": lambda x, y: _in_order(x) == _in_order(y),
    "LT_TO": lambda x, y: _in_order(x) < _in_order(y),
    "LE_TO": lambda x, y: _in_order(x) <= _in_order(y),
    "MAX": larger,
    "MIN": smaller,
    "SELECT": lambda which, x, y: np.where(which != 0.0, y, x),
    "CLAMP": lambda low, x, high: smaller(larger(x, low), high),
}
#: Functions of whole numbers; they wrap round.
_WHOLE: dict[str, Any] = {
    "NOTBITS": np.invert,
    "AND": np.bitwise_and,
    "OR": np.bitwise_or,
    "XOR": np.bitwise_xor,
    "IADD": np.add,
    "ISUB": np.subtract,
    "IMUL": np.multiply,
    "IDIV": lambda x, y: _quotient(x, y),
    "IREM": lambda x, y: np.where(y == 0, x, np.where(y == -1, 0, np.fmod(x, np.where(y == 0, 1, y)))),
}


def _quotient(x, y):
    """Towards zero; what XLA has where the divisor is zero."""
    divisor = np.where((y == 0) | (y == -1), 1, y)
    found = (x - np.fmod(x, divisor)) // divisor
    return np.where(y == 0, -1, np.where(y == -1, -x, found))


def _store(out, function, *operands):
    out[...] = function(*operands)


@binding(*_UFUNCS, *_FUNCTIONS)
def _by_number(i, memory):
    name = NAMES[i.op]
    number = ("UNARY", "BINARY", "TERNARY").index(OPERANDS[i.op]) + 1
    operands = [memory.operand(i, operand) for operand in "abc"[:number]]
    out = memory.result(i)
    if name in _UFUNCS:
        return _UFUNCS[name], (*operands, out)
    return _store, (out, _FUNCTIONS[name], *operands)


@binding("POWER")
def _by_power(i, memory):
    return _store, (memory.result(i), lambda x: _power(x, i.x0), memory.operand(i, "a"))


@binding(*_WHOLE)
def _by_whole(i, memory):
    function = _WHOLE[NAMES[i.op]]
    operands = [memory.operand(i, name) for name in ("a" if OPERANDS[i.op] == "UNARY" else "ab")]

    def exactly(*numbers):
        found = function(*map(whole, numbers))
        if i.x0 == 64 and np.any((found > 2**53) | (found < -(2**53))):
            raise UnsupportedError(LONG_INTEGERS)
        return _wrapped(found, i.x0)

    return _store, (memory.result(i), exactly, *operands)
