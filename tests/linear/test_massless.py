"""Rows without mass in modes, responses, motions and reductions: condensed, which is exact, and put back."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

import jaxmbs as mbs
from jaxmbs.forces import SpringDamper
from jaxmbs.reductions import CraigBampton, CraigChang, Guyan, Hurty, MacNeal, Mixed, Rubin, reduce
from jaxmbs.vibration import CoordinateLaw, ModalSuperposition

N, LIGHT = 7, [1, 4, 5]
HEAVY = [k for k in range(N) if k not in LIGHT]
NAMES = [f"node{k} x" for k in range(N)]
PLACES = {f"node{k}": (float(k), 0.0, 0.0) for k in range(N)}


def matrices(free=False, damping=0.0):
    """Random stiffness, masses of three decades and rows of zeros; damping in proportion to stiffness and mass."""
    draw = np.random.default_rng(3)
    B = draw.standard_normal((N, N))
    K = B @ B.T + np.eye(N)
    if free:  # one rigid motion, all alike
        R = np.ones((N, 1))
        K = K - K @ R @ R.T @ K / (R.T @ K @ R)
    M = np.zeros((N, N))
    A = draw.standard_normal((4, 4))
    M[np.ix_(HEAVY, HEAVY)] = A @ A.T + np.diag([1.0, 10.0, 0.1, 1.0])
    return K, M, damping * (0.3 * M + 0.02 * K)


def system(free=False, damping=0.0, **options):
    K, M, C = matrices(free, damping)
    C = C if damping else None
    return mbs.LinearSystem(mass=M, stiffness=K, damping=C, coordinates=NAMES, positions=PLACES, **options)


def exact_roots(K, M, C):
    """Finite roots of the pencil, by SciPy."""
    n = len(K)
    A, B = scipy.linalg.block_diag(np.eye(n), -K), scipy.linalg.block_diag(np.eye(n), M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-K, -C]])
    return scipy.linalg.eigvals(A, B)


@pytest.mark.long
@pytest.mark.parametrize("known", [True, False])
def test_modes_are_the_finite_ones_of_the_pencil(known):
    s = system(massless=LIGHT if known else ())
    found = mbs.modes(s)
    K, M, _ = matrices()
    values = scipy.linalg.eigvals(K, M)
    exact = np.sort(values[np.isfinite(values) & (np.abs(values) < 1e9)].real)
    np.testing.assert_allclose(found.values, exact, rtol=1e-9)
    np.testing.assert_allclose(K @ found.shapes, M @ np.asarray(found.shapes) * np.asarray(found.values), atol=1e-9)
    assert found.shapes.shape == (N, len(HEAVY))
    with pytest.raises(ValueError, match="there are 4 modes"):
        mbs.modes(s, 5)


@pytest.mark.long
def test_complex_modes_where_damping_is_proportional_to_stiffness():
    """Damping that vanishes in the statically condensed motion leaves it exact; other damping is refused by name."""
    K, M, C = matrices(damping=1.0)
    found = mbs.modes(system(damping=1.0))
    left = [np.abs(np.linalg.det(root**2 * M + root * C + K)) for root in np.asarray(found.roots)]
    size = [np.abs(np.linalg.det(1.01 * root**2 * M + root * C + K)) for root in np.asarray(found.roots)]
    assert np.max(np.array(left) / size) < 1e-9
    bare = system().with_damping(np.diag([0.0, 0.5, 0, 0, 0, 0.1, 0]))
    with pytest.raises(ValueError, match="rows without mass are damped: node1 x, node4 x, node5 x"):
        mbs.modes(bare)
    assert mbs.modes(bare, damped=False).roots is None


@pytest.mark.long
@pytest.mark.parametrize("damping", [0.0, 1.0])
@pytest.mark.parametrize("loss", [0.0, 0.05])
def test_frequency_response_in_modes_is_the_direct_one(damping, loss):
    """At all rows, forces on massless ones too, against NumPy; its derivative by frequency."""
    K, M, C = matrices(damping=damping)
    omega = np.array([0.0, 0.7, 2.3, 11.0])
    s = system(damping=damping)

    def respond(omega):
        return mbs.frequency_response(s, omega, into=NAMES, out=NAMES, method="modal", loss=loss).values

    exact = [np.linalg.inv(K * (1 + 1j * loss) + 1j * w * C - w**2 * M) for w in omega]
    np.testing.assert_allclose(respond(jnp.asarray(omega)), exact, rtol=1e-8, atol=1e-10)
    slope = jax.jacfwd(lambda w: respond(w[None])[0])(jnp.asarray(2.3))
    H = exact[2]
    np.testing.assert_allclose(slope, -H @ (1j * C - 2 * 2.3 * M) @ H, rtol=1e-7, atol=1e-9)


def test_no_mass_says_so_by_name_and_never_nan():
    s = system()
    loose = s.replace(stiffness=s.stiffness.at[4].set(0.0).at[:, 4].set(0.0))
    for ask in (
        lambda s: mbs.modes(s),
        lambda s: mbs.frequency_response(s, jnp.ones(2), into=["node0"], out=["node0"], method="modal"),
        lambda s: mbs.simulate(s, ts=np.linspace(0.0, 1.0, 5)),
        lambda s: reduce(s.with_interface("node0"), CraigBampton(1)),
    ):
        with pytest.raises(ValueError, match="node4 x have neither mass nor stiffness:"):
            ask(loose)
    K, M, C = matrices(damping=1.0)
    for wrong in (
        lambda: mbs.vibration.receptance(K=K, M=M, omega=jnp.ones(2), out=[0], into=[0]),
        lambda: mbs.vibration.viscous_receptance(K=K, M=M, C=C, omega=jnp.ones(2), out=[0], into=[0]),
    ):
        with pytest.raises(ValueError, match=r"\[1, 4, 5\] have no mass.*LinearSystem"):
            wrong()


@pytest.mark.long
def test_motion_by_steps_in_modes_and_by_the_exponential():
    """Forces on rows with and without mass that grow straight: displacements against the exponential of SciPy."""
    K, M, C = matrices(damping=1.0)
    s, ts = system(damping=1.0), np.linspace(0.0, 1.2, 13)
    force = np.outer(ts, np.array([1.0, 0.0, 0.0, -2.0, 0.0, 0.0, 0.0]))
    S = -np.linalg.solve(K[np.ix_(LIGHT, LIGHT)], K[np.ix_(LIGHT, HEAVY)])
    T = np.zeros((N, 4))
    T[HEAVY], T[LIGHT] = np.eye(4), S
    k, m, c = (T.T @ A @ T for A in (K, M, C))
    A = np.zeros((10, 10))  # displacement, velocity, the load's slope and the load itself
    A[:4, 4:8], A[4:8, :4], A[4:8, 4:8] = np.eye(4), -np.linalg.solve(m, k), -np.linalg.solve(m, c)
    A[4:8, 8], A[8, 9] = np.linalg.solve(m, T.T @ force[-1] / ts[-1]), 1.0
    x = np.array([T @ (scipy.linalg.expm(A * t) @ np.eye(10)[9])[:4] for t in ts])
    for solver in (None, ModalSuperposition()):
        motion = mbs.simulate(s, ts=ts, forces=force, solver=solver, **({} if solver else {"rtol": 1e-10}))
        np.testing.assert_allclose(motion.displacement, x, atol=1e-8)
        balance = motion.displacement @ K + motion.velocity @ C + motion.acceleration @ M - force
        np.testing.assert_allclose(balance, 0.0, atol=1e-7)
    undamped, push = system(), force + np.outer(ts, np.eye(N)[4])
    for solver in (None, ModalSuperposition(ratios=0.02)):
        motion = mbs.simulate(undamped, ts=ts, forces=push, solver=solver)
        x, load = np.asarray(motion.displacement), push[:, LIGHT]
        np.testing.assert_allclose(x @ K[:, LIGHT], load, atol=1e-9)  # statics of the massless rows
    with pytest.raises(ValueError, match="laws act on node4 x, which have no mass"):
        mbs.simulate(undamped, ts=ts, laws=[CoordinateLaw(SpringDamper(1.0), {"node4 x": 1.0})])
    with pytest.raises(ValueError, match="loads act on node4 x, which have damping and no mass"):
        mbs.simulate(s, ts=ts, forces=push)


METHODS = [CraigBampton(2), Hurty(2, ("node0 x",)), Rubin(2), MacNeal(2), Mixed(2), CraigChang(1)]


@pytest.mark.long
@pytest.mark.parametrize("method", METHODS, ids=lambda m: type(m).__name__)
@pytest.mark.parametrize("interface", [("node0", "node6"), ("node0", "node1")], ids=["heavy", "light"])
def test_reductions_of_a_free_component(method, interface):
    """All coordinates come back.  As many coordinates as rows with mass: the frequencies are the whole's (MacNeal's
    leave out mass); statics are exact, at massless rows nothing pulls."""
    s = system(free=True, interface=interface)
    reduced = reduce(s, method)
    assert reduced.whole == s.coordinates and reduced.basis.shape == (N, 4)
    exact, found = np.asarray(mbs.modes(s).omega), np.asarray(mbs.modes(reduced).omega)
    if interface[1] == "node6" and not isinstance(method, MacNeal):
        np.testing.assert_allclose(found, exact, rtol=1e-6, atol=1e-6)
    else:
        np.testing.assert_allclose(found[:2], exact[:2], rtol=0.2, atol=1e-6)
    K = np.asarray(s.stiffness)
    inner = [k for k in LIGHT if NAMES[k].split()[0] not in interface]
    np.testing.assert_allclose(K[inner] @ np.asarray(reduced.basis), 0.0, atol=1e-9)


@pytest.mark.long
def test_guyan_and_derivatives_through_the_way_out():
    """Gradients of a frequency by stiffness against differences, the rows known without mass inside a trace."""
    K, M, _ = matrices()
    s = reduce(system(interface=("node0", "node2")), Guyan())
    T = np.asarray(s.basis)
    np.testing.assert_allclose(s.stiffness, T.T @ K @ T, rtol=1e-9)
    rest = np.asarray(s.expand(np.linalg.solve(np.asarray(s.stiffness), np.array([1.0, -2.0]))))
    np.testing.assert_allclose(rest, np.linalg.solve(K, [1.0, 0, -2.0, 0, 0, 0, 0]), rtol=1e-9)

    def lowest(k):
        own = mbs.LinearSystem(mass=M, stiffness=jnp.asarray(K).at[4, 4].add(k), coordinates=NAMES, massless=LIGHT)
        return mbs.modes(own, 2).omega[1]

    step = 1e-5
    slope = jax.jit(jax.grad(lowest))(0.3)
    np.testing.assert_allclose(slope, (lowest(0.3 + step) - lowest(0.3 - step)) / (2 * step), rtol=1e-6)
    assert abs(slope) > 1e-3


def free_chain(seed):
    """Eight points in a row with springs of seven decades, three of the points without mass."""
    draw, n = np.random.default_rng(seed), 8
    K, M = np.zeros((n, n)), np.diag(10 ** draw.uniform(-1, 2, n))
    for k, spring in enumerate(10 ** draw.uniform(0, 7, n - 1)):
        K[k : k + 2, k : k + 2] += spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
    M[draw.choice(n, 3, replace=False)] = 0.0
    return K, M


@pytest.mark.parametrize("damped", [False, True])
def test_a_free_chain_has_one_rigid_motion(damped):
    """What condensing leaves of a rigid motion's stiffness is rounding of the whole stiffness, not an instability."""
    for seed in range(25):
        K, M = free_chain(seed)
        found = mbs.modes(mbs.LinearSystem(mass=M, stiffness=K, damping=1e-6 * K if damped else None))
        assert found.num_rigid == 1 + damped and not np.any(found.is_unstable), seed
        assert np.all(np.isfinite(found.omega))
