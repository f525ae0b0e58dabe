"""The block-sparse solver against dense LAPACK: graphs, kinds, precisions, derivatives, batches."""

from functools import partial

import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np
import pytest

from jaxmbs import blocksparse as bs
from tests.blocksparse.graphs import GRAPHS, chain, ladder, matrix, random_graph, star

SIZE = 2
TOLERANCE = {"float64": 1e-12, "float32": 2e-5, "complex128": 1e-12}


def right_hand_side(pattern, columns=(), dtype=float, seed=1):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(*pattern.shape, *columns))
    x = np.where(pattern.padding.reshape(*pattern.shape, *[1] * len(columns)), 0.0, x)
    return jnp.asarray(x, dtype)


@jax.jit
def dense_solution(A, right):
    n, b = A.pattern.shape
    full = A.to_dense() + jnp.diag(jnp.asarray(A.pattern.padding.ravel(), A.diagonal.dtype))
    return jnp.linalg.solve(full, right.reshape(n * b, -1)).reshape(right.shape)


MARKS = dict.fromkeys(("chain", "ring"), pytest.mark.slow)
MARKS |= dict.fromkeys(("binary tree", "ladder", "grid", "random"), pytest.mark.long)


@pytest.mark.parametrize("graph", [pytest.param(g, marks=MARKS.get(g, ())) for g in GRAPHS])
def test_every_graph_is_solved(graph):
    """Definite, with three columns; the transposed solve of the unsymmetric kind comes with its gradient below."""
    pattern = bs.Pattern(GRAPHS[graph][0], SIZE, GRAPHS[graph][1])
    A, right = matrix(pattern), right_hand_side(pattern, (3,))
    x = jax.jit(bs.solve_once)(A, right)
    np.testing.assert_allclose(x, dense_solution(A, right), atol=1e-13)


@pytest.mark.long
@pytest.mark.parametrize("kind, dtype", [(kind, dtype) for dtype in TOLERANCE for kind in ("cholesky", "ldl", "lu")])
def test_every_kind_in_every_precision(kind, dtype):
    """Complex "cholesky" is left out: complex symmetric matrices are not positive definite."""
    if (kind, dtype) == ("cholesky", "complex128"):
        pytest.skip("complex symmetric matrices have no Cholesky factor")
    pattern = bs.Pattern(*_sized(random_graph(20), 3))
    A, right = matrix(pattern, kind, np.dtype(dtype)), right_hand_side(pattern, dtype=np.dtype(dtype))

    @jax.jit
    def both(A, right):
        factor = bs.factor(A, kind)
        return bs.solve(factor, right), bs.solve(factor.T, right), bs.log_determinant(factor)

    x, transposed, (sign, log) = both(A, right)
    assert x.dtype == dtype
    np.testing.assert_allclose(x, dense_solution(A, right), atol=TOLERANCE[dtype])
    np.testing.assert_allclose(transposed, dense_solution(A.T, right), atol=TOLERANCE[dtype])
    expected = np.linalg.slogdet(np.asarray(A.to_dense()))
    np.testing.assert_allclose(sign, expected[0], atol=TOLERANCE[dtype])
    np.testing.assert_allclose(log, expected[1], rtol=TOLERANCE[dtype])


def _sized(graph, size):
    return graph[0], size, graph[1]


def test_large_pivots_are_not_inverted():
    """One dense front of 80 coordinates: the branch of triangular solves."""
    n = 20
    pattern = bs.Pattern(n, 4, [(i, j) for i in range(n) for j in range(i)])
    A, right = matrix(pattern), right_hand_side(pattern, (2,))
    factor = jax.jit(lambda A: bs.factor(A, leaf=n))(A)
    assert factor.plan.report.largest_front == 80
    np.testing.assert_allclose(jax.jit(bs.solve)(factor, right), dense_solution(A, right), atol=1e-13)


# ------------------------------------------------------------------------------------------------- orderings
@pytest.mark.long
def test_the_users_order_and_the_root():
    pattern = bs.Pattern(*_sized(random_graph(25), SIZE))
    A, right = matrix(pattern), right_hand_side(pattern)
    order = np.random.default_rng(3).permutation(25)
    for options in ({"order": order}, {"last": (3, 11)}, {"leaf": 1, "tiers": 2}):
        x = jax.jit(partial(bs.solve_once, **options))(A, right)
        np.testing.assert_allclose(x, dense_solution(A, right), atol=1e-12, err_msg=str(options))
    root = bs.analyse(pattern, last=(3, 11)).tiers[-1]
    assert {3, 11} <= set(root.pivot[-1, 0].tolist())


@pytest.mark.long
def test_planes_cut_a_mesh():
    """Median planes need less work on a block of hexahedra than level sets from a corner."""
    index = np.arange(8**3).reshape(8, 8, 8)
    cells = np.stack([index[i : 7 + i, j : 7 + j, k : 7 + k].ravel() for i, j, k in np.ndindex(2, 2, 2)], axis=1)
    pattern = bs.Pattern(8**3, 1, np.concatenate([cells[:, [r, s]] for r in range(8) for s in range(r)]))
    positions = np.stack(np.unravel_index(index.ravel(), index.shape), axis=1)
    by_planes, by_levels = bs.analyse(pattern, positions=positions), bs.analyse(pattern)
    assert by_planes.report.flops < by_levels.report.flops
    A, right = matrix(pattern), right_hand_side(pattern)
    x = jax.jit(partial(bs.solve_once, plan=by_planes))(A, right)
    np.testing.assert_allclose(A @ x, right, atol=1e-12)


@pytest.mark.parametrize("graph", [chain, ladder], ids=["chain", "ladder"])
def test_work_grows_linearly_and_depth_with_the_logarithm(graph):
    reports = [bs.analyse(bs.Pattern(*_sized(graph(n), 6))).report for n in (500, 4000)]
    assert reports[1].flops < 9.6 * reports[0].flops
    assert reports[1].factor_entries < 9.6 * reports[0].factor_entries
    assert reports[1].levels <= reports[0].levels + 4
    for report in reports:
        assert len(report.tiers) <= 8 and report.padded_flops < 1.5 * report.flops
    assert "Mflop" in str(reports[0])


def test_many_children_are_merged_in_groups():
    """A star of 300: its centre never has more than four fronts below it."""
    plan = bs.analyse(
        bs.Pattern(
            *_sized(star(300), SIZE),
        ),
        leaf=1,
    )
    assert max(t.updates.shape[1] for t in plan.tiers) <= 4
    assert plan.report.levels <= 7


# ------------------------------------------------------------------------------------------- small blocks
@pytest.mark.long
def test_blocks_of_different_sizes():
    sizes = {"base": 3, "arm": 1, "mast": 4, "tip": 2}
    pattern = bs.Pattern.from_graph(sizes, [("base", "arm"), ("mast", "arm"), ("mast", "tip"), ("tip", "base")])
    for kind in ("cholesky", "ldl", "lu"):
        A, right = matrix(pattern, kind), right_hand_side(pattern)
        used = ~pattern.padding.ravel()
        dense = np.asarray(A.to_dense())[np.ix_(used, used)]
        x, log = jax.jit(lambda A, right, kind=kind: _solution_and_log(bs.factor(A, kind), right))(A, right)
        np.testing.assert_allclose(
            np.asarray(x).ravel()[used], np.linalg.solve(dense, right.ravel()[used]), atol=1e-13
        )
        np.testing.assert_allclose(log, np.linalg.slogdet(dense)[1])
    parts = pattern.split(x)
    assert {name: v.shape for name, v in parts.items()} == {name: (n,) for name, n in sizes.items()}
    np.testing.assert_array_equal(pattern.join(parts), x)
    np.testing.assert_array_equal(pattern.join({"arm": jnp.ones(1)})[1], [1.0, 0.0, 0.0, 0.0])


def _solution_and_log(factor, right):
    return bs.solve(factor, right), bs.log_determinant(factor)[1]


@pytest.mark.long
def test_inertia_counts_the_frequencies_below():
    """A chain of masses between walls: eigenvalues 4 sin^2(j pi / 2(n + 1)) in closed form."""
    n = 40
    pattern = bs.Pattern(*_sized(chain(n), 1))
    K = bs.BlockMatrix(pattern, 2.0 * jnp.ones((n, 1, 1)), -jnp.ones((n - 1, 1, 1)))
    identity = bs.BlockMatrix(pattern, jnp.ones((n, 1, 1)), jnp.zeros((n - 1, 1, 1)))
    exact = 4 * np.sin(np.arange(1, n + 1) * np.pi / (2 * (n + 1))) ** 2
    count = jax.jit(lambda shift: bs.matrix_inertia(bs.factor(K + -shift * identity, "ldl")))
    for shift in (0.0, 0.5, 2.1, 3.3, 5.0):
        below = int(np.sum(exact < shift))
        assert tuple(map(int, count(shift))) == (n - below, below)


# ---------------------------------------------------------------------------------------------- derivatives
@pytest.fixture(scope="module")
def small():
    pattern = bs.Pattern(*_sized(ladder(8), 2))
    return pattern, right_hand_side(pattern)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["cholesky", "ldl", "lu"])
def test_derivatives_of_a_solution(kind, small):
    """jvp, vjp and their second orders against differences; equal to those of a dense solve."""
    pattern, right = small
    A = matrix(pattern, kind)

    def loss(A, right):
        return jnp.sum(bs.solve_once(A, right, kind, leaf=2) ** 3)

    def dense_loss(A, right):
        return jnp.sum(dense_solution(A, right) ** 3)

    ours = jax.jit(jax.grad(loss, (0, 1)))(A, right)
    theirs = jax.jit(jax.grad(dense_loss, (0, 1)))(A, right)
    for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-12)
    direction = matrix(pattern, kind, seed=5)
    along = lambda loss: jax.jit(jax.hessian(lambda s: loss(A + s * direction, (1.0 + s) * right)))
    np.testing.assert_allclose(along(loss)(0.1), along(dense_loss)(0.1), rtol=1e-9)
    if kind == "cholesky":
        at = jax.jit(lambda s: loss(A + s * direction, right))
        slope = jax.jit(jax.grad(lambda s: loss(A + s * direction, right)))(0.0)
        np.testing.assert_allclose(slope, (at(1e-5) - at(-1e-5)) / 2e-5, rtol=1e-7)


@pytest.mark.long
def test_the_gradient_through_a_stored_factor_is_that_of_a_fresh_solve(small):
    """Factor once, solve twice, each solution of the other: exact gradients, not those of a frozen matrix."""
    pattern, right = small
    A = matrix(pattern)

    def stored(A):
        factor = bs.factor(A)
        return jnp.sum(bs.solve(factor, bs.solve(factor, right)) ** 2)

    def fresh(A):
        return jnp.sum(bs.solve_once(A, bs.solve_once(A, right)) ** 2)

    factor = jax.jit(bs.factor)(A)  # made outside of what is differentiated: the values still carry the derivative
    outside = jax.jit(jax.grad(lambda f: jnp.sum(bs.solve(f, bs.solve(f, right)) ** 2), allow_int=True))(
        factor
    ).matrix
    for one in (jax.jit(jax.grad(stored))(A), outside):
        for a, b in zip(jax.tree.leaves(one), jax.tree.leaves(jax.jit(jax.grad(fresh))(A)), strict=True):
            np.testing.assert_allclose(a, b, atol=1e-13)
            assert np.abs(np.asarray(b)).max() > 1e-3


@pytest.mark.long
@pytest.mark.parametrize("kind", ["ldl", "cholesky", "lu"])
def test_derivatives_of_the_log_determinant(kind, small):
    pattern, _ = small
    A, direction = matrix(pattern, kind), matrix(pattern, kind, seed=5)

    def ours(s):
        return bs.log_determinant(bs.factor(A + s * direction, kind))[1]

    def theirs(s):
        return jnp.linalg.slogdet((A + s * direction).to_dense())[1]

    for derivative in (jax.grad, jax.jacfwd, jax.hessian):
        np.testing.assert_allclose(jax.jit(derivative(ours))(0.1), jax.jit(derivative(theirs))(0.1), rtol=1e-10)


@pytest.mark.long
def test_batches_over_values_right_hand_sides_and_both(small):
    pattern, right = small
    A = jax.tree.map(lambda *x: jnp.stack(x), *(matrix(pattern, seed=s) for s in range(3)))
    many = jnp.stack([right, 2.0 * right + 1.0, right**2])
    take = lambda k: jax.tree.map(lambda x: x[k], A)
    by_values = jax.jit(jax.vmap(bs.solve_once, (0, None)))(A, right)
    by_right = jax.jit(jax.vmap(bs.solve_once, (None, 0)))(take(0), many)
    by_both = jax.jit(jax.vmap(jax.value_and_grad(lambda A, r: jnp.sum(bs.solve_once(A, r) ** 2))))(A, many)
    for k in range(3):
        np.testing.assert_allclose(by_values[k], dense_solution(take(k), right), atol=1e-13)
        np.testing.assert_allclose(by_right[k], dense_solution(take(0), many[k]), atol=1e-13)
        x = dense_solution(take(k), many[k])
        np.testing.assert_allclose(by_both[0][k], jnp.sum(x**2))
        adjoint = dense_solution(take(k), 2.0 * x)
        np.testing.assert_allclose(by_both[1].diagonal[k], -adjoint[:, :, None] * x[:, None, :], atol=1e-12)


# ------------------------------------------------------------------------------------------------ the rest
@pytest.mark.long
@pytest.mark.parametrize("kind", ["cholesky", "lu"])
def test_as_a_lineax_solver(kind, small):
    pattern, right = small
    A = matrix(pattern, kind)
    solution = lambda A: lx.linear_solve(bs.BlockOperator(A), right, bs.BlockSolver(kind)).value
    np.testing.assert_allclose(jax.jit(solution)(A), dense_solution(A, right), atol=1e-13)
    ours = jax.jit(jax.grad(lambda A: jnp.sum(solution(A) ** 2)))(A)
    theirs = jax.jit(jax.grad(lambda A: jnp.sum(dense_solution(A, right) ** 2)))(A)
    for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-12)


@pytest.mark.long
def test_refinement_mends_an_ill_conditioned_chain():
    """Springs in series from a wall, 400 of stiffness 1 to 1e6 in turn: the residual falls by refinement."""
    n = 400
    pattern = bs.Pattern(*_sized(chain(n), 1))
    k = jnp.asarray(np.where(np.arange(n) % 2, 1.0, 1e6))
    diagonal = k + jnp.append(k[1:], 0.0)
    K = bs.BlockMatrix(pattern, diagonal[:, None, None], -k[1:, None, None])
    right = jnp.ones((n, 1))
    exact = np.cumsum((n - np.arange(n)) / np.asarray(k))
    once, refined = (jax.jit(lambda K, r=r: bs.solve(bs.factor(K), right, refine=r))(K) for r in (0, 2))
    worst = lambda x: float(jnp.max(jnp.abs(K @ x - right)))
    assert worst(refined) <= worst(once)
    np.testing.assert_allclose(refined[:, 0], exact, rtol=1e-6)


def test_assembly_of_elements_sums_what_they_share():
    """Springs of 3 by 3 between random pairs, some repeated and turned round, against a dense sum."""
    rng = np.random.default_rng(2)
    pairs = np.array([(0, 1), (1, 0), (2, 1), (2, 3), (3, 2), (0, 3)])
    k = rng.normal(size=(len(pairs), 6, 6))
    k = k + k.transpose(0, 2, 1)
    pattern = bs.Pattern(4, 3, pairs)
    elements = jnp.asarray(k.reshape(-1, 2, 3, 2, 3).transpose(0, 1, 3, 2, 4))
    dense = np.zeros((12, 12))
    for (i, j), each in zip(pairs, k, strict=True):
        rows = np.r_[3 * i : 3 * i + 3, 3 * j : 3 * j + 3]
        dense[np.ix_(rows, rows)] += each
    np.testing.assert_allclose(bs.assemble(pattern, pairs, elements).to_dense(), dense, atol=1e-14)
    with pytest.raises(ValueError, match="couples blocks 0 and 2"):
        bs.assemble(pattern, [(0, 2)], elements[:1])


def test_equal_patterns_share_one_analysis():
    n, edges = random_graph(15)
    one, two = bs.Pattern(n, 2, edges), bs.Pattern(n, 2, [(j, i) for i, j in reversed(edges)])
    assert one == two and hash(one) == hash(two) and bs.analyse(one) is bs.analyse(two)
    assert one != bs.Pattern(n, 3, edges) and one != bs.Pattern(n, 2, edges[:-1])


def test_a_matrix_that_is_not_definite_is_told():
    pattern = bs.Pattern(*_sized(chain(5), 2))
    good, bad = matrix(pattern), -1.0 * matrix(pattern)
    definite = jax.jit(lambda A: bs.is_finite(bs.factor(A)))
    assert definite(good) and not definite(bad)


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda: bs.Pattern(3, 2, [(0, 3)]), "two different blocks of 0 ... 2"),
        (lambda: bs.Pattern(3, 2, [(1, 1)]), "two different blocks"),
        (lambda: bs.Pattern(2, 2, [], names=("a", "a")), "stands there twice"),
        (lambda: bs.Pattern(2, 2, [], sizes=(1, 3)), "sizes must be 2 numbers of at most 2"),
        (lambda: bs.Pattern.from_graph({"a": 2}, [("a", "b")]), "no block is named 'b'"),
        (lambda: bs.analyse(bs.Pattern(3, 2, [(0, 1)]), order=(0, 1)), "permutation of 0 ... 2"),
        (lambda: bs.factor(matrix(bs.Pattern(2, 2, [(0, 1)])), "qr"), "kind must be one of cholesky, ldl, lu"),
        (lambda: bs.factor(matrix(bs.Pattern(2, 2, [(0, 1)]), "lu")), "use 'lu'"),
        (
            lambda: jax.jit(lambda A: bs.matrix_inertia(bs.factor(A, "lu")))(matrix(bs.Pattern(2, 2, []), "lu")),
            "factor(matrix, 'ldl')",
        ),
        (lambda: matrix(bs.Pattern(2, 2, [])) + matrix(bs.Pattern(3, 2, [])), "different patterns"),
    ],
)
def test_wrong_use_is_told(call, message):
    with pytest.raises(ValueError) as error:
        call()
    assert message in str(error.value)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["cholesky", "ldl"])
def test_unsymmetric_diagonal_blocks(kind):
    """Symmetric kinds refuse them, in a trace by values that are not finite; "lu" solves them and their transpose."""
    pattern = bs.Pattern(*_sized(chain(6), SIZE))
    A, right = matrix(pattern), right_hand_side(pattern)
    spoilt = bs.BlockMatrix(pattern, A.diagonal.at[2, 0, 1].add(0.5), A.upper)
    with pytest.raises(ValueError, match=f"kind '{kind}': diagonal blocks are unsymmetric by 0."):
        bs.factor(spoilt, kind)
    solve = jax.jit(lambda A: (bs.is_finite(bs.factor(A, kind)), bs.solve_once(A, right, kind)))
    finite, x = solve(A)
    assert finite and np.all(np.isfinite(x))
    finite, x = solve(spoilt)
    assert not finite and not np.any(np.isfinite(x))
    both = jax.jit(jax.vmap(lambda d: bs.is_finite(bs.factor(bs.BlockMatrix(pattern, d, A.upper), kind))))
    assert both(jnp.stack([A.diagonal, spoilt.diagonal])).tolist() == [True, False]

    @jax.jit
    def forth_and_back(A):
        factor = bs.factor(A, "lu")
        return bs.solve(factor, right), bs.solve(factor.T, right, 1)

    for found, matrix_ in zip(forth_and_back(spoilt), (spoilt, spoilt.T), strict=True):
        np.testing.assert_allclose(found, dense_solution(matrix_, right), atol=1e-13)
    np.testing.assert_allclose(spoilt.T.to_dense(), spoilt.to_dense().T)


def test_unsymmetric_elements_are_told():
    pattern = bs.Pattern(2, 1, [(0, 1)])
    with pytest.raises(ValueError, match="element matrices are unsymmetric by 0.5"):
        bs.assemble(pattern, [[0, 1]], jnp.array([[1.0, -0.5], [-1.0, 1.0]]).reshape(1, 2, 2, 1, 1))


@pytest.mark.long
@pytest.mark.parametrize("kind", ["lu", "ldl"])
def test_sign_of_a_determinant_whose_rows_change_places(kind):
    """Pivots off the diagonal of a block: each exchange of rows turns the sign."""
    blocks = np.array([[[0.0, 2.0], [2.0, 0.0]], [[3.0, 0.0], [0.0, 1.0]]])
    odd = bs.BlockMatrix(bs.Pattern(2, 2, []), jnp.asarray(blocks), jnp.zeros((0, 2, 2)))
    even = bs.BlockMatrix(odd.pattern, jnp.asarray(blocks[[0, 0]]), odd.upper)
    for A, sign, size in ((odd, -1.0, 12.0), (even, 1.0, 16.0)):
        np.testing.assert_allclose(bs.log_determinant(bs.factor(A, kind)), (sign, np.log(size)), rtol=1e-12)


def test_the_conjugate_operator():
    """Of a complex matrix, as lineax asks for it: transposed and conjugate are two things."""
    values = np.array([[[2.0 + 1.0j, 0.5j], [0.5j, 3.0 - 2.0j]]])
    operator = bs.BlockOperator(
        bs.BlockMatrix(bs.Pattern(1, 2, []), jnp.asarray(values), jnp.zeros((0, 2, 2), complex))
    )
    x = jnp.array([[1.0 + 2.0j, -1.0j]])
    np.testing.assert_allclose(lx.conj(operator).mv(x)[0], values[0].conj() @ x[0], rtol=1e-12)
    np.testing.assert_allclose(operator.T.mv(x)[0], values[0].T @ x[0], rtol=1e-12)
