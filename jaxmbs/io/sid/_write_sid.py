"""Writer of standard input data."""

import os
from collections.abc import Iterator

import numpy as np

from ...atomic_write import write_atomic
from ...checks import is_concrete
from ...errors import ModelError
from ...flexible import ElasticBody, FloatingFrame
from ...math._linalg import skew
from ._text import matrix_lines

#: Order of the products of angular velocities in Oe: xx yy zz xy yz xz.
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))


def write_sid(path: str | os.PathLike, body: ElasticBody | FloatingFrame) -> None:
    """Write an elastic body as standard input data of flexible bodies (SID) in text.

    Args: body: of a floating frame all nodes of its substructure are written, of a body its interfaces.

    Modes are the deformations of the body: displacements and rotations of all interfaces but the first, then the
    modal coordinates.

    Raises: TypeError for another object; ModelError for a body with stiffening, or with faults; OSError.
    Source: Wallrapp (1994).
    """
    frame, body = (body, body.body) if isinstance(body, FloatingFrame) else (None, body)
    if not isinstance(body, ElasticBody):
        raise TypeError(f"body must be an ElasticBody or a FloatingFrame, got {type(body).__name__}")
    faults = list(body.faults()) if is_concrete(body) else ["its numbers are not known: it is traced"]
    if body.stiffening is not None:
        faults.append("its stiffening is of second order, which is not written: make it without")
    if faults:
        raise ModelError(faults, "the elastic body")
    nodes = list(_interfaces(body) if frame is None else _nodes(frame))
    title = f"{len(nodes)} {body.num_deformations} : number of nodes, number of modes"
    write_atomic(path, "\n".join([title, *_body_lines(body, nodes)]) + "\n")


def _body_lines(body, nodes) -> Iterator[str]:
    S, m = np.asarray(body.inertia, float), body.num_deformations
    q, turned = slice(6 + 3 * m, None), S[:, 6 : 6 + 3 * m].reshape(-1, 3, m)
    yield "part"
    yield "new modal"
    yield "refmod"
    yield f"   mass      = {S[3, 3]:.17g}"
    yield f"   nelastq   = {m}"
    for k in range(m):
        yield f"   ielastq({k + 1}) = deformation {k + 1}"
    yield "end refmod"
    yield "frame"
    for name, origin, phi, psi in nodes:
        yield from _node_lines(name, origin, phi, psi, m)
    yield "end frame"
    N, G = turned[:3], turned[q]  # (b, a, i): r x (e_a x Phi_i); (i, a, j): Phi_i . (e_a x Phi_j)
    W = S[6 : 6 + 3 * m, 6 : 6 + 3 * m].reshape(3, m, 3, m)
    centre = np.array([S[4, 2], S[5, 0], S[3, 1]])  # S[3:6, :3] = -skew(m c)
    moved = np.stack([turned[4, 2], turned[5, 0], turned[3, 1]])  # (e_a x c)_b; of finite elements not quite Ct
    Ct = S[q, 3:6]
    J1 = N + N.transpose(1, 0, 2)
    Oe = -np.stack([(J1[a, b] if a != b else N[a, a]) for a, b in PAIRS], axis=1)
    mixed = W.transpose(1, 0, 2, 3)  # (i, a, b, j)
    Oe1 = -np.stack([mixed[:, a, b] + (a != b) * mixed[:, b, a] for a, b in PAIRS], axis=1)
    yield from matrix_lines("mdCM", centre[:, None], moved[:, None, :], m)
    yield from matrix_lines("J", S[:3, :3], J1, m)
    yield from matrix_lines("Ct", Ct, None, m)
    yield from matrix_lines("Cr", S[q, :3], G, m)
    yield from matrix_lines("Me", S[q, q], None, m)
    yield from matrix_lines("Gr", 2 * N.transpose(0, 2, 1).reshape(3, 3 * m), None, m)
    yield from matrix_lines("Ge", 2 * G.transpose(0, 2, 1).reshape(m, 3 * m), None, m)
    yield from matrix_lines("Oe", Oe, Oe1, m)
    yield from matrix_lines("ksigma", np.zeros((m, 1)), None, m)
    yield from matrix_lines("Ke", np.asarray(body.stiffness, float), None, m)
    yield from matrix_lines("De", np.asarray(body.damping, float), None, m)
    yield "end modal"
    yield "end part"


def _node_lines(name, origin, phi, psi, m):
    yield f"new node = {name}"
    yield "   rframe    = body ref"
    yield from matrix_lines("origin", origin[:, None], phi[:, None, :], m)
    yield from matrix_lines("phi", phi, None, m)
    yield from matrix_lines("psi", psi, None, m)
    yield from matrix_lines(
        "AP", np.eye(3), np.moveaxis(np.array([skew(c) for c in psi.T]).reshape(-1, 3, 3), 0, 2), m
    )
    yield "end node"


def _interfaces(body):
    """Names, origins (3,), displacements and rotations (3, m) of the interfaces."""
    places, m = np.asarray(body.places, float), body.num_deformations
    yield body.interfaces[0], np.zeros(3), np.zeros((3, m)), np.zeros((3, m))
    for k, name in enumerate(body.interfaces[1:]):
        shapes = np.eye(m)[6 * k : 6 * k + 6]
        yield name, places[k], shapes[:3], shapes[3:]


def _nodes(frame):
    """Likewise of all nodes of the substructure, the interfaces first."""
    s, m = frame.system, frame.body.num_deformations
    about = np.asarray(s.positions[s.nodes.index(frame.body.interfaces[0])], float)
    places, shapes = {label: k for k, label in enumerate(s.coordinates)}, np.asarray(frame.shapes, float)

    def rows(node, directions):
        at = [places.get((node, d)) for d in directions]
        return np.stack([np.zeros(m) if k is None else shapes[k] for k in at])

    rest = [node for node in s.nodes if node not in frame.body.interfaces]
    for node in (*frame.body.interfaces, *rest):
        origin = np.asarray(s.positions[s.nodes.index(node)], float) - about
        yield node, origin, rows(node, ("x", "y", "z")), rows(node, ("rx", "ry", "rz"))
