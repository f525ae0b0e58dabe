"""Forces of contacts and cables as arrows."""

import jax
import numpy as np

from ..dynamics import cable_states, contact_load
from ..dynamics._contact_load import contact_groups
from ..model._entry_points import states_of
from ._drawable import cables


def element_arrows(system, states) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Places (T, k, 3) [m] and forces (T, k, 3) [N] by the names of contacts and cables, in world axes.

    Of a contact they are on the round part at each of its points, of a cable on the body of each of its elements.
    """
    states = states_of(system, states)
    if states.coordinates.ndim == 1:
        states = jax.tree.map(lambda x: x[None], states)
    there = np.all(np.isfinite(np.asarray(states.coordinates)), axis=1)
    there = there if np.any(there) else np.ones_like(there)
    found = {}
    for group in contact_groups(system):
        for name in group.names:
            load = contact_load(system, states, name)
            found[name] = load.point, load.normal_force[..., None] * load.normal + load.friction
    named = cable_states(system, states) if cables(system) else {}
    for name, cable in named.items():
        found[name] = _middles(cable), cable.force
    return {name: (np.asarray(place)[there], np.asarray(force)[there]) for name, (place, force) in found.items()}


def _middles(cable):
    """Points (T, n, 3) of the elements of a cable: its ends, and the middles of the chords on its wheels."""
    start, end = (np.asarray(cable.points[..., side, :]) for side in (0, 1))
    if start.shape[-2] == cable.force.shape[-2]:  # a closed belt: the last span ends on the first element
        return (start + np.roll(end, 1, axis=-2)) / 2
    return np.concatenate([start[..., :1, :], (start[..., 1:, :] + end[..., :-1, :]) / 2, end[..., -1:, :]], axis=-2)
