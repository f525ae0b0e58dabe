"""Meshes of Gmsh files and of scikit-fem into structures (meshio reads the files)."""

import contextlib
import io
import re
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ..checks import distinct_names, place_of
from ..elements import AbstractElement
from ..errors import ModelError
from ..fem import Structure
from ._regular_file import require_file

#: Kinds of cells, by their names in meshio, and the number of nodes of the elements that they become.
CELLS = {"vertex": 1, "line": 2, "triangle": 3, "quad": 4, "hexahedron": 8}
MAX_BYTES = 256 * 2**20
_SECTIONS = ("NodeData", "ElementData")
_LONG_NUMBER = re.compile(r"(?<![.\w+-])\d{8,}(?![.\w])")


@dataclass(frozen=True)
class Mesh:
    """Nodes and cells, with sets of them by name.

    Attributes:
        points: (nodes, 3) [m]; a node's name is its number.
        cells: (cells, k) node numbers by kind: "triangle", "quad", "hexahedron", "line", "vertex", and others that no
            element fits.
        cell_sets: by name (a physical group of Gmsh), the numbers of its cells by kind.
        node_sets: by name, node numbers; a set of cells is one of their nodes too.
    """

    points: np.ndarray
    cells: dict[str, np.ndarray]
    cell_sets: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    node_sets: dict[str, np.ndarray] = field(default_factory=dict)

    def nodes(self, *names: str) -> list[int]:
        """Numbers of the nodes of sets, ascending: an interface.  Raises: UnknownNameError."""
        found = [np.zeros(0, int)]
        for name in distinct_names("names", names):
            place_of("set of the mesh", name, [*self.node_sets, *self.cell_sets])
            found.append(np.asarray(self.node_sets.get(name, []), int))
            found += [self.cells[kind][rows].ravel() for kind, rows in self.cell_sets.get(name, {}).items()]
        return np.unique(np.concatenate(found)).tolist()

    def structure(
        self,
        elements: AbstractElement | Mapping[str, AbstractElement | Iterable[AbstractElement]],
        held: Mapping[str, str] | None = None,
    ) -> Structure:
        """Finite elements on the cells.

        Args:
            elements: for each set of cells an element, or several, one for each kind of its cells: a `Triangle` and
                a `Quadrilateral`; a kind of lower dimension (the edges of a set of faces) may be left out.  One
                element alone is for all cells of its kind.
            held: by set, the directions held to ground: "x y", "all".

        Raises: ModelError for cells without an element, or as of `Structure`; UnknownNameError for a set.
        """
        given = {"": elements} if isinstance(elements, AbstractElement) else elements
        groups, faults = {}, []
        for name, own in given.items():
            kinds = {element.num_nodes: element for element in _own_lists(own)}
            found = self.cells if name == "" else self._cells(name)
            used = {kind: rows for kind, rows in found.items() if CELLS.get(kind) in kinds}
            top = max((_dimension(kind) for kind in found), default=0)
            left = [kind for kind in found if kind not in used and _dimension(kind) == top]
            where = name or "the mesh"
            faults += [f"{where}: there is no element for its cells of kind {kind!r}" for kind in left]
            missing = sorted(set(kinds) - {CELLS[kind] for kind in used})
            faults += [f"{where} has no cells for the {type(kinds[k]).__name__}" for k in missing]
            for kind, rows in used.items():
                groups[name or kind if len(used) == 1 else f"{name} {kind}".strip()] = kinds[CELLS[kind]], rows
        if faults:
            raise ModelError(faults)
        at: dict[int, str] = {}
        for name, directions in (held or {}).items():
            for node in self.nodes(name):
                at[node] = f"{at.get(node, '')} {directions}".strip()
        return Structure(self.points, groups, at)

    def _cells(self, name):
        place_of("set of cells", name, self.cell_sets)
        return {kind: self.cells[kind][rows] for kind, rows in self.cell_sets[name].items()}


def read_mesh(source: Any) -> Mesh:
    """A mesh from a Gmsh file (.msh, ASCII, 2.2 or 4.1), a mesh of scikit-fem, or one of meshio.

    Physical groups of Gmsh, subdomains and boundaries of scikit-fem keep their names: `mesh.nodes("hub")` is an
    interface, `mesh.structure({"skin": Quadrilateral(...)}, held={"edge": "all"})` a structure.  Plane meshes
    get z = 0.

    Raises: ModelError for files of another kind, and those that cannot be read; OSError where there is no file;
    ImportError without meshio (the extra `io`).
    """
    if isinstance(source, str | PathLike):
        return _from_meshio(_read(Path(source)))
    if hasattr(source, "points") and hasattr(source, "cells_dict"):
        return _from_meshio(source)
    if hasattr(source, "p") and hasattr(source, "t"):
        return _from_skfem(source)
    raise TypeError("a mesh is the path of a .msh file, or a mesh of scikit-fem or of meshio")


def _dimension(kind):
    """Dimension of a kind of cells: 3 for tetra, wedge, pyramid, hexahedron and higher-order kinds, and so on."""
    by_name = (("vertex", 0), ("line", 1), ("triangle", 2), ("quad", 2), ("polygon", 2))
    return next((dimension for name, dimension in by_name if kind.startswith(name)), 3)


def _own_lists(own):
    return (own,) if isinstance(own, AbstractElement) else tuple(own)


def _read(path):
    if path.suffix.lower() != ".msh":
        raise ModelError([f"{path.name}: of files with meshes those of Gmsh, .msh, are read"])
    if require_file(path).stat().st_size > MAX_BYTES:
        raise ModelError([f"{path.name}: larger than {MAX_BYTES} bytes"])
    faults = _size_faults(path.read_bytes())
    if faults:
        raise ModelError([f"{path.name}: {fault}" for fault in faults])
    try:
        from meshio import gmsh
    except ImportError as error:
        raise ImportError("meshes of Gmsh are read by meshio: pip install 'jaxmbs[io]'") from error
    try:
        with warnings.catch_warnings(), contextlib.redirect_stderr(io.StringIO()):
            warnings.simplefilter("ignore")
            return gmsh.read(path)
    except Exception as error:  # meshio lets through whatever a broken file makes of it
        raise ModelError([f"{path.name} is no mesh of Gmsh: {type(error).__name__} {str(error)[:200]}"]) from error


def _size_faults(data):
    """Faults that meshio would not notice: more nodes than lines, tags that size an array, solutions."""
    lines = data.decode("latin-1").split("\n")
    head = lines[1].split() if len(lines) > 1 else []
    if lines[0].strip() != "$MeshFormat" or len(head) != 3:
        return ["it does not begin with $MeshFormat"]
    if head[1] != "0":
        return ["it is binary: save it as ASCII (Mesh.Binary = 0)"]
    faults = []
    for k, line in enumerate(lines):
        if not line.startswith("$"):
            continue
        section, following = line[1:].strip(), lines[k + 1].split() if k + 1 < len(lines) else []
        if section in _SECTIONS:
            faults.append(f"line {k + 1}: section ${section} is not read: save the mesh alone")
        counts = following[: 2 if section in ("Nodes", "Elements") else 4]
        if section in ("Nodes", "Elements", "Entities", "PhysicalNames", "Periodic"):
            faults += [
                f"line {k + 2}: {count[:20]!r} is more than the file holds"
                for count in counts
                if not re.fullmatch("[0-9]{1,9}", count) or int(count) > len(lines)
            ]
        if section == "PhysicalNames" and counts and not faults and int(counts[0]) > 1000:
            faults.append(f"line {k + 2}: more than 1000 physical groups")
    limit = max(10**7, 10 * len(lines))
    large = next((found[0] for found in _LONG_NUMBER.finditer("\n".join(lines)) if int(found[0][:12]) > limit), None)
    if large:
        faults.append(f"the number {large[:20]} is too large for a tag")
    return faults


def _from_meshio(source):
    points = _as_points(source.points)
    kinds = {kind: np.asarray(cells, int) for kind, cells in source.cells_dict.items() if len(cells)}
    wrong = [
        kind for kind, cells in kinds.items() if cells.size and not 0 <= cells.min() <= cells.max() < len(points)
    ]
    if wrong:
        raise ModelError([f"cells of kind {kind!r} name nodes that are not there" for kind in wrong])
    sets = {
        name: {kind: np.asarray(rows, int) for kind, rows in own.items()}
        for name, own in source.cell_sets_dict.items()
        if not name.startswith("gmsh:")
    }
    tags = source.cell_data_dict.get("gmsh:physical", {})
    for name, (tag, _) in source.field_data.items():
        own = {kind: np.flatnonzero(values == tag) for kind, values in tags.items()}
        if not sets.get(name):
            sets[name] = {kind: rows for kind, rows in own.items() if rows.size}
    return Mesh(points, kinds, sets, {name: np.asarray(rows, int) for name, rows in source.point_sets.items()})


def _from_skfem(source):
    from skfem.io.meshio import to_meshio

    try:
        made = to_meshio(source, encode_cell_data=False)
    except KeyError as error:
        raise ModelError([f"meshes of kind {type(source).__name__} are not read"]) from error
    (kind,) = made.cells_dict
    sets = {name: {kind: np.asarray(rows, int)} for name, rows in (source.subdomains or {}).items()}
    edges = {name: np.unique(source.facets[:, rows]) for name, rows in (source.boundaries or {}).items()}
    return Mesh(_as_points(made.points), {kind: np.asarray(made.cells_dict[kind], int)}, sets, edges)


def _as_points(points):
    points = np.asarray(points, float)
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not len(points):
        raise ModelError([f"a mesh needs points (nodes, 2) or (nodes, 3), not of shape {points.shape}"])
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
