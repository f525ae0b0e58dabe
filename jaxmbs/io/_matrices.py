"""Linear systems from files of matrices: Matrix Market, Nastran's OP4 and DMIG (pyYeti reads those two)."""

import warnings
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from typing import Any

from ..elements import DIRECTIONS
from ..errors import ModelFileError
from ..linear import LinearSystem
from ..typing import CoordinateLike
from ._matrix_market import parse_matrix_market
from ._regular_file import require_file


def read_matrix_market(
    mass: str | PathLike, stiffness: str | PathLike, damping: str | PathLike | None = None, **options: Any
) -> LinearSystem:
    """Read a linear system from one Matrix Market file per matrix; `options` as of `LinearSystem`.

    Raises: ModelFileError for what is no such file.
    """
    paths = (mass, stiffness, damping)
    read = [None if path is None else _parse(parse_matrix_market, path, "a Matrix Market file") for path in paths]
    return LinearSystem(**_drop_missing(read), **options)


def read_op4(
    path: str | PathLike, mass: str = "mxx", stiffness: str = "kxx", damping: str | None = None, **options: Any
) -> LinearSystem:
    """Read a linear system from matrices by name in an OP4 file, text or binary.

    Args: options: as of `LinearSystem`; an OP4 file holds no names of coordinates.

    Raises: ModelFileError for what is no such file, naming the matrices that it has where one is missing; ImportError
    without pyYeti (the extra `io`).
    """
    found = _parse(_import_pyyeti("op4").read, path, "an OP4 file")
    return LinearSystem(**_drop_missing(_select_matrices(path, found, mass, stiffness, damping)), **options)


def read_dmig(
    path: str | PathLike,
    mass: str = "maax",
    stiffness: str = "kaax",
    damping: str | None = None,
    interface: Iterable[CoordinateLike] = (),
    positions: Mapping | Sequence | None = None,
) -> LinearSystem:
    """Read a linear system from DMIG cards; coordinates are named by grid and component, "101 rz".

    Raises: as `read_op4`.
    """
    bulk = _import_pyyeti("bulk")
    found = _parse(lambda file: bulk.rddmig(file, square=True), path, "a file of DMIG cards")
    frames = _select_matrices(path, found, mass, stiffness, damping)
    rows = sorted(set().union(*(set(frame.index) for frame in frames if frame is not None)))
    if any(len(row) != 2 or row[1] not in range(7) for row in rows):
        raise ModelFileError(path, ["a row is no pair of a grid and a component from 0 to 6"])
    matrices = [
        None if f is None else f.reindex(index=rows, columns=rows).fillna(0.0).to_numpy(float) for f in frames
    ]
    labels = [(str(int(grid)), DIRECTIONS[int(component) - 1] if component else "") for grid, component in rows]
    return LinearSystem(**_drop_missing(matrices), interface=interface, coordinates=labels, positions=positions)


def _parse(read, path, what):
    """Parse a file by another library; its errors are reported with the name of the file."""
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("error", "Premature end-of-file")  # of pyYeti: a matrix is cut off
            found = read(str(require_file(path)))
    except ModelFileError:
        raise
    except FileNotFoundError as error:
        raise ModelFileError(path, ["it cannot be read: No such file or directory"]) from error
    except Exception as error:  # whatever a parser raises for what it does not expect
        words = " ".join(str(error).split())[:200] or type(error).__name__
        raise ModelFileError(path, [f"it is not {what}: {words}"]) from error
    if isinstance(found, Mapping) and not found:
        raise ModelFileError(path, [f"it is not {what}: it has no matrix"])
    return found


def _drop_missing(matrices):
    return dict(zip(("mass", "stiffness", "damping"), matrices, strict=True))


def _select_matrices(path, found, *names):
    """Matrices by name, None where none was requested."""
    missing = [name for name in names if name is not None and name.lower() not in found]
    if missing:
        raise ModelFileError(
            path, [f"it has no matrix {name!r}: it has {', '.join(sorted(found))}" for name in missing]
        )
    return [None if name is None else found[name.lower()] for name in names]


def _import_pyyeti(module):
    try:
        from pyyeti import nastran
    except ImportError as error:
        raise ImportError("OP4 and DMIG files are read by pyYeti: pip install 'jaxmbs[io]'") from error
    return getattr(nastran, module)
