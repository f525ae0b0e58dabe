"""Free coordinates of a deck, and the displacements of all nodes by them."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ...typing import AnyArray
from ._context import DeckContext
from ._coordinate_systems import CoordinateSystem
from ._ties import AbstractTie, Pair


class DeckCoordinates(eqx.Module):
    """Free coordinates, and the nodes that move otherwise than by free coordinates of their own in basic axes.

    Attributes:
        free: (node, direction), in the order of the rows.
        turned: by node, its displacement frame, where the deck holds or ties something there.
        others: nodes that are turned or that depend on others.
        ties: by name.
    """

    free: tuple[Pair, ...] = eqx.field(static=True)
    turned: tuple[tuple[int, int], ...] = eqx.field(static=True)
    others: tuple[int, ...] = eqx.field(static=True)
    ties: dict[str, AbstractTie]
    frames: dict[int, CoordinateSystem]

    @property
    def plain(self) -> bool:
        """True if every node moves by its own coordinates only."""
        return not self.others

    def motions(self, positions: AnyArray) -> Float[Array, "others 6 free"]:
        """Displacements and rotations of `others` in basic axes by the free coordinates."""
        columns, found = self.motions_by_columns(positions)
        return jnp.zeros((*found.shape[:2], len(self.free)), found.dtype).at[:, :, columns].set(found)

    def motions_by_columns(self, positions: AnyArray) -> tuple[np.ndarray, Float[Array, "others 6 columns"]]:
        """The columns of `motions` that are not zero: of a large deck few, of the nodes that ties refer to."""
        place = {node: k for k, node in enumerate(self.others)}
        tied = {pair for tie in self.ties.values() for pair in tie.pairs}
        numbered = [(k, pair) for k, pair in enumerate(self.free) if pair[0] in place or pair in tied]
        column = {pair: k for k, (_, pair) in enumerate(numbered)}
        own = [(place[pair[0]], pair[1], k) for pair, k in column.items() if pair[0] in place]
        found = np.zeros((len(self.others), 6, len(column)))
        if own:
            found[tuple(np.array(own).T)] = 1.0
        motions = jnp.asarray(found, positions.dtype)
        if self.ties:
            dependent, given = self.tied(positions, column)
            at = np.array([(place[node], d) for node, d in dependent])
            motions = motions.at[at[:, 0], at[:, 1]].set(given)
        axes = self.axes(positions, self.others)
        turned = jnp.einsum("nab,nkaq->nkbq", axes, motions.reshape(len(place), 2, 3, len(column)))
        return np.array([k for k, _ in numbered], int), turned.reshape(motions.shape)

    def tied(self, positions: AnyArray, column: dict[Pair, int]) -> tuple[list[Pair], Array]:
        """Directions that ties give, and how free coordinates give them, by their columns, in the nodes' own axes."""
        dependent = [pair for tie in self.ties.values() for pair in tie.dependent]
        R, own = self.equations(positions)
        touched = self._touched
        mine = [k for k, pair in enumerate(touched) if pair in column]
        given = -R[:, np.array(mine, int)]
        if not are_ties_uncoupled(self.ties):
            given = jnp.linalg.solve(R[:, own], given)
        whole = jnp.zeros((len(dependent), len(column)), R.dtype)
        return dependent, whole.at[:, np.array([column[touched[k]] for k in mine], int)].set(given)

    def follow(self, positions: AnyArray, held: Float[Array, "nodes 6"]) -> Float[Array, "nodes 6"]:
        """Displacements `held` of held directions, in basic axes, with those that ties make of them."""
        dependent = [pair for tie in self.ties.values() for pair in tie.dependent]
        if not dependent:
            return held
        R, own = self.equations(positions)
        touched = self._touched
        nodes, directions = np.array(touched).T
        axes = self.axes(positions, tuple(nodes.tolist()))[np.arange(len(nodes)), directions % 3]
        along = jnp.where((directions > 2)[:, None], held[nodes, 3:], held[nodes, :3])
        values = jnp.sum(axes * along, axis=1).at[own].set(0.0)
        given = -R @ values
        if not are_ties_uncoupled(self.ties):
            given = jnp.linalg.solve(R[:, own], given)
        turns = (directions[own] > 2)[:, None]
        rows = given[:, None] * axes[own]
        rows = jnp.concatenate([jnp.where(turns, 0.0, rows), jnp.where(turns, rows, 0.0)], axis=1)
        return held.at[nodes[own]].add(rows)

    @property
    def _touched(self):
        return list(dict.fromkeys(pair for tie in self.ties.values() for pair in tie.pairs))

    def equations(self, positions: AnyArray) -> tuple[Array, np.ndarray]:
        """Coefficients (dependent, touched) of all ties, and the columns of the dependent directions."""
        place = {pair: k for k, pair in enumerate(self._touched)}
        dependent = [pair for tie in self.ties.values() for pair in tie.dependent]
        R, row = jnp.zeros((len(dependent), len(place)), positions.dtype), 0
        for tie in self.ties.values():
            rows = np.arange(row, row + len(tie.dependent))
            columns = np.array([place[pair] for pair in tie.pairs])
            R = R.at[rows[:, None], columns[None]].add(tie.equations(positions, lambda n: self.axes(positions, n)))
            row += len(rows)
        return R, np.array([place[pair] for pair in dependent], int)

    def axes(self, positions: AnyArray, nodes: tuple[int, ...]) -> Float[Array, "nodes 3 3"]:
        """Rows: the axes of the nodes' displacements."""
        turned = dict(self.turned)
        found = jnp.asarray(np.broadcast_to(np.eye(3), (len(nodes), 3, 3)), positions.dtype)
        for one in sorted({turned[node] for node in nodes if node in turned}):
            at = np.array([k for k, node in enumerate(nodes) if turned.get(node) == one])
            here = positions[np.array(nodes)[at]]
            found = found.at[at].set(jax.vmap(self.frames[one].at)(here).astype(found.dtype))
        return found


def are_ties_uncoupled(ties: dict[str, AbstractTie]) -> bool:
    """True if no tie depends on a direction that another tie gives."""
    dependent = {pair for tie in ties.values() for pair in tie.dependent}
    free = all(not dependent & (set(tie.pairs) - set(tie.dependent)) for tie in ties.values())
    return free and all(tie.is_explicit for tie in ties.values())


def number_coordinates(
    deck: DeckContext, ties: dict[str, AbstractTie], held: set[Pair], sizes: np.ndarray, weak: set[Pair]
) -> DeckCoordinates:
    """Number the free coordinates from supports, coordinates of elements (0, 3 or 6 a node) and AUTOSPC."""
    present = {(n, d) for n, size in enumerate(sizes.tolist()) for d in range(size)}
    present |= {pair for tie in ties.values() for pair in tie.implied_directions}
    dependent = {pair for tie in ties.values() for pair in tie.dependent}
    touched = held | weak | {pair for tie in ties.values() for pair in tie.pairs}
    turned = {n: deck.turned[n] for n in sorted({n for n, _ in touched}) if deck.turned[n]}
    free = sorted(present - held - weak - dependent)
    others = sorted({*turned, *(n for n, _ in dependent), *(n for n, d in free if d >= sizes[n])})
    frames = {one: deck.frames[one] for one in sorted(set(turned.values()))}
    return DeckCoordinates(tuple(free), tuple(turned.items()), tuple(others), ties, frames)
