"""The order of elimination: every node once, children first, and as narrow a front as its graph has."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxmbs.constraints._frontal_plan import _plan, frontal_plan
from jaxmbs.model._tree import Tree
from tests.cases import models
from tests.dynamics.test_sparse_saddle import closed_ring


@pytest.mark.slow
def test_width_of_a_row_does_not_grow():
    assert [frontal_plan(models.n_four_bar(n)).width for n in (1, 2, 5)] == [2, 2, 2]


def test_width_of_a_ring_is_three():
    assert frontal_plan(closed_ring(12)[0]).width <= 3


@pytest.mark.parametrize("rungs", [3, 12])
def test_width_of_a_ladder_is_four(rungs):
    """Two chains side by side; every rung hangs on the first and is tied to the second."""
    chains = [-1, *range(rungs - 1), -1, *range(rungs, 2 * rungs - 1)]
    parent = tuple(chains + list(range(rungs)))
    order, first = np.arange(3 * rungs), 2 * rungs
    tree, place = _depth_first(parent)
    ends = tuple((place[first + k], place[rungs + k]) for k in range(rungs))
    assert len(order) == tree.size and _plan(tree, ends).width <= 4


def _depth_first(parent):
    """The tree numbered depth first, and the new number of each old node."""
    children = [[] for _ in range(len(parent) + 1)]
    for node, p in enumerate(parent):
        children[p].append(node)
    order, stack = [], children[-1][::-1]
    while stack:
        order.append(stack.pop())
        stack.extend(children[order[-1]][::-1])
    place = {old: new for new, old in enumerate(order)}
    return Tree(tuple(-1 if parent[old] < 0 else place[parent[old]] for old in order)), place


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_every_element_is_taken_in_once(data):
    n = data.draw(st.integers(1, 12))
    tree, _ = _depth_first(tuple(data.draw(st.integers(-1, k - 1)) for k in range(n)))
    ends = tuple(data.draw(st.tuples(st.integers(-1, n - 1), st.integers(-1, n - 1))) for _ in range(3))
    plan = _plan(tree, ends)
    assert sorted(plan.order) == list(range(n)) and np.array_equal(plan.order[plan.step], np.arange(n))
    assert all(plan.step[k] < plan.step[p] for k, p in enumerate(tree.parent) if p >= 0)
    taken = plan.closure[plan.closure < 3].tolist()
    assert sorted(taken) == [e for e, (a, b) in enumerate(ends) if a != b]
    _check_slots(plan, tree)


def _check_slots(plan, tree):
    """A slot holds one node from its first use until that node goes."""
    holder = {}
    for i, node in enumerate(plan.order.tolist()):
        uses = [(plan.own[i], node), (plan.parent[i], tree.parent[node])]
        for hot, e, is_b in zip(plan.far[i], plan.closure[i], plan.is_end_b[i], strict=True):
            uses.append((hot, int(plan.ends[e][0 if is_b else 1]) if e < len(plan.ends) else -1))
        for hot, held in uses:
            held = -1 if held == tree.size else held
            assert hot.sum() == (0.0 if held < 0 else 1.0)
            if held >= 0:
                assert holder.setdefault(int(hot.argmax()), held) == held
        del holder[int(plan.own[i].argmax())]
    assert not holder
