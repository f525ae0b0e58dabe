"""Linear systems from files of matrices: Matrix Market, Nastran's OP4 and DMIG (pyYeti reads those two)."""

from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from typing import Any

from ..elements import DIRECTIONS
from ..errors import ModelError
from ..linear import LinearSystem
from ..typing import CoordinateLike


def read_matrix_market(
    mass: str | PathLike, stiffness: str | PathLike, damping: str | PathLike | None = None, **options: Any
) -> LinearSystem:
    """From one Matrix Market file per matrix; `options` as of `LinearSystem`."""
    import scipy.io

    paths = (mass, stiffness, damping)
    return LinearSystem(**_by_kind(None if path is None else scipy.io.mmread(path) for path in paths), **options)


def read_op4(
    path: str | PathLike, mass: str = "mxx", stiffness: str = "kxx", damping: str | None = None, **options: Any
) -> LinearSystem:
    """From matrices by name in an OP4 file, text or binary.

    Args: options: as of `LinearSystem`; an OP4 file holds no names of coordinates.

    Raises: ModelError naming the matrices that the file has; ImportError without pyYeti (the extra `io`).
    """
    op4 = _pyyeti("op4")
    return LinearSystem(**_by_kind(_named(path, op4.read(str(path)), mass, stiffness, damping)), **options)


def read_dmig(
    path: str | PathLike,
    mass: str = "maax",
    stiffness: str = "kaax",
    damping: str | None = None,
    interface: Iterable[CoordinateLike] = (),
    positions: Mapping | Sequence | None = None,
) -> LinearSystem:
    """From DMIG cards in a bulk or punch file; coordinates are named by grid and component, "101 rz".

    Raises: as `read_op4`.
    """
    found = _pyyeti("bulk").rddmig(str(path), square=True)
    frames = _named(path, found, mass, stiffness, damping)
    rows = sorted(set().union(*(set(frame.index) for frame in frames if frame is not None)))
    matrices = [
        None if f is None else f.reindex(index=rows, columns=rows).fillna(0.0).to_numpy(float) for f in frames
    ]
    labels = [(str(grid), DIRECTIONS[component - 1] if component else "") for grid, component in rows]
    return LinearSystem(**_by_kind(matrices), interface=interface, coordinates=labels, positions=positions)


def _by_kind(matrices):
    return dict(zip(("mass", "stiffness", "damping"), matrices, strict=True))


def _named(path, found, *names):
    """Matrices by name, None where none is asked."""
    missing = [name for name in names if name is not None and name.lower() not in found]
    if missing:
        raise ModelError([f"{path} has no matrix {name!r}: it has {', '.join(sorted(found))}" for name in missing])
    return [None if name is None else found[name.lower()] for name in names]


def _pyyeti(module):
    try:
        from pyyeti import nastran
    except ImportError as error:
        raise ImportError("OP4 and DMIG files are read by pyYeti: pip install 'jaxmbs[io]'") from error
    return getattr(nastran, module)
