"""Measurements as one vector: names, noise, gaps, and complex values as pairs."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from ..checks import require_reals
from ..errors import ModelError


class LeafLayout(NamedTuple):
    """Places of the leaves of a pytree in one vector: of complex ones all real parts, then all imaginary parts.

    Attributes: structure: of the pytree; labels, shapes, is_complex: of its leaves.
    """

    structure: jax.tree_util.PyTreeDef
    labels: tuple[str, ...]
    shapes: tuple[tuple[int, ...], ...]
    is_complex: tuple[bool, ...]

    def flatten(self, tree: PyTree) -> Array:
        """The numbers (all,) of a traced pytree.  Raises: ModelError where it does not have this layout."""
        leaves, structure = jax.tree.flatten(tree)
        if structure != self.structure:
            raise ModelError([f"the prediction has the parts {structure}, the data {self.structure}"], "identify")
        leaves = [jnp.asarray(leaf) for leaf in leaves]
        rows = list(zip(self.labels, leaves, self.shapes, self.is_complex, strict=True))
        faults = [f"{name}: the prediction has shape {x.shape}, not {s}" for name, x, s, _ in rows if x.shape != s]
        kinds = ("real", "complex")
        pairs = [(name, kinds[jnp.iscomplexobj(x)], kinds[c]) for name, x, _, c in rows]
        faults += [f"{name}: the prediction is {a}, the data are {b}" for name, a, b in pairs if a != b]
        if faults:
            raise ModelError(faults, "identify")
        return jnp.concatenate([_parts(x, c) for _, x, _, c in rows])

    def unflatten(self, values: Array | np.ndarray) -> PyTree:
        """The pytree of numbers (all,)."""
        leaves, start = [], 0
        for shape, c in zip(self.shapes, self.is_complex, strict=True):
            size = int(np.prod(shape))
            part = values[start : start + size * (1 + c)]
            start += len(part)
            leaves.append((part[:size] + 1j * part[size:] if c else part).reshape(shape))
        return jax.tree.unflatten(self.structure, leaves)


class Measurements(NamedTuple):
    """The n measured numbers.

    Attributes:
        layout: of one experiment.
        values: (n,), gaps left out; kept: (all,) false at gaps; weights: (n,) factors of the differences.
        experiments: number of experiments, the leading axis of all data; or None.
    """

    layout: LeafLayout
    values: np.ndarray
    kept: np.ndarray
    weights: np.ndarray
    experiments: int | None = None

    def unflatten(self, values: np.ndarray) -> PyTree:
        """A pytree like the data of numbers (n,), NaN at gaps."""
        whole = np.full(len(self.kept), np.nan)
        whole[self.kept] = values
        if self.experiments is None:
            return self.layout.unflatten(whole)
        rows = [self.layout.unflatten(row) for row in whole.reshape(self.experiments, -1)]
        return jax.tree.map(lambda *parts: np.stack(parts), *rows)


def _parts(x, is_complex):
    x = x.ravel()
    return jnp.concatenate([x.real, x.imag]) if is_complex else x


def _rows(x, is_complex, count):
    """Real and imaginary parts of all data (count, m), a row for each experiment."""
    x = x.reshape(count, -1)
    return np.concatenate([x.real, x.imag], axis=1) if is_complex else x


def read_measurements(
    data: PyTree, deviations: PyTree | None, weights: PyTree | None, experiments: int | None = None
) -> Measurements:
    """Read data and their noise: standard deviations, or relative weights; of several experiments side by side.

    Raises: ModelError with every fault.
    """
    paths, structure = jax.tree_util.tree_flatten_with_path(data)
    labels = tuple(jax.tree_util.keystr(path, simple=True, separator=".") or "data" for path, _ in paths)
    leaves = [np.asarray(leaf) for _, leaf in paths]
    leaves = [np.where(np.isnan(x), complex(np.nan, np.nan), x) if x.dtype.kind == "c" else x for x in leaves]
    faults = [
        f"{label}: data must be numbers, not {x.dtype}"
        for label, x in zip(labels, leaves, strict=True)
        if x.dtype.kind not in "fciu"
    ]
    faults += ["give deviations or weights, not both"] if deviations is not None and weights is not None else []
    faults += [] if leaves else ["there are no data"]
    if experiments is not None:
        faults += [
            f"{label}: data of shape {x.shape} are not of {experiments} experiments, their leading axis"
            for label, x in zip(labels, leaves, strict=True)
            if x.shape[:1] != (experiments,)
        ]
    given, word = (weights, "weights") if deviations is None else (deviations, "deviations")
    noise = _noise(structure, labels, leaves, given, word, faults) if not faults else []
    if faults:
        raise ModelError(faults, "identify")
    is_complex = tuple(x.dtype.kind == "c" for x in leaves)
    count = 1 if experiments is None else experiments
    flat = (
        np.concatenate([_rows(x, c, count) for x, c in zip(leaves, is_complex, strict=True)], 1).ravel().astype(float)
    )
    noise = np.concatenate(
        [np.tile(x.reshape(count, -1), 1 + c) for x, c in zip(noise, is_complex, strict=True)], 1
    ).ravel()
    kept = ~np.isnan(flat)
    if not np.all(np.isfinite(flat[kept])):
        raise ModelError(["data must be finite; NaN marks a gap"], "identify")
    factors = noise if deviations is None else 1.0 / noise
    shapes = tuple(x.shape if experiments is None else x.shape[1:] for x in leaves)
    layout = LeafLayout(structure, labels, shapes, is_complex)
    return Measurements(layout, flat[kept], kept, factors[kept], experiments)


def _noise(structure, labels, leaves, given, word, faults):
    """Positive numbers for every leaf, in its shape; one number stands for all."""
    if given is None or np.ndim(given) == 0 and not isinstance(given, dict):
        given = jax.tree.unflatten(structure, [1.0 if given is None else given] * len(leaves))
    try:
        parts = structure.flatten_up_to(given)
    except ValueError:
        faults.append(f"{word} must be one number, or have the parts of the data")
        return []
    found = []
    for label, x, part in zip(labels, leaves, parts, strict=True):
        try:
            require_reals(part)
            part = np.broadcast_to(np.asarray(part, float), x.shape)
        except (TypeError, ValueError):
            faults.append(f"{label}: {word} do not fit data of shape {x.shape}")
            continue
        if not np.all(np.isfinite(part) & (part > 0)):
            faults.append(f"{label}: {word} must be positive and finite")
        found.append(part)
    return found
