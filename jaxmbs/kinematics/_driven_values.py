"""Values of the drives' functions of time: functions of equal structure are evaluated together, traced once."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from ..model._rows import Drive
from ..model._system import System
from ..runtime import gather_static


def driven_values(system: System, t: Array, dtype) -> Array:
    """Values (drives,) at which the drives hold their coordinates."""
    laws = [row.law for row in system.rows if isinstance(row, Drive)]
    groups: dict = {}
    for number, law in enumerate(laws):
        groups.setdefault(_structure(law), []).append(number)
    values = [jnp.zeros(0, dtype)]
    values += [_values_of([laws[k] for k in members], t, dtype) for members in groups.values()]
    order = np.argsort([k for members in groups.values() for k in members])
    return gather_static(jnp.concatenate(values), order)


def _structure(law):
    """Structure of a law, shared by those that differ in numbers alone."""
    return jax.tree.structure(law), tuple((x.shape, x.dtype) for x in jax.tree.leaves(law))


def _values_of(laws, t, dtype):
    """Values (laws,) of laws of equal structure."""

    def value(law):
        return jnp.reshape(jnp.asarray(law(t), dtype), ())

    if len(laws) == 1 or not jax.tree.leaves(laws[0]):  # without numbers of its own it is the same function for all
        return jnp.broadcast_to(value(laws[0]), (len(laws),))
    return jax.vmap(value)(jax.tree.map(lambda *x: jnp.stack(x), *laws))
