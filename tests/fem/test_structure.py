"""Declaring, assembling and recovering structures: faults, block form against dense form, gradients, batches."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs import blocksparse as bs
from jaxmbs.elements import Beam, GroundSpring, Hexahedron, PointMass, Quadrilateral, Rod, Spring, Triangle
from jaxmbs.errors import ModelError
from jaxmbs.fem import (
    Structure,
    assemble_blocks,
    assemble_dense,
    body_load,
    element_forces,
    element_matrices,
    gather_rows,
    line_load,
    nodal_load,
    node_pattern,
    pressure_load,
    scatter_rows,
)
from jaxmbs.linear import rigid_motions

CUBE = [[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]


def mixed():
    """Beams on a held base, a knee of rods, a spring and a mass: nodes of three and of six coordinates."""
    nodes = {"f0": (0.0, 0, 0), "f1": (1.0, 0, 0), "f2": (0.0, 1, 0), "knee": (0.3, 0.4, 0.9), "base": (1.0, 1, 0)}
    nodes |= {"top": (0.6, 0.5, 2.0), "side": (1.8, 0.5, 1.3)}
    beam = Beam(5.0, 2.0, 0.3, 0.02, 0.03, 0.04, 1.0, shear=(0.8, 0.8), reference=(0, 1, 0))
    rods = [Rod(4.0, 0.1 * k, 1.0) for k in range(1, 6)]
    elements = {
        "beams": (beam, [("base", "top"), ("side", "top")]),
        "rods": (rods, [("knee", "f0"), ("knee", "f1"), ("f2", "knee"), ("knee", "top"), ("f1", "side")]),
        "mount": (Spring((1.0, 2, 3, 4, 5, 6), damper=(0.1,) * 6), [("side", "base")]),
        "mass": (PointMass(2.0, (0.0, 0.1, 0.2), 0.1 * np.eye(3)), [("side",)]),
    }
    held = {f"f{i}": "x y z" for i in range(3)} | {"base": "all", "side": ["rx"]}
    return Structure(nodes, elements, held)


@jax.jit
def both(structure):
    dense, blocks = assemble_dense(structure), assemble_blocks(structure)
    return dense, [b.to_dense() for b in blocks]


@pytest.mark.long
def test_block_form_is_the_dense_form():
    """The same matrices, held and absent coordinates set aside."""
    structure = mixed()
    assert structure.size == 6 and structure.sizes.tolist() == [3, 3, 3, 3, 6, 6, 6]
    table = structure.index.table
    assert (structure.index.num_rows, table[0, 0], table[3, 3], table[6, 3]) == (3 + 6 + 5, -1, -1, -1)
    assert structure.labels[0] == ("knee", "x") and structure.labels[-1] == ("side", "rz")
    rows = np.nonzero(table.ravel() >= 0)[0]
    (K, M), (K6, M6) = both(structure)
    np.testing.assert_allclose(K6[np.ix_(rows, rows)], K, atol=1e-14)
    np.testing.assert_allclose(M6[np.ix_(rows, rows)], M, atol=1e-14)
    rest = np.setdiff1d(np.arange(42), rows)
    held = [6 * n + d for n, d in structure.held]
    np.testing.assert_array_equal(K6[np.ix_(rest, rest)], np.diag(np.isin(rest, held).astype(float)))
    assert not np.any(K6[np.ix_(rest, rows)]) and not np.any(M6[rest])


@pytest.mark.long
def test_single_precision():
    """Blocks of a structure cast as a whole."""
    single = jax.tree.map(lambda leaf: leaf.astype(jnp.float32), mixed())
    (K,) = assemble_blocks(single, ("stiffness",))
    assert K.diagonal.dtype == jnp.float32
    np.testing.assert_allclose(K.to_dense(), both(mixed())[1][0], atol=2e-5)


FRAME = {"a": (0.0, 0, 0), "b": (1.0, 0, 0), "c": (0.9, 0.1, 1.0), "d": (0.1, 0.9, 1.1), "e": (0.5, 0.4, 1.6)}


def frame(young, positions):
    """Four beams of one kind on two feet, braced by a rod."""
    beam = Beam(young, 2.0, 0.3, 0.02, 0.03, 0.04, 1.0, reference=(0.5, 1.0, 0.1))
    beams = [("b", "c"), ("c", "e"), ("e", "d"), ("a", "d")]
    elements = {"beams": (beam, beams), "brace": (Rod(4.0, 0.1, 1.0), [("a", "c")])}
    return Structure(dict(zip(FRAME, positions, strict=True)), elements, {"a": "all", "b": "x y z"})


@pytest.mark.long
def test_block_solve_gradient_and_batch():
    """Compliance by the block solver equals the dense one; gradients by modulus and by every position."""
    at = jnp.asarray(list(FRAME.values()))
    tip = nodal_load(frame(1.0, at), {"e": {"z": -1.0, "ry": 0.3}})
    plan = bs.analyse(node_pattern(frame(1.0, at)))

    def compliance(young, positions, block):
        s = frame(young, positions)
        load = tip + body_load(s, (0.0, 0.0, -0.1))
        if block:
            free = scatter_rows(s, gather_rows(s, load))
            return jnp.sum(free * bs.solve_once(assemble_blocks(s, ("stiffness",))[0], free, plan=plan))
        f = gather_rows(s, load)
        return f @ jnp.linalg.solve(assemble_dense(s, ("stiffness",))[0], f)

    young = jnp.array([2.0, 3.0, 5.0])
    dense = jax.jit(jax.vmap(lambda e, x: compliance(e, x, False), (0, None)))
    found, slopes = jax.jit(jax.vmap(jax.value_and_grad(lambda *a: compliance(*a, True), (0, 1)), (0, None)))(
        young, at
    )
    np.testing.assert_allclose(found, dense(young, at), rtol=1e-10)
    moves = np.random.default_rng(2).normal(size=(2, 5, 3))
    for e, x in ((1.0, 0 * at), (0.0, moves[0]), (0.0, moves[1])):
        ahead, behind = (dense(young + d * e, at + d * x) for d in (1e-6, -1e-6))
        slope = slopes[0] * e + np.einsum("kni,ni->k", slopes[1], np.asarray(x))
        np.testing.assert_allclose(slope, (ahead - behind) / 2e-6, rtol=1e-6)


@pytest.mark.long
def test_reactions_of_elements_balance():
    """At every free node the elements' forces, as `k_e x`, add up to the load; all of them balance as a whole."""
    structure = mixed()
    load = nodal_load(structure, {"side": {"z": -1.0}})
    x = jnp.linalg.solve(both(structure)[0][0], gather_rows(structure, load))
    u = np.asarray(scatter_rows(structure, x))
    total = np.zeros((7, 6))
    for name, group in structure.groups.items():
        k, c = group.element.num_nodes, group.element.coordinates
        for row, matrix in zip(group.nodes, np.asarray(element_matrices(structure, name)), strict=True):
            total[list(row), :c] += (matrix @ u[list(row), :c].ravel()).reshape(k, c)
    np.testing.assert_allclose(gather_rows(structure, total), gather_rows(structure, load), atol=1e-12)
    motions = np.asarray(rigid_motions(structure.positions)).reshape(42, 6)
    np.testing.assert_allclose(motions.T @ total.ravel(), 0.0, atol=1e-12)
    forces = element_forces(structure, x)
    assert {name: f.shape for name, f in forces.items()} == {
        "beams": (2, 12), "rods": (5, 1), "mount": (1, 6), "mass": (1, 0)
    }  # fmt: skip
    line = np.array([1.8, 0.5, 1.3]) - np.array([1.0, 0, 0])
    stretch = (u[6, :3] - u[1, :3]) @ line / np.linalg.norm(line) ** 2
    np.testing.assert_allclose(forces["rods"][4, 0], 4.0 * 0.5 * stretch, rtol=1e-12)


UNEVEN = np.eye(3) + np.eye(3, k=1)
ROD, BEAM = Rod(1.0, 1.0), Beam(1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
FAULTS = [
    (lambda: Structure({"a": (0, 0, 0), "b": (1, 0, 0)}, {"r": (ROD, [("a", "c")])}), "r: there is no node 'c'"),
    (lambda: Structure(np.eye(3), {"r": (ROD, [(0, 1, 2)])}), "r[0] joins 3 nodes, a Rod has 2"),
    (lambda: Structure(np.eye(3), {"r": (ROD, [(0, 1), (2, 2)])}), "r[1] repeats a node"),
    (lambda: Structure(np.eye(3), {"r": ([ROD, ROD], [(0, 1)])}), "r has 2 elements for 1 connections"),
    (lambda: Structure(np.eye(3), {"r": ([ROD, BEAM], [(0, 1), (1, 2)])}), "of one kind with equal settings"),
    (lambda: Structure(np.eye(3), {"r": (Rod(1.0, -1.0), [(0, 1)])}), "r[0]: area must not be negative"),
    (lambda: Structure(CUBE, {"h": (Hexahedron(1.0, 0.5), [tuple(range(8))])}), "poisson must lie between"),
    (lambda: Structure(np.eye(3), {"r": (Rod(np.nan, 1.0), [(0, 1)])}), "r[0]: young must be finite"),
    (lambda: Structure(np.zeros((2, 3)), {"r": (ROD, [(0, 1)])}), "r[0]: its nodes lie at one point"),
    (lambda: Structure(np.zeros((2, 2)), {"r": (ROD, [(0, 1)])}), "three components"),
    (
        lambda: Structure(np.eye(3), {"r": (ROD, [(0, 1)])}, {0: "w"}),
        "held at 0: unknown direction 'w', the directions are x, y",
    ),
    (lambda: Structure(np.eye(3), {"r": (ROD, [(0, 1)])}, {7: "x"}), "held: there is no node 7"),
    (
        lambda: Structure(np.eye(3), {"r": (ROD, [(0, 1)])}, {0: 2}),
        "held at 0: unknown direction 2, the directions are x, y",
    ),
    (lambda: Structure(np.eye(3), {"r": (ROD, [0, 1])}), "r[0] joins 1 nodes, a Rod has 2"),
    (
        lambda: Structure(np.diag([1.0, np.nan, 1.0]), {"r": (ROD, [(0, 1)])}),
        "the position of node '1' is not finite",
    ),
    (
        lambda: Structure(CUBE, {"h": (Hexahedron(1.0, 0.3), [(4, 5, 6, 7, 0, 1, 2, 3)])}),
        "h[0]: it is inside out or flat somewhere",
    ),
    (
        lambda: Structure(CUBE, {"q": (Quadrilateral(1.0, 0.3, 0.1), [(0, 1, 3, 2)])}),
        "q[0]: its corners do not go round",
    ),
    (
        lambda: Structure([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]], {"t": (Triangle(1.0, 0.3, 0.1), [(0, 1, 2)])}),
        "t[0]: its corners lie on a line",
    ),
    (
        lambda: Structure(CUBE, {"b": (Beam(1, 1, 1, 1, 1, 1, reference=(2.0, 0, 0)), [(0, 1)])}),
        "b[0]: its ends meet, or its reference lies along it",
    ),
    (
        lambda: Structure(CUBE, {"b": (Beam(1, 1, 1, 1, 2, 1), [(0, 1)])}),
        "b[0]: its section differs in y and z: give a reference",
    ),
    (lambda: Structure(CUBE, {"s": (Spring(np.triu(np.ones((6, 6)))), [(0, 1)])}), "s[0]: matrix must be symmetric"),
    (
        lambda: Structure(CUBE, {"s": (Spring((1.0,) * 6, axes=2 * np.eye(3)), [(0, 1)])}),
        "axes must be three right-handed orthogonal unit",
    ),
    (lambda: Structure(CUBE, {"s": (Spring((1.0,) * 6, axes=-np.eye(3)), [(0, 1)])}), "right-handed orthogonal"),
    (
        lambda: Structure(CUBE, {"q": (Quadrilateral(1, 0.3, 0.0), [(0, 1, 2, 3)])}),
        "q[0]: thickness must not be zero",
    ),
    (lambda: Structure(CUBE, {"t": (Triangle(1, 0.3, 0.0), [(0, 1, 2)])}), "t[0]: thickness must not be zero"),
    (lambda: Structure(CUBE, {"q": (Quadrilateral(0, 0.3, 0.1), [(0, 1, 2, 3)])}), "q[0]: young must not be zero"),
    (lambda: Structure(CUBE, {"h": (Hexahedron(0, 0.3), [tuple(range(8))])}), "h[0]: young must not be zero"),
    (lambda: Structure(CUBE, {"b": (Beam(*(1,) * 6, shear=(0, 1)), [(0, 1)])}), "b[0]: shear must not be zero"),
    (lambda: Structure(CUBE, {"b": (Beam(1, 0, *(1,) * 4, shear=(1, 1)), [(0, 1)])}), "b[0]: shear_modulus must not"),
    (lambda: Structure(CUBE, {"m": (PointMass(1, inertia=UNEVEN), [(0,)])}), "m[0]: inertia must be symmetric"),
    (
        lambda: Structure(CUBE, {"m": (PointMass(1, inertia=-np.eye(3)), [(0,)])}),
        "m[0]: inertia must not be negative",
    ),
    (lambda: Structure(CUBE, {}), "a structure needs at least one element"),
    (lambda: Structure(CUBE, {"r": (ROD, [])}), "a structure needs at least one element"),
    (lambda: Structure(CUBE, {"r": ([], [])}), "r has no element"),
    (lambda: Structure({}, {"r": (ROD, [(0, 1)])}), "a structure needs at least one node"),
    (lambda: Structure(np.zeros((0, 3)), {}), "a structure needs at least one node"),
    (lambda: Structure(CUBE, {"r": (ROD, [(0, 1)])}, {9: "all"}), "the model has 1 fault"),
]


@pytest.mark.parametrize(("make", "message"), FAULTS, ids=[message for _, message in FAULTS])
def test_faults(make, message):
    with pytest.raises(ModelError) as error:
        make()
    assert message in str(error.value)


def test_wrong_questions():
    """Releases that leave a mechanism, unknown matrices, loads on elements that take none, unknown nodes."""
    with pytest.raises(ValueError, match="mechanism"):
        Beam(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, releases=("rx1", "rx2"))
    with pytest.raises(ValueError, match="six numbers"):
        Spring((1.0, 2.0))
    with pytest.raises(ValueError, match="rq1"):
        Beam(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, releases=("rq1",))
    structure = Structure(CUBE, {"r": (ROD, [(0, 1)]), "g": (GroundSpring((1.0,) * 6), [(2,)])})
    with pytest.raises(ValueError, match="kind must be one of"):
        element_matrices(structure, "r", "compliance")
    with pytest.raises(ValueError, match="take no pressure"):
        pressure_load(structure, "r", 1.0)
    with pytest.raises(ValueError, match="take no line load"):
        line_load(structure, "r", (1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="take no line load"):
        element_forces(structure, jnp.zeros((8, 6)), {"r": (1.0, 0.0, 0.0)})
    with pytest.raises(ValueError, match="unknown direction 'q'"):
        nodal_load(structure, {"0": {"q": 1.0}})
    with pytest.raises(ValueError, match="values must be of shape"):
        gather_rows(structure, np.zeros((7, 6)))
    with pytest.raises(KeyError, match="nowhere"):
        nodal_load(structure, {"nowhere": {"x": 1.0}})
