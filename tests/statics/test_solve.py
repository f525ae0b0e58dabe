"""Reactions of bonds against closed forms and dense linear algebra on the matrix of S1 (26)-(27)."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.statics import Bonds, bond_reactions, reaction_family, reaction_matrix, redundancy, with_redundancy
from tests.statics.networks import applied, dense_reactions, four_bar, ladder, random_bonds, random_loads, solve


# ------------------------------------------------------------------------------------------------- closed forms
def bar(a, b):
    """Frame (3, 3) whose x axis points from a to b."""
    x = (b - a) / np.linalg.norm(b - a)
    y = np.array([-x[1], x[0], 0.0])
    return np.stack([x, y, np.cross(x, y)], axis=1)


def bracket(effort=None):
    bonds = {"foot": ("ground", "strut"), "wall": ("ground", "tie"), "tip": ("strut", "tie")}
    position = [(0.0, 0.0, 0.0), (0.0, 0.5773502691896257, 0.0), (1.0, 0.0, 0.0)]
    return Bonds.from_arrays(["strut", "tie"], bonds, position, carries=[(1, 1, 1, 1, 1, 0)] * 3, effort=effort)


@pytest.mark.long
def test_a_bracket_of_two_bars():
    """Strut and tie pinned to the wall, 1 kN down at the tip.

    Numbers: case G2_static_truss_bracket, closed form by the method of joints.
    """
    found = solve(bracket(), applied(["strut", "tie"], {"strut": [((0.0, -1000.0, 0.0), (1.0, 0.0, 0.0))]}))
    np.testing.assert_allclose(found["foot"].force, [1732.0508075688776, 0.0, 0.0], atol=1e-8)
    np.testing.assert_allclose(found["wall"].force, [-1732.0508075688776, 1000.0, 0.0], atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(found["tip"].force), 2000.0000000000002, atol=1e-8)
    np.testing.assert_allclose(found.components[:, 3:], 0.0, atol=1e-8)


@pytest.mark.long
def test_a_spring_in_a_pin():
    """A torsion spring at the tip turns the tie by 7 N m and the strut back: couples of the pins' forces."""
    tip, high = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.5773502691896257, 0.0])
    effort = np.zeros((3, 6))
    effort[2, 5] = 7.0
    found = solve(bracket(effort), np.zeros((2, 6)))
    np.testing.assert_allclose(found["tip"].moment, [0.0, 0.0, 7.0], atol=1e-11)
    for arm in (tip, tip - high):
        np.testing.assert_allclose(np.cross(arm, found["tip"].force)[2], -7.0, atol=1e-11)


@pytest.mark.long
def test_a_warren_truss_of_seven_bars():
    """Bars as bonds that carry one force between pins as bodies.

    Numbers: case G2_static_truss_bracket, closed form by the method of joints.
    """
    h = 0.8660254037844386
    nodes = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0], [0.5, h, 0], [1.5, h, 0]])
    bars = [(0, 1), (1, 2), (0, 3), (3, 1), (1, 4), (4, 2), (3, 4)]
    names = [f"pin {k}" for k in range(5)]
    bonds = {f"bar {a}{b}": (names[a], names[b]) for a, b in bars}
    frames = [bar(nodes[a], nodes[b]) for a, b in bars]
    carries = [(1, 0, 0, 0, 0, 0)] * 7
    for k in range(5):  # holds the pin out of plane and against turning; two of them are the supports
        bonds[f"support {k}"] = ("ground", names[k])
        carries.append((k == 0, k in (0, 2), 1, 1, 1, 1))
    position = np.vstack([[(nodes[a] + nodes[b]) / 2 for a, b in bars], nodes])
    truss = Bonds.from_arrays(names, bonds, position, np.array(frames + [np.eye(3)] * 5), carries)
    found = solve(with_redundancy(truss), applied(names, {"pin 1": [((0.0, -1000.0, 0.0), nodes[1])]}))
    tension = [288.6751345948129, 288.6751345948129, -577.3502691896258, 577.3502691896258]
    tension += [577.3502691896258, -577.3502691896258, -577.3502691896258]
    # The parent pulls the child towards itself in tension: against x.
    np.testing.assert_allclose(-found.components[:7, 0], tension, atol=1e-8)
    np.testing.assert_allclose(found["support 0"].force, [0.0, 500.0, 0.0], atol=1e-8)
    np.testing.assert_allclose(found["support 2"].force, [0.0, 500.0, 0.0], atol=1e-8)
    assert all(loads.unique_force.all() and loads.unique_moment.all() for _, loads in found.items())


FEET = np.array([[1.0, 0.5, 0.0], [1.0, -0.5, 0.0], [-1.0, 0.5, 0.0], [-1.0, -0.5, 0.0]])


def table(carries, size=1.0, **options):
    bonds = {f"foot {k}": ("ground", "table") for k in range(4)}
    bonds["guide"] = ("ground", "table")  # holds what feet on ice do not
    position = np.vstack([size * FEET, np.zeros((1, 3))])
    return Bonds.from_arrays(["table"], bonds, position, carries=[carries] * 4 + [(1, 1, 0, 0, 0, 1)], **options)


@pytest.mark.long
def test_a_table_on_four_legs_is_exactly_symmetric():
    x, y = 0.3, 0.1
    bonds = table((0, 0, 1, 0, 0, 0))
    loads = applied(["table"], {"table": [((0.0, 0.0, -98.1), (x, y, 0.3))]})
    expected = 98.1 / 4.0 * (1.0 + x * FEET[:, 0] + y * FEET[:, 1] / 0.25)
    np.testing.assert_allclose(solve(bonds, loads).components[:4, 2], expected, rtol=1e-12)
    centred = solve(bonds, applied(["table"], {"table": [((0.0, 0.0, -98.1), (0.0, 0.0, 0.3))]}))
    np.testing.assert_allclose(centred.components[:4, 2], 98.1 / 4.0, rtol=1e-12)
    marks = redundancy(bonds).undetermined
    assert marks == ((False, False, True, False, False, False),) * 4 + ((False,) * 6,)


@pytest.mark.long
def test_stiff_legs_take_more():
    """One leg of vanishing compliance against three: springs in parallel, by the 3 x 3 stiffness of the plate."""
    c = np.array([0.5, 1.0, 2.0, 4.0])
    compliance = np.ones((5, 6))
    compliance[:4, 2] = c
    found = solve(
        table((0, 0, 1, 0, 0, 0), compliance=compliance), applied(["table"], {"table": [((0, 0, -1), (0.3, 0.1, 0))]})
    )
    arms = np.c_[np.ones(4), FEET[:, :2]]
    plate = np.linalg.solve(arms.T @ (arms / c[:, None]), [1.0, 0.3, 0.1])
    np.testing.assert_allclose(found.components[:4, 2], arms @ plate / c, rtol=1e-11)


@pytest.mark.long
def test_feet_close_together():
    """Nearly singular: the feet of a narrow table, a hundredth of the characteristic length apart, hold a moment."""
    loads = applied(["table"], {"table": [((0.0, 0.0, -1.0), (0.3, 0.1, 0.0))]})
    found = solve(table((0, 0, 1, 0, 0, 0), size=0.01, length=1.0), loads)
    expected = 0.25 * (1.0 + 30.0 * FEET[:, 0] + 10.0 * FEET[:, 1] / 0.25)
    np.testing.assert_allclose(found.components[:4, 2], expected, rtol=1e-10)


# ------------------------------------------------------------------------------------------- the paper's four-bar
def test_four_bar_in_space_has_the_papers_counts():
    """S1 (26): 18 x 20, rank 17 = 6p - N, three reactions that statics leaves open."""
    bonds = four_bar()
    Q = reaction_matrix(bonds).matrix
    assert Q.shape == (18, 20)
    assert np.linalg.matrix_rank(Q, tol=1e-10) == 17
    found = redundancy(bonds)
    assert (found.redundant, found.mobility, found.rank) == (3, 1, 3)
    assert set(found.components) == {"A", "B", "C", "D"}
    assert set(found.components.values()) == {("force z", "moment x", "moment y")}
    stress = found.self_stress
    assert np.abs(Q @ reaction_matrix(bonds).directions.T @ np.reshape(stress, (3, -1)).T).max() < 1e-13


@pytest.mark.long
def test_four_bar_against_dense_algebra():
    bonds = four_bar()
    loads = random_loads(bonds)
    found = solve(bonds, loads)
    np.testing.assert_allclose(found.components, dense_reactions(bonds, loads), atol=1e-11)
    assert found.relative_residual < 1e-14 and found.relative_free_residual < 1e-11


def test_loads_that_would_move_the_network_show():
    loads = random_loads(four_bar())
    loads[1, 0] += 1.0
    found = solve(four_bar(), loads)
    assert found.relative_residual < 1e-14 and found.relative_free_residual > 1e-3
    assert np.all(np.isfinite(found.components))


# ---------------------------------------------------------------------------------------------- random networks
@pytest.mark.parametrize(
    "graph, method",
    [
        ("tree", "auto"),
        pytest.param("all of them", "force", marks=pytest.mark.long),
        pytest.param("all of them", "nodal", marks=pytest.mark.long),
    ],
)
def test_random_networks_against_dense_algebra(graph, method):
    bonds = random_bonds(graph, seed=3)
    loads = random_loads(bonds)
    found = solve(bonds, loads, method)
    np.testing.assert_allclose(found.components, dense_reactions(bonds, loads), atol=1e-10)
    assert found.relative_residual < 1e-13 and found.relative_free_residual < 1e-11


@pytest.mark.long
def test_the_family_holds_the_solution_and_equilibrium():
    bonds = random_bonds("all of them", seed=3)
    loads = random_loads(bonds)
    found, family = solve(bonds, loads, "nodal"), reaction_family(bonds, loads)
    np.testing.assert_allclose(family.wrench(found.parameters), found.wrench, atol=1e-11)
    Q = reaction_matrix(bonds)
    other = family.wrench(found.parameters + 1.7)
    np.testing.assert_allclose(Q.incidence @ np.asarray(other).reshape(-1), loads.reshape(-1), atol=1e-11)


@pytest.mark.long
def test_other_compliances_change_only_what_is_undetermined():
    bonds = random_bonds("all of them", seed=3)
    loads = random_loads(bonds)
    factor = jnp.asarray(np.random.default_rng(5).uniform(1.0, 9.0, size=bonds.compliance.shape))
    other = eqx.tree_at(lambda b: b.compliance, bonds, bonds.compliance * factor)
    change = np.abs(solve(other, loads, "nodal").components - solve(bonds, loads, "nodal").components)
    open_ = np.array(redundancy(bonds).undetermined)
    assert 0 < open_.sum() < open_.size
    assert change[~open_].max() < 1e-10 and change[open_].max() > 1e-2
    assert np.mean(change[open_] > 1e-4) > 0.95


@pytest.mark.slow
def test_far_from_the_origin():
    """Reactions in bond axes do not depend on where the mechanism stands."""
    near = random_bonds("all of them", seed=3)
    loads, shift = random_loads(near), np.array([300.0, -200.0, 100.0])
    far = eqx.tree_at(lambda b: b.position, near, near.position + jnp.asarray(shift[None]))
    moved = np.concatenate([loads[:, :3], loads[:, 3:] + np.cross(shift, loads[:, :3])], axis=1)
    np.testing.assert_allclose(
        solve(far, moved, "nodal").components, solve(near, loads, "nodal").components, atol=1e-9
    )


# -------------------------------------------------------------------------------------------------- many loops
@pytest.fixture(scope="module")
def long_ladder():
    bonds = ladder(60)
    return bonds, np.random.default_rng(0).normal(size=(120, 6))


@pytest.mark.long
def test_nodes_and_parameters_agree_on_sixty_loops(long_ladder):
    bonds, loads = long_ladder
    by_nodes, by_parameters = solve(bonds, loads, "nodal"), solve(bonds, loads, "force")
    scale = float(by_parameters.scale)
    np.testing.assert_allclose(by_nodes.components, by_parameters.components, atol=1e-11 * scale)
    for found in (by_nodes, by_parameters):
        assert found.relative_residual < 1e-13 and found.relative_free_residual < 1e-11


@pytest.mark.long
def test_redundancy_by_projection_is_that_of_the_decomposition():
    bonds = random_bonds("loops", seed=3)
    dense, projected = redundancy(bonds, "svd"), redundancy(bonds, "random projection")
    assert (dense.rank, dense.redundant, dense.mobility) == (projected.rank, projected.redundant, projected.mobility)
    assert dense.undetermined == projected.undetermined
    assert projected.self_stress.shape == dense.self_stress.shape
    both = np.vstack([basis.reshape(len(basis), -1) for basis in (dense.self_stress, projected.self_stress)])
    assert np.linalg.matrix_rank(both, tol=1e-6) == dense.redundant


@pytest.mark.long
def test_redundancy_of_many_loops():
    """Each loop of the ladder leaves four of six open: no moment about either pin, so none across their distance."""
    found = redundancy(ladder(104))
    assert found.method == "random projection"
    assert (found.redundant, found.mobility) == (4 * 104, 0)
    pins = [row for name, row in zip(found.network.bonds, found.undetermined, strict=True) if "rail" in name]
    assert set(pins) == {(False, True, True, True, True, False)}


# -------------------------------------------------------------------------------------- batches and precisions
@pytest.mark.long
def test_vmap_over_loads_and_positions():
    bonds = random_bonds("loops", seed=3, most_free=1)
    loads = jnp.stack([jnp.asarray(random_loads(bonds, seed)) for seed in range(3)])
    moves = 0.1 * jax.random.normal(jax.random.key(0), (3, *bonds.position.shape))
    at = lambda move: eqx.tree_at(lambda b: b.position, bonds, bonds.position + move)
    found = jax.jit(jax.vmap(lambda move, x: bond_reactions(at(move), x, "nodal")))(moves, loads)
    for k in range(3):
        np.testing.assert_allclose(found.components[k], dense_reactions(at(moves[k]), loads[k]), atol=1e-10)
    assert found["bond 2"].force.shape == (3, 3)


@pytest.mark.long
def test_single_precision():
    single, double = (random_bonds("all of them", seed=3, dtype=dtype) for dtype in (np.float32, np.float64))
    loads = random_loads(double)
    found = solve(single, jnp.asarray(loads, jnp.float32), "nodal")
    assert found.components.dtype == jnp.float32
    np.testing.assert_allclose(found.components, dense_reactions(double, loads), atol=2e-4)
    assert found.relative_residual < 1e-6


def test_wrong_arguments():
    with pytest.raises(ValueError, match="method must be 'auto', 'force' or 'nodal'"):
        bond_reactions(four_bar(), np.zeros((3, 6)), method="fast")
    with pytest.raises(ValueError, match="3 bodies need one wrench of 6 each"):
        bond_reactions(four_bar(), np.zeros((2, 6)))
    with pytest.raises(ValueError, match="it is not known which components are unique"):
        _ = solve(four_bar(), np.zeros((3, 6)))["A"].unique_force


def test_free_twists_may_be_any_that_span_the_same():
    """World twists, six columns for one to three directions: the same reactions as by axes."""
    bonds = random_bonds("all of them", seed=3)
    loads, axes = random_loads(bonds), np.asarray(bonds.twist_axes)
    columns = np.asarray(bonds.free).copy()
    efforts = np.einsum("qic,qc->qi", columns, np.asarray(bonds.effort))  # wrench along the free axes
    f = columns.shape[2]
    mix = np.eye(f) + 0.3 * np.random.default_rng(1).normal(size=(f, f))
    columns = columns @ mix
    other = Bonds.from_twists(
        bonds.network,
        bonds.position,
        bonds.frame,
        jnp.asarray(axes @ columns),
        jnp.asarray(np.einsum("qic,qi->qc", columns, efforts)),
        bonds.length,
        bonds.compliance,
    )
    found, expected = solve(other, loads, "nodal"), solve(bonds, loads, "nodal")
    np.testing.assert_allclose(found.components, expected.components, atol=1e-9)
    assert redundancy(other).redundant == redundancy(bonds).redundant
    assert reaction_matrix(other).matrix.shape == reaction_matrix(bonds).matrix.shape
