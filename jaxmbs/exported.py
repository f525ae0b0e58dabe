"""Questions stored in a file: traced once, asked in other processes without tracing a model again."""

import hashlib
import json
import pickle
import re
import zipfile
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any

import jax
import jax.export
import jax.numpy as jnp
from jaxtyping import PyTree

from .checks import known
from .math.jit import options
from .typing import Explained

_ABOUT, _PROGRAM, _RESULTS = "about.json", "program.bin", "results.pickle"


class Program:
    """A stored question; call it like the function it was made of.

    It runs under `jax.jit`, has a first derivative in reverse mode (`jax.grad`), and no `jax.vmap`: export the
    function that is mapped.
    """

    def __init__(self, exported: jax.export.Exported, results: PyTree, about: dict) -> None:
        self.about, self._results = about, results
        self._inner = exported.call
        self._outer = jax.jit(exported.call, compiler_options=options("full", jax.default_backend()) or None)

    def __call__(self, *arguments: Any) -> Any:
        """The answer.  Raises: ValueError if the arguments are not of the structure that was stored."""
        leaves = _numbers(arguments)
        if _key(arguments, leaves) != self.about["structure"]:
            raise ValueError(
                f"the arguments are not of the structure that {self.about['function']!r} was exported with: other "
                "names, bodies, joints, array shapes or types; it takes "
                f"{', '.join(self.about['arrays'])}. Export it again"
            )
        call = self._outer if known(leaves) else self._inner
        treedef = jax.tree.structure(self._results)
        return jax.tree.unflatten(treedef, call(*leaves))


def export(function: Callable, example: Explained[tuple], path: str | PathLike) -> Path:
    """Store a question of a model with its first derivative.

    Args:
        function: of pytrees to a pytree of arrays, for example a loss, or `lambda s, x: mbs.reactions(s, x)`.
        example: the arguments, a tuple; later calls may have other numbers, but the same structure, shapes and types.
        path: of the file.

    Returns: the path.  The program is compiled by the process that loads it: use `mbs.cache` there as well.

    Raises: TypeError for an example that is no tuple, or has leaves that are no numbers.
    """
    if not isinstance(example, tuple):
        raise TypeError(f"example must be the tuple of arguments, got {type(example).__name__}; write (x,) for one")
    leaves, treedef = _numbers(example), jax.tree.structure(example)
    results = []

    def flat(*leaves):
        found, structure = jax.tree.flatten(function(*jax.tree.unflatten(treedef, leaves)))
        results[:] = [jax.tree.unflatten(structure, range(len(found)))]
        return found

    exported = jax.export.export(jax.jit(flat))(*leaves)
    about = {
        "function": getattr(function, "__name__", type(function).__name__),
        "structure": _key(example, leaves),
        "arrays": [f"{leaf.dtype.name}{list(leaf.shape)}" for leaf in leaves],
        "jax": jax.__version__,
        "platforms": list(exported.platforms),
    }
    path = Path(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(_ABOUT, json.dumps(about))
        file.writestr(_PROGRAM, bytes(exported.serialize(vjp_order=1)))
        file.writestr(_RESULTS, pickle.dumps(results[0]))
    return path


def load_program(path: str | PathLike) -> Program:
    """The question that `export` stored.  Load what you trust only: the file holds a pickle.

    Raises: OSError if the file cannot be read; ValueError if it is none of `export`, or was stored with another
    version of JAX or for another platform.
    """
    try:
        with zipfile.ZipFile(path) as file:
            about = json.loads(file.read(_ABOUT))
            program, results = file.read(_PROGRAM), file.read(_RESULTS)
    except (zipfile.BadZipFile, KeyError) as error:
        raise ValueError(f"{path} is no program that `export` stored") from error
    if about["jax"] != jax.__version__:
        raise ValueError(f"{path} was stored with jax {about['jax']}, this is {jax.__version__}: export it again")
    if jax.default_backend() not in about["platforms"]:
        raise ValueError(f"{path} was stored for {', '.join(about['platforms'])}, not for {jax.default_backend()}")
    return Program(jax.export.deserialize(bytearray(program)), pickle.loads(results), about)


def _numbers(arguments):
    """The leaves as arrays."""
    for where, leaf in jax.tree_util.tree_leaves_with_path(arguments):
        if known(leaf) and not hasattr(leaf, "dtype") and not isinstance(leaf, (bool, int, float)):
            raise TypeError(f"argument{jax.tree_util.keystr(where)} is no number but {leaf!r}")
    return [jnp.asarray(leaf) for leaf in jax.tree.leaves(arguments)]


def _key(arguments, leaves) -> str:
    """A name for the structure, the same in every process."""
    structure = re.sub(r" at 0x[0-9a-f]+", "", str(jax.tree.structure(arguments)))
    arrays = [(leaf.shape, leaf.dtype.name) for leaf in leaves]
    return hashlib.sha256(f"{structure} {arrays}".encode()).hexdigest()
