"""Reader of standard input data."""

import os
from collections.abc import Sequence

import numpy as np

from ...checks import no_such
from ...errors import ModelFileError
from ...flexible import ElasticBody
from ...math._linalg import skew
from .._numbers import real, whole
from .._regular_file import read_bytes
from ._text import Expansion, expansion, parse
from ._write_sid import PAIRS

_MOST_BYTES = 200_000_000
_ZERO = 1e-9  # of the largest entry: shapes of the first interface that count as none
_RANK = 1e-8  # of the largest singular value


def read_sid(path: str | os.PathLike, interfaces: Sequence[str]) -> ElasticBody:
    """Read an elastic body from standard input data of flexible bodies (SID) in text, as FEM programs write them.

    Args: interfaces: names of the nodes to attach joints to; the first carries the body's frame, so that no mode may
        move it.

    The modes become displacements and rotations of the other interfaces and, of what is left of them, modal
    coordinates; a body of few modes may have one interface only.  Stiffening terms are not told apart and enter as
    they stand; where Oe has no first order, rotation does not soften.

    Returns: the body, for `SystemBuilder.elastic`.

    Raises: ModelFileError for a file that is not understood, with the line; a node that there is not; modes that move
    the first interface, or cannot move another one in all six ways.
    Source: Wallrapp (1994).
    """
    interfaces = (interfaces,) if isinstance(interfaces, str) else tuple(interfaces)
    text = read_bytes(path, _MOST_BYTES).decode("latin-1")
    try:
        modal = parse(text)["part"]["modal"]
        modes = whole(modal["refmod"]["nelastq"])
        mass = real(modal["refmod"]["mass"].lower().replace("d", "e"))
        given = {name: expansion(part, modes) for name, part in modal.items() if "nrow" in part}
        nodes = {
            name: {key: expansion(part, modes) for key, part in node.items() if "nrow" in part}
            for name, node in modal["frame"].nodes.items()
        }
        missing = [name for name in ("mdcm", "j", "ct", "cr", "me", "ke") if name not in given]
        if missing:
            raise ValueError(f"it has no {', '.join(missing)}")
        S = _inertia(mass, given, modes)
    except (KeyError, TypeError, ValueError) as error:
        what = f"it has no section {error}" if isinstance(error, KeyError) else str(error)
        raise ModelFileError(path, [f"it is no standard input data: {what}"]) from error
    faults = _node_faults(nodes, interfaces)
    if faults:
        raise ModelFileError(path, faults)
    P, faults = _coordinates(nodes, interfaces, modes)
    if faults:
        raise ModelFileError(path, faults)
    places = [nodes[name]["origin"].m0[:, 0] for name in interfaces]
    T = np.zeros((6 + 4 * modes, 6 + 4 * modes))
    T[:6, :6] = np.eye(6)
    T[3:6, :3] = np.asarray(skew(places[0]))  # v of the body's origin = v of the first interface - omega x place
    T[6:, 6:] = np.kron(np.eye(4), P)
    none = Expansion(np.zeros((modes, modes)), np.zeros(0))
    return ElasticBody(
        inertia=T.T @ S @ T,
        stiffness=_symmetric_part(P.T @ given["ke"].m0 @ P),
        damping=_symmetric_part(P.T @ given.get("de", none).m0 @ P),
        places=np.array(places[1:]).reshape(-1, 3) - places[0],
        interfaces=interfaces,
    )


def _inertia(mass, given, m):
    """The matrix of `ElasticBody.inertia` (6 + 4 m, 6 + 4 m)."""
    S, q = np.zeros((6 + 4 * m, 6 + 4 * m)), slice(6 + 3 * m, None)
    Ct, Cr, J = given["ct"].m0.reshape(m, 3), given["cr"], given["j"]
    N = _by_mode(given["gr"].m0, 3, m) / 2 if "gr" in given else J.m1 / 2
    if "ge" in given:
        G = _by_mode(given["ge"].m0, m, m) / 2
    else:
        G = Cr.m1.reshape(m, 3, m)
    S[:3, :3], S[3:6, 3:6] = _symmetric_part(J.m0), mass * np.eye(3)
    S[3:6, :3] = -np.asarray(skew(given["mdcm"].m0[:, 0]))
    S[q, 3:6], S[q, :3], S[q, q] = Ct, Cr.m0.reshape(m, 3), _symmetric_part(given["me"].m0.reshape(m, m))
    centre = given["mdcm"].m1.reshape(3, m).T
    turned = np.cross(np.eye(3)[:, None, :], (centre if np.any(centre) else Ct)[None])  # e_a x c_i: (a, i, b)
    S[6 : 6 + 3 * m, 3:6] = turned.reshape(3 * m, 3)
    S[6 : 6 + 3 * m, :3] = N.transpose(1, 2, 0).reshape(3 * m, 3)
    S[q, 6 : 6 + 3 * m] = G.reshape(m, 3 * m)
    if "oe" in given:
        W = np.zeros((3, m, 3, m))
        for k, (a, b) in enumerate(PAIRS):
            part = -given["oe"].m1[:, k] * (1.0 if a == b else 0.5)
            W[a, :, b], W[b, :, a] = part, part.T
        S[6 : 6 + 3 * m, 6 : 6 + 3 * m] = _symmetric_part(W.reshape(3 * m, 3 * m))
    for low, high in ((slice(3, 6), slice(0, 3)), (slice(6, None), slice(0, 6)), (q, slice(6, 6 + 3 * m))):
        S[high, low] = S[low, high].T
    return S


def _by_mode(matrix, rows, m):
    """(rows, 3, m) of (rows, 3 m), in which the three columns of a mode stand side by side."""
    return matrix.reshape(rows, m, 3).transpose(0, 2, 1)


def _node_faults(nodes, interfaces):
    faults = [] if interfaces else ["an elastic body needs at least one interface"]
    faults += [no_such("node", name, nodes) for name in interfaces if name not in nodes]
    if len(set(interfaces)) < len(interfaces):
        faults.append("an interface is given twice")
    for name in (name for name in interfaces if name in nodes):
        lacks = [key for key in ("origin", "phi", "psi") if key not in nodes[name]]
        turned = "ap" in nodes[name] and not np.allclose(nodes[name]["ap"].m0, np.eye(3), atol=1e-9)
        faults += [f"node {name!r} has no {', '.join(lacks)}"] if lacks else []
        faults += [f"the axes of node {name!r} are turned; they must agree with those of the body"] if turned else []
    return faults


def _coordinates(nodes, interfaces, m):
    """Modes (m, m) per displacement and rotation of each further interface, then per modal coordinate; faults."""
    moved = [np.concatenate([nodes[n][key].m0.reshape(3, m) for key in ("phi", "psi")]) for n in interfaces]
    largest = max((np.abs(part).max(initial=0.0) for node in nodes.values() for part in
                   (node[key].m0 for key in ("phi", "psi") if key in node)), default=0.0)  # fmt: skip
    if np.abs(moved[0]).max(initial=0.0) > _ZERO * largest:
        return None, [f"modes move the first interface {interfaces[0]!r}: name one that is fixed in the body's frame"]
    D = np.concatenate([*moved[1:], np.zeros((0, m))])
    if len(D) == 0 or np.array_equal(D, np.eye(len(D), m)):
        return np.eye(m), []
    U, size, V = np.linalg.svd(D)
    rank = int(np.sum(size > _RANK * size.max(initial=0.0)))
    if rank < len(D):
        names = ", ".join(map(repr, interfaces[1:]))
        ways = f"the modes move {names} in {rank} independent ways of {len(D)}"
        return None, [f"{ways}: name fewer interfaces, or write the body with more modes"]
    return np.concatenate([np.linalg.pinv(D), V[rank:].T], axis=1), []


def _symmetric_part(A):
    return 0.5 * (A + A.T)
