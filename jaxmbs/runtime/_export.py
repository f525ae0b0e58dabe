"""Questions stored in a file: traced once, asked in other processes without tracing a model again."""

import hashlib
import json
import zipfile
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any

import jax
import jax.export
import jax.numpy as jnp
from jaxtyping import PyTree

from ..atomic_write import atomic_path
from ..checks import is_concrete
from ..typing import WordedError
from ._compiler_options import compiler_options
from ._content import content_of
from ._structure_data import from_data, to_data

_ABOUT, _PROGRAM, _FORWARD = "about.json", "program.bin", "forward.bin"
_FORMAT = 2  # 1 held a pickle


class Program:
    """A stored question; call it like the function it was made of.

    It runs under `jax.jit`, has a first derivative in reverse mode (`jax.grad`), and no `jax.vmap`: export the
    function that is mapped.
    """

    def __init__(self, exported: jax.export.Exported, results: PyTree, about: dict) -> None:
        self.about, self._results = about, results
        self._inner = exported.call
        self._outer = jax.jit(exported.call, compiler_options=compiler_options("full", jax.default_backend()) or None)

    @property
    def names(self) -> tuple[list[str], list[str]]:
        """Paths of the arguments' leaves and of the results', `"rod.length"`; one argument has no place in them."""
        paths = jax.tree_util.tree_leaves_with_path(self._results)
        results = [jax.tree_util.keystr(path, simple=True, separator=".") or "result" for path, _ in paths]
        known = self.about.get("names")  # files of earlier releases have none
        return known or [f"input {k}" for k in range(len(self.about["arrays"]))], results

    @property
    def shapes(self) -> tuple[list[jax.ShapeDtypeStruct], list[jax.ShapeDtypeStruct]]:
        """Shapes and types of the arguments' leaves and of the results'."""
        exported: Any = getattr(self._inner, "__self__")  # noqa: B009
        taken, given = (
            [jax.ShapeDtypeStruct(x.shape, x.dtype) for x in avals]
            for avals in (exported.in_avals, exported.out_avals)
        )
        return taken, given

    def __call__(self, *arguments: Any) -> Any:
        """The answer.  Raises: ValueError if the arguments are not of the structure that was stored."""
        leaves = _numbers(arguments)
        if _key(arguments, leaves) != self.about["structure"]:
            raise ValueError(
                f"the arguments are not of the structure that {self.about['function']!r} was exported with: other "
                "names, bodies, joints, laws (their code or the numbers in it), array shapes or types; it takes "
                f"{', '.join(self.about['arrays'])}. Export it again"
            )
        call = self._outer if is_concrete(leaves) else self._inner
        treedef = jax.tree.structure(self._results)
        return jax.tree.unflatten(treedef, call(*leaves))


def export(function: Callable, example: WordedError[tuple], path: str | PathLike, forward: bool = False) -> Path:
    """Store a question of a model with its first derivative.

    Args:
        function: of pytrees to a pytree of arrays, for example a loss, or `lambda s, x: mbs.reactions(s, x)`.
        example: the arguments, a tuple; later calls may have other numbers, but the same structure, shapes and types.
            Laws of the user are known by their code, as this version of Python compiles it, and what that reads.
        path: of the file.
        forward: store the derivative in a direction as well, for programs that ask for it (`jaxmbs tesseract`); the
            function must have a forward derivative, a motion by `simulate(..., gradient="forward")`.

    Returns: the path.  The program is compiled by the process that loads it: use `mbs.cache` there as well.

    Raises: TypeError for an example that is no tuple, or has leaves that are no numbers; for a result that holds
    functions, whose structure is no data; OSError where the file cannot be written.  What was at the path stays then.
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
    content = bytes(exported.serialize(vjp_order=1))
    contents = {_PROGRAM: content} | ({_FORWARD: _forward_derivative(flat, leaves)} if forward else {})
    about = {
        "format": _FORMAT,
        "function": getattr(function, "__name__", type(function).__name__),
        "structure": _key(example, leaves),
        "arrays": [f"{leaf.dtype.name}{list(leaf.shape)}" for leaf in leaves],
        "names": _argument_names(example),
        "jax": jax.__version__,
        "platforms": list(exported.platforms),
        "results": to_data(results[0]),
        "sha256": hashlib.sha256(content).hexdigest(),
    }
    with atomic_path(path) as part, zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(_ABOUT, json.dumps(about))
        for name, stored in contents.items():
            file.writestr(name, stored)
    return Path(path)


def _forward_derivative(flat: Callable, leaves: list) -> bytes:
    """The stored function of leaves, and of tangents of those that are real, to tangents of the real results."""
    real = [jnp.issubdtype(leaf.dtype, jnp.floating) for leaf in leaves]

    def derivative(leaves, tangents):
        tangents = iter(tangents)

        def of_real(*numbers):
            numbers = iter(numbers)
            whole = [next(numbers) if is_real else leaf for leaf, is_real in zip(leaves, real, strict=True)]
            return [x for x in flat(*whole) if jnp.issubdtype(jnp.asarray(x).dtype, jnp.floating)]

        numbers = [leaf for leaf, is_real in zip(leaves, real, strict=True) if is_real]
        return jax.jvp(of_real, numbers, list(tangents))[1]

    tangents = [leaf for leaf, is_real in zip(leaves, real, strict=True) if is_real]
    return bytes(jax.export.export(jax.jit(derivative))(leaves, tangents).serialize())


def _argument_names(example: tuple) -> list[str]:
    """Paths of the leaves; of a single argument without its place in the tuple."""
    skip = 1 if len(example) == 1 else 0
    paths = [path[skip:] for path, _ in jax.tree_util.tree_leaves_with_path(example)]
    return [jax.tree_util.keystr(path, simple=True, separator=".") or "input" for path in paths]


def load_program(path: str | PathLike) -> Program:
    """The question that `export` stored.  The file is data: nothing in it is run by Python.

    Raises: OSError if the file cannot be read; ValueError if it is none of `export` or damaged, or was stored with
    another version of JAX or for another platform.
    """
    if Path(path).exists() and not Path(path).is_file():
        raise ValueError(f"{path} is no file")
    try:
        with zipfile.ZipFile(path) as file:
            about, program = json.loads(file.read(_ABOUT)), file.read(_PROGRAM)
        stored = [about[name] for name in ("function", "structure", "arrays", "jax", "platforms")]
    except OSError:
        raise
    except Exception as error:  # noqa: BLE001 - a damaged archive raises whatever its reader meets
        raise ValueError(f"{path} is no program that `export` stored") from error
    _, _, _, version, platforms = stored
    if version != jax.__version__ or about.get("format") != _FORMAT:
        made = "another version of jaxmbs" if version == jax.__version__ else f"jax {version}"
        raise ValueError(f"{path} was stored with {made}, this is jax {jax.__version__}: export it again")
    if jax.default_backend() not in platforms:
        raise ValueError(f"{path} was stored for {', '.join(platforms)}, not for {jax.default_backend()}")
    if hashlib.sha256(program).hexdigest() != about.get("sha256"):
        raise ValueError(f"{path} is damaged: export it again")
    try:
        return Program(jax.export.deserialize(bytearray(program)), from_data(about["results"]), about)
    except Exception as error:  # noqa: BLE001
        raise ValueError(f"{path} cannot be used: {error}") from error


def _numbers(arguments):
    """The leaves as arrays."""
    for where, leaf in jax.tree_util.tree_leaves_with_path(arguments):
        if is_concrete(leaf) and not hasattr(leaf, "dtype") and not isinstance(leaf, (bool, int, float)):
            raise TypeError(f"argument{jax.tree_util.keystr(where)} is no number but {leaf!r}")
    return [jnp.asarray(leaf) for leaf in jax.tree.leaves(arguments)]


def _key(arguments, leaves) -> str:
    """A name for the structure, the same in every process: of functions in it (laws of the user) it has the code, and
    the numbers that they read."""
    arrays = [(leaf.shape, leaf.dtype.name) for leaf in leaves]
    structure = content_of(jax.tree.structure(arguments), strict=False)
    return hashlib.sha256(f"{structure} {arrays}".encode()).hexdigest()
