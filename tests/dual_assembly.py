"""Reactions by the dual assembly, with the forces of bonds as unknowns: an oracle for the primal one."""

import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import block_diag

from jaxmbs.coupling._primal_assembly import join
from jaxmbs.vibration._direct_response import dynamic_stiffness


def dual_reactions(components, joints, forces, omega=None):
    """Forces of the bonds (b_c,) on each component from `[Z B^T; B 0] (rho, lambda) = (Q, 0)`.

    Args:
        joints: as in `join`.
        forces: (n_c,) on each component's own coordinates, None for none.
        omega: [rad/s], None for statics.
    """
    assembly = join(components, joints)
    parts, sizes = assembly.components, [len(p) for p in assembly.places]
    starts = np.cumsum([0, *sizes])
    Z = block_diag(
        *(c.stiffness if omega is None else dynamic_stiffness(c.stiffness, c.damping, c.mass, omega) for c in parts)
    )
    B = jnp.asarray(compatibility(np.concatenate([np.array(p) for p in assembly.places])), Z.dtype)
    pairs = zip(parts, sizes, forces, strict=True)
    right = jnp.concatenate(
        [jnp.zeros(n, Z.dtype) if f is None else (c.basis.T @ f).astype(Z.dtype) for c, n, f in pairs]
    )
    saddle = jnp.block([[Z, B.T], [B, jnp.zeros((len(B), len(B)), Z.dtype)]])
    multipliers = jnp.linalg.solve(saddle, jnp.concatenate([right, jnp.zeros(len(B), Z.dtype)]))[starts[-1] :]
    reactions = -B.T @ multipliers
    return [reactions[start : start + c.num_interface] for start, c in zip(starts[:-1], parts, strict=True)]


def compatibility(places):
    """Rows B with `B rho = 0`: members of a joint move with the first one, those of the ground not at all."""
    rows = []
    for joint in np.unique(places):
        members = np.flatnonzero(places == joint)
        unit = np.eye(len(places))[members]
        rows.append(unit if joint < 0 else unit[1:] - unit[0])
    return np.concatenate(rows)
