"""Forces of contacts, cables and other elements as arrows."""

import jax
import numpy as np

from ..dynamics._element_reports import element_arrows
from ..model._entry_points import states_of


def arrows_along(system, states) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """`dynamics.element_arrows` at all instants that were reached, (T, k, 3) each; of one state T is 1."""
    states = states_of(system, states)
    if states.coordinates.ndim == 1:
        states = jax.tree.map(lambda x: x[None], states)
    there = np.all(np.isfinite(np.asarray(states.coordinates)), axis=1)
    there = there if np.any(there) else np.ones_like(there)
    found = element_arrows(system, states)
    return {name: (np.asarray(place)[there], np.asarray(force)[there]) for name, (place, force) in found.items()}
