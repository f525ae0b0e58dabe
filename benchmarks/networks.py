"""Networks of rigid bodies for `reactions.py`, and the sparse nodal matrix that the peers factor."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse as sp

from jaxmbs.statics import Bonds, bond_reactions

CARRIES_HINGE = np.array([True, True, True, True, True, False])  # all but the moment about z


def chain(p):
    return [(i - 1, i) for i in range(p)], []


def tree(p):
    return [(-1 if i == 0 else (i - 1) // 2, i) for i in range(p)], []


def loops(p):
    """A chain in which every tenth body is hinged to the ninth after it: p / 10 loops."""
    tree_bonds, _ = chain(p)
    return tree_bonds, [(i, i + 9) for i in range(0, p - 9, 10)]


def ladder(p):
    """Two rails of p / 2 bodies, hinged rungs: p / 2 loops less one."""
    h = p // 2
    rails = [(-1 if i == 0 else start + i - 1, start + i) for start in (0, h) for i in range(h)]
    return rails, [(i, h + i) for i in range(1, h)]


SHAPES = {"chain": chain, "tree": tree, "loops": loops, "ladder": ladder}


class Case:
    """Bodies at random places; tree bonds are welds, the bonds that close loops are hinges; random loads."""

    def __init__(self, shape, p, seed=0):
        rng = np.random.default_rng(seed)
        welds, hinges = SHAPES[shape](p)
        self.shape, self.p, self.hinges = shape, p, len(hinges)
        name = lambda k: "ground" if k < 0 else f"b{k}"
        bonds = {f"e{k}": (name(a), name(b)) for k, (a, b) in enumerate(welds + hinges)}
        carries = np.ones((len(bonds), 6), bool)
        carries[len(welds) :] = CARRIES_HINGE
        frame = np.linalg.qr(rng.normal(size=(len(bonds), 3, 3)))[0]
        frame *= np.sign(np.linalg.det(frame))[:, None, None]
        # Bodies a few metres apart, near each other when bonded.
        place = np.zeros((p + 1, 3))
        for a, b in welds:
            place[b] = place[a] + rng.normal(size=3) * 0.5
        ends = np.array(welds + hinges)
        position = 0.5 * (place[ends[:, 0]] + place[ends[:, 1]])
        self.bonds = Bonds.from_arrays([f"b{k}" for k in range(p)], bonds, position, frame, carries, length=1.0)
        force, moment = rng.normal(size=(2, p, 3))
        self.loads = jnp.asarray(np.concatenate([force, moment + np.cross(place[:p], force)], axis=1))
        self.carries = carries

    def value(self, position, loads):
        """Components (q, 6) of all bonds in their own frames: assembly, factorisation and substitution."""
        return bond_reactions(_moved(self.bonds, position), loads).components

    def wrenches(self, position, loads):
        """World wrenches (q, 6) about the origin."""
        return bond_reactions(_moved(self.bonds, position), loads).wrench

    def scalar(self, position, loads):
        return jnp.sum(self.value(position, loads) ** 2)

    def value_and_gradient(self, position, loads):
        """A scalar of all reactions, and its gradient by every joint position."""
        return jax.value_and_grad(self.scalar)(position, loads)

    def value_and_tangent(self, position, loads):
        """All reactions and their change for one direction of all joint positions."""
        return jax.jvp(lambda x: self.value(x, loads), (position,), (jnp.cos(position),))

    def nodal(self, position=None):
        """The sparse matrix `Q C^-1 Q^T` (6 p, 6 p) that the peers factor; symmetric positive definite here."""
        bonds = self.bonds if position is None else _moved(self.bonds, position)
        axes, stiffness = np.asarray(bonds.twist_axes), np.linalg.inv(np.asarray(bonds.compliance))
        carried = self.carries[:, :, None] & self.carries[:, None, :]
        inverse = np.linalg.inv(axes)  # local twist from world twist
        K = np.einsum("qji,qjk,qkl->qil", inverse, stiffness * carried, inverse)
        parent, child = self.bonds.network.ends
        blocks, rows, columns = [], [], []
        for a, b, sign in ((parent, parent, 1), (child, child, 1), (parent, child, -1), (child, parent, -1)):
            keep = (a < self.p) & (b < self.p)
            blocks.append(sign * K[keep])
            rows.append(6 * a[keep, None, None] + np.arange(6)[None, :, None] + np.zeros((1, 1, 6), int))
            columns.append(6 * b[keep, None, None] + np.arange(6)[None, None, :] + np.zeros((1, 6, 1), int))
        flat = [np.concatenate([x.ravel() for x in parts]) for parts in (blocks, rows, columns)]
        matrix = sp.coo_matrix((flat[0], (flat[1], flat[2])), shape=(6 * self.p, 6 * self.p)).tocsc()
        return matrix, K

    def wrenches_from(self, twists, K):
        """Bond wrenches of the nodal solution."""
        u = np.vstack([np.asarray(twists).reshape(self.p, 6), np.zeros(6)])
        parent, child = self.bonds.network.ends
        return np.einsum("qij,qj->qi", K, u[child] - u[parent])


def _moved(bonds, position):
    return eqx.tree_at(lambda b: b.position, bonds, position)
