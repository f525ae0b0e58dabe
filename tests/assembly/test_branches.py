"""Branches: followed by `near=` and `states_along`, told apart by the signs of states; closed forms by circles."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.sparse.csgraph

import jaxmbs as mbs
from jaxmbs.assembly._branches import coupled_blocks
from jaxmbs.math._determinant import determinant_signs
from tests.models import PIN, bennett, four_bar

CRANK_ROCKER = (1.0, 0.42, 1.1, 0.75)  # ground, crank, coupler, rocker [m]
TURN = np.linspace(0.0, 2.0 * np.pi, 181)


def crossing(P, r, Q, s, sign=1.0):
    """Where circles about P and Q (complex) meet, left of the way from P to Q for sign 1; NaN where they do not."""
    d = Q - P
    along = (r * r - s * s + abs(d) ** 2) / (2.0 * abs(d))
    height = np.sqrt(np.where(r * r >= along * along, r * r - along * along, np.nan))
    return P + d / abs(d) * (along + sign * 1j * height)


def rocker(angle, lengths=CRANK_ROCKER, sign=1.0):
    """Angle of a four-bar's rocker."""
    ground, crank, coupler, last = lengths
    return np.angle(crossing(crank * np.exp(1j * np.asarray(angle)), coupler, ground + 0j, last, sign) - ground)


def off(found, wanted):
    """Distance of angles on the circle."""
    return np.abs((np.asarray(found) - wanted + np.pi) % (2.0 * np.pi) - np.pi)


def slope(function, x, h=1e-5):
    return (function(x + h) - function(x - h)) / (2.0 * h)


@pytest.fixture(scope="module")
def bars():
    return four_bar(CRANK_ROCKER)


@pytest.fixture(scope="module")
def rest(bars):
    return mbs.State.at(bars, A=0.6, guess={"B": 0.4, "D": rocker(0.6)})


@pytest.mark.long
def test_a_whole_turn_stays_on_the_branch(bars, rest):
    """181 crank angles; without `near=` some forty are the mirror image, and their sign says so."""
    guess = {name: float(bars.coordinates(rest)[name]) for name in "BD"}
    searched = jax.vmap(lambda angle: mbs.State.at(bars, A=angle, guess=guess))(TURN)
    mirrored = off(bars.coordinates(searched)["D"], rocker(TURN)) > 1e-6
    assert np.all(searched.ok) and 20 < np.sum(mirrored) < 80
    np.testing.assert_array_equal(np.asarray(searched.branch)[:, 0] != rest.branch[0], mirrored)
    for states in (
        jax.jit(jax.vmap(lambda angle: mbs.State.at(bars, A=angle, near=rest)))(TURN),
        mbs.assembly.states_along(bars, "A", TURN, rest),
    ):
        assert np.all(states.ok) and np.array_equal(np.unique(states.branch), rest.branch)
        assert np.max(off(bars.coordinates(states)["D"], rocker(TURN))) < 1e-9
        np.testing.assert_array_equal(mbs.assembly.branch(bars, states, ["A"]), states.branch)


@pytest.mark.long
def test_gradients_along_a_branch(bars, rest):
    def followed(angle):
        return bars.coordinates(mbs.State.at(bars, A=angle, near=rest))["D"]

    for angle in (0.6, 2.5, 4.4):
        for derivative in (jax.grad, jax.jacfwd):
            np.testing.assert_allclose(derivative(followed)(angle), slope(rocker, angle), rtol=1e-7, atol=1e-9)

    def summed(crank, angles):
        new = four_bar((1.0, crank, 1.1, 0.75), like=bars)
        return jnp.sum(jnp.sin(new.coordinates(mbs.assembly.states_along(new, "A", angles, rest))["D"]))

    def truth(crank, angles):
        return np.sum(np.sin(rocker(angles, (1.0, crank, 1.1, 0.75))))

    some = TURN[10::30]
    by_crank, by_angles = jax.grad(summed, argnums=(0, 1))(0.42, jnp.asarray(some))
    np.testing.assert_allclose(by_crank, slope(lambda crank: truth(crank, some), 0.42), rtol=1e-7)
    np.testing.assert_allclose(by_angles, slope(lambda angle: np.sin(rocker(angle)), some), rtol=1e-6, atol=1e-9)


@pytest.mark.long
def test_random_four_bars_arrive_or_say_that_they_cannot(bars):
    """Grashof or not, from either branch: what can be reached is reached, nothing is on another branch."""
    random, turn = np.random.default_rng(5), np.linspace(0.0, 2.0 * np.pi, 25)
    lengths, begin, sign = random.uniform(0.3, 1.2, (80, 4)), random.uniform(0.0, 6.0, 80), random.choice([-1, 1], 80)
    first = np.array([rocker(*x) for x in zip(begin, lengths, sign, strict=True)])
    lengths, begin, sign, first = (x[np.isfinite(first)] for x in (lengths, begin, sign, first))

    def sweep(lengths, begin, first):
        new = four_bar(lengths, like=bars)
        knee = lengths[1] * jnp.array([jnp.cos(begin), jnp.sin(begin)])
        end = jnp.array([lengths[0] + lengths[3] * jnp.cos(first), lengths[3] * jnp.sin(first)])
        coupler = jnp.arctan2(*(end - knee)[::-1])
        start = mbs.State.at(new, A=begin, guess={"B": coupler - begin, "D": first})
        return mbs.assembly.states_along(new, "A", begin + turn, start)

    states = jax.jit(jax.vmap(sweep))(lengths, begin, first)
    D, ok = np.asarray(states.coordinates)[..., 2], np.asarray(states.ok)
    fine = np.linspace(0.0, 1.0, 400)[:, None] * turn  # the way to each angle
    reached = [np.all(np.isfinite(rocker(a + fine, x, s)), 0) for a, x, s in zip(begin, lengths, sign, strict=True)]
    wanted = np.array([rocker(a + turn, x, s) for a, x, s in zip(begin, lengths, sign, strict=True)])
    assert len(lengths) > 50 and 10 < np.sum(np.all(reached, axis=1)) < len(lengths) - 10
    np.testing.assert_array_equal(ok, reached)
    assert np.max(off(D, wanted)[ok]) < 1e-8 and np.all(np.isnan(D[~ok]))


@pytest.mark.long
def test_the_end_of_a_branch_is_said(bars, rest):
    """The rocker has limits; an exact one from the triangle in which crank and coupler are in line."""
    last = np.arccos((1.0 + 0.75**2 - (1.1 + 0.42) ** 2) / (2.0 * 0.75))
    limit = np.pi - last
    with pytest.raises(mbs.AssemblyError, match=r"branch of near= ends at D = (\S+),") as caught:
        mbs.State.at(bars, D=limit - 0.2, near=rest)
    assert abs(float(str(caught.value).split("D = ")[1].split(",")[0]) - limit) < 1e-4
    angles = np.array([limit + 0.1, limit - 0.2, limit + 0.1])
    with pytest.warns(UserWarning, match="the branch ends before D"):
        states = mbs.assembly.states_along(bars, "D", angles, rest)
    np.testing.assert_array_equal(states.ok, [True, False, False])
    assert np.all(np.isnan(states.coordinates[1:])) and np.all(np.isnan(states.branch[1:]))


@pytest.mark.long
def test_a_parallelogram_turns_through_its_flat_poses():
    """Branches cross there: it stays a parallelogram, and the change of its sign is told."""
    system = four_bar((2.0, 1.0, 2.0, 1.0))
    start = mbs.State.at(system, A=1.0, guess={"B": -1.0, "D": 1.0})
    angles = np.concatenate([np.linspace(1.0, 7.0, 20), [2.0 * np.pi, np.pi, 1.0]])
    with pytest.warns(UserWarning, match="sign changes at A"):
        states = mbs.assembly.states_along(system, "A", angles, start)
    np.testing.assert_allclose(system.coordinates(states)["D"], angles, atol=1e-9)
    signs = np.asarray(states.branch)[:, 0]
    np.testing.assert_array_equal(signs[-3:], [0.0, 0.0, start.branch[0]])  # flat, flat, as at the start
    np.testing.assert_array_equal(signs[:-3], np.sign(np.sin(angles[:-3])) * start.branch[0])


def watt():
    """A crank-rocker and on its rocker a second pair of links."""
    b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
    for name, length in (("crank", 0.3), ("coupler", 0.9), ("rocker", 0.7), ("arm", 0.8), ("lever", 0.6)):
        b.body(name, 1.0, (length / 2.0, 0.0, 0.0), mbs.inertia.rod(1.0, length))
    b.joint("A", PIN, "ground", "crank")
    b.joint("B", PIN, "crank", "coupler", parent_frame=(0.3, 0.0, 0.0))
    b.joint("D", PIN, "ground", "rocker", parent_frame=(1.0, 0.0, 0.0))
    b.joint("C", PIN, "coupler", "rocker", parent_frame=(0.9, 0.0, 0.0), child_frame=(0.7, 0.0, 0.0))
    b.joint("E", PIN, "rocker", "arm", parent_frame=(0.5, 0.1, 0.0))
    b.joint("G", PIN, "ground", "lever", parent_frame=(1.8, 0.1, 0.0))
    b.joint("F", PIN, "arm", "lever", parent_frame=(0.8, 0.0, 0.0), child_frame=(0.6, 0.0, 0.0))
    return b.build()


def watt_angles(angle, first, second):
    """B, D, E, G of the six-bar by two crossings of circles."""
    B = 0.3 * np.exp(1j * np.asarray(angle))
    C = crossing(B, 0.9, 1.0 + 0j, 0.7, first)
    D = np.angle(C - 1.0)
    E = 1.0 + np.exp(1j * D) * (0.5 + 0.1j)
    F = crossing(E, 0.8, 1.8 + 0.1j, 0.6, second)
    return np.stack([np.angle(C - B) - angle, D, np.angle(F - E) - D, np.angle(F - 1.8 - 0.1j)])


@pytest.mark.long
def test_the_four_branches_of_a_six_bar():
    system, turn, signs = watt(), 0.7 + np.linspace(0.0, 2.0 * np.pi, 37), []
    for first in (1.0, -1.0):
        for second in (1.0, -1.0):
            start = mbs.State.at(system, A=0.7, guess=dict(zip("BDEG", watt_angles(0.7, first, second), strict=True)))
            states = mbs.assembly.states_along(system, "A", turn, start)
            found = np.stack([system.coordinates(states)[name] for name in "BDEG"])
            assert np.max(off(found, watt_angles(turn, first, second))) < 1e-9
            assert np.array_equal(np.unique(states.branch, axis=0), start.branch[None])
            signs.append(tuple(np.asarray(start.branch)))
    assert len(signs[0]) == 2 and len(set(signs)) == 4
    assert signs[0] == tuple(-s for s in signs[3]) and signs[0][0] == signs[1][0]


def rssr(length=1.4, like=None):
    """A crank about z and a rocker about x, joined by a rod with a ball at each end, which may turn about itself."""
    b = mbs.SystemBuilder()
    along = jnp.asarray(length) * jnp.array([1.0, 0.0, 0.0])
    b.body("crank", 1.0, (0.15, 0.0, 0.0), 0.01)
    b.body("rod", 1.0, along / 2.0, 0.05)
    b.body("rocker", 1.0, (0.0, 0.4, 0.0), 0.05)
    b.joint("A", PIN, "ground", "crank")
    b.joint("B", mbs.Spherical(), "crank", "rod", parent_frame=(0.3, 0.0, 0.0))
    b.joint("D", mbs.Revolute("x"), "ground", "rocker", parent_frame=(1.0, 0.2, -0.5))
    b.joint("C", mbs.Spherical(), "rod", "rocker", parent_frame=along, child_frame=(0.0, 0.8, 0.0))
    return b.build(like=like, cut=["C"])


def rssr_rocker(angle, sign, length=1.4):
    angle = np.asarray(angle)
    c = np.stack([1.0 - 0.3 * np.cos(angle), 0.2 - 0.3 * np.sin(angle), -0.5 + 0.0 * angle])
    level = (length**2 - 0.8**2 - np.sum(c * c, axis=0)) / 1.6
    return np.arctan2(c[2], c[1]) + sign * np.arccos(level / np.hypot(c[1], c[2]))


@pytest.mark.long
def test_a_spatial_loop_with_a_second_freedom():
    system, turn, signs = rssr(), np.linspace(0.3, 0.3 + 2.0 * np.pi, 31), []
    for sign in (1.0, -1.0):
        guess = {"D": float(rssr_rocker(0.3, sign))}
        end = np.array([1.0, 0.2 + 0.8 * np.cos(guess["D"]), -0.5 + 0.8 * np.sin(guess["D"])])
        rod = end - 0.3 * np.array([np.cos(0.3), np.sin(0.3), 0.0])
        x, y, z = np.array([[np.cos(0.3), np.sin(0.3), 0], [-np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]]) @ rod / 1.4
        guess["B"] = np.array([1.0 + x, 0.0, -z, y]) / np.sqrt(2.0 + 2.0 * x)  # turns x to the rod
        start = mbs.State.at(system, A=0.3, guess=guess)
        states = jax.vmap(lambda angle, start=start: mbs.State.at(system, A=angle, near=start))(turn)
        assert np.max(off(system.coordinates(states)["D"], rssr_rocker(turn, sign))) < 1e-9
        assert np.array_equal(np.unique(states.branch, axis=0), start.branch[None]) and states.branch.shape == (31, 1)
        signs.append(float(start.branch[0]))
    assert sorted(signs) == [-1.0, 1.0]

    def by_length(length):
        return system.coordinates(mbs.State.at(rssr(length, system), A=2.0, near=start))["D"]

    wanted = slope(lambda length: rssr_rocker(2.0, -1.0, length), 1.4)
    np.testing.assert_allclose(jax.grad(by_length)(1.4), wanted, rtol=1e-7)
    np.testing.assert_allclose(off(by_length(1.5), rssr_rocker(2.0, -1.0, 1.5)), 0.0, atol=1e-9)  # of another design


@pytest.mark.long
def test_cut_joints_and_held_ones_are_followed():
    """A five-bar of two freedoms: its cut joint goes to an angle while another joint stays."""
    b = mbs.SystemBuilder()
    for name, length in (("a", 1.0), ("b", 2.0), ("c", 2.0), ("d", 1.0)):
        b.body(name, 1.0, (length / 2.0, 0.0, 0.0), mbs.inertia.rod(1.0, length))
    b.joint("A", PIN, "ground", "a")
    b.joint("B", PIN, "a", "b", parent_frame=(1.0, 0.0, 0.0))
    b.joint("E", PIN, "ground", "d", parent_frame=(1.5, 0.0, 0.0))
    b.joint("D", PIN, "d", "c", parent_frame=(1.0, 0.0, 0.0))
    b.joint("C", PIN, "b", "c", parent_frame=(2.0, 0.0, 0.0), child_frame=(2.0, 0.0, 0.0))
    system = b.build()
    start = mbs.State.at(system, A=2.0, E=1.0, guess={"B": -1.0, "D": 1.0})
    turned = mbs.assembly.states_along(system, "A", 2.0 + np.linspace(0.0, 2.0 * np.pi, 25), start, held=["E"])
    assert np.all(turned.ok) and np.array_equal(np.unique(turned.branch, axis=0), start.branch[None])
    np.testing.assert_allclose(system.coordinates(turned)["E"], 1.0, atol=1e-12)
    np.testing.assert_allclose(np.cos(turned.coordinates[-1]), np.cos(start.coordinates), atol=1e-9)

    def knee(q):
        return sum(q[name] * sign for name, sign in (("E", 1), ("D", 1), ("A", -1), ("B", -1)))

    here = float(knee(system.coordinates(start)))
    angles = here + np.linspace(0.0, -0.4, 5)
    cut = mbs.assembly.states_along(system, "C", angles, start, held=["E"])
    assert np.all(cut.ok)
    np.testing.assert_allclose(off(knee(system.coordinates(cut)), angles), 0.0, atol=1e-9)


@pytest.mark.long
def test_where_the_redundancy_turns_there_is_no_sign():
    """Bennett's loop is followed through a whole turn all the same: tan(J0 / 2) tan(J1 / 2) is constant."""
    system = bennett().build()
    start = mbs.State.at(system, J0=0.5, guess={"J1": 0.5, "J2": -0.5})
    np.testing.assert_array_equal(start.branch, [0.0])
    states = mbs.assembly.states_along(system, "J0", 0.5 + np.linspace(0.0, 2.0 * np.pi, 13), start)
    q = system.coordinates(states)
    product = np.tan(q["J0"] / 2.0) * np.tan(q["J1"] / 2.0)
    np.testing.assert_allclose(product, product[0], rtol=1e-6)


@pytest.mark.long
def test_states_without_loops_and_by_hand_have_no_signs(bars, rest):
    b = mbs.SystemBuilder()
    b.body("bob", 1.0, (1.0, 0.0, 0.0))
    b.joint("pin", PIN, "ground", "bob")
    tree = b.build()
    state = mbs.State.at(tree, pin=0.3)
    assert state.branch.shape == (0,) and mbs.assembly.branch(tree, state).shape == (0,)
    moved = mbs.State.at(tree, pin=1.3, near=state)
    np.testing.assert_allclose(moved.coordinates, [1.3])
    by_hand = mbs.State(np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3)))
    assert by_hand.branch.shape == (3, 0)
    motion = mbs.simulate(bars, rest, ts=np.linspace(0.0, 0.01, 3))
    assert motion.states.branch.shape == (3, 0)
    np.testing.assert_array_equal(mbs.assembly.branch(bars, motion.states, "A"), np.tile(rest.branch, (3, 1)))


def test_wrong_near_is_refused(bars, rest):
    for wrong in (0.3, {"A": 1.0}, "rest"):
        with pytest.raises(TypeError, match="near= takes a State.*values of a joint called"):
            mbs.State.at(bars, A=0.3, near=wrong)
    with pytest.raises(mbs.ModelError, match=r"(?s)has 2 faults.*jax\.vmap.*guess="):
        many = jax.tree.map(lambda x: jnp.stack([x, x]), rest)
        mbs.State.at(bars, A=0.3, near=many, guess={"B": 1.0})
    with pytest.raises(mbs.ModelError, match="another system"):
        mbs.State.at(watt(), A=0.3, near=rest)
    with pytest.raises(mbs.UnknownNameError, match="no joint 'a'"):
        mbs.assembly.branch(bars, rest, ["a"])
    with pytest.raises(mbs.ModelError, match="values of 'A'"):
        mbs.assembly.states_along(bars, "A", 0.3, rest)
    with pytest.raises(mbs.ModelError, match="no joint 'crank'"):
        mbs.assembly.states_along(bars, "crank", TURN, rest)


@pytest.mark.long
def test_a_batch_says_where_the_branch_changes(bars, rest):
    guess = {name: float(bars.coordinates(rest)[name]) for name in "BD"}

    def searched(design):
        return {"state": mbs.State.at(bars, A=design["angle"], guess=guess)}

    def swept(design):
        return jax.vmap(lambda angle: mbs.State.at(bars, A=design["angle"] + angle, guess=guess))(TURN[::30])

    mirrored = off(rocker(TURN), bars.coordinates(mbs.batch(searched, {"angle": TURN}).values["state"])["D"]) > 1e-6
    found = mbs.batch(searched, {"angle": TURN}, progress=False)
    np.testing.assert_array_equal(found.status == mbs.Status.BRANCH, mirrored)
    assert "another branch" in found.summary() and np.array_equal(found.ok, ~mirrored)
    traced = jax.jit(lambda angles: mbs.batch(searched, {"angle": angles}).status)(TURN)
    np.testing.assert_array_equal(traced, found.status)
    assert np.all(mbs.batch(swept, {"angle": np.array([0.0])}, progress=False).status == mbs.Status.BRANCH)


@pytest.mark.parametrize("traced", [False, pytest.param(True, marks=pytest.mark.long)])
def test_signs_of_determinants(traced):
    random = np.random.default_rng(2)
    sizes = (3, 1, 4, 2)
    block = np.repeat(np.arange(4), sizes)
    for k in range(20):
        parts = [random.normal(size=(n, n)) for n in sizes]
        parts[2][:, 1] = parts[2][:, 3] * (k % 2) + parts[2][:, 1] * (1 - k % 2)
        A = np.zeros((10, 10))
        for number, part in enumerate(parts):
            A[np.ix_(block == number, block == number)] = part
        order = random.permutation(10)  # the blocks need not stand together
        A, mixed = A[np.ix_(order, order)], block[order]
        found = determinant_signs(jnp.asarray(A) if traced else A, mixed, 1e-9)
        wanted = np.array([np.linalg.slogdet(part)[0] for part in parts])
        wanted[2] *= 1 - k % 2
        np.testing.assert_array_equal(found, wanted)


def test_columns_that_share_rows_are_coupled():
    random = np.random.default_rng(5)
    for touched in (
        random.random((12, 20)) < 0.08,
        np.eye(9, dtype=bool) | np.eye(9, k=1, dtype=bool),
        np.zeros((0, 3), bool),
    ):
        count, block = coupled_blocks(touched)
        graph = touched.T.astype(int) @ touched.astype(int)
        wanted = scipy.sparse.csgraph.connected_components(graph, directed=False)
        assert count == wanted[0]
        np.testing.assert_array_equal(block, wanted[1])
