"""Named bonds of every kind against one dense model of all components, in which the bonds' forces are unknowns."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.coupling import bushing, connect, hinge, rigid_bond
from jaxmbs.elements import Beam, PointMass
from jaxmbs.errors import ModelError
from jaxmbs.fem import Structure, assemble
from jaxmbs.reductions import CraigBampton, reduce
from tests.structural_matrices import beam, component

TUBE = Beam(70e9, 27e9, 4e-4, 2e-8, 2e-8, 4e-8, 2700.0)
BOX = PointMass(0.6, (0.0, 0.0, 0.1), 2e-3 * np.eye(3))
STIFFNESS = np.diag([3e5, 4e5, 5e5, 90.0, 80.0, 70.0])
DAMPING = 1e-3 * STIFFNESS
MASS = np.diag([0.2, 0.2, 0.2, 1e-4, 1e-4, 1e-4])
AXES = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
OMEGA = 200.0


def part(nodes, interface):
    nodes = {name: np.array(place, float) for name, place in nodes.items()}
    names = list(nodes)
    elements = {"tube": (TUBE, list(zip(names[:-1], names[1:], strict=True))), "box": (BOX, [(names[1],)])}
    return assemble(Structure(nodes, elements), interface)


PARTS = {
    "stage": part({"foot": (0, 0, 0), "knee": (0.1, 0, 0.4), "top": (0, 0.1, 0.8)}, ["foot", "knee", "top"]),
    "mast": part({"root": (0, 0.1, 0.8), "middle": (0, 0.3, 1.2), "end": (0.1, 0.2, 1.6)}, ["root", "end"]),
    "panel": part({"hinge": (0.1, 0.2, 1.6), "edge": (0.5, 0.3, 1.7), "far": (0.9, 0.6, 1.9)}, ["hinge", "far"]),
}
GIRDER = ({"a": np.zeros(3), "b": np.array([1.0, 0, 0])}, {"tube": (TUBE, [("a", "b")])}, {"a": "all"})
FORCE = np.random.default_rng(1).normal(size=18)


def network(stiffness, axes, linear_solver="auto"):
    """Bolted to the ground, a bushing, a hinge about an axis of its own, a ball joint to the ground."""
    parts = {
        "stage": PARTS["stage"],
        "mast": reduce(PARTS["mast"], CraigBampton(6)),
        "panel": PARTS["panel"],
    }
    bonds = {
        "bolts": rigid_bond("stage.foot"),
        "mount": bushing("stage.top", "mast.root", stiffness=stiffness, damping=DAMPING, mass=MASS, axes=axes),
        "pin": hinge("mast.end", "panel.hinge", free="ry", axes=axes),
        "stay": hinge(("panel", "far"), free="rx ry rz"),
    }
    return connect(parts, bonds, linear_solver=linear_solver)


def monolithic(omega):
    """Displacements by component, force of the pin on the mast and of the mount on both its ends: NumPy."""
    start = {name: 18 * i for i, name in enumerate(PARTS)}
    Z = np.zeros((66, 66), complex)  # three components, both frames of the mount
    for name, s in PARTS.items():
        at = slice(start[name], start[name] + 18)
        Z[at, at] = np.asarray(s.stiffness) - omega**2 * np.asarray(s.mass)
    elastic, two = STIFFNESS + 1j * omega * DAMPING, np.array([[2, 1], [1, 2]]) / 6
    Z[54:, 54:] = np.kron([[1, -1], [-1, 1]], elastic) - omega**2 * np.kron(two, MASS)
    turn = np.kron(np.eye(2), AXES)
    rows = []

    def tie(first, second, turned, kept=range(6)):
        row = np.zeros((6, 66))
        row[:, first : first + 6] = turned
        if second is not None:
            row[:, second : second + 6] = -turn if second < 54 else -np.eye(6)
        rows.extend(row[list(kept)])

    tie(0, None, np.eye(6))  # foot
    tie(12, 54, turn)  # top
    tie(18, 60, turn)  # root
    tie(30, 36, turn, (0, 1, 2, 3, 5))  # end, hinge
    tie(48, None, np.eye(6), range(3))  # far
    B = np.array(rows)
    saddle = np.block([[Z, B.T], [B, np.zeros((len(B), len(B)))]])
    right = np.zeros(len(saddle))
    right[36:54] = FORCE
    solution = np.linalg.solve(saddle, right)
    f = -solution[66:]
    pin = np.insert(f[18:23], 4, 0.0)
    moved = {name: solution[s : s + 18] for name, s in start.items()}
    return moved, {"bolts": f[:6], "mount": f[6:12], "pin": pin, "stay": np.r_[f[23:], np.zeros(3)]}, f[12:18]


@partial(jax.jit, static_argnums=2)
def shaken(stiffness, axes, linear_solver="auto"):
    """Amplitudes by component and loads at two frequencies, the force twice as large at the second one."""
    net = network(stiffness, axes, linear_solver)
    force = np.outer([1.0, 2.0], FORCE)
    response = mbs.vibration.harmonic_response(net, [OMEGA, OMEGA], {"panel": force})
    return net.expand(response.displacement), mbs.reactions(net, response), net


@pytest.mark.long
@pytest.mark.parametrize("linear_solver", ["dense", "multifrontal"])
def test_every_bond_against_one_dense_model(linear_solver):
    """Harmonic displacements, forces of all bonds, and their balance."""
    moved, found, _ = shaken(jnp.asarray(STIFFNESS), jnp.asarray(AXES), linear_solver)
    exact, forces, second = monolithic(OMEGA)
    scale = np.array([1.0, 2.0])[:, None]
    for name, x in exact.items():
        np.testing.assert_allclose(moved[name], scale * x, atol=1e-8 * np.max(np.abs(x)))
    for name, f in forces.items():
        np.testing.assert_allclose(found[name].on_first, scale * f, atol=1e-8 * np.max(np.abs(f)))
        opposite = second if name == "mount" else -f
        np.testing.assert_allclose(found[name].on_second, scale * opposite, atol=1e-8 * np.max(np.abs(f)))
    assert np.max(np.abs(second + forces["mount"])) > 1e-3 * np.max(np.abs(second))  # its mass takes a part
    assert found.ok and found.residual < 1e-9


@pytest.mark.long
def test_amplitudes_are_those_of_the_transfer_functions():
    """By the same names; complex amplitudes, one for each frequency; a loss factor; block matrices."""
    net, omega, push = shaken(jnp.asarray(STIFFNESS), jnp.asarray(AXES))[2], [20.0, 90.0], np.array([1.0, 2.0 - 1j])
    found = mbs.vibration.harmonic_response(net, omega, {"panel.edge z": push, "mast.middle x": 3.0}, loss=0.05)
    asked = {"into": ["panel.edge z", "mast.middle x"], "out": ["stage.knee y"]}
    H = mbs.frequency_response(net, omega, **asked, loss=0.05).values[:, 0]
    rows, _ = net.outputs("stage.knee y")
    np.testing.assert_allclose(
        np.asarray(found.displacement) @ np.asarray(rows[0]), H[:, 0] * push + 3.0 * H[:, 1], rtol=1e-9
    )
    loads = mbs.reactions(net, found)
    assert loads.ok and loads["bolts"].force.shape == (2, 3)
    sheet = assemble(Structure(*GIRDER), blocks=True)
    one, other = (mbs.vibration.harmonic_response(s, omega, {"b x": push}, 0.1) for s in (sheet, sheet.to_dense()))
    np.testing.assert_allclose(one.displacement, other.displacement, rtol=1e-9)
    with pytest.raises(ValueError, match="the frequencies must be its first axis"):
        mbs.vibration.harmonic_response(net, omega, {"panel.edge z": np.ones(3)})
    with pytest.raises(ValueError, match="no component 'pannel': did you mean 'panel'"):
        mbs.vibration.harmonic_response(net, omega, {"pannel.edge z": 1.0})


@pytest.mark.long
def test_a_network_shows_its_components_and_bonds():
    """A table that fits a screen, of a part too; with traced numbers, shapes."""
    net = network(STIFFNESS, AXES)
    lines = repr(net).splitlines()
    assert (
        len(lines) == 2 + 4 + 4
        and lines[0] == f"ComponentNetwork: {net.num_rows} coordinates of 4 components, 4 bonds"
    )
    assert any(line.split()[:2] == ["pin", "bond"] and line.endswith("x y z rx rz") for line in lines)
    part = repr(PARTS["stage"])
    assert "18 coordinates, 18 of them interface, dense matrices, no damping" in part and "knee" in part
    assert "interface" in repr(PARTS["mast"]).splitlines()[2] and len(part.splitlines()) == 5
    jax.eval_shape(lambda k: repr(network(k, AXES)) and k, jnp.asarray(STIFFNESS))


@pytest.mark.long
def test_gradient_and_batch_by_a_mount():
    """Size of the pin's force by the mount's stiffness, many at once, against differences."""

    def size(t):
        net = network(STIFFNESS * jnp.exp(t), jnp.asarray(AXES))
        found = mbs.reactions(net, mbs.equilibrium(net, {"panel": jnp.asarray(FORCE)}))
        return jnp.sum(found["pin"].on_first ** 2)

    t = jnp.array([0.0, -1e-3, 1e-3])
    value, slope = jax.jit(jax.vmap(jax.value_and_grad(size)))(t)
    np.testing.assert_allclose(slope[0], (value[2] - value[1]) / 2e-3, rtol=3e-6)


@pytest.mark.long
@pytest.mark.parametrize("linear_solver", ["dense", "multifrontal"])
def test_loads_of_a_network_that_nothing_holds(linear_solver):
    """Pushed through the middle of two equal parts, the first takes half: inertia relief."""
    half = {"a": PARTS["mast"], "b": PARTS["mast"]}
    net = connect(half, {"weld": rigid_bond("a.root", "b.root")}, linear_solver=linear_solver)
    push = np.array([0.0, 5.0, 0.0])
    rest = mbs.equilibrium(net, {"a.root": np.r_[push, np.zeros(3)]}, free=True)
    found = mbs.reactions(net, rest)
    assert found.ok
    np.testing.assert_allclose(found["weld"].force, -push / 2, atol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("linear_solver", ["dense", "multifrontal"])
def test_determinate_and_redundant_bonds_by_name(linear_solver):
    """A chain clamped at one end, with a hinge, held by a ball joint at the other; beams with and without a prop."""
    report = network(STIFFNESS, AXES, linear_solver).determinacy()
    assert (report.redundant, report.free_motions) == (2, 0)
    assert report.labels["pin"] == ("x", "y", "z", "rx", "rz")
    assert not any(any(flags) for flags in report.determinate.values())
    half = component(*beam(4), (0, 1, 8, 9))
    join = partial(connect, {"a": half, "b": half}, linear_solver=linear_solver)
    bonds = {"wall": rigid_bond(("a", (0, 1))), "weld": rigid_bond(("a", (2, 3)), ("b", (0, 1)))}
    report = join(bonds).determinacy()
    assert (report.redundant, report.free_motions) == (0, 0)
    assert all(all(flags) for flags in report.determinate.values())
    propped = join(bonds | {"prop": hinge(("b", (2, 3)), free=(1,))}).determinacy()
    assert str(propped) == (
        "1 redundant bonds, 0 free motions\nwall  redundant 0 1\nweld  redundant 0 1\nprop  redundant 0"
    )
    pinned = hinge(("a", (2, 3)), ("b", (0, 1)), free=(1,))
    assert join(bonds | {"weld": pinned}).determinacy().free_motions == 1


WRONG = [
    ({"b.c": bushing("stage.foot", stiffness=np.ones(6))}, "bond 'b.c': names must not contain a dot"),
    ({"b": rigid_bond("nothing")}, "bond 'b': there is no component 'nothing'"),
    ({"b": rigid_bond(("stage", "tip"))}, "bond 'b': interface of 'stage': there is no coordinate or node 'tip'"),
    ({"b": rigid_bond(("stage", 40))}, "bond 'b': 'stage' has no interface coordinate number 40"),
    (
        {"b": rigid_bond(("stage", "foot"), "mast")},
        "bond 'b': its ends have different directions: x y z rx ry rz and x y z",
    ),
    ({"b": hinge(("stage", "foot"), free="w")}, "bond 'b': its ends have no direction w, only x y z rx ry rz"),
    (
        {"b": bushing(("stage", "foot"), stiffness=(1.0, 2.0, 3.0))},
        "bond 'b': its stiffness has 3 directions, its ends 6",
    ),
    ({"b": rigid_bond("ground", ("stage", "foot"))}, "bond 'b': its first end is the ground"),
    ({"stage": rigid_bond(("stage", "foot"))}, "bond 'stage': a component has this name"),
    (
        {"b": rigid_bond("stage"), "c": rigid_bond(("stage", "foot"))},
        "bond 'c': its ends are tied by other bonds already",
    ),
    (
        {"b": rigid_bond(("stage", "foot")), "c": hinge(("stage", "foot"), ("mast", "root"), free="x", axes=AXES)},
        "bond 'c' has axes: b must not join the same coordinates",
    ),
]


@pytest.mark.parametrize(("bonds", "said"), WRONG, ids=[said for _, said in WRONG])
def test_faults(bonds, said):
    parts = {name: PARTS[name] for name in ("stage", "mast")}
    with pytest.raises(ModelError) as error:
        connect(parts, bonds)
    assert said in str(error.value)


def test_ends_by_coordinate():
    """A prop under one coordinate, by its name."""
    by_name, by_number = (
        connect({"stage": PARTS["stage"]}, {"prop": rigid_bond(end)}) for end in ("stage.top y", ("stage", (13,)))
    )
    np.testing.assert_array_equal(by_name.stiffness, by_number.stiffness)
    assert by_name.bonds[0][1].labels == ("y",)


def test_joined_nodes_must_be_at_one_place():
    """Told by name, with the distance and the way out; a prop may stand on what is below it."""
    parts = {"stage": PARTS["stage"], "mast": PARTS["mast"].translate((0.0, 0.0, 0.5))}
    bolts = {"bolts": rigid_bond("stage.top", "mast.root")}
    with pytest.raises(ModelError) as error:
        connect(parts, bolts)
    told = str(error.value)
    assert "bond 'bolts': stage.top and mast.root are 0.5 m apart" in told
    assert "`mast.translate((0, 0, -0.5))`" in told and "places=False" in told
    net = connect(parts | {"mast": parts["mast"].translate((0, 0, -0.5))}, bolts)
    np.testing.assert_allclose(net.stiffness, connect(parts, bolts, places=False).stiffness)
    assert connect(parts, {"prop": rigid_bond("stage.top z", "mast.root z")}).num_rows == 35
    for bond in (rigid_bond("stage.top y", "mast.root y"), bushing("stage.top", "mast.root", stiffness=[1.0] * 6)):
        with pytest.raises(ModelError, match="0.5 m apart"):
            connect(parts, {"b": bond})
    tilted = hinge("stage.top", "mast.root", free="x y rx ry rz", axes=np.diag([1.0, -1.0, -1.0]))
    assert connect(parts, {"b": tilted}).num_rows == 35
    jax.eval_shape(lambda z: connect(parts | {"mast": PARTS["mast"].translate(z)}, bolts).stiffness, np.zeros(3))
    with pytest.raises(ModelError, match="`translate` needs the positions"):
        component(*beam(2), (0, 1)).translate((1, 0, 0))


def test_wrong_numbers_and_names():
    with pytest.raises(ValueError, match="must be of one shape"):
        bushing("a", "b", stiffness=np.eye(3), damping=np.eye(2))
    net = connect({"a": component(*beam(2), (0, 1))}, {"wall": rigid_bond("a")})
    with pytest.raises(ValueError, match="no component 'c'"):
        net.load({"c": jnp.zeros(6)})
    with pytest.raises(ValueError, match="singular: there is a motion without strain"):
        mbs.equilibrium(connect({"a": component(*beam(2), (0, 1))}, {}), {"a": jnp.ones(6)})
    with pytest.raises(ModelError, match="component 'a' is a tuple, not a LinearSystem"):
        connect({"a": beam(2)}, {})
    with pytest.raises(ValueError, match="not possible under tracing"):
        jax.jit(lambda K: connect({"a": component(K, beam(2)[1], (0, 1))}, {}).determinacy().redundant)(beam(2)[0])
