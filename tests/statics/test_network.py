"""Names and graph of a network: faults, spanning tree, loops, series reduction."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.errors import ModelError
from jaxmbs.statics import BodyNetwork, Bonds
from jaxmbs.statics._cycles import cycle_pattern
from jaxmbs.statics._series_reduction import series_reduction

from .networks import GRAPHS


def network(graph):
    pairs = GRAPHS[graph]
    p = 1 + max(max(pair) for pair in pairs)
    parent, child = zip(*pairs, strict=True)
    return BodyNetwork(tuple(f"b{k}" for k in range(p)), tuple(f"e{k}" for k in range(len(pairs))), parent, child)


def incidence(net):
    parent, child = net.ends
    matrix = np.zeros((len(net.bodies) + 1, len(net.bonds)))
    matrix[child, np.arange(len(child))] += 1.0
    matrix[parent, np.arange(len(child))] -= 1.0
    return matrix[:-1]


@pytest.mark.parametrize("graph", GRAPHS)
def test_loops_load_no_body_and_are_as_many_as_the_null_space(graph):
    net = network(graph)
    Y, I_E = cycle_pattern(net), incidence(net)
    assert not np.any(I_E @ Y)
    assert Y.shape[1] == len(net.bonds) - np.linalg.matrix_rank(I_E)
    np.testing.assert_array_equal(Y[net.chords], np.eye(net.num_loops))


def test_the_spanning_tree_is_of_least_depth():
    """A ring of 9 bodies on the ground: two branches of at most 5, so 3 steps of doubling."""
    names = [f"b{k}" for k in range(9)]
    ring = ["ground", *names, "ground"]
    net = BodyNetwork.from_names(names, {f"e{k}": (ring[k], ring[k + 1]) for k in range(10)})
    assert net.num_loops == 1
    assert len(net.tree.jumps) == 3
    assert list(net.tree.references) == []


def test_equal_networks_share_their_hash():
    assert network("loops") == network("loops")
    assert hash(network("loops")) == hash(network("loops"))
    assert network("loops") != network("floating")


@pytest.mark.parametrize(
    "graph, nodes, chains, edges",
    [
        ("tree", 0, 0, 0),
        # Chains: ground-0, 0-1, 1-2-ground, 1-3, 3-4, 0-4, 4-5, 5-6-5, 3-ground; the ground and 5-5 make no edge.
        ("loops", 5, 9, 5),
        ("one loop and a tail", 0, 1, 0),
        ("loop on a stalk", 1, 2, 0),
        ("parallel", 1, 4, 0),
    ],
)
def test_series_reduction(graph, nodes, chains, edges):
    r = series_reduction(network(graph))
    assert (r.num_nodes, r.num_chains, len(r.edges)) == (nodes, chains, edges)
    assert r.num_chains - r.num_nodes == network(graph).num_loops
    assert np.all((r.sign == 0) == (r.chain == r.num_chains))


@pytest.mark.parametrize(
    "bodies, bonds, words",
    [
        (["a"], {"e": ("ground", "b")}, "bond 'e': 'b' is not a body"),
        (["a"], {"e": ("a", "a")}, "bond 'e' joins 'a' to itself"),
        (["a"], {"e": ("ground", "a"), "f": ("ground", "ground")}, "bond 'f' joins the ground to itself"),
        (["a", "b"], {"e": ("ground", "a")}, "body 'b' has no bond"),
        (["a", "a"], {"e": ("ground", "a")}, "the body name 'a' occurs twice"),
        (["ground"], {"e": ("ground", "ground")}, "the name 'ground' is reserved"),
    ],
)
def test_faults_name_bodies_and_bonds(bodies, bonds, words):
    with pytest.raises(ModelError, match=words):
        BodyNetwork.from_names(bodies, bonds)


@pytest.mark.parametrize(
    "options, words",
    [
        ({"carries": np.ones((1, 6), bool)}, r"carries has shape \(1, 6\); 2 bonds need \(2, 6\)"),
        ({"compliance": np.array([[1.0] * 6, [1.0] * 5 + [0.0]])}, "bond 'f': compliance must be positive"),
        ({"effort": np.array([[0.0] * 6, [1.0] + [0.0] * 5])}, "bond 'f': effort acts in a component that the bond"),
        ({"frame": np.full((2, 3, 3), np.nan)}, "bond 'e': frame must be finite"),
        ({"frame": np.stack([np.eye(3), 2 * np.eye(3)])}, "bond 'f': frame must be a rotation"),
        ({"frame": np.stack([np.zeros((3, 3)), np.eye(3)])}, "bond 'e': frame must be a rotation"),
        ({"frame": np.stack([np.eye(3), np.diag([1.0, 1.0, -1.0])])}, "bond 'f': frame must be a rotation"),
    ],
)
def test_faults_of_numbers_name_the_bond(options, words):
    with pytest.raises(ModelError, match=words):
        Bonds.from_arrays(["a"], {"e": ("ground", "a"), "f": ("ground", "a")}, np.zeros((2, 3)), **options)


def test_frames_under_tracing():
    """One that is no rotation makes its bond's reactions not a number; derivatives of others pass."""

    def frames(scale):
        turned = scale * jnp.broadcast_to(jnp.eye(3), (2, 3, 3))
        return Bonds.from_arrays(["a"], {"e": ("ground", "a"), "f": ("ground", "a")}, np.zeros((2, 3)), turned).frame

    assert np.all(np.isfinite(jax.jit(frames)(1.0))) and np.all(np.isnan(jax.jit(frames)(2.0)))
    assert np.all(np.isfinite(jax.jit(jax.jacfwd(frames))(1.0)))
