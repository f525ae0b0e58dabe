"""The tree primitives against plain sums over dense numpy paths, and their derivative rules against autodiff."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from jaxmbs.kinematics import _tree as primitives
from jaxmbs.model._tree import Tree

CHAIN, BRANCHED = Tree((-1, 0, 1, 2)), Tree((-1, 0, 1, 0, 3, -1))


@st.composite
def trees(draw):
    """Parents in depth-first order: each new node hangs on the last one or on one of its ancestors."""
    parents, path = [], [-1]
    for k in range(draw(st.integers(2, 7))):
        path = path[: 1 + draw(st.integers(0, len(path) - 1))]
        parents.append(path[-1])
        path = [*path, k]
    return Tree(tuple(parents))


def above(tree):
    """paths[k, j] = 1 where j is k or an ancestor of k, by walking up."""
    paths = np.zeros((tree.size, tree.size))
    for k in range(tree.size):
        j = k
        while j >= 0:
            paths[k, j] = 1.0
            j = tree.parent[j]
    return paths


def skew(x):
    return np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])


def sample(tree, seed=0, batch=()):
    """Random local poses (as pairs), joint twists and inertias, batch axes last."""
    random, n = np.random.default_rng(seed), tree.size
    shape = (n, *batch)
    count = int(np.prod(shape))
    rotations = Rotation.random(count, random_state=random).as_matrix().reshape(*shape, 9)
    local = np.concatenate([rotations, random.normal(size=(*shape, 3))], axis=-1)
    dense = np.zeros((*shape, 6, 6))
    ten = np.zeros((*shape, 10))
    for index in np.ndindex(*shape):
        m, c, root = random.uniform(0.5, 2.0), random.normal(size=3), random.normal(size=(3, 3))
        about_origin = root @ root.T + m * skew(c) @ skew(c).T
        dense[index] = np.block([[about_origin, m * skew(c)], [m * skew(c).T, m * np.eye(3)]])
        ten[index] = [m, *(m * c), *about_origin[np.triu_indices(3)]]
    last = lambda x: jnp.asarray(np.moveaxis(x, -1, 1))
    return last(local), last(random.normal(size=(*shape, 6))), last(ten), dense


@pytest.fixture(scope="module")
def everything():
    def evaluate(tree, local, S, J, p):
        return (
            primitives.poses(tree, local),
            primitives.ancestors(tree, S),
            primitives.subtrees(tree, S),
            primitives.solve(tree, S, J, p),
            primitives.tree_mass_matrix(tree, S, J),
            primitives.apply_mass(tree, S, J, p),
        )

    return jax.jit(evaluate, static_argnums=0)


def dense_mass(tree, S, dense):
    """sum_k J_k^T I_k J_k with the columns on each body's path."""
    paths = above(tree)
    return sum((S * paths[k][:, None]) @ dense[k] @ (S * paths[k][:, None]).T for k in range(tree.size))


def check_against_dense(tree, local, S, dense, p, found):
    local, S = np.asarray(local), np.asarray(S)
    W, down, up, u, M, Mp = (np.asarray(x) for x in found)
    for k in range(tree.size):
        j, R, x = k, np.eye(3), np.zeros(3)
        while j >= 0:
            R_j = local[j, :9].reshape(3, 3)
            R, x = R_j @ R, R_j @ x + local[j, 9:]
            j = tree.parent[j]
        np.testing.assert_allclose(W[k], np.r_[R.ravel(), x], atol=1e-12)
    np.testing.assert_allclose(down, above(tree) @ S, atol=1e-12)
    np.testing.assert_allclose(up, above(tree).T @ S, atol=1e-12)
    expected = dense_mass(tree, S, dense)
    np.testing.assert_allclose(M, expected, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(Mp, expected @ p, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(expected @ u, p, atol=1e-8 * np.linalg.cond(expected) ** 0.5)


@pytest.mark.long
@settings(max_examples=6, deadline=None, database=None, derandomize=True)
@given(tree=trees(), seed=st.integers(0, 1000))
def test_primitives_are_what_they_say(everything, tree, seed):
    local, S, J, dense = sample(tree, seed)
    p = np.random.default_rng(seed).normal(size=tree.size)
    check_against_dense(tree, local, S, dense, p, everything(tree, local, S, J, jnp.asarray(p)))


@settings(max_examples=60, deadline=None, database=None)
@given(tree=trees())
def test_static_maps_of_the_tree(tree):
    np.testing.assert_array_equal(tree.path, above(tree) > 0)
    np.testing.assert_array_equal(tree.depth, above(tree).sum(axis=1) - 1)
    for k in range(tree.size):
        np.testing.assert_array_equal(np.nonzero(above(tree)[:, k])[0], np.arange(k, tree.end[k]))


@pytest.mark.long
@pytest.mark.parametrize("tree", [CHAIN, BRANCHED], ids=["chain", "branched"])
def test_batch_axes_stand_last(tree, everything):
    local, S, J, dense = sample(tree, 4, batch=(3,))
    p = jnp.asarray(np.random.default_rng(1).normal(size=(tree.size, 3)))
    W, down, up, u, M, Mp = everything(tree, local, S, J, p)
    assert M.shape == (3, tree.size, tree.size)
    for i in range(3):
        found = [x[..., i] for x in (W, down, up, u)] + [M[i], Mp[:, i]]
        check_against_dense(tree, local[..., i], S[..., i], dense[:, i], np.asarray(p[:, i]), found)


# ------------------------------------------------------------------------------------------------ derivatives
def turned(local, angles):
    """Local poses after a turn about z and a slide along z by the angle of each node: rotations stay rotations."""
    c, s, one, zero = jnp.cos(angles), jnp.sin(angles), jnp.ones_like(angles), jnp.zeros_like(angles)
    turn = jnp.stack([jnp.stack(row) for row in ((c, -s, zero), (s, c, zero), (zero, zero, one))])
    R = local[:, :9].reshape(-1, 3, 3)
    R = jnp.einsum("kij,jlk->kil", R, turn)
    return jnp.concatenate([R.reshape(-1, 9), local[:, 9:] + angles[:, None] * R[:, :, 2]], axis=1)


def naive_poses(tree, local):
    out = []
    for k, p in enumerate(tree.parent):
        R, x = local[k, :9].reshape(3, 3), local[k, 9:]
        if p >= 0:
            R, x = out[p][0] @ R, out[p][0] @ x + out[p][1]
        out.append((R, x))
    return jnp.stack([jnp.concatenate([R.reshape(9), x]) for R, x in out])


def naive_mass(tree, S, J):
    rows = []
    for k in range(tree.size):
        m, h = J[k, 0], J[k, 1:4]
        spin = jnp.stack([J[k, jnp.array([4, 5, 6])], J[k, jnp.array([5, 7, 8])], J[k, jnp.array([6, 8, 9])]])
        H = jnp.cross(jnp.broadcast_to(h[None], (3, 3)), jnp.eye(3), axisb=0, axisc=0)
        block = jnp.concatenate([jnp.concatenate([spin, H], axis=1), jnp.concatenate([H.T, m * jnp.eye(3)], axis=1)])
        own = S * jnp.asarray(above(tree)[k])[:, None]
        rows.append(own @ block @ own.T)
    return sum(rows)


NAIVE = {
    "poses": (
        lambda tree, a, local, S, J, p: primitives.poses(tree, turned(local, a)),
        lambda tree, a, local, S, J, p: naive_poses(tree, turned(local, a)),
    ),
    "ancestors": (
        lambda tree, a, local, S, J, p: primitives.ancestors(tree, S * jnp.sin(a)[:, None]),
        lambda tree, a, local, S, J, p: jnp.asarray(above(tree)) @ (S * jnp.sin(a)[:, None]),
    ),
    "subtrees": (
        lambda tree, a, local, S, J, p: primitives.subtrees(tree, S * jnp.sin(a)[:, None]),
        lambda tree, a, local, S, J, p: jnp.asarray(above(tree)).T @ (S * jnp.sin(a)[:, None]),
    ),
    "solve": (
        lambda tree, a, local, S, J, p: primitives.solve(
            tree, S * (1.0 + jnp.sin(a)[:, None] / 2.0), J * jnp.exp(a / 5.0)[:, None], p + a
        ),
        lambda tree, a, local, S, J, p: jnp.linalg.solve(
            naive_mass(tree, S * (1.0 + jnp.sin(a)[:, None] / 2.0), J * jnp.exp(a / 5.0)[:, None]), p + a
        ),
    ),
    "mass_matrix": (
        lambda tree, a, local, S, J, p: primitives.tree_mass_matrix(
            tree, S * (1.0 + jnp.sin(a)[:, None] / 2.0), J * jnp.exp(a / 5.0)[:, None]
        ),
        lambda tree, a, local, S, J, p: naive_mass(
            tree, S * (1.0 + jnp.sin(a)[:, None] / 2.0), J * jnp.exp(a / 5.0)[:, None]
        ),
    ),
}


@pytest.mark.parametrize("tree", [BRANCHED], ids=["branched"])
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.long) if n in ("mass_matrix", "solve", "poses") else n for n in NAIVE]
)
def test_derivative_rules(name, tree):
    """Value, JVP, VJP, Hessian-vector product (both orders of modes) and vmap of the gradient."""
    local, S, J, _ = sample(tree, 7)
    random = np.random.default_rng(3)
    p, v = jnp.asarray(random.normal(size=tree.size)), jnp.asarray(random.normal(size=tree.size))
    points = jnp.asarray(random.normal(size=(2, tree.size)))

    def all_derivatives(f):
        def vector(a):
            return f(tree, a, local, S, J, p)

        def scalar(a):
            y = vector(a)
            return jnp.sum(jnp.sin(y) * jnp.arange(1.0, y.size + 1.0).reshape(y.shape))

        def derivatives(a):
            gradient = jax.grad(scalar)
            return (
                vector(a),
                jax.jvp(vector, (a,), (v,))[1],
                gradient(a),
                jax.jvp(gradient, (a,), (v,))[1],
                jax.grad(lambda a: jnp.dot(gradient(a), v))(a),
            )

        return jax.jit(jax.vmap(derivatives))(points)

    ours, naive = (all_derivatives(f) for f in NAIVE[name])
    for a, b in zip(ours, naive, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-8 * np.abs(b).max())
