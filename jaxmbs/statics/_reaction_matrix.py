"""The matrix of the reactions as the paper writes it, for views, teaching and tests; the solvers never form it."""

from typing import NamedTuple

import numpy as np

from ..quantities import matrix
from ..reports import Report, reported
from ._bonds import Bonds


@reported
class ReactionMatrix(NamedTuple):
    """The factors of `Qbar = I_E R G T`, numpy, rows and columns force before moment.

    `incidence` I_E (6p, 6q), `arms` R (6q, 6q) moments from the bonds' origins to the world's, `frames` G (6q, 6q),
    `directions` T (6q, n) the components that bonds carry, in their axes.  `bond` (n,): the bond of each component.
    """

    incidence: np.ndarray
    arms: np.ndarray
    frames: np.ndarray
    directions: np.ndarray
    bond: np.ndarray

    def report(self) -> Report:
        factors = {"Qbar": self.matrix, "incidence": self.incidence, "arms": self.arms, "directions": self.directions}
        return Report([matrix(name, x, "m" if name == "arms" else "") for name, x in factors.items()])

    @property
    def matrix(self) -> np.ndarray:
        """Qbar (6p, n).  Source: S1 (26)-(27)."""
        return self.incidence @ self.arms @ self.frames @ self.directions


def reaction_directions(bonds: Bonds) -> list[np.ndarray]:
    """For every bond the wrenches (6, n_e) (force, moment) in its axes that do no work on its free twists.

    Units where they are axes, else orthonormal with moments divided by the characteristic length.
    """
    scale = np.r_[np.ones(3), np.full(3, float(bonds.length))]
    sizes = np.sqrt(np.asarray(bonds.free_sizes(), float))
    out = []
    for free, size in zip(np.asarray(bonds.free, float), sizes, strict=True):
        twists = scale[:, None] * free[:, size > 0] / size[None, size > 0]
        U, s, _ = np.linalg.svd(twists, full_matrices=True)
        carried = U[:, int(np.sum(s > 1e-9)) :]
        on_axes = np.isclose(np.sum(carried**2, axis=1), 1.0)
        if on_axes.sum() == carried.shape[1]:
            out.append(np.eye(6)[:, on_axes])
        else:
            out.append(scale[:, None] * carried)
    return out


def _block_diagonal(blocks):
    out = np.zeros([sum(b.shape[k] for b in blocks) for k in (0, 1)])
    row = column = 0
    for block in blocks:
        out[row : row + block.shape[0], column : column + block.shape[1]] = block
        row, column = row + block.shape[0], column + block.shape[1]
    return out


def reaction_matrix(bonds: Bonds) -> ReactionMatrix:
    """Qbar of `Qbar g = qz` with its factors, from concrete bonds; loads are about the world origin.

    Source: S1 (26)-(27), all moments about one common origin.
    """
    parent, child = bonds.network.ends
    incidence = np.zeros((len(bonds.network.bodies) + 1, len(parent)))
    columns = np.arange(len(parent))
    incidence[child, columns] += 1.0
    incidence[parent, columns] -= 1.0
    arms, frames = [], []
    for x, G in zip(np.asarray(bonds.position), np.asarray(bonds.frame), strict=True):
        cross = np.cross(x, np.eye(3)).T
        arms.append(np.block([[np.eye(3), np.zeros((3, 3))], [cross, np.eye(3)]]))
        frames.append(_block_diagonal([G, G]))
    directions = reaction_directions(bonds)
    bond = np.repeat(columns, [d.shape[1] for d in directions])
    whole = np.kron(incidence[:-1], np.eye(6))
    return ReactionMatrix(whole, _block_diagonal(arms), _block_diagonal(frames), _block_diagonal(directions), bond)
