"""Networks to test with, and their reactions by dense linear algebra on the matrix of S1 (26)-(27)."""

import equinox as eqx
import numpy as np
from scipy.spatial.transform import Rotation

from jaxmbs.statics import Bonds, bond_reactions, reaction_matrix

solve = eqx.filter_jit(bond_reactions)
PIN = (1, 1, 1, 1, 1, 0)
BALL = (1, 1, 1, 0, 0, 0)


def applied(bodies, forces):
    """Loads (p, 6) that bonds must supply at rest against forces: body -> list of (force, point)."""
    loads = np.zeros((len(bodies), 6))
    for name, pairs in forces.items():
        for force, point in pairs:
            loads[bodies.index(name)] -= np.r_[force, np.cross(point, force)]
    return loads


def four_bar(lengths=(2.0, 1.0, 2.2, 1.6), driven=False):
    """Planar four-bar in space, hinges about z; `lengths` of ground, crank, coupler, rocker [m], crank at 70 degrees.

    Driven: the crank's hinge also carries the moment about z.
    """
    import jax.numpy as jnp

    g, a, b, c = (jnp.asarray(length, float) for length in lengths)
    angle = np.radians(70.0)
    A, D = jnp.zeros(3), jnp.stack([g, 0 * g, 0 * g])
    B = jnp.stack([a * np.cos(angle), a * np.sin(angle), 0 * a])
    span = D - B
    d = jnp.sqrt(span @ span)
    along = (d * d + b * b - c * c) / (2 * d)
    across = jnp.stack([-span[1], span[0], 0 * d])
    C = B + along * span / d + jnp.sqrt(b * b - along * along) * across / d
    names = {
        "A": ("ground", "crank"),
        "B": ("crank", "coupler"),
        "C": ("coupler", "rocker"),
        "D": ("ground", "rocker"),
    }
    carries = [(1, 1, 1, 1, 1, 1) if driven else PIN, PIN, PIN, PIN]
    return Bonds.from_arrays(
        ["crank", "coupler", "rocker"], names, jnp.stack([A, B, C, D]), carries=carries, length=1.0
    )


GRAPHS = {  # pairs (parent, child), ground -1
    "tree": [(-1, 0), (1, 0), (1, 2), (0, 3), (4, 3), (4, 5), (3, 6), (6, 7), (7, 8)],
    "loops": [(-1, 0), (0, 1), (2, 1), (2, -1), (1, 3), (3, 4), (0, 4), (4, 5), (5, 6), (6, 5), (3, -1)],
    "one loop and a tail": [(-1, 0), (0, 1), (1, 2), (2, -1), (1, 3), (3, 4)],
    "loop on a stalk": [(-1, 0), (0, 1), (1, 2), (2, 3), (3, 1), (2, 4)],
    "floating": [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (3, 4), (4, 5)],
    "parallel": [(-1, 0), (0, -1), (0, 1), (1, 0), (-1, 0)],
}


def beside_each_other():
    """All graphs as one network in many parts."""
    pairs, first = [], 0
    for graph in GRAPHS.values():
        pairs += [tuple(k if k < 0 else k + first for k in pair) for pair in graph]
        first = 1 + max(max(pair) for pair in pairs)
    return pairs


GRAPHS["all of them"] = beside_each_other()


def random_bonds(graph, seed=0, most_free=3, dtype=float):
    """Bonds of a graph at random places with random frames, carried components, compliances and efforts."""
    random, pairs = np.random.default_rng(seed), GRAPHS[graph]
    q, p = len(pairs), 1 + max(max(pair) for pair in pairs)
    bodies = [f"b{k}" for k in range(p)]
    name = lambda k: "ground" if k < 0 else bodies[k]
    bonds = {f"bond {e}": (name(a), name(b)) for e, (a, b) in enumerate(pairs)}
    carries = np.ones((q, 6), bool)
    for row in carries:
        row[random.permutation(6)[: random.integers(0, most_free + 1)]] = False
    return Bonds.from_arrays(
        bodies,
        bonds,
        random.normal(size=(q, 3)).astype(dtype),
        frame=Rotation.random(q, random_state=seed).as_matrix(),
        carries=carries,
        compliance=random.uniform(0.5, 2.0, size=(q, 6)),
        effort=np.where(carries, 0.0, random.normal(size=(q, 6))),
        length=1.5,
    )


def random_loads(bonds, seed=1):
    """Loads (p, 6) that the bonds can supply: those of random reactions and of the efforts."""
    Q = reaction_matrix(bonds)
    g = np.random.default_rng(seed).normal(size=Q.matrix.shape[1])
    return (Q.matrix @ g + Q.incidence @ Q.arms @ Q.frames @ effort_wrenches(bonds)).reshape(-1, 6)


def effort_wrenches(bonds):
    """Wrenches (6 q,) in the bonds' axes that give the efforts; free twists are single axes here."""
    return np.einsum("qic,qc->qi", np.asarray(bonds.free), np.asarray(bonds.effort)).reshape(-1)


def dense_reactions(bonds, loads):
    """Components (q, 6) of least compliance among those that satisfy `Qbar g = qz`, by null space in numpy."""
    Q = reaction_matrix(bonds)
    q, T, own = len(bonds.network.bonds), Q.directions, effort_wrenches(bonds)
    C = np.zeros((6 * q, 6 * q))
    for e, block in enumerate(np.asarray(bonds.compliance)):
        C[6 * e : 6 * e + 6, 6 * e : 6 * e + 6] = block
    right = np.asarray(loads).reshape(-1) - Q.incidence @ Q.arms @ Q.frames @ own
    g = np.linalg.lstsq(Q.matrix, right, rcond=1e-10)[0]
    _, s, Vt = np.linalg.svd(Q.matrix)
    N = Vt[np.sum(s > 1e-10 * s[0]) :].T
    g = g - N @ np.linalg.solve(N.T @ T.T @ C @ T @ N, N.T @ T.T @ C @ (T @ g + own))
    return (T @ g + own).reshape(q, 6)


def ladder(rungs, frame=None):
    """Two rails of links pinned about z to rungs that are welded; one loop a rung."""
    bodies = [f"{side}{k}" for k in range(rungs) for side in "LR"]
    bonds, position, carries = {}, [], []
    for k in range(rungs):
        for side, y in (("L", 0.5), ("R", -0.5)):
            bonds[f"rail {side}{k}"] = (f"{side}{k - 1}" if k else "ground", f"{side}{k}")
            position.append((k, y, 0.1 * np.sin(k)))
            carries.append(PIN)
        bonds[f"rung {k}"] = (f"L{k}", f"R{k}")
        position.append((k + 0.5, 0.0, 0.0))
        carries.append((1,) * 6)
    return Bonds.from_arrays(bodies, bonds, np.array(position), frame, np.array(carries), length=1.0)
