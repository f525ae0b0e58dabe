"""A function of one design, traced once with its status and cost, and its programs for many designs side by side."""

import math
import weakref
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from jaxtyping import PyTree

from ..checks import is_concrete
from ..runtime import compile_batch, compile_kind, is_motion, jaxpr_function, not_tracing, tuning, working_bytes
from ._result import count_steps, design_status
from ._table import num_designs, design_shape, select_designs

_CACHE: weakref.WeakKeyDictionary = weakref.WeakKeyDictionary()


class BatchedFunction:
    """The jaxpr of a function of one design with its status and cost, and the programs compiled from it so far.

    Attributes:
        shape: (values, status, cost) of one design as abstract arrays.
    """

    def __init__(self, function: Callable, cost: Callable, design: PyTree, compile: str = "full"):
        def lane(design):
            values = function(design)
            work = lax.stop_gradient(jnp.nan_to_num(jnp.asarray(cost(values), float)))
            return values, design_status(values), work

        self.__name__ = getattr(function, "__name__", "batch")  # of the compiled program, in the messages of XLA
        with compile_kind(compile):
            self._jaxpr, self.shape = jax.make_jaxpr(lane, return_shape=True)(design)
        self._row, self._programs, self._kind = jax.tree.leaves(design), {}, compile

    @property
    def is_traced(self) -> bool:
        """Whether the function holds numbers that are known only to a trace."""
        return not is_concrete(self._jaxpr.consts)

    def __call__(self, *columns):
        """Leaves of (values, status, cost) of the designs whose leaves are the columns (n, ...), all at once."""
        return jax.vmap(jaxpr_function(self._jaxpr))(*columns)

    def in_turn(self, designs: PyTree, chunk: int) -> PyTree:
        """(values, status, cost) of traced designs (B, ...), by chunks; a gradient holds the memory of one."""
        number = math.ceil(num_designs(designs) / chunk)
        if number == 1:
            return self.named(self(*jax.tree.leaves(designs)))
        index = np.minimum(np.arange(number * chunk), num_designs(designs) - 1).reshape(number, chunk)
        columns = jax.tree.leaves(select_designs(jax.tree.map(jnp.asarray, designs), index))
        flat = lax.map(jax.checkpoint(lambda part: self(*part)), columns)
        return self.named([x.reshape(-1, *x.shape[2:])[: num_designs(designs)] for x in flat])

    def named(self, leaves: list) -> PyTree:
        """(values, status, cost) from its leaves."""
        return jax.tree.unflatten(jax.tree.structure(self.shape), leaves)

    def program(self, chunk: int, devices: tuple = ()):
        """The compiled program of exactly `chunk` designs, spread evenly over the devices if any are given."""
        if (chunk, devices) not in self._programs:
            self._programs[chunk, devices] = self._compile(chunk, devices)
        return self._programs[chunk, devices]

    def fitting(self, chunk: int, devices: tuple = ()):
        """(program, chunk): of this chunk, or of the next power of two below that keeps within memory."""
        program = self.program(chunk, devices)
        excess = max(working_bytes(program) / tuning.CHUNK_BYTES, 1.0)
        smaller = round_to_devices(2 ** math.floor(math.log2(max(chunk / excess, 1.0))), devices)
        return (program, chunk) if excess == 1.0 or smaller >= chunk else self.fitting(smaller, devices)

    def _compile(self, chunk, devices):
        function, where = self, None
        if devices:
            mesh, split = Mesh(np.array(devices), ("designs",)), PartitionSpec("designs")
            where = NamedSharding(mesh, split)
            # Each device ends its own loops: sharding the whole would make them agree after every step.
            function = jax.shard_map(self, mesh=mesh, in_specs=split, out_specs=split, check_vma=False)
        columns = [jax.ShapeDtypeStruct((chunk, *x.shape), x.dtype, sharding=where) for x in self._row]
        # motions gain 3 % by the compiler's highest level, for a third more to compile
        return compile_batch(function, columns, self._kind, not is_motion(self._jaxpr), self.__name__)


def batched_function(function: Callable, designs: PyTree, cost: Callable = count_steps, compile: str = "full") -> BatchedFunction:
    """The lanes of a function and of the cost of its values, from the cache if it met designs of this kind before."""
    row = design_shape(designs)
    leaves, structure = jax.tree.flatten(row)
    key = cost, compile, not_tracing(), structure, tuple((x.shape, x.dtype) for x in leaves)
    try:
        known = _CACHE.setdefault(function, {})
    except TypeError:  # neither hashable nor weakly held
        known = {}
    lanes = known.get(key) or BatchedFunction(function, cost, row, compile)
    if not lanes.is_traced:
        known[key] = lanes
    return lanes


def round_to_devices(chunk: int, devices: tuple) -> int:
    """The chunk rounded up to equal shares of the devices."""
    share = max(len(devices), 1)
    return math.ceil(chunk / share) * share
