"""Rules of primitives that work number by number."""

import jax
import numpy as np

from ._flatten import Atom, Operation, UnsupportedError
from ._memory import Value
from ._rearrange import take
from ._writer import Writer, rule

_UNARY = {
    **{name: name.upper() for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")},
    **{name: name.upper() for name in ("asinh", "acosh", "atanh", "sqrt", "rsqrt", "cbrt", "exp", "exp2", "expm1")},
    **{name: name.upper() for name in ("log", "log1p", "logistic", "erf", "erfc", "lgamma", "sign")},
    **{name: name.upper() for name in ("floor", "ceil")},
    "is_finite": "ISFINITE",
    "signbit": "SIGNBIT",
}
_BINARY = {
    **{name: name.upper() for name in ("add", "sub", "mul", "div", "max", "min", "pow", "rem", "atan2", "nextafter")},
    **{name: name.upper() for name in ("eq", "ne", "lt", "le", "gt", "ge", "and", "or", "xor")},
    **{name: name.upper() for name in ("eq_to", "lt_to", "le_to")},
    "add_any": "ADD",
}
_OF_INTEGERS = {"ADD": "IADD", "SUB": "ISUB", "MUL": "IMUL", "DIV": "IDIV", "REM": "IREM"}
_OF_INTEGERS |= {name: name for name in ("AND", "OR", "XOR")}


@rule(*_UNARY)
def _unary(writer, operation, values):
    return [_write(writer, _UNARY[operation.name], operation, values)]


@rule(*_BINARY)
def _binary(writer, operation, values):
    op, kind = _BINARY[operation.name], operation.inputs[0].dtype
    if operation.params.get("out_dtype") not in (None, kind):
        raise UnsupportedError("products of another type")
    if kind.kind not in "iu" or op not in _OF_INTEGERS:
        return [_write(writer, op, operation, values)]
    return [_write(writer, _OF_INTEGERS[op], operation, values, x0=_bits(kind))]


def _bits(kind):
    """Number of bits of whole numbers, negative for those without sign."""
    return 8 * kind.itemsize * (-1 if kind.kind == "u" else 1)


@rule("neg", "abs")
def _signed(writer, operation, values):
    """Of whole numbers what is wrapped round: the least one stays as it is, and zero has no sign."""
    (x,) = operation.inputs
    if x.dtype.kind not in "iu":
        return [_write(writer, operation.name.upper(), operation, values)]
    zero, bits = np.zeros((), x.dtype), _bits(x.dtype)
    beside = writer.arena.constant(zero)
    two = operation._replace(inputs=[Atom(zero, zero), x])
    if operation.name == "neg":
        return [_write(writer, "ISUB", two, [beside, *values], x0=bits)]
    return [_write(writer, "IADD", two, [beside, _write(writer, "ABS", operation, values)], x0=bits)]


@rule("log2")
def _log2(writer, operation, values):
    """As XLA has it: the natural logarithm by that of two."""
    out = operation.outputs[0]
    two = np.asarray(np.log(2.0))
    found = _write(writer, "LOG", operation, values)
    return [
        _write(writer, "DIV", Operation("div", {}, [out, Atom(two, two)], [out]), [found, writer.arena.constant(two)])
    ]


@rule("square")
def _square(writer, operation, values):
    if operation.inputs[0].dtype.kind != "f":
        return [_whole_power(writer, operation, values[0], 2)]
    return [_write(writer, "SQUARE", operation, values)]


@rule("integer_pow")
def _integer_pow(writer, operation, values):
    y = operation.params["y"]
    if operation.inputs[0].dtype.kind != "f":
        if y < 1:
            raise UnsupportedError("powers of whole numbers below one")
        return [_whole_power(writer, operation, values[0], y)]
    return [_write(writer, *(("SQUARE",) if y == 2 else ("POWER",)), operation, values, x0=y)]


@rule("round")
def _round(writer, operation, values):
    op = "ROUND_EVEN" if int(operation.params["rounding_method"]) == 1 else "ROUND_AWAY"
    return [_write(writer, op, operation, values)]


@rule("not")
def _not(writer, operation, values):
    if operation.inputs[0].dtype.kind == "u":
        raise UnsupportedError("bits of whole numbers without sign")
    if operation.inputs[0].dtype == bool:
        return [_write(writer, "NOT", operation, values)]
    return [_write(writer, "NOTBITS", operation, values, x0=_bits(operation.inputs[0].dtype))]


@rule("convert_element_type")
def _convert(writer, operation, values):
    old, new = operation.inputs[0].dtype, operation.outputs[0].dtype
    if new.kind == "b" and old.kind != "b":
        op = "TRUTH"
    elif old.kind == "f" and new.kind in "iu":
        op = f"TO_{new.name.upper()}"
    elif old.kind in "iu" and new in (np.int32, np.uint32) and new != old:
        op = f"WRAP_{new.name.upper()}"
    else:
        return [Value(values[0].buffer, values[0].place, values[0].is_splat)]
    return [_write(writer, op, operation, values)]


@rule("select_n")
def _select(writer, operation, values):
    if len(values) == 2:
        return values[1:]
    if len(values) > 3:
        return [_among(writer, operation, values)]
    return [_write(writer, "SELECT", operation, values)]


def _among(writer, operation, values):
    """One of several cases, by whole numbers: each in turn takes the place of those before it."""
    which, out = operation.inputs[0], operation.outputs[0]
    truth = Atom(jax.ShapeDtypeStruct(which.shape, np.dtype(bool)))
    found = values[1]
    for k, value in enumerate(values[2:]):
        number = np.asarray(k)
        later = Operation("lt", {}, [Atom(number, number), which], [truth])
        is_later = _write(writer, "LT", later, [writer.arena.constant(number), values[0]])
        choice = Operation("select_n", {}, [truth, out, operation.inputs[k + 2]], [out])
        found = _write(writer, "SELECT", choice, [is_later, found, value])
    return found


def _whole_power(writer, operation, value, y):
    """Whole numbers times themselves, wrapped round."""
    kind = operation.inputs[0].dtype
    bits, found = _bits(kind), value
    for _ in range(y - 1):
        twice = operation._replace(inputs=[*operation.inputs, *operation.inputs])
        found = _write(writer, "IMUL", twice, [found, value], x0=bits)
    return found


@rule("clamp")
def _clamp(writer, operation, values):
    return [_write(writer, "CLAMP", operation, values)]


def _write(writer: Writer, op: str, operation: Operation, values: list[Value], **fields: int) -> Value:
    """An instruction of up to three operands; one number where all of them are."""
    out = operation.outputs[0]
    values = [_matched(writer, value, atom, out) for value, atom in zip(values, operation.inputs, strict=True)]
    is_splat = all(value.is_splat for value in values)
    result = writer.new(1 if is_splat else out.size)
    result.is_splat = is_splat
    places = dict(zip("abc", (value.place for value in values), strict=False))
    splat = sum(value.is_splat << k for k, value in enumerate(values))
    writer.emit(op, 1 if is_splat else out.size, out=result.place, splat=splat, **places, **fields)
    return result


def _matched(writer: Writer, value: Value, atom: Atom, out: Atom) -> Value:
    """An operand with axes of length one, spread over those of the result."""
    if value.is_splat or atom.shape == out.shape or not atom.shape:
        return value
    places = np.broadcast_to(np.arange(atom.size).reshape(atom.shape), out.shape)
    return take(writer, value, places, is_temporary=True)
