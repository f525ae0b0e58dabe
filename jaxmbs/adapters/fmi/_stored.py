"""Programs of an exported mechanism as bytes: StableHLO with versions, of one array each."""

import jax
import jax.export
import jax.numpy as jnp
import numpy as np

from ...runtime import garbage_collection_paused, jaxpr_function, kernel_options, one_kernel, without_unused
from ._program import FlatMechanism


def serialised_programs(flat: FlatMechanism, start: np.ndarray, kind: str) -> dict[str, tuple[bytes, int]]:
    """Bytes by name, with the size of the argument; those with "_kernel" are marked for this release of JAX alone."""
    z, known, unknown = len(start), flat.num_known, flat.num_states + len(flat.output_names)
    instant = _traced(flat.instant, z)
    at = lambda x: instant(x)[:unknown]
    along = lambda seed: jnp.concatenate([seed, jnp.zeros(z - known)])  # hidden coordinates follow
    functions = {
        "instant": (instant, [z]),
        "directional": (lambda x, seed: jax.jvp(at, (x,), (along(seed),))[1], [z, known]),
        "adjoint": (lambda x, seed: jax.vjp(at, x)[1](seed)[0][:known], [z, unknown]),
    }
    found = {}
    for name, (function, sizes) in functions.items():
        size, whole = (
            sum(sizes),
            function if name == "instant" else _traced(_of_one_array(function, sizes), sum(sizes)),
        )
        found[name] = _serialised(one_kernel(whole, marks=False), size)
        if kernel_options() is not None:
            found[f"{name}_kernel"] = _serialised(one_kernel(whole, marks=True), size)
    if flat.ends_of_models:
        found["margins"] = _serialised(flat.margins, z)
    if kind == "CS":
        found["step"] = _serialised(_of_one_array(flat.step, [z, 1]), z + 1)
    return found


def _traced(function, size):
    """A function of one array that is traced once, for all that is made of it."""
    with garbage_collection_paused(), jax.default_matmul_precision("highest"):
        call = jaxpr_function(without_unused(jax.make_jaxpr(function)(jnp.zeros(size))))
    return lambda x: call(x)[0]


def _of_one_array(function, sizes):
    return lambda x: function(*jnp.split(x, np.cumsum(sizes)[:-1]))


def _serialised(function, size):
    """The bytes of a program of one array, and its size."""
    with garbage_collection_paused(), jax.default_matmul_precision("highest"):
        exported = jax.export.export(jax.jit(function), platforms=["cpu"])(jax.ShapeDtypeStruct((size,), np.float64))
    return bytes(exported.serialize()), size
