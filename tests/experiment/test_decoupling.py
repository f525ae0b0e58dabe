"""Coupling, decoupling, taking out the rig and virtual points, against inverses of assembled and free matrices."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmbs.coupling import _transfer_functions as transfer_functions
from jaxmbs.coupling._regularised_inverse import regularised_inverse
from jaxmbs.coupling._uncoupled_transfer import uncoupled_transfer
from jaxmbs.errors import ModelError
from jaxmbs.experiment import _decoupling as decoupling
from jaxmbs.experiment._rig import free_response, measured_stiffness, remove_stiffness
from jaxmbs.experiment._virtual_point import flexible_channels, rigid_channels, virtual_point
from jaxmbs.linear._transfer import TransferFunctions
from jaxmbs.reductions import CraigBampton, reduce
from jaxmbs.vibration import frequency_response
from jaxmbs.vibration._direct_response import dense_response
from tests.structural_matrices import chain, component

OMEGA = np.linspace(2.0, 60.0, 23)
couple, interface_forces, decouple = (
    eqx.filter_jit(f)
    for f in (transfer_functions.couple_transfer, transfer_functions.coupling_forces, decoupling.decouple)
)


def net(n, seed, ground=0.0):
    """Dynamic stiffness (frequencies, n, n) of n masses, each joined to every other one, damped."""
    r = np.random.default_rng(seed)
    K = -r.uniform(100.0, 900.0, (n, n))
    K = np.triu(K, 1) + np.triu(K, 1).T
    K = K - np.diag(K.sum(1)) + ground * np.eye(n)
    M = np.diag(r.uniform(0.5, 1.5, n))
    C = 1e-3 * K + 0.1 * M
    w = OMEGA[:, None, None]
    return K + 1j * w * C - w**2 * M


def transfer(Z, names, **options):
    return TransferFunctions(OMEGA, np.linalg.inv(Z), names, names, **options)


def close(found, expected, digits=1e-9):
    np.testing.assert_allclose(found, expected, rtol=digits, atol=digits * np.abs(expected).max())


ZA, ZB = net(5, 1, ground=50.0), net(4, 2)
A, B = transfer(ZA, list("abcde")), transfer(ZB, list("defg"))
PAIRS = [("A d", "B d"), ("A e", "B e")]
ASSEMBLED = np.zeros((len(OMEGA), 7, 7), complex)
ASSEMBLED[:, :5, :5] += ZA
ASSEMBLED[:, 3:, 3:] += ZB
AB = transfer(ASSEMBLED, list("abcdefg"))


@pytest.mark.long
def test_coupling_is_the_inverse_of_the_assembled_matrices():
    joined = couple({"A": A, "B": B}, PAIRS)
    names = ["A a", "A b", "A c", "A d", "A e", "B f", "B g"]
    close(joined.at(names, names).values, AB.values)
    close(joined.at(["B d"], names).values, AB.at(["d"]).values)
    twice = couple(couple({"A": A, "B": B}, PAIRS[:1]), PAIRS[1:])
    close(twice.values, joined.values)
    close(couple({"A": A, "B": B}, PAIRS, rcond=1e-12).values, joined.values)


def test_interface_forces_are_the_multipliers():
    forces = interface_forces({"A": A, "B": B}, PAIRS)
    joined = couple({"A": A, "B": B}, PAIRS)
    inputs = ["A a", "B f"]
    moved = joined.at([f"A {c}" for c in "abcde"], inputs).values
    taken = forces[:, :, joined.columns(inputs)]
    needed = ZA @ np.asarray(moved)  # all forces on A: the applied one and those of the bonds
    needed[:, 0, 0] -= 1.0
    close(taken, needed[:, 3:5])
    np.testing.assert_allclose(needed[:, :3], 0.0, atol=1e-9)


def test_elastic_bonds_and_held_channels():
    k = np.array([[500.0, 100.0], [100.0, 300.0]]) * (1 + 0.05j)
    Z = np.zeros((len(OMEGA), 9, 9), complex)
    Z[:, :5, :5] += ZA
    Z[:, 5:, 5:] += ZB
    for i, a in enumerate((3, 4)):
        for j, b in enumerate((3, 4)):
            Z[:, a, b] += k[i, j]
            Z[:, a + 2, b + 2] += k[i, j]
            Z[:, a, b + 2] -= k[i, j]
            Z[:, a + 2, b] -= k[i, j]
    close(couple({"A": A, "B": B}, PAIRS, compliance=np.linalg.inv(k)).values, np.linalg.inv(Z))
    held = couple(A, [("c", None)]).at(list("abde"), list("abde"))
    keep = [0, 1, 3, 4]
    close(held.values, np.linalg.inv(ZA[:, keep][:, :, keep]))


@pytest.mark.parametrize(
    ("motions", "forces", "rank"),
    [("de", None, None), ("defg", "de", None), ("defg", None, 2), ("fg", "de", None)],
    ids=["standard", "non-collocated", "extended", "inner points"],
)
def test_decoupling(motions, forces, rank):
    free = decouple(AB, B, list(motions), forces if forces is None else list(forces), rank=rank)
    close(free.at(A.outputs, A.inputs).values, A.values, 2e-9)


def test_truncation_and_damping_fight_noise():
    """0.1 % noise becomes 5 % at a standard interface; an extended one of the right rank is ten times better."""
    r = np.random.default_rng(5)

    def noisy(tf):
        shape = tf.values.shape
        return tf.with_values(tf.values * (1 + 1e-3 * (r.normal(size=shape) + 1j * r.normal(size=shape))))

    seen, fixture = noisy(AB), noisy(B)

    def error(motions, **options):
        found = decouple(seen, fixture, list(motions), **options).at(A.outputs, A.inputs).values
        return float(jnp.sqrt(jnp.mean(jnp.abs(found / A.values - 1) ** 2)))

    truncated, whole = error("defg", rank=2), error("defg")
    assert truncated < 0.2 * error("de")
    assert truncated < 0.5 * whole
    assert error("defg", noise=1e-5) < 0.6 * whole


def test_weights_know_the_worse_sensors():
    """Two of four compatible channels a hundred times noisier: weighing by one over the deviation drops the error."""
    r = np.random.default_rng(7)
    size = {c: 1e-2 if c in "de" else 1e-4 for c in "abcdefg"}

    def noisy(tf):
        scale = np.array([size[c] for c in tf.outputs])[None, :, None] * np.abs(tf.values).mean()
        return tf.with_values(
            tf.values + scale * (r.normal(size=tf.values.shape) + 1j * r.normal(size=tf.values.shape))
        )

    seen, fixture = noisy(AB), noisy(B)

    def error(weights):
        found = decouple(seen, fixture, list("defg"), list("de"), weights=weights).at(list("abc"), list("abc")).values
        return float(jnp.sqrt(jnp.mean(jnp.abs(found - A.values[:, :3, :3]) ** 2)))

    assert error(jnp.array([1.0, 1.0, 100.0, 100.0])) < 0.1 * error(None)


@pytest.mark.long
def test_free_response_from_measured_support_forces():
    """Whatever the supports are, their measured forces take them out; their forces need not even be linear."""
    Z = net(4, 7)
    r = np.random.default_rng(3)
    F, R = (r.normal(size=(len(OMEGA), 4, 6)) + 1j * r.normal(size=(len(OMEGA), 4, 6)) for _ in range(2))
    X = np.linalg.solve(Z, F + R)
    found = jax.jit(free_response)(X, F, R)
    close(found.receptance, np.linalg.inv(Z))
    assert np.all(found.residual < 1e-10)
    spoiled = free_response(X, jnp.asarray(F), jnp.asarray(R).at[:, 0].set(0.0))
    assert np.all(spoiled.residual > 1e-3)
    weighted = free_response(X, F, R, weights=jnp.linspace(1.0, 2.0, 6))
    close(weighted.receptance, np.linalg.inv(Z))


@pytest.mark.long
def test_weights_of_runs():
    """Noise on the motions: the weighted least squares of NumPy, run by run; a worthless run has no say."""
    r = np.random.default_rng(13)
    X, F = (r.normal(size=(len(OMEGA), n, 6)) + 1j * r.normal(size=(len(OMEGA), n, 6)) for n in (3, 4))
    w = np.array([1.0, 3.0, 0.5, 2.0, 1.5, 0.0])
    found = free_response(X, F, weights=w)
    exact = [np.linalg.lstsq((f * w).T, (x * w).T, rcond=None)[0].T for x, f in zip(X, F, strict=True)]
    close(found.receptance, np.stack(exact))
    spoiled = X.copy()
    spoiled[:, :, 5] = 1e3
    close(free_response(spoiled, F, weights=w).receptance, np.stack(exact))


@pytest.mark.long
def test_known_rig_is_taken_out():
    free, rig = net(5, 4), np.diag([0.0, 30.0, 0.0, 40.0, 0.0])
    Z_rig = rig[None] * (1 + 0.02j) - OMEGA[:, None, None] ** 2 * 0.1 * (rig > 0)
    on_rig = transfer(free + Z_rig, list("abcde")).to("accelerance")
    channels = ["b", "d"]
    inner = Z_rig[:, [1, 3]][:, :, [1, 3]]
    found = remove_stiffness(on_rig, channels, inner).to("receptance")
    close(found.values, np.linalg.inv(free))
    close(remove_stiffness(found, channels, -inner).values, on_rig.to("receptance").values)
    H, J = measured_stiffness(found)
    close(np.asarray(H) + 1j * np.asarray(J), free)


def test_kinds_of_transfer_functions():
    """(40): velocity per force is `i w B`, acceleration `-w^2 B`, and back."""
    w, B = OMEGA[:, None, None], np.asarray(A.values)
    expected = {"receptance": B, "mobility": 1j * w * B, "accelerance": -(w**2) * B}
    for kind, values in expected.items():
        given = TransferFunctions(OMEGA, values, A.outputs, A.inputs, kind=kind)
        for other, wanted in expected.items():
            close(given.to(other).values, wanted)
            assert given.to(other).kind == other


@pytest.mark.long
def test_virtual_point():
    """A rigid block on springs, seen by nine sensors and hit at ten places, is a 6 by 6 inverse."""
    r = np.random.default_rng(8)
    sensors = {f"s{i}": (r.normal(size=3), r.normal(size=3)) for i in range(9)}
    impacts = {f"i{i}": (r.normal(size=3), r.normal(size=3)) for i in range(10)}
    point = np.array([0.1, -0.2, 0.3])
    Z = net(6, 9, 20.0) + net(1, 1)[:, :1, :1] * 0.01
    six = np.linalg.inv(Z)
    Ru, Rf = (np.asarray(rigid_channels(list(p.values()), point)) for p in (sensors, impacts))
    place, d = impacts["i4"]
    d = d / np.linalg.norm(d)
    np.testing.assert_allclose(Rf[4], [*d, *np.cross(place - point, d)], atol=1e-14)
    measured = TransferFunctions(OMEGA, Ru @ six @ Rf.T, [*sensors], [*impacts])
    found = virtual_point(measured, point, sensors, impacts, name="p")
    close(found.transfer.values, six)
    assert found.transfer.outputs == ("p x", "p y", "p z", "p rx", "p ry", "p rz")
    assert np.all(found.motion_residual < 1e-10) and np.all(found.force_residual < 1e-10)
    bent = virtual_point(measured.with_values(measured.values.at[:, 2].mul(1.3)), point, sensors, impacts)
    assert np.all(np.max(bent.motion_residual, axis=1) > 0.01)
    weights = r.uniform(0.2, 3.0, 9)
    seen = measured.values.at[:, 2].mul(1.3)
    weighed = virtual_point(measured.with_values(seen), point, sensors, impacts, weights=weights).transfer.values
    root = np.sqrt(weights)[:, None]
    motion = np.linalg.lstsq(root * Ru, root * np.asarray(seen).transpose(1, 0, 2).reshape(9, -1), rcond=None)[0]
    motion = motion.reshape(6, len(OMEGA), 10).transpose(1, 0, 2)
    close(weighed, motion @ np.linalg.pinv(Rf.T))


@pytest.mark.long
def test_virtual_point_of_an_interface_that_stretches():
    """A seventh coordinate: what the block and its one flexible motion do is a 7 by 7 inverse."""
    r = np.random.default_rng(9)
    sensors, impacts = ({f"{c}{i}": (r.normal(size=3), r.normal(size=3)) for i in range(10)} for c in "si")
    point, stretch = np.array([0.1, -0.2, 0.3]), {"stretch": lambda arm: arm * jnp.array([1.0, 0.0, -0.5])}
    seven = np.linalg.inv(net(7, 9, 20.0))
    R = []
    for places in (sensors, impacts):
        along = [d @ ((p - point) * [1.0, 0.0, -0.5]) / np.linalg.norm(d) for p, d in places.values()]
        np.testing.assert_allclose(flexible_channels(list(places.values()), point, stretch["stretch"]), along)
        R.append(np.column_stack([rigid_channels(list(places.values()), point), along]))
    measured = TransferFunctions(OMEGA, R[0] @ seven @ R[1].T, [*sensors], [*impacts])
    found = virtual_point(measured, point, sensors, impacts, "p", flexible=stretch)
    close(found.transfer.values, seven)
    assert found.transfer.inputs[5:] == ("p rz", "p stretch")
    assert np.all(found.motion_residual < 1e-10) and np.all(found.force_residual < 1e-10)
    assert np.all(np.max(virtual_point(measured, point, sensors, impacts).motion_residual, axis=1) > 0.01)
    turned = {"turn": lambda arm: jnp.cross(jnp.array([0.0, 0.0, 1.0]), arm)}
    with pytest.raises(ModelError, match="determine only 6 of 7 coordinates"):
        virtual_point(measured, point, sensors, impacts, flexible=turned)


@pytest.mark.long
def test_gradient_of_decoupling_and_of_truncation():
    """Size of the recovered component by every entry of the assembled one, against differences; also truncated."""

    def size(rank, motions, values):
        free = decouple(AB.with_values(values), B, motions, rank=rank)
        return jnp.sum(jnp.abs(free.values[:, 0, 1]) ** 2) * 1e6

    r = np.random.default_rng(2)
    direction = (r.normal(size=AB.values.shape) + 1j * r.normal(size=AB.values.shape)) * np.abs(AB.values)
    for rank, motions in ((None, list("de")), (2, list("defg"))):
        start = AB.values * (1 + 0.01 * direction / np.abs(AB.values))
        f = jax.jit(lambda values, rank=rank, motions=motions: size(rank, motions, values))
        slope = jnp.sum(jax.grad(f)(start) * direction).real
        step = 1e-6
        expected = (f(start + step * direction) - f(start - step * direction)) / (2 * step)
        np.testing.assert_allclose(slope, expected, rtol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "rank", "noise"),
    [((4, 4), None, 0.0), ((6, 3), None, 0.0), ((3, 5), None, 0.3), ((4, 4), 2, 0.3), ((6, 3), 2, 0.0)],
)
def test_regular_inverse_and_its_derivative(shape, rank, noise):
    r = np.random.default_rng(4)
    A, dA = (r.normal(size=shape) + 1j * r.normal(size=shape) for _ in range(2))
    f = lambda t: regularised_inverse(A + t * dA, rank=rank, noise=noise + t)
    U, s, Vh = np.linalg.svd(A, full_matrices=False)
    g = s / (s**2 + noise**2) * (np.arange(len(s)) < (rank or 9))
    close(f(0.0), (Vh.conj().T * g) @ U.conj().T)
    change = jax.jvp(f, (0.0,), (1.0,))[1]
    close(change, (f(1e-6) - f(-1e-6)) / 2e-6, 1e-6)


@pytest.mark.long
def test_repeated_singular_values_have_a_derivative():
    change = jax.jvp(lambda A: regularised_inverse(A), (jnp.eye(3) * 2,), (jnp.ones((3, 3)),))[1]
    close(change, -np.ones((3, 3)) / 4)


@pytest.mark.long
def test_single_precision():
    low = [TransferFunctions(OMEGA, c.values.astype(np.complex64), c.outputs, c.inputs) for c in (A, B)]
    joined = couple(dict(zip("AB", low, strict=True)), PAIRS)
    assert joined.values.dtype == np.complex64 and joined.omega.dtype == np.float32
    close(joined.at(["A a"], ["A b"]).values, AB.at(["a"], ["b"]).values, 1e-3)
    removed = remove_stiffness(low[0], ["a"], np.array([[20.0]]))
    assert removed.values.dtype == np.complex64


@pytest.mark.long
def test_many_designs_at_once():
    """The rig's stiffness as a batch."""
    stiffness = jnp.array([10.0, 25.0])
    found = jax.vmap(lambda k: remove_stiffness(A, ["b"], k.reshape(1, 1)).values)(stiffness)
    for k, values in zip(np.asarray(stiffness), found, strict=True):
        Z = ZA.copy()
        Z[:, 1, 1] -= k
        close(values, np.linalg.inv(Z))


def _short():
    return TransferFunctions(OMEGA[:5], A.values[:5], A.outputs, A.inputs)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: TransferFunctions(OMEGA, A.values, list("abc"), list("abcde")), "values have shape"),
        (lambda: TransferFunctions(OMEGA, A.values, list("abcda"), list("abcde")), "'a' stands there twice"),
        (
            lambda: TransferFunctions(OMEGA, A.values, list("abcde"), list("abcde"), kind="force"),
            "unknown kind 'force'",
        ),
        (lambda: A.at(["x"]), "no output 'x'"),
        (lambda: couple({"A": A, "B": B}, [("A d", "B x")]), "no channel 'B x'"),
        (lambda: couple(A, [("a", "a")]), "joined to itself"),
        (lambda: uncoupled_transfer({"A": A, "B": _short()}), "5 frequencies"),
        (lambda: uncoupled_transfer({"A": A, "B": B.to("mobility")}), "'B' is a mobility"),
        (lambda: decouple(AB, B, list("d"), list("de")), "fewer than the 2 of equilibrium"),
        (lambda: decouple(AB, B, [("d", "x")]), "no output 'x'"),
        (lambda: remove_stiffness(A, ["b"], np.eye(2)), "1 channels need"),
        (lambda: free_response(jnp.ones((3, 2, 1)), jnp.ones((3, 2, 1))), "1 runs are too few for 2"),
        (lambda: free_response(jnp.ones((3, 2, 2)), jnp.ones((4, 2, 2))), "frequencies and runs differ"),
        (
            lambda: virtual_point(A, np.zeros(3), {"a": ((0, 0, 0.0), (1, 0, 0.0))}, {}),
            "1 sensors are too few",
        ),
        (
            lambda: virtual_point(
                TransferFunctions(OMEGA, np.ones((23, 6, 6)), list("abcdef"), list("abcdef")),
                np.zeros(3),
                *[{c: ((i, 0.0, 0.0), (0.0, 1.0, 0.1 * i)) for i, c in enumerate("abcdef")}] * 2,
            ),
            "of 6 coordinates",
        ),
    ],
)
def test_faults_are_told(call, told):
    with pytest.raises(ValueError, match=told):
        call()


@pytest.mark.long
def test_gradient_from_elements_to_coupled_transfer_functions():
    """Chains reduced, turned to transfer functions, coupled: value and gradient are those of the joined inverse."""
    omega = jnp.array([0.4, 1.3, 2.2])

    def level(values):
        return jnp.sum(jnp.abs(values) ** 2)

    @jax.jit
    @jax.value_and_grad
    def reduced(k):
        parts = {}
        for name, (K, M), i in (("a", chain(4, k, ends=1), 3), ("b", chain(3, 2.0, ends=0), 0)):
            own = reduce(component(K, M, (i,), 0.1 * K), CraigBampton(len(K) - 1))
            ends = ["0", str(len(K) - 1)]
            parts[name] = frequency_response(own, omega, ends, ends)
        return level(couple(parts, [("a 3", "b 0")]).at(["b 2"], ["a 0"]).values)

    @jax.jit
    @jax.value_and_grad
    def joined(k):
        K, M = jnp.zeros((6, 6)), jnp.zeros((6, 6))
        for place, (A, B) in ((slice(0, 4), chain(4, k, ends=1)), (slice(3, 6), chain(3, 2.0, ends=0))):
            K, M = K.at[place, place].add(A), M.at[place, place].add(B)
        return level(dense_response(K=K, M=M, load=jnp.eye(6)[:, :1], omega=omega, C=0.1 * K, out=jnp.eye(6)[5:]))

    np.testing.assert_allclose(reduced(1.7), joined(1.7), rtol=1e-8)
