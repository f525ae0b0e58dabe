"""Programs under a user's own `jax.grad` or `jax.vjp`, outside of any `jit`.

JAX would take such a program apart, and compile what it knows now, what is linear, and the transpose of that.  Here a
program is one operation with three functions, each a program of its own that runs at once like any other: its value;
its tangents, linear in those given; and their transpose, which goes through the value again.  Derivatives of these,
batches of them and compilation go by JAX's rules through what they are made of.
"""

import contextlib
import functools
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
from jax.extend.core import Primitive, get_opaque_trace_state
from jax.interpreters import ad, batching, mlir

_DERIVATIVES = ("LinearizeTrace", "JVPTrace")


def is_differentiating() -> bool:
    """True where a derivative of the user's is under way, of numbers that are known: nothing else is."""
    with contextlib.suppress(AttributeError):
        trace = get_opaque_trace_state()._trace_ref()
        return type(trace).__name__ in _DERIVATIVES and type(trace.parent_trace).__name__ == "EvalTrace"
    return False


class Differentiable:
    """A program whose derivatives are programs too.

    Args:
        program: of arguments and keyword arguments; it is run where nothing is traced.
        function: what it is made of; known: the function that decides what it does.
        jit: makes a program of a function of arrays and of the function that decides what that does.
    """

    def __init__(self, program: Callable, function: Callable, known: Callable, jit: Callable):
        self._program = program
        self.push, self.pull = (
            jit(_named(functools.partial(derivative, function), program, kind), _Content([kind, known]))
            for kind, derivative in (("tangents", _pushed), ("gradient", _pulled))
        )

    def __call__(self, args: tuple, kwargs: dict) -> Any:
        """Results of the program, whose derivative is under way."""
        call = _Call(self, *eqx.partition((args, kwargs), eqx.is_array))
        arrays = _value.bind(*call.leaves, call=call)
        return eqx.combine(jax.tree.unflatten(call.structure, arrays), call.fixed)

    def value(self, args: tuple, kwargs: dict) -> Any:
        """Results of arguments that are known."""
        with jax.core.eval_context():
            return self._program(*args, **kwargs)


class _Content:
    """Content of a derivative, by which it is stored: the function, and which derivative of it."""

    def __init__(self, content):
        self._content = content

    def __content__(self):
        return self._content


def _named(function, program, kind):
    """A function with a name for what is told of it."""
    function.__name__ = f"{kind}_of_{getattr(program, '__name__', 'program')}"
    return function


class _Call:
    """One call: what of its arguments is no array, and, once its value is known, what of its results is none."""

    def __init__(self, program, dynamic, static):
        self.program, self._static = program, static
        self.leaves, self._given = jax.tree.flatten(dynamic)

    def arguments(self, leaves):
        return eqx.combine(jax.tree.unflatten(self._given, leaves), self._static)

    def value(self, *leaves):
        arrays, self.fixed = eqx.partition(self.program.value(*self.arguments(leaves)), eqx.is_array)
        found, self.structure = jax.tree.flatten(arrays)
        return found

    def push(self, primals, tangents, moving):
        return self.program.push(*self.arguments(primals), moving, tangents)

    def pull(self, primals, cotangents, moving, wanted):
        return self.program.pull(*self.arguments(primals), moving, wanted, cotangents)


def _smooth(function, args, kwargs, moving):
    """Results in floating point as a function of the arrays that move, and these."""
    dynamic, static = eqx.partition((args, kwargs), eqx.is_array)
    leaves, structure = jax.tree.flatten(dynamic)

    def of(*moved):
        rest = iter(moved)
        every = [next(rest) if moves else x for x, moves in zip(leaves, moving, strict=True)]
        args, kwargs = eqx.combine(jax.tree.unflatten(structure, every), static)
        return jax.tree.leaves(eqx.filter(function(*args, **kwargs), eqx.is_inexact_array))

    return of, [x for x, moves in zip(leaves, moving, strict=True) if moves]


def _pushed(function, args, kwargs, moving, tangents):
    of, start = _smooth(function, args, kwargs, moving)
    return jax.jvp(of, start, tangents)[1]


def _pulled(function, args, kwargs, moving, wanted, cotangents):
    of, start = _smooth(function, args, kwargs, moving)
    chosen = lambda *moved: [x for x, is_wanted in zip(of(*moved), wanted, strict=True) if is_wanted]
    return list(jax.vjp(chosen, *start)[1](cotangents))


def _value_jvp(primals, tangents, *, call):
    found = _value.bind(*primals, call=call)
    moving = tuple(not isinstance(tangent, ad.Zero) for tangent in tangents)
    smooth = [x for x in found if eqx.is_inexact_array(x)]
    shapes = tuple(jax.typeof(x) for x in smooth)
    given = [tangent for tangent, moves in zip(tangents, moving, strict=True) if moves]
    rest = iter(_tangents.bind(*primals, *given, call=call, moving=moving, shapes=shapes))
    return found, [next(rest) if eqx.is_inexact_array(x) else ad.Zero(jax.typeof(x).to_tangent_aval()) for x in found]


def _push(*numbers, call, moving, shapes):
    return call.push(list(numbers[: len(moving)]), list(numbers[len(moving) :]), moving)


def _push_jvp(primals, tangents, **params):
    moving = [not isinstance(tangent, ad.Zero) for tangent in tangents]

    def of(*moved):
        rest = iter(moved)
        return _push(*[next(rest) if moves else x for x, moves in zip(primals, moving, strict=True)], **params)

    return jax.jvp(of, *([x for x, moves in zip(xs, moving, strict=True) if moves] for xs in (primals, tangents)))


def _push_batched(numbers, axes, **params):
    found = jax.vmap(lambda *numbers: _push(*numbers, **params), axes)(*numbers)
    return found, [0] * len(found)


def _transposed(cotangents, *numbers, call, moving, shapes):
    primals = list(numbers[: len(moving)])
    wanted = tuple(not isinstance(cotangent, ad.Zero) for cotangent in cotangents)
    given = [cotangent for cotangent, is_wanted in zip(cotangents, wanted, strict=True) if is_wanted]
    found = call.pull(primals, given, moving, wanted) if given else [None] * sum(moving)
    return [None] * len(moving) + found


_value = Primitive("jaxmbs_program")
_value.multiple_results = True
_value.def_impl(lambda *leaves, call: call.value(*leaves))
ad.primitive_jvps[_value] = _value_jvp

_tangents = Primitive("jaxmbs_tangents")
_tangents.multiple_results = True
_tangents.def_impl(_push)
_tangents.def_abstract_eval(lambda *_, shapes, **__: list(shapes))
ad.primitive_jvps[_tangents] = _push_jvp
ad.primitive_transposes[_tangents] = _transposed
batching.primitive_batchers[_tangents] = _push_batched
mlir.register_lowering(_tangents, mlir.lower_fun(_push, multiple_results=True))
