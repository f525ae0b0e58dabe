"""Modes of a universal file: data set 55, data at nodes, of normal modes and complex eigenvalues."""

import collections
from os import PathLike
from typing import NamedTuple

import numpy as np

from ...elements import DIRECTIONS
from ...errors import ModelFileError, warn
from ...experiment import MeasuredModes
from .._regular_file import read_bytes
from ._data_sets import DataSet, data_sets
from ._functions import FunctionError, _integers, _reals
from ._uff import _IGNORED_SILENTLY, _MOST_BYTES, _MOST_FAULTS, _count_functions
from ._units import FileUnits, file_units

_NORMAL, _COMPLEX = 2, (3, 7)  # analyses: normal modes; complex eigenvalues of first and second order
_MOTIONS = (0, 1, 8, 11, 12)  # data of unknown and general kind, displacements, velocities, accelerations
_ANALYSES = {0: "unknown", 1: "static", 4: "transient", 5: "frequency response", 6: "buckling"}
_HEADER = 8  # lines before the first node
_GEOMETRY = (15, 18, 82, 151, 164, 2400, 2411, 2412, 2420)  # nodes, systems, trace lines, header, units


class _Mode(NamedTuple):
    """A mode: where it stands, its number, eigenvalue [rad/s], damping ratio, and values (6,) by nodes."""

    place: str
    number: int
    root: complex
    ratio: float
    nodes: dict[int, np.ndarray]
    is_complex: bool


def read_uff_modes(path: str | PathLike) -> MeasuredModes:
    """All modes of a file of a modal test, in ascending order, for `experiment.update`.

    Normal modes have a frequency [Hz] and a viscous damping ratio, or half of a hysteretic one; complex modes an
    eigenvalue [rad/s], of whose conjugate pairs one is taken.  Channels are "node direction", as "12 z", those of the
    file's global directions; a channel that is zero in every mode was not measured and is left out, as are damping
    ratios unless every mode has one above zero.  Shapes of rotations beside translations are in rad and m, by the
    units of the file (data set 164).

    Warns: UserWarning that lists what is left out: rigid modes, stresses, responses, transfer functions.

    Raises: ModelFileError with every fault, by data set and line: no modes, data sets that are cut off, numbers that
    are not finite, values per node that are neither 3 nor 6, nodes or modes that are there twice.
    """
    faults: list[str] = []
    modes, others = _modes(read_bytes(path, _MOST_BYTES), faults)
    modes = sorted(_without_conjugates(modes), key=lambda mode: abs(mode.root))
    proper = [mode for mode in modes if mode.root.imag > 0]
    others.update(["rigid or overdamped mode"] * (len(modes) - len(proper)))
    if not proper and not faults:
        had = f": it has {_count_functions(others)}" if others else ""
        faults.append(f"it has no modes (data set 55, normal modes or complex eigenvalues){had}")
    faults += _repeated(proper)
    names, shapes = _shapes(proper) if proper else ((), np.zeros((0, 0)))
    if proper and not names and not faults:
        faults.append("the shapes of all its modes are zero")
    if faults:
        more = [f"and {len(faults) - _MOST_FAULTS} more"] if len(faults) > _MOST_FAULTS else []
        raise ModelFileError(path, faults[:_MOST_FAULTS] + more)
    ratios = np.array([mode.ratio for mode in proper])
    if np.any(ratios > 0) and not np.all(ratios > 0):
        others["damping, as some ratios are not above zero"] += 1
    if others:
        warn(f"{path}: left out: {_count_functions(others)}")
    frequencies = np.array([abs(mode.root) for mode in proper]) / (2 * np.pi)
    return MeasuredModes(frequencies, shapes, names, ratios if np.all(ratios > 0) else None)


def _modes(content, faults):
    """Modes with translations in metres, and how often the file has what else."""
    found = []
    others = collections.Counter()
    units = FileUnits()
    for data in data_sets(content, faults):
        try:
            if data.number == 164:
                units = file_units(data)
            elif data.number != 55:
                others.update([] if data.number in (*_IGNORED_SILENTLY, *_GEOMETRY) else [f"data set {data.number}"])
            elif (other := _other_content(data)) is not None:
                others[other] += 1
            else:
                found.append(_mode_of(data, units.length))
        except FunctionError as error:
            faults.append(str(error))
    return found, others


def _header(data):
    """Analysis, characteristic, kind of data, type of number, and number of values per node."""
    if len(data.lines) < _HEADER:
        raise FunctionError(f"{data.place}: its header of {_HEADER} lines is cut off")
    return _integers(data, 5, [(10 * k, 10 * k + 10) for k in range(6)])[1:]


def _other_content(data: DataSet) -> str | None:
    """The content of a data set that has no mode."""
    analysis, _, kind, _, _ = _header(data)
    if analysis not in (_NORMAL, *_COMPLEX):
        return f"data of a {_ANALYSES.get(analysis, f'number {analysis}')} analysis"
    return None if kind in _MOTIONS else f"shape of stress, strain or another kind ({kind}) than motion"


def _mode_of(data: DataSet, length: float) -> _Mode:
    analysis, characteristic, _, number_type, per_node = _header(data)
    if number_type not in (2, 5):
        raise FunctionError(f"{data.place}: its data type {number_type} is neither real (2) nor complex (5)")
    if characteristic not in (0, 2, 3) or per_node not in (3, 6):
        said = f"{per_node} values per node, of the characteristic {characteristic}"
        raise FunctionError(f"{data.place}: {said}: vectors (2, 3) of 3 or 6 values are read")
    _, count, _, number = _integers(data, 6, [(10 * k, 10 * k + 10) for k in range(4)])
    reals = _reals(data.lines[7], data)
    if len(reals) < min(count, 2) or not np.all(np.isfinite(reals)):
        raise FunctionError(f"{data.place}: its eigenvalue cannot be read: {data.lines[7].strip()[:60]!r}")
    if analysis == _NORMAL:
        f, _, viscous, hysteretic = [*reals.tolist(), 0.0, 0.0, 0.0][:4]
        root, ratio = 2j * np.pi * f, viscous or hysteretic / 2
    else:
        root = complex(*reals[:2])
        ratio = -root.real / abs(root) if root else 0.0
    size = np.repeat([length, 1.0], 3)
    nodes = {node: size * values for node, values in _values(data, number_type == 5, per_node).items()}
    return _Mode(data.place, number, root, ratio, nodes, number_type == 5)


def _values(data, is_complex, per_node):
    """Six values by nodes, from lines of a number and lines of values."""
    lines = iter(line for line in data.lines[_HEADER:] if line.strip())
    found = {}
    size = per_node * (1 + is_complex)
    for line in lines:
        if not line.strip().isdigit():
            raise FunctionError(f"{data.place}: {line.strip()[:40]!r} stands where a node number should")
        node, numbers = int(line), np.zeros(0)
        while len(numbers) < size and (line := next(lines, "")):
            numbers = np.append(numbers, _reals(line, data))
        if len(numbers) != size:
            raise FunctionError(f"{data.place}: node {node} has {len(numbers)} numbers, not {size}")
        if not np.all(np.isfinite(numbers)):
            raise FunctionError(f"{data.place}: the values of node {node} are not finite")
        if node in found:
            raise FunctionError(f"{data.place}: node {node} is there twice")
        values = numbers[::2] + 1j * numbers[1::2] if is_complex else numbers
        found[node] = np.pad(values, (0, 6 - per_node))
    return found


def _without_conjugates(modes):
    """One of each pair; a mode of the lower half plane without its partner as its conjugate."""
    upper = [mode for mode in modes if mode.root.imag >= 0]
    for mode in modes:
        if mode.root.imag < 0:
            flipped = mode._replace(
                root=mode.root.conjugate(), nodes={node: values.conj() for node, values in mode.nodes.items()}
            )
            if not any(abs(flipped.root - one.root) < 1e-4 * abs(one.root) for one in upper):
                upper.append(flipped)
    return upper


def _repeated(modes):
    count = collections.Counter((mode.number, mode.root) for mode in modes)
    return [
        f"{mode.place}: mode {mode.number} of {abs(mode.root) / (2 * np.pi):g} Hz is there twice"
        for k, mode in enumerate(modes)
        if count[mode.number, mode.root] > 1 and (mode.number, mode.root) in [(m.number, m.root) for m in modes[:k]]
    ]


def _shapes(modes):
    """Names of channels and shapes (channels, m); a node that a data set leaves out is zero, as the format says."""
    nodes = sorted({node for mode in modes for node in mode.nodes})
    names = [f"{node} {direction}" for node in nodes for direction in DIRECTIONS]
    zero, kind = np.zeros(6), complex if any(mode.is_complex for mode in modes) else float
    table = np.array([[mode.nodes.get(node, zero) for node in nodes] for mode in modes], kind)
    table = table.reshape(len(modes), -1).T
    is_measured = np.any(table != 0, axis=1)
    return tuple(name for name, kept in zip(names, is_measured, strict=True) if kept), table[is_measured]
