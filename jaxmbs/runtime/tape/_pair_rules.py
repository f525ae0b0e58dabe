"""Rules of primitives for pairs of real and imaginary parts."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
from jax import lax

from ._flatten import UnsupportedError
from ._pair import Pair, is_complex
from ._refusals import host

#: The rule of each primitive: of an equation and its arguments, the value or a list of values.
PAIR_RULES: dict[str, Callable[[Any, list], Any]] = {}
#: Operations that are done part by part.
_BY_PARTS = (
    *("reshape", "squeeze", "expand_dims", "broadcast_in_dim", "transpose", "slice", "rev", "concatenate", "pad"),
    *("dynamic_slice", "dynamic_update_slice", "gather", "scatter", "scatter-add", "scatter_add", "select_n", "neg"),
    *("reduce_sum", "cumsum", "add", "sub", "add_any", "copy", "copy_p", "stop_gradient", "optimization_barrier"),
    *("reverse_only", "name", "split", "stack", "tile", "unstack", "pvary", "xla_metadata_value", "nontraceable"),
    *("nonbatchable", "nondifferentiable_backward", "device_put"),
)


def rule(*names: str) -> Callable[[Callable], Callable]:
    """Register a rule."""

    def register(function):
        PAIR_RULES.update(dict.fromkeys(names, function))
        return function

    return register


@rule(*_BY_PARTS)
def _by_parts(equation, args):
    def part(k):
        params = dict(equation.params)
        if k and params.get("fill_value", 0) is None:
            params["fill_value"] = 0.0  # of what is filled in, NaN, the real part alone is
        elif params.get("fill_value") is not None:
            params["fill_value"] = float((np.real, np.imag)[k](params["fill_value"]))
        given = [x[k] if isinstance(x, Pair) else x for x in args]
        results = equation.primitive.bind(*given, **params)
        return results if equation.primitive.multiple_results else [results]

    outputs = zip(part(0), part(1), equation.outvars, strict=True)
    return [Pair(x, y) if is_complex(variable.aval) else x for x, y, variable in outputs]


@rule("empty", "empty2")
def _empty(equation, args):
    return Pair(*[np.zeros(equation.outvars[0].aval.shape)] * 2)


@rule("convert_element_type")
def _convert(equation, args):
    (x,) = args
    if is_complex(equation.outvars[0].aval):
        return x if isinstance(x, Pair) else _real(lax.convert_element_type(x, np.float64))
    return lax.convert_element_type(x.real, equation.params["new_dtype"])


def _real(x):
    return Pair(x, lax.full_like(x, 0.0))


@rule("complex")
def _complex(equation, args):
    return Pair(*(jnp.broadcast_to(x, equation.outvars[0].aval.shape) for x in args))


@rule("real")
def _real_part(equation, args):
    return args[0].real


@rule("imag")
def _imaginary_part(equation, args):
    return args[0].imag


@rule("conj")
def _conjugate(equation, args):
    (x,) = args
    return Pair(x.real, -x.imag) if isinstance(x, Pair) else _real(x)


@rule("mul")
def _mul(equation, args):
    _only(equation.params.get("out_dtype") in (None, np.complex128), "products of another type", 0)
    return product(*args)


def product(x: Pair, y: Pair) -> Pair:
    """x y."""
    return Pair(x.real * y.real - x.imag * y.imag, x.real * y.imag + x.imag * y.real)


@rule("square")
def _square(equation, args):
    return product(args[0], args[0])


@rule("div")
def _div(equation, args):
    return quotient(*args)


def quotient(x: Pair, y: Pair) -> Pair:
    """x / y by Smith's method: the larger part of y is divided by."""
    is_wide = lax.abs(y.real) >= lax.abs(y.imag)
    large, small = jnp.where(is_wide, y.real, y.imag), jnp.where(is_wide, y.imag, y.real)
    ratio = small / jnp.where(large == 0.0, 1.0, large)
    size = large + small * ratio
    wide = Pair((x.real + x.imag * ratio) / size, (x.imag - x.real * ratio) / size)
    tall = Pair((x.real * ratio + x.imag) / size, (x.imag * ratio - x.real) / size)
    return Pair(*(jnp.where(is_wide, a, b) for a, b in zip(wide, tall, strict=True)))


@rule("abs")
def _abs(equation, args):
    return size_of(args[0])


def size_of(x: Pair) -> Any:
    """|x|, without overflow."""
    a, b = lax.abs(x.real), lax.abs(x.imag)
    large, small = lax.max(a, b), lax.min(a, b)
    ratio = small / jnp.where(large == 0.0, lax.full_like(large, 1.0), large)
    size = large * lax.sqrt(1.0 + ratio * ratio)
    return jnp.where(large == np.inf, large, size)


@rule("sign")
def _sign(equation, args):
    (x,) = args
    size = size_of(x)
    size = jnp.where(size == 0.0, lax.full_like(size, 1.0), size)
    return Pair(x.real / size, x.imag / size)


@rule("eq", "ne")
def _compare(equation, args):
    same = (args[0].real == args[1].real) & (args[0].imag == args[1].imag)
    return same if equation.primitive.name == "eq" else ~same


@rule("exp")
def _exp(equation, args):
    return exponential(args[0])


def exponential(x: Pair) -> Pair:
    """e^x."""
    size = lax.exp(x.real)
    return Pair(size * lax.cos(x.imag), jnp.where(x.imag == 0.0, x.imag, size * lax.sin(x.imag)))


@rule("log")
def _log(equation, args):
    return logarithm(args[0])


def logarithm(x: Pair) -> Pair:
    """The principal value; near a size of one by `log1p`, where the logarithm of the size would cancel."""
    a, b = lax.abs(x.real), lax.abs(x.imag)
    large, small = lax.max(a, b), lax.min(a, b)
    near = 0.5 * lax.log1p((large - 1.0) * (large + 1.0) + small * small)
    is_near = (large > 0.5) & (large < 2.0)
    return Pair(jnp.where(is_near, near, lax.log(size_of(x))), lax.atan2(x.imag, x.real))


@rule("sqrt")
def _sqrt(equation, args):
    return root(args[0])


def root(x: Pair) -> Pair:
    """The root whose real part is not negative."""
    size = lax.sqrt(0.5 * (size_of(x) + lax.abs(x.real)))
    other = lax.abs(x.imag) / jnp.where(size == 0.0, lax.full_like(size, 1.0), 2.0 * size)
    is_right = x.real >= 0.0
    real, imag = jnp.where(is_right, size, other), jnp.where(is_right, other, size)
    below = (x.imag < 0.0) | ((x.imag == 0.0) & (lax.div(lax.full_like(x.imag, 1.0), x.imag) < 0.0))
    return Pair(real, jnp.where(below, -imag, imag))


@rule("rsqrt")
def _rsqrt(equation, args):
    y = root(args[0])
    return quotient(_real(lax.full_like(y.real, 1.0)), y)


@rule("integer_pow")
def _integer_pow(equation, args):
    (x,), y = args, equation.params["y"]
    left, result = abs(y), None
    while left:
        if left & 1:
            result = x if result is None else product(result, x)
        x, left = product(x, x), left >> 1
    unit = _real(lax.full_like(x.real, 1.0))
    result = unit if result is None else result
    return quotient(unit, result) if y < 0 else result


@rule("pow")
def _pow(equation, args):
    x, y = args[0], args[1] if isinstance(args[1], Pair) else _real(args[1])
    return exponential(product(y, logarithm(x)))


@rule("sin", "cos", "sinh", "cosh")
def _circular(equation, args):
    (x,), name = args, equation.primitive.name
    a, b = x if name.endswith("h") else (x.imag, x.real)
    sinh, cosh, sin, cos = lax.sinh(a), lax.cosh(a), lax.sin(b), lax.cos(b)
    if name.startswith("sin"):
        return Pair(sinh * cos, cosh * sin) if name.endswith("h") else Pair(sin * cosh, cos * sinh)
    return Pair(cosh * cos, sinh * sin if name.endswith("h") else -sin * sinh)


@rule("tanh", "tan")
def _tangents(equation, args):
    """tan(x) = -i tanh(i x)."""
    (x,) = args
    is_circular = equation.primitive.name == "tan"
    y = _tanh(times_i(x) if is_circular else x)
    return Pair(y.imag, -y.real) if is_circular else y


def _tanh(x):
    t, u = lax.tanh(x.real), lax.tan(x.imag)
    return quotient(Pair(t, u), Pair(lax.full_like(t, 1.0), t * u))


def times_i(x: Pair) -> Pair:
    """i x."""
    return Pair(-x.imag, x.real)


@rule("expm1")
def _expm1(equation, args):
    (x,) = args
    half = lax.sin(0.5 * x.imag)
    return Pair(lax.expm1(x.real) * lax.cos(x.imag) - 2.0 * half * half, lax.exp(x.real) * lax.sin(x.imag))


@rule("log1p")
def _log1p(equation, args):
    return _logarithm_beside_one(args[0])


def _logarithm_beside_one(x):
    return Pair(0.5 * lax.log1p(x.real * (2.0 + x.real) + x.imag * x.imag), lax.atan2(x.imag, 1.0 + x.real))


@rule("logistic")
def _logistic(equation, args):
    below = exponential(Pair(-args[0].real, -args[0].imag))
    return quotient(_real(lax.full_like(below.real, 1.0)), Pair(1.0 + below.real, below.imag))


@rule("asin", "acos", "acosh", "asinh")
def _inverse(equation, args):
    """By roots of 1 - x and 1 + x.  Source: Kahan, Branch cuts for complex elementary functions (1987)."""
    (x,), name = args, equation.primitive.name
    if name == "asinh":  # asinh(x) = -i asin(i x)
        y = _asin(times_i(x))
        return Pair(y.imag, -y.real)
    if name == "asin":
        return _asin(x)
    first, second = root(Pair(1.0 - x.real, -x.imag)), root(Pair(1.0 + x.real, x.imag))
    if name == "acos":
        angle = 2.0 * lax.atan2(first.real, second.real)
        return Pair(angle, lax.asinh(second.real * first.imag - second.imag * first.real))
    first = root(Pair(x.real - 1.0, x.imag))
    size = lax.asinh(first.real * second.real + first.imag * second.imag)
    return Pair(size, 2.0 * lax.atan2(first.imag, second.real))


def _asin(x):
    first, second = root(Pair(1.0 - x.real, -x.imag)), root(Pair(1.0 + x.real, x.imag))
    angle = lax.atan2(x.real, first.real * second.real - first.imag * second.imag)
    return Pair(angle, lax.asinh(first.real * second.imag - first.imag * second.real))


@rule("atanh", "atan")
def _inverse_tangents(equation, args):
    """atan(x) = -i atanh(i x)."""
    (x,) = args
    is_circular = equation.primitive.name == "atan"
    x = times_i(x) if is_circular else x
    first, second = _logarithm_beside_one(x), _logarithm_beside_one(Pair(-x.real, -x.imag))
    y = Pair(0.5 * (first.real - second.real), 0.5 * (first.imag - second.imag))
    return Pair(y.imag, -y.real) if is_circular else y


@rule("reduce_prod")
def _product_along(equation, args):
    (x,), axes = args, equation.params["axes"]
    x = Pair(*(jnp.moveaxis(part, axes, range(len(axes))) for part in x))
    shape = x.real.shape[len(axes) :]
    x = Pair(*(part.reshape(-1, *shape) for part in x))
    while (number := x.real.shape[0]) > 1:
        half = number // 2
        low, high, rest = (Pair(*(part[cut] for part in x)) for cut in _thirds(half))
        products = product(low, high)
        x = Pair(*(jnp.concatenate(pair) for pair in zip(products, rest, strict=True)))
    if not number:
        return _real(jnp.ones(shape))
    return Pair(x.real[0], x.imag[0])


def _thirds(half):
    """Two halves of an array, and what is left."""
    return slice(0, half), slice(half, 2 * half), slice(2 * half, None)


@rule("dot_general")
def _dot(equation, args):
    params = dict(equation.params) | {"preferred_element_type": np.dtype(np.float64)}
    (a, b), (c, d) = (x if isinstance(x, Pair) else (x, None) for x in args)

    def dot(x, y):
        return None if x is None or y is None else equation.primitive.bind(x, y, **params)

    real, crossed, first, second = dot(a, c), dot(b, d), dot(a, d), dot(b, c)
    imag = second if first is None else first if second is None else first + second
    return Pair(real if crossed is None else real - crossed, imag)


@rule("sort")
def _sort(equation, args):
    """Complex numbers by their real parts, then by the imaginary ones."""
    parts = [part for x in args for part in (x if isinstance(x, Pair) else (x,))]
    keys = sum(2 if isinstance(x, Pair) else 1 for x in args[: equation.params["num_keys"]])
    parts = iter(equation.primitive.bind(*parts, **(dict(equation.params) | {"num_keys": keys})))
    return [Pair(next(parts), next(parts)) if isinstance(x, Pair) else next(parts) for x in args]


# ------------------------------------------------------------------------------------------------- by NumPy and SciPy
#: Fields of the mode of each decomposition, lowest bit first; numbers of `fft` have their own.
HOST_PRIMITIVES: dict[str, Callable[[dict], int]] = {
    "eig": lambda p: p["compute_left_eigenvectors"] + 2 * p["compute_right_eigenvectors"],
    "schur": lambda p: _only(not p["sort_eig_vals"], "schur with an order", p["compute_schur_vectors"]),
    "qr": lambda p: p["full_matrices"] + 2 * p["pivoting"],
    "householder_product": lambda p: 0,
    "fft": lambda p: int(p["fft_type"]) + 4 * len(p["fft_lengths"]) + 16 * p["fft_lengths"][-1],
}
_COMPLEX_ALONE: dict[str, Callable[[dict], int]] = {
    "eigh": lambda p: _only(p.get("subset_by_index") is None, "eigh of a part", p["lower"]),
    "svd": lambda p: p["compute_uv"] + 2 * p["full_matrices"],
    "lu": lambda p: 0,
    "cholesky": lambda p: _only(not p.get("symmetrize_input"), "cholesky of what is made symmetric", 0),
    "triangular_solve": lambda p: (
        p["left_side"] + 2 * p["lower"] + 4 * p["unit_diagonal"] + 8 * p["transpose_a"] + 16 * p["conjugate_a"]
    ),
}


def _only(is_good, what, mode):
    if not is_good:
        raise UnsupportedError(what)
    return int(mode)


@rule(*HOST_PRIMITIVES, *_COMPLEX_ALONE)
def _by_host(equation, args):
    name, avals = equation.primitive.name, [variable.aval for variable in equation.outvars]
    shapes = [aval.update(dtype=np.dtype(np.float64)) if is_complex(aval) else aval for aval in avals]
    numbers = [2 if is_complex(aval) else 1 for aval in avals]
    given = [part for x in args for part in (x if isinstance(x, Pair) else (x,))]
    pairs = sum(isinstance(x, Pair) << k for k, x in enumerate(args))
    mode = int((HOST_PRIMITIVES | _COMPLEX_ALONE)[name](equation.params))
    wide = tuple(shape for shape, number in zip(shapes, numbers, strict=True) for _ in range(number))
    parts = iter(host.bind(*given, name=name, mode=mode, pairs=pairs, shapes=wide))
    return [Pair(next(parts), next(parts)) if number == 2 else next(parts) for number in numbers]
