"""Networks stored in blocks: every verb against the dense storage, which other tests hold against outside truth."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.blocksparse import BlockMatrix
from jaxmbs.coupling import connect, rigid_bond
from jaxmbs.errors import ModelError
from jaxmbs.linear import StaticResponse, static_response
from jaxmbs.linear._block_statics import solve_statics
from jaxmbs.runtime import tuning
from tests.structural_matrices import beam, component

BARS = 12


def bars(factors, mass=1.0, damping=None):
    """Beams of two elements, a coordinate pair at either end and one between; factors of their stiffness."""
    K, M = beam(2)
    C = None if damping is None else damping * K
    interface = (0, 1, 4, 5)
    return {f"bar {k}": component(f * K, mass * M, interface, C) for k, f in enumerate(factors)}


def row(factors, linear_solver, free=False, **options):
    """Beams end to end, the first one clamped unless free."""
    parts = bars(factors, **options)
    bonds = {} if free else {"wall": rigid_bond(("bar 0", (0, 1)))}
    for k in range(1, len(parts)):
        bonds[f"weld {k}"] = rigid_bond((f"bar {k - 1}", (2, 3)), (f"bar {k}", (0, 1)))
    return connect(parts, bonds, linear_solver=linear_solver)


FACTORS = 1.0 + 0.3 * np.random.default_rng(3).uniform(size=BARS)
TIP = f"bar {BARS - 1}.4"


@pytest.fixture(scope="module", params=[False, True], ids=["held", "free"])
def pair(request):
    return [row(FACTORS, kind, request.param, damping=1e-3) for kind in ("dense", "multifrontal")]


def test_blocks_are_the_dense_matrices(pair):
    dense, blocks = pair
    assert isinstance(blocks.stiffness, BlockMatrix) and blocks.linear_solver == "multifrontal"
    assert "linear solver: multifrontal" in repr(blocks) and "linear solver" not in repr(dense)
    assert blocks.coordinates == dense.coordinates and blocks.num_rows == dense.num_rows
    again = blocks.to_dense()
    assert again.linear_solver == "dense"
    for kind in ("mass", "stiffness", "damping"):
        np.testing.assert_allclose(getattr(again, kind), getattr(dense, kind), atol=1e-12)


def test_displacements_of_the_components(pair):
    """Of every component by name, from one vector of the network."""
    xi = np.random.default_rng(5).normal(size=(3, pair[0].num_rows))
    exact, found = (net.expand(xi) for net in pair)
    assert list(found) == list(exact)
    for name, x in exact.items():
        np.testing.assert_allclose(found[name], x, atol=1e-14)


# ----------------------------------------------------------------------------------------------- one program for all
def tip_and_load(designs, linear_solver):
    """Sum of squares of the loads at the sixth weld under a force at the tip, with a spring to the ground there."""
    parts = bars(designs)
    bonds = {
        "wall": rigid_bond(("bar 0", (0, 1))),
        "prop": mbs.coupling.bushing((f"bar {BARS - 1}", (2,)), stiffness=[2.0]),
    }
    for k in range(1, BARS):
        bonds[f"weld {k}"] = rigid_bond((f"bar {k - 1}", (2, 3)), (f"bar {k}", (0, 1)))
    net = connect(parts, bonds, linear_solver=linear_solver)
    return jnp.sum(mbs.reactions(net, mbs.equilibrium(net, {TIP: 1.0}))["weld 6"].on_first ** 2)


def largest_squares(text, size):
    """Tensors of a lowered program with two axes of at least `size`."""
    shapes = {
        tuple(int(n) for n in s.split("x")[:-1])
        for s in re.findall(r"tensor<((?:\d+x)+)[a-z]", text)
        for s in [s + "f"]
    }
    return {shape for shape in shapes if sum(n >= size for n in shape) > 1}


@pytest.mark.long
def test_designs_to_gradient_in_blocks():
    """Designs, connect, reactions and gradient, 16 designs at once: no matrix of the whole, and the dense values."""
    designs = 1.0 + np.random.default_rng(0).uniform(size=(16, BARS))
    programs = [
        jax.jit(jax.vmap(jax.value_and_grad(lambda d, kind=kind: tip_and_load(d, kind))))
        for kind in ("dense", "multifrontal")
    ]
    rows = 4 * BARS
    lowered = [program.lower(designs) for program in programs]
    squares = [largest_squares(one.as_text(), rows) for one in lowered]
    assert (16, rows, rows) in squares[0] and not squares[1], squares
    (exact, slopes), (values, found) = (one.compile()(designs) for one in lowered)
    np.testing.assert_allclose(values, exact, rtol=1e-10)
    np.testing.assert_allclose(found, slopes, atol=1e-10 * np.abs(slopes).max())
    direction = np.random.default_rng(1).normal(size=(16, BARS))
    ahead, behind = (lowered[1].compile()(designs + h * direction)[0] for h in (1e-4, -1e-4))
    secant = (ahead - behind) / 2e-4
    np.testing.assert_allclose(np.sum(found * direction, axis=1), secant, rtol=1e-5, atol=1e-7 * np.abs(secant).max())


# ------------------------------------------------------------------------------------------------------------- verbs
@pytest.mark.long
def test_statics_and_loads(pair):
    """Several load cases; a free row accelerates."""
    forces = {TIP: np.array([1.0, 2.0]), "bar 2.2": np.array([0.5, -1.0])}
    rigid = np.linalg.svd(pair[0].stiffness)[0][:, -2:]
    answers = []
    for net in pair:
        if "wall" in dict(net.bonds):
            rest = mbs.equilibrium(net, forces)
        else:
            with pytest.raises(ValueError, match="the stiffness is singular"):
                mbs.equilibrium(net, forces)
            rest = _relieved(net, forces, rigid)
        answers.append((rest, mbs.reactions(net, rest)))
    (exact, loads), (found, ours) = answers
    np.testing.assert_allclose(found.displacement, exact.displacement, atol=1e-9 * np.abs(exact.displacement).max())
    for name, load in loads.items():
        np.testing.assert_allclose(ours[name].on_first, load.on_first, atol=1e-9)
        np.testing.assert_array_equal(ours[name].on_second, -ours[name].on_first)
    assert bool(ours.ok)


def _relieved(net, forces, rigid):
    """Equilibrium of a free network whose nodes have no positions: rigid motions of the dense matrices."""
    load = net.load(forces)
    if not isinstance(net.stiffness, BlockMatrix):
        found = static_response(K=net.stiffness, M=net.mass, load=load, rigid=rigid)
        return StaticResponse(found.displacement, found.acceleration, found.rigid, (forces,))
    x, a, _ = solve_statics(net, load.T, jnp.asarray(rigid))
    return StaticResponse(x.T, a.T, jnp.asarray(rigid), (forces,))


@pytest.mark.long
def test_harmonics_and_their_loads(pair):
    omega = [0.01, 0.4]
    forces = {TIP: np.array([1.0, 2.0 - 1.0j])}
    exact, found = (mbs.vibration.harmonic_response(net, omega, forces, loss=0.02) for net in pair)
    _assert_close(found.displacement, exact.displacement, 1e-10)
    loads, ours = (mbs.reactions(net, answer)["weld 3"] for net, answer in zip(pair, (exact, found), strict=True))
    _assert_close(ours.on_second, loads.on_second, 1e-8)
    first, second = (mbs.frequency_response(net, omega, [TIP], ["bar 0.4", "bar 3.2"]).values for net in pair)
    _assert_close(second, first, 1e-10)


def _assert_close(found, exact, error):
    np.testing.assert_allclose(found, exact, atol=error * np.abs(exact).max())


@pytest.mark.long
def test_modes_free_or_held(pair):
    """The lowest by block Lanczos, rigid ones flagged; all or complex ones from dense matrices."""
    exact, found = (mbs.modes(net, 6, damped=False) for net in pair)
    assert found.num_rigid == exact.num_rigid == (0 if "wall" in dict(pair[0].bonds) else 2)
    np.testing.assert_allclose(found.omega, exact.omega, rtol=1e-8, atol=1e-12)
    elastic = slice(found.num_rigid, None)
    cosines = np.abs(np.sum(found.shapes * (pair[0].mass @ exact.shapes), axis=0))[elastic]
    np.testing.assert_allclose(cosines, 1.0, atol=1e-8)
    assert mbs.modes(pair[1], 2).is_complex


@pytest.mark.long
def test_gradient_of_a_free_frequency():
    """Of the lowest elastic mode, whose shift carries no derivative, against differences."""

    def value(t):
        net = row(FACTORS * (1.0 + t * jnp.arange(float(BARS))), "multifrontal", free=True)
        return mbs.modes(net, 4).values[2]

    value, slope = (jax.jit(f) for f in (value, jax.grad(value)))
    np.testing.assert_allclose(slope(0.0), (value(1e-4) - value(-1e-4)) / 2e-4, rtol=1e-6)


@pytest.mark.long
def test_motion_and_its_loads(pair):
    ts = np.linspace(0.0, 2.0, 9)
    motions = [mbs.simulate(net, ts=ts, forces={TIP: np.sin(ts)}) for net in pair]
    exact, found = motions
    np.testing.assert_allclose(found.displacement, exact.displacement, atol=1e-9)
    loads, ours = (mbs.reactions(net, motion)["weld 3"] for net, motion in zip(pair, motions, strict=True))
    np.testing.assert_allclose(ours.on_first, loads.on_first, atol=1e-7)


@pytest.mark.long
def test_motion_with_rows_without_mass():
    """Joints without mass follow statically, loads on them included; its gradient is that of dense matrices."""
    ts = np.linspace(0.0, 3.0, 7)

    def net(t, kind):
        K, M = beam(2)
        M = M.at[4:6].set(0.0).at[:, 4:6].set(0.0)
        parts = {f"bar {k}": component(f * t * K, M, (0, 1, 4, 5)) for k, f in enumerate(FACTORS[:4])}
        bonds = {"wall": rigid_bond(("bar 0", (0, 1)))}
        bonds |= {f"weld {k}": rigid_bond((f"bar {k - 1}", (2, 3)), (f"bar {k}", (0, 1))) for k in range(1, 4)}
        return connect(parts, bonds, linear_solver=kind)

    forces = {"bar 3.4": np.sin(ts), "bar 1.2": ts}
    exact, found = (mbs.simulate(net(1.0, kind), ts=ts, forces=forces) for kind in ("dense", "multifrontal"))
    np.testing.assert_allclose(found.displacement, exact.displacement, atol=1e-8)
    np.testing.assert_allclose(found.acceleration, exact.acceleration, atol=1e-5)

    def last(t):
        system = net(1.0, "multifrontal")
        system = system.replace(stiffness=system.stiffness * t)
        return mbs.simulate(system, ts=ts, forces=forces).displacement[-1, 3]

    slope = jax.grad(last)(1.0)
    np.testing.assert_allclose(slope, (last(1.0 + 1e-5) - last(1.0 - 1e-5)) / 2e-5, rtol=1e-4)


# -------------------------------------------------------------------------------------------------------- the choice
@pytest.mark.long
def test_choice_by_size():
    """Dense below the break-even, in blocks above it; both can be asked for, and other names are refused."""
    assert tuning.NETWORK_BONDS <= 24
    small = row(FACTORS, "auto")
    assert small.linear_solver == "dense"
    count = max(tuning.NETWORK_BONDS, -(-tuning.NETWORK_ROWS // 4))
    large = row(np.ones(count), "auto")
    assert large.linear_solver == "multifrontal" and row(np.ones(count), "dense").linear_solver == "dense"
    with pytest.raises(
        ModelError, match="linear_solver must be one of 'auto', 'dense', 'multifrontal', got 'sparse'"
    ):
        row(FACTORS, "sparse")
    body = mbs.coupling.RigidBody(mass=1.0, points={"a": (0, 0, 0)})
    with pytest.raises(ModelError, match="linear_solver='multifrontal'"):
        connect(
            {"body": body},
            {"mount": mbs.coupling.bushing("body.a", stiffness=np.ones(6))},
            linear_solver="multifrontal",
        )


@pytest.mark.long
def test_unsymmetric_component():
    """A follower force makes a stiffness unsymmetric: it is solved by LU, also where it is traced."""
    K, M = beam(2)
    skew = jnp.zeros((6, 6)).at[4, 5].set(0.4)

    def loads(t, kind):
        parts = {"a": component(K, M, (0, 1, 4, 5)), "b": component(K + t * skew, M, (0, 1, 4, 5))}
        bonds = {"wall": rigid_bond(("a", (0, 1))), "weld": rigid_bond(("a", (2, 3)), ("b", (0, 1)))}
        net = connect(parts, bonds, linear_solver=kind)
        return mbs.reactions(net, mbs.equilibrium(net, {"b.4": 1.0}))["weld"].on_first

    exact = loads(1.0, "dense")
    np.testing.assert_allclose(loads(1.0, "multifrontal"), exact, rtol=1e-9)
    np.testing.assert_allclose(jax.jit(lambda t: loads(t, "multifrontal"))(1.0), exact, rtol=1e-9)
