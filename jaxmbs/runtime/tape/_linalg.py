"""Rules of products of matrices, of factors of small ones, and of what LAPACK does on the host."""

import functools
import math

import numpy as np

from ._flatten import UnsupportedError
from ._host import host_table
from ._host_functions import HOST_FUNCTIONS, SPECIAL_FUNCTIONS
from ._rearrange import places_of
from ._reduce import _wrapped, exact, sizes
from ._writer import rule


@rule("dot_general")
def _dot(writer, operation, values):
    ((sum_a, sum_b), (batch_a, batch_b)), (A, B) = operation.params["dimension_numbers"], operation.inputs
    if "Algorithm" in str(operation.params["precision"]):
        raise UnsupportedError("products of another precision")
    out = operation.outputs[0]
    if A.size == 0 or B.size == 0:
        return [writer.arena.constant(np.zeros(out.shape, out.dtype))]
    in_a, rows, along_a = _grouped(A.shape, batch_a, sum_a)
    in_b, columns, along_b = _grouped(B.shape, batch_b, sum_b)
    a, b, result = writer.dense(values[0], A.size), writer.dense(values[1], B.size), writer.new(out.size)
    strides = [_stride(places) for places in (rows, along_a, columns, along_b)]
    size = rows.size, columns.size, along_a.size
    writer.claim_work(in_a.size * math.prod(size))
    if None not in strides:
        table = writer.arena.table(size, strides, in_a, in_b)
        product = functools.partial(writer.emit, "DOT", out.size, x0=in_a.size, table=table)
    else:
        table = writer.arena.table(in_a, in_b, rows, columns, along_a, along_b)
        lengths = dict(zip(("x1", "x2", "x3"), size, strict=True))
        product = functools.partial(writer.emit, "DOT_TABLE", out.size, x0=in_a.size, **lengths, table=table)
    if out.dtype.kind in "iu":
        total = writer.temporary(out.size).place
        product(out=total, a=sizes(writer, a, A.size), b=sizes(writer, b, B.size))
        exact(writer, total, out.size)
    product(out=result.place, a=a, b=b)
    if out.dtype == bool:  # a sum of truth values is one
        writer.emit("TRUTH", out.size, out=result.place, a=result.place)
    return [_wrapped(writer, operation, result)]


def _grouped(shape, batch, summed):
    """Places of an array's numbers by its axes of the batch, its own, and those that are summed over."""
    own = [axis for axis in range(len(shape)) if axis not in (*batch, *summed)]
    lengths = [int(np.prod([shape[axis] for axis in axes], dtype=np.int64)) for axes in (batch, own, summed)]
    places = places_of(shape).transpose(*batch, *own, *summed).reshape(lengths)
    return places[:, 0, 0], places[0, :, 0], places[0, 0, :]


def _stride(places):
    """The distance of places that are regular, else None."""
    step = int(places[1] - places[0]) if places.size > 1 else 1
    return step if np.array_equal(places, step * np.arange(places.size)) else None


@rule("cholesky")
def _cholesky(writer, operation, values):
    (array,) = operation.inputs
    if operation.params.get("symmetrize_input"):
        raise UnsupportedError("cholesky of what is made symmetric")
    place, result, N = writer.dense(values[0], array.size), writer.new(array.size), array.shape[-1]
    writer.claim_work(array.size * N)
    writer.emit("CHOLESKY", array.size, out=result.place, a=place, x0=array.size // N**2, x1=N)
    return [result]


@rule("triangular_solve")
def _triangular_solve(writer, operation, values):
    (A, B), params = operation.inputs, operation.params
    N, is_left = A.shape[-1], params["left_side"]
    sides = B.size // (N * (A.size // N**2))
    a, b, result = writer.dense(values[0], A.size), writer.dense(values[1], B.size), writer.new(B.size)
    mode = params["lower"] + 2 * params["transpose_a"] + 4 * params["unit_diagonal"] + 8 * (not is_left)
    fields = {"x0": A.size // N**2, "x1": N, "x2": sides, "mode": mode}
    writer.claim_work(B.size * N)
    writer.emit("TRIANGULAR", B.size, out=result.place, a=a, b=b, **fields)
    return [result]


@rule("lu")
def _lu(writer, operation, values):
    (array,) = operation.inputs
    place = writer.dense(values[0], array.size)
    results = [writer.new(atom.size) for atom in operation.outputs]
    rows, columns = array.shape[-2:]
    fields = {"b": results[1].place, "c": results[2].place, "x0": array.size // (rows * columns)}
    writer.claim_work(array.size * columns)
    writer.emit("LU", array.size, out=results[0].place, a=place, x1=rows, x2=columns, **fields)
    return results


@rule("eigh", "svd")
def _decomposition(writer, operation, values):
    params = operation.params
    if params.get("subset_by_index") is not None:
        raise UnsupportedError(f"{operation.name} of a part")
    mode = params.get("compute_uv", params.get("lower", False)) + 2 * params.get("full_matrices", False)
    return _host(writer, operation, values, operation.name, mode, 0)


@rule(*SPECIAL_FUNCTIONS)
def _special(writer, operation, values):
    return _host(writer, operation, values, operation.name, 0, 0)


@rule("tape_host")
def _of_pairs(writer, operation, values):
    params = operation.params
    return _host(writer, operation, values, params["name"], params["mode"], params["pairs"])


def _host(writer, operation, values, name, mode, pairs):
    """By NumPy: one call with the places of the operands and results."""
    given = [(writer.dense(v, a.size), a.shape) for v, a in zip(values, operation.inputs, strict=True)]
    results = [writer.new(atom.size) for atom in operation.outputs]
    arrays = given + [(r.place, o.shape) for r, o in zip(results, operation.outputs, strict=True)]
    fields = {"x0": list(HOST_FUNCTIONS).index(name), "x1": len(given), "x2": len(results), "x3": pairs, "mode": mode}
    writer.emit("HOST", 1, table=writer.arena.table(host_table(arrays)), **fields)
    return results
