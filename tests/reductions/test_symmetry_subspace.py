"""Halves, quarters and sectors against the whole structure: modes, statics, derivatives, closed forms, faults."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg
import scipy.spatial

import jaxmbs as mbs
from jaxmbs.coupling import connect, rigid_bond
from jaxmbs.elements import DIRECTIONS, Beam
from jaxmbs.errors import ModelError
from jaxmbs.fem import Structure, assemble
from jaxmbs.linear import LinearSystem
from jaxmbs.reductions import CraigBampton, Cyclic, Mirror, reduce, rotate
from jaxmbs.vibration import modes

ACROSS_X = np.diag([-1.0, 1.0, 1.0])


def at(place):
    return tuple(np.round(np.asarray(place), 6) + 0.0)


def six_by_six(axes):
    return scipy.linalg.block_diag(axes, np.linalg.det(axes) * axes)


def in_six(system):
    """For each node its place, and its rows with their directions."""
    for name, place in zip(system.nodes, np.asarray(system.positions), strict=True):
        rows = [i for i, (node, _) in enumerate(system.coordinates) if node == name]
        yield place, rows, [DIRECTIONS.index(system.coordinates[i][1]) for i in rows]


def shared_out(forces, part, axes):
    """Forces (6,) by place as (parts, n) on all parts, in each one's axes; what parts have in common is divided."""
    axes, found = np.asarray(axes), np.zeros((len(axes), part.num_rows))
    met = [at(Q @ place) for Q in axes for place, *_ in in_six(part)]
    for k, Q in enumerate(axes):
        for place, rows, directions in in_six(part):
            key = at(Q @ place)
            found[k, rows] = (six_by_six(Q).T @ forces[key])[directions] / met.count(key)
    return jnp.asarray(found)


def by_place(motions, part, axes):
    """Displacements (6,) by place in world axes, of all parts (parts, n); what parts have in common agrees."""
    found = {}
    for x, Q in zip(np.asarray(motions), np.asarray(axes), strict=True):
        for place, rows, directions in in_six(part):
            own = np.zeros(6)
            own[directions] = x[rows]
            moved = six_by_six(Q) @ own
            np.testing.assert_allclose(found.setdefault(at(Q @ place), moved), moved, rtol=1e-7, atol=1e-9)
    return found


def check_statics(families, part, whole, seed=0):
    """Any forces on the whole, the answers of the families summed: those of one solution of the whole."""
    random = np.random.default_rng(seed)
    forces, load = {}, np.zeros(whole.num_rows)
    for place, rows, directions in in_six(whole):
        forces[at(place)] = f = np.zeros(6)
        f[directions] = load[rows] = random.normal(size=len(rows))
    answer, given = 0.0, shared_out(forces, part, families[0].axes)
    for family in families:
        answer = answer + family.part_displacements(jnp.linalg.solve(family.stiffness, family.gather_forces(given)))
    x, found = np.linalg.solve(whole.stiffness, load), by_place(answer, part, families[0].axes)
    for place, rows, directions in in_six(whole):
        if rows:
            np.testing.assert_allclose(found[at(place)][directions], x[rows], rtol=1e-7, atol=1e-9 * np.abs(x).max())


def squared(systems):
    """All squared frequencies of the systems, by SciPy."""
    return np.sort(np.concatenate([scipy.linalg.eigh(s.stiffness, s.mass, eigvals_only=True) for s in systems]))


# --------------------------------------------------------------------------------------------------- mirror images
TUBE = Beam(70.0, 27.0, 4e-2, 2e-2, 2e-2, 4e-2, 2.7)
LEFT = {"a": (-1.0, 0.0, 0.0), "b": (-0.8, 0.1, 1.0), "p": (0.0, 0.3, 1.2)}


def half(height=1.0, groups=(("a", "b"), ("b", "p"))):
    """Foot, corner and middle of a skew portal; the middle is on the plane x = 0."""
    used = [n for n in LEFT if any(n in pair for pair in groups)]
    nodes = {n: jnp.asarray(LEFT[n]) * jnp.stack([1.0, 1.0, jnp.asarray(height, float)]) for n in used}
    held = {"a": "all"} if "a" in used else {}
    return assemble(Structure(nodes, {"tube": (TUBE, list(groups))}, held=held), [n for n in used if n != "a"])


def portal(height=1.0):
    nodes = {n + end: np.array(LEFT[n]) * [x, 1, height] for end, x in (("", 1), ("'", -1)) for n in LEFT}
    del nodes["p'"]
    pairs = [("a", "b"), ("b", "p"), ("a'", "b'"), ("b'", "p")]
    return assemble(Structure(nodes, {"tube": (TUBE, pairs)}, held={"a": "all", "a'": "all"}))


@jax.jit
def mirrored(part):
    return tuple(reduce(part, Mirror("x", ["p"], antisymmetric=anti)) for anti in (False, True))


@pytest.mark.slow
def test_two_families_are_the_portal():
    """Frequencies of both families, and what any forces do."""
    part, whole = half(), portal()
    families = mirrored(part)
    assert [f.num_rows for f in families] == [9, 9]
    np.testing.assert_allclose(squared(families), squared([whole]), rtol=1e-8)
    check_statics(families, part, whole)


@pytest.mark.long
def test_mirror_image_joined_to_the_half():
    part, whole = half(), portal()
    net = connect({"left": part, "right": rotate(part, ACROSS_X)}, {"middle": rigid_bond("left.p", "right.p")})
    np.testing.assert_allclose(squared([net]), squared([whole]), rtol=1e-8)


@pytest.mark.long
def test_subsystems_of_one_family_joined():
    """The column does not reach the plane; both families joined are the whole portal."""
    column, girder = half(groups=[("a", "b")]), half(groups=[("b", "p")])
    nets = [
        connect(
            {"column": reduce(column, Mirror("x", (), anti)), "girder": reduce(girder, Mirror("x", ["p"], anti))},
            {"corner": rigid_bond("column.b", "girder.b")},
        )
        for anti in (False, True)
    ]
    np.testing.assert_allclose(squared(nets), squared([portal()]), rtol=1e-8)
    rest = mbs.equilibrium(nets[0], {"girder.p z": -0.5})  # on either half: one together
    corner = mbs.reactions(nets[0], rest)["corner"]
    np.testing.assert_allclose(corner.force[2], -0.5, rtol=1e-8)
    whole = portal()
    x = np.linalg.solve(whole.stiffness, np.eye(whole.num_rows)[whole.rows("p z")[0]])
    moved = nets[0].expand(rest.displacement)["girder"][np.array(girder.rows("b"))]
    np.testing.assert_allclose(moved, -x[list(whole.rows("b"))], rtol=1e-7, atol=1e-10)


@pytest.mark.long
def test_gradient_by_the_height_of_the_portal():
    """Compliance of one corner pushed: half of either family's, against differences of the whole."""

    def compliance(height):
        total = 0.0
        for family in mirrored(half(height)):
            row = family.outputs("b x")[0][0]
            total = total + family.share * row @ jnp.linalg.solve(family.stiffness, row)
        return total

    def exact(height):
        whole = portal(height)
        row = whole.rows("b x")[0]
        return np.linalg.inv(whole.stiffness)[row, row]

    value, slope = jax.jit(jax.value_and_grad(compliance))(1.1)
    np.testing.assert_allclose(value, exact(1.1), rtol=1e-8)
    np.testing.assert_allclose(slope, (exact(1.1 + 1e-5) - exact(1.1 - 1e-5)) / 2e-5, rtol=1e-5)


@pytest.mark.long
def test_a_quarter_of_a_membrane_in_closed_form():
    """Three by three masses in a fixed frame, by four families of a quarter; the way back finds all images."""
    T, m = np.array([[2.0, -1.0], [-1.0, 1.0]]), np.diag([1.0, 0.5])  # half a string: its middle is halved
    names = {f"{i}{j}": (i - 1.0, j - 1.0, 0.0) for i in range(2) for j in range(2)}
    quarter = LinearSystem(
        mass=np.kron(m, m),
        stiffness=np.kron(T, m) + np.kron(m, T),
        coordinates=[(name, "z") for name in names],
        positions={name: np.array(place) for name, place in names.items()},
    )
    families = [
        reduce(reduce(quarter, Mirror("x", ["10", "11"], one)), Mirror("y", ("01",) if one else ("01", "11"), two))
        for one in (False, True)
        for two in (False, True)
    ]
    string = 2 - 2 * np.cos(np.arange(1, 4) * np.pi / 4)
    np.testing.assert_allclose(squared(families), np.sort(np.add.outer(string, string).ravel()), rtol=1e-12)
    three = 2 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    places = {f"{i}{j}": np.array([i - 1.0, j - 1.0, 0.0]) for i in range(3) for j in range(3)}
    whole = LinearSystem(
        mass=np.eye(9),
        stiffness=np.kron(three, np.eye(3)) + np.kron(np.eye(3), three),
        coordinates=[(name, "z") for name in places],
        positions=places,
    )
    assert families[0].axes.shape == (4, 3, 3)
    check_statics(families, quarter, whole)


# ----------------------------------------------------------------------------------------------------------- rings
def about_z(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def springs(places, pairs, k):
    """Stiffness (3 n, 3 n) of springs between nodes in space, by NumPy."""
    K = np.zeros((3 * len(places),) * 2)
    for a, b in pairs:
        n = places[a] - places[b]
        row = np.zeros(len(K))
        row[3 * a : 3 * a + 3], row[3 * b : 3 * b + 3] = n / np.linalg.norm(n), -n / np.linalg.norm(n)
        K += k * np.outer(row, row)
    return K


SECTOR = {"low": (1.0, 0.0, 0.0), "high": (0.9, 0.1, 0.5), "tip": (1.3, 0.7, 0.3), "hub": (0.0, 0.0, 0.2)}
OWN = [
    ("low", "high"),
    ("low", "tip"),
    ("high", "tip"),
    ("hub", "tip"),
    ("hub", "low"),
    ("tip", "low+"),
    ("tip", "high+"),
]
OWN += [("low", "low+"), ("high", "high+"), ("low", "high+")]
MASSES = {"low": 1.0, "high": 0.6, "tip": 0.4}


def sector_matrices(N, k):
    """Of one sector by NumPy; every node is also on a spring to the ground, the hub's mass is 1 in all."""
    turn = about_z(2 * np.pi / N)
    places = {n: np.array(p) for n, p in SECTOR.items()}
    places |= {"low+": turn @ places["low"], "high+": turn @ places["high"]}
    names = list(places)
    K = springs(list(places.values()), [(names.index(a), names.index(b)) for a, b in OWN], k)
    M = np.repeat([MASSES.get(n, 1.0 / N if n == "hub" else 0.0) for n in names], 3)
    K += 0.7 * np.diag(np.repeat([1.0 if n in MASSES else 1.0 / N if n == "hub" else 0.0 for n in names], 3))
    return places, K, np.diag(M)


def sector(N, k=1.0):
    """With stiffness k, which may be traced."""
    places, unit, M = sector_matrices(N, 1.0)
    ground = sector_matrices(N, 0.0)[1]
    labels = [(n, d) for n in places for d in "xyz"]
    return LinearSystem(
        mass=M,
        stiffness=k * jnp.asarray(unit - ground) + ground,
        coordinates=labels,
        positions=places,
        interface=["low", "high", "low+", "high+"],
    )


def ring(N, k=1.0):
    """The whole ring from its nodes, by NumPy."""
    places = {"hub": np.array(SECTOR["hub"])}
    for s in range(N):
        places |= {f"{n}{s}": about_z(2 * np.pi * s / N) @ np.array(SECTOR[n]) for n in MASSES}
    names = list(places)

    def number(n, s):
        return 0 if n == "hub" else names.index(f"{n[:-1]}{(s + 1) % N}" if n.endswith("+") else f"{n}{s}")

    K = springs(list(places.values()), [(number(a, s), number(b, s)) for s in range(N) for a, b in OWN], k)
    M = np.repeat([1.0] + [MASSES[n[:-1]] for n in names[1:]], 3)
    K += 0.7 * np.eye(len(K))
    labels = [(n, d) for n in names for d in "xyz"]
    return LinearSystem(mass=np.diag(M), stiffness=K, coordinates=labels, positions=places)


def harmonics(part, N):
    faces = {"low": "low+", "high": "high+"}
    return [reduce(part, Cyclic(N, h, faces, centre=["hub"])) for h in range(N // 2 + 1)]


@cache
def families_of(N):
    return jax.jit(lambda k: harmonics(sector(N, k), N))(1.0)


@pytest.mark.parametrize("N", [2, 4, 5])
def test_harmonics_of_a_ring_are_the_ring(N):
    """Odd and even numbers of sectors, a hub that all share; pairs of frequencies; what any forces do."""
    families, whole = families_of(N), ring(N)
    assert sum(f.num_rows for f in families) == whole.num_rows
    np.testing.assert_allclose(squared(families), squared([whole]), rtol=1e-8, atol=1e-10)
    if N == 5:
        pairs = squared(families[1:2])
        np.testing.assert_allclose(pairs[::2], pairs[1::2], rtol=1e-9)
        assert "tip x cos" in map(families[1].label, range(families[1].num_rows))
    check_statics(families, sector(N), whole)


def test_gradient_of_a_ring_by_its_stiffness():
    """One tip pushed radially: compliance by all harmonics, against differences of the whole."""

    def compliance(k):
        rows = [(f, f.outputs("tip x")[0][0]) for f in harmonics(sector(5, k), 5)]
        return sum(f.share * row @ jnp.linalg.solve(f.stiffness, row) for f, row in rows)

    def exact(k):
        whole = ring(5, k)
        row = whole.rows("tip0 x")[0]
        return np.linalg.inv(whole.stiffness)[row, row]

    value, slope = jax.jit(jax.value_and_grad(compliance))(1.2)
    np.testing.assert_allclose(value, exact(1.2), rtol=1e-8)
    np.testing.assert_allclose(slope, (exact(1.2 + 1e-5) - exact(1.2 - 1e-5)) / 2e-5, rtol=1e-6)


def test_a_ring_of_masses_in_closed_form():
    """`w^2 = (g + 2 k (1 - cos(2 pi h / N))) / m`, once or twice; a wave moves sectors by its phase."""
    k, g, m, N = 3.0, 0.4, 2.0, 6
    part = LinearSystem(
        mass=np.diag([m, 0.0]), stiffness=np.array([[k + g, -k], [-k, k]]), coordinates=["left", "right"]
    )
    for h in range(N // 2 + 1):
        family = reduce(part, Cyclic(N, h, {"left": "right"}))
        found = modes(family)
        np.testing.assert_allclose(found.values, (g + 2 * k * (1 - np.cos(2 * np.pi * h / N))) / m, rtol=1e-12)
        assert len(found.values) == (1 if h in (0, 3) else 2)
    motion = reduce(part, Cyclic(N, 1, {"left": "right"})).part_displacements(jnp.array([1.0, 0.0]))
    np.testing.assert_allclose(motion[:, 0], np.cos(2 * np.pi * np.arange(N) / N), atol=1e-12)
    np.testing.assert_allclose(motion[:, 1], np.roll(motion[:, 0], -1), atol=1e-12)


@pytest.mark.long
def test_a_reduced_sector_has_its_way_back():
    """Fixed-interface modes of a sector first, all of them kept: the ring's frequencies; inner motions come back."""
    N, part = 4, sector(4)
    inner = part.with_interface("low", "high", "low+", "high+", "hub")
    small = reduce(inner, CraigBampton(3))
    families = harmonics(small, N)
    np.testing.assert_allclose(squared(families), squared([ring(N)]), rtol=1e-8, atol=1e-10)
    exact = families_of(N)
    for family, straight in zip(families, exact, strict=True):
        load = np.zeros((N, part.num_rows))
        load[1, part.rows("tip")] = [0.3, -1.0, 2.0]
        moved = [
            f.part_displacements(jnp.linalg.solve(f.stiffness, f.gather_forces(load))) for f in (family, straight)
        ]
        np.testing.assert_allclose(*moved, rtol=1e-7, atol=1e-9)


@pytest.mark.slow
def test_a_turned_sector_is_one_made_in_its_new_place():
    """Matrices and places by NumPy; of a reduced one the interface turns, and the way back leads to the old axes."""
    Q, part = scipy.spatial.transform.Rotation.from_rotvec([0.3, -0.5, 0.9]).as_matrix(), sector(5)
    whole, E = rotate(part, Q), np.kron(np.eye(6), Q)
    np.testing.assert_allclose(whole.stiffness, E @ np.asarray(part.stiffness) @ E.T, atol=1e-12)
    np.testing.assert_allclose(whole.positions, np.asarray(part.positions) @ Q.T, atol=1e-12)
    small = reduce(part.with_interface("low", "high", "low+", "high+", "hub"), CraigBampton(2))
    rho = np.random.default_rng(0).normal(size=17)
    there = np.r_[E[:15, :15] @ rho[:15], rho[15:]]
    again = rotate(small, Q)
    np.testing.assert_allclose(again.expand(there), small.expand(rho), atol=1e-12)
    np.testing.assert_allclose(there @ again.stiffness @ there, rho @ np.asarray(small.stiffness) @ rho, rtol=1e-9)


# ---------------------------------------------------------------------------------------------------------- faults
@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: reduce(half(), Mirror("w")), "unknown normal 'w': give one of x, y, z"),
        (lambda: reduce(half(), Mirror("x")), "nodes b, p do not lie in one plane normal to x"),
        (lambda: reduce(half().with_interface(), Mirror("x")), "no node is on the plane"),
        (lambda: reduce(half(), Mirror("x", ["q"])), "there is no coordinate or node 'q'"),
        (lambda: reduce(half(), Cyclic(3, 2, {"b": "p"})), r"harmonics 0 \.\.\. 1"),
        (lambda: reduce(sector(5), Cyclic(5, 1, {})), "give pairs of nodes"),
        (lambda: reduce(sector(5), Cyclic(5, 1, {"low": "low+"}, axis="r")), "unknown axis 'r'"),
        (
            lambda: reduce(sector(5), Cyclic(5, 1, {"low": "high+"})),
            "'low' rotated by 1/5 turn about z does not meet 'high\\+'",
        ),
        (lambda: reduce(sector(5), Cyclic(5, 1, {"low": "low+ x"})), "have different coordinates"),
        (lambda: rotate(half(), np.eye(3) * 2), "orthogonal"),
        (
            lambda: rotate(LinearSystem(mass=np.eye(1), stiffness=np.eye(1), coordinates=["a x"]), about_z(0.3)),
            "a x",
        ),
    ],
)
def test_faults_are_told(wrong, said):
    with pytest.raises((ModelError, ValueError), match=said):
        wrong()
