"""Batched programs: a function of one design, traced once with its status and cost, vectorised and compiled."""

import math
from collections import OrderedDict
from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.sharding import Mesh, NamedSharding, PartitionSpec
from jaxtyping import Array, PyTree

from ..runtime import (
    TracedFunction,
    bytes_for_chunk,
    bytes_of_arrays,
    compile_batch,
    forget_with_programs,
    is_double,
    is_motion,
    not_tracing,
    tuning,
    working_bytes,
)
from ._result import count_steps, design_status
from ._table import design_shape, num_designs, select_designs

_CACHE: OrderedDict[Callable, dict] = OrderedDict()
forget_with_programs(_CACHE)


class BatchedFunction:
    """A function of one design with its status and cost: its jaxpr, and the programs compiled from it so far.

    Attributes: traced: of the leaves of a design to (values, status, cost).
    """

    def __init__(self, function: Callable, cost: Callable, design: PyTree, compile: str = "full") -> None:
        leaves, structure = jax.tree.flatten(design)

        def with_status(*leaves: Array) -> tuple:
            values = function(jax.tree.unflatten(structure, leaves))
            work = lax.stop_gradient(jnp.nan_to_num(jnp.asarray(cost(values), float)))
            return values, design_status(values), work

        self.__name__ = getattr(function, "__name__", "batch")  # names the compiled program in XLA's messages
        self.traced = TracedFunction(with_status, *leaves, compile=compile)
        self._row, self._programs, self._kind = leaves, {}, compile

    @property
    def shape(self) -> PyTree:
        """(values, status, cost) of one design as abstract arrays."""
        return self.traced.shape

    @property
    def is_traced(self) -> bool:
        """True if the function closes over traced numbers."""
        return self.traced.closes_over_traced

    def __call__(self, *columns: Any) -> list:
        """Leaves of (values, status, cost) of the designs whose leaves are the columns (n, ...), vectorised."""
        return jax.vmap(self.traced)(*columns)

    def map_chunks(self, designs: PyTree, chunk: int) -> PyTree:
        """(values, status, cost) of traced designs (B, ...) by chunks; a gradient needs the memory of one chunk.

        The designs are padded to whole chunks: `lax.map` compiles the remainder as a program of its own.
        """
        number = num_designs(designs)
        if number <= chunk:
            return self.unflatten(self(*jax.tree.leaves(designs)))
        padded = np.minimum(np.arange(math.ceil(number / chunk) * chunk), number - 1)
        columns = jax.tree.leaves(select_designs(jax.tree.map(jnp.asarray, designs), padded))
        run = jax.checkpoint(lambda row: self.traced(*row))
        return self.unflatten([x[:number] for x in lax.map(run, columns, batch_size=chunk)])

    def unflatten(self, leaves: list) -> PyTree:
        """(values, status, cost) from its leaves."""
        return jax.tree.unflatten(jax.tree.structure(self.shape), leaves)

    def chunks_in_turn(self, number: int, threads: int, chunk: int) -> int:
        """Chunks that one call works on, one after another: several on a CPU where a chunk takes less than a call.

        The chunks of a motion take longer, and are scheduled by their cost.
        """
        turns = tuning.CHUNKS_IN_TURN
        many = number >= 2 * threads * chunk * turns
        results = sum(x.size * x.dtype.itemsize for x in jax.tree.leaves(self.shape)) * chunk * turns
        small = results < bytes_for_chunk() / 4
        return turns if many and small and jax.default_backend() == "cpu" and not is_motion(self.traced.jaxpr) else 1

    def program(self, chunk: int, devices: tuple = (), turns: int = 1) -> jax.stages.Compiled:
        """The compiled program of exactly `chunk` designs, spread evenly over the devices if any are given.

        It takes `turns` such chunks one after another.
        """
        key = chunk, devices, turns
        if key not in self._programs:
            self._programs[key] = self._compile(*key)
        return self._programs[key]

    def program_within_memory(
        self, chunk: int, devices: tuple = (), turns: int = 1
    ) -> tuple[jax.stages.Compiled, int]:
        """(program, chunk) for this chunk, or for a power of two below within `bytes_for_chunk`."""
        within_cache = tuning.CACHED_CHUNK // max(bytes_of_arrays(self.traced.jaxpr), 1)
        if jax.default_backend() == "cpu" and chunk > tuning.SMALL_CHUNK:
            chunk = max(min(chunk, 2 ** max(within_cache.bit_length() - 1, 0)), tuning.SMALL_CHUNK)
        program = self.program(chunk, devices, turns)
        excess = max(working_bytes(program) / bytes_for_chunk(), 1.0)
        smaller = round_to_devices(2 ** math.floor(math.log2(max(chunk / excess, 1.0))), devices)
        return (
            (program, chunk)
            if excess == 1.0 or smaller >= chunk
            else self.program_within_memory(smaller, devices, turns)
        )

    def _compile(self, chunk: int, devices: tuple, turns: int) -> jax.stages.Compiled:
        function, where = self, None
        if turns > 1:
            function = partial(_in_turn, self, chunk)
        if devices:
            mesh, split = Mesh(np.array(devices), ("designs",)), PartitionSpec("designs")
            where = NamedSharding(mesh, split)
            # Each device ends its own loops: sharding the whole program would make them communicate after every step.
            function = jax.shard_map(self, mesh=mesh, in_specs=split, out_specs=split, check_vma=False)
        columns = [jax.ShapeDtypeStruct((chunk * turns, *x.shape), x.dtype, sharding=where) for x in self._row]
        # motions gain 3 % by the compiler's highest level, for a third more to compile
        return compile_batch(function, columns, self._kind, not is_motion(self.traced.jaxpr), self.__name__)


def _in_turn(function: Callable, chunk: int, *columns: Any) -> list:
    """The function of `chunk` rows of the columns, of one chunk after another."""
    split = [x.reshape(-1, chunk, *x.shape[1:]) for x in columns]
    return [x.reshape(-1, *x.shape[2:]) for x in lax.map(lambda rows: function(*rows), split)]


def batched_function(
    function: Callable, designs: PyTree, cost: Callable = count_steps, compile: str = "full"
) -> BatchedFunction:
    """The `BatchedFunction` of a function and a cost, cached by function and by shapes and types of the designs."""
    row = design_shape(designs)
    leaves, structure = jax.tree.flatten(row)
    key = cost, compile, is_double(), not_tracing(), structure, tuple((x.shape, x.dtype) for x in leaves)
    known = _programs_of(function)
    batched = known.get(key) or BatchedFunction(function, cost, row, compile)
    if not batched.is_traced:
        known[key] = batched
    return batched


def _programs_of(function: Callable) -> dict:
    """The programs of a function, which is now the last that was asked for; none are kept if it is not hashable."""
    try:
        known = _CACHE.setdefault(function, {})
    except TypeError:
        return {}
    _CACHE.move_to_end(function)
    if len(_CACHE) > tuning.BATCHED_FUNCTIONS:
        _CACHE.popitem(last=False)
    return known


def round_to_devices(chunk: int, devices: tuple) -> int:
    """The chunk, rounded up so that all devices get equally many designs."""
    share = max(len(devices), 1)
    return math.ceil(chunk / share) * share
