"""Coupled components against the dual saddle system, in which the bonds' forces are unknowns of their own."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.blocksparse import analyse
from jaxmbs.coupling import Components, coupled_response, interface_pattern

SIZE, INNER, NODES = 2, 3, 7
BARS = ((0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 6), (0, 3))  # one loop
HELD = ((-1, 0), (6, -1))


def stiffness(rng, count, places):
    """Positive definite inside, with rigid translations of the interface costing nothing: floating components."""
    n = places * SIZE + INNER
    rigid = np.vstack([np.tile(np.eye(SIZE), (places, 1)), rng.normal(size=(INNER, SIZE))])
    keep = np.eye(n) - rigid @ np.linalg.pinv(rigid)
    B = rng.normal(size=(count, n, n))
    return keep @ (B @ B.transpose(0, 2, 1) + np.eye(n)) @ keep


def groups(scale=1.0, complex_=False):
    rng = np.random.default_rng(4)
    made = []
    for nodes in (BARS, HELD):
        K = stiffness(rng, len(nodes), 2)
        Z = K * (1 + 0.1j) - 0.3 * np.eye(K.shape[1]) if complex_ else K
        load = rng.normal(size=K.shape[:2])
        made.append(Components(nodes, scale * jnp.asarray(Z), jnp.asarray(load)))
    return made, jnp.asarray(rng.normal(size=(NODES, SIZE)))


def dual(made, load):
    """Displacements of every component by itself, and the bonds' multipliers, from the dense saddle system."""
    blocks, loads, rows, at = [], [], [], 0
    total = sum(np.prod(g.load.shape) for g in made) + NODES * SIZE
    for g in made:
        for c, nodes in enumerate(g.nodes):
            for place, node in enumerate(nodes):
                for axis in range(SIZE):
                    row = np.zeros(total)
                    row[at + place * SIZE + axis] = 1.0
                    if node >= 0:
                        row[total - NODES * SIZE + node * SIZE + axis] = -1.0
                    rows.append(row)
            blocks.append(np.asarray(g.matrix[c]))
            loads.append(np.asarray(g.load[c]))
            at += len(blocks[-1])
    B = np.array(rows)
    K = np.zeros((total, total), blocks[0].dtype)
    at = 0
    for block in blocks:
        K[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    saddle = np.block([[K, B.T], [B, np.zeros((len(B), len(B)))]])
    right = np.r_[np.concatenate(loads), np.asarray(load).ravel(), np.zeros(len(B))]
    solution = np.linalg.solve(saddle, right)
    return solution[total - NODES * SIZE : total].reshape(NODES, SIZE), -solution[total:].reshape(-1, SIZE)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["cholesky", "ldl"])
def test_displacements_and_reactions(kind):
    """Static, and complex dynamic stiffness; seven floating components, two that are held."""
    made, load = groups(complex_=kind == "ldl")
    plan = analyse(interface_pattern(made, NODES, SIZE))
    found = jax.jit(lambda made, load: coupled_response(made, load, kind, plan))(made, load)
    x, forces = dual(made, load)
    np.testing.assert_allclose(found.interface, x, atol=1e-10)
    np.testing.assert_allclose(
        np.concatenate([np.asarray(r).reshape(-1, SIZE) for r in found.reactions]), forces, atol=1e-9
    )
    assert found.residual < 1e-12
    for g, inner in zip(made, found.internal, strict=True):
        assert inner.shape == (len(g.nodes), INNER)


@pytest.mark.long
def test_gradient_by_the_components():
    """Square sum of the reactions by one stiffness of every kind, against differences."""
    made, load = groups()

    @jax.jit
    def level(s):
        changed = [Components(g.nodes, g.matrix * (1 + s * k), g.load) for k, g in enumerate(made, 1)]
        return sum(jnp.sum(r**2) for r in coupled_response(changed, load).reactions)

    slope = jax.jit(jax.grad(level))(0.0)
    np.testing.assert_allclose(slope, (level(1e-5) - level(-1e-5)) / 2e-5, rtol=1e-6)


def test_wrong_nodes_are_told():
    made, load = groups()
    wrong = Components(((2, 2),), made[0].matrix[:1], made[0].load[:1])
    with pytest.raises(ValueError, match="component 0: nodes \\[2, 2\\] must be distinct and among 0 ... 6"):
        coupled_response([wrong], load)
