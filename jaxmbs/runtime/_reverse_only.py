"""A mark on what has a reverse derivative and no forward one, so that the library's error says what to do.

JAX says of a `custom_vjp` that is differentiated forward that it cannot be; which option of which function makes it
so it cannot know.  The mark is an identity.  What it puts on the tangents is an identity too, which reverse mode
transposes away before anything runs; where it is still there when it runs or is compiled, the mode is forward.
"""

import equinox as eqx
import jax
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir
from jaxtyping import PyTree

#: Of a forward derivative of `simulate`, of either noun, as it is by default.
FORWARD_MODE = (
    'simulate(gradient="reverse"), the default, has reverse derivatives (jax.grad, jax.jacrev): for jax.jacfwd or '
    'jax.jvp give simulate(..., gradient="forward")'
)


def reverse_only(tree: PyTree, message: str) -> PyTree:
    """The same tree; a forward derivative by its arrays is a TypeError with this message.

    Forward over reverse is none: `jax.jacfwd(jax.grad(f))` passes.
    """
    moving, fixed = eqx.partition(tree, eqx.is_inexact_array)
    leaves, structure = jax.tree.flatten(moving)
    if not leaves:
        return tree
    return eqx.combine(jax.tree.unflatten(structure, _mark.bind(*leaves, message=message)), fixed)


def _refuse(*_, message):
    raise TypeError(message)


def _mark_jvp(primals, tangents, *, message):
    refused = [t if isinstance(t, ad.Zero) else _tangent.bind(t, message=message) for t in tangents]
    return primals, refused  # the values without the mark: an outer derivative of any mode passes


def _mark_batched(values, axes, *, message):
    return _mark.bind(*values, message=message), axes


_mark = Primitive("reverse_only")
_mark.multiple_results = True
_mark.def_impl(lambda *values, message: values)
_mark.def_abstract_eval(lambda *values, message: values)
ad.primitive_jvps[_mark] = _mark_jvp
batching.primitive_batchers[_mark] = _mark_batched
mlir.register_lowering(_mark, lambda _, *values, message: values)

_tangent = Primitive("tangent_of_reverse_only")
_tangent.def_impl(_refuse)
_tangent.def_abstract_eval(lambda value, message: value)
ad.deflinear2(_tangent, lambda bar, _, message: [bar])
batching.primitive_batchers[_tangent] = _refuse  # reverse mode has transposed it away before it meets a batch
mlir.register_lowering(_tangent, _refuse)
