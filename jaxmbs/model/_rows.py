"""Constraint rows on coordinates and velocities: driven joints, couplers, the user's functions.

Rows between frames are `ClosureGroup`s.  A new kind of row defines its residual, or its slip if it is nonholonomic,
and `may_depend_on_time`; rates and efforts follow by differentiation.
"""

from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np


class CoordinateRows(eqx.Module):
    """Rows of one item; `columns` are the velocities it depends on, `coordinates` theirs; empty stands for all.

    `is_nonholonomic`: True if the rows restrict velocities alone.
    """

    name: str = eqx.field(static=True)
    columns: tuple[int, ...] = eqx.field(static=True)
    coordinates: tuple[int, ...] = eqx.field(static=True)
    law: Any

    is_nonholonomic: ClassVar[bool] = False
    may_depend_on_time: ClassVar[bool] = True

    def depends_on_time(self, psi, u, t) -> bool:
        """True if the traced code of the rows reads the time."""
        traced = jax.make_jaxpr(lambda t: (self.residual(psi, t), self.slip(psi, u, t)))(t).jaxpr
        return any(traced.invars[0] is x for equation in traced.eqns for x in equation.invars)

    def residual(self, psi, t):
        """Residual (k,), zero where the coordinates psi (nq,) satisfy the rows."""
        return jnp.zeros(0, psi.dtype)

    def slip(self, psi, u, t):
        """Slip (k,), zero where the velocities u (nv,) satisfy nonholonomic rows."""
        return jnp.zeros(0, psi.dtype)


class Drive(CoordinateRows):
    """Row of a drive: a joint's coordinate is a function of time."""

    def residual(self, psi, t):
        return psi[np.asarray(self.coordinates)] - jnp.reshape(self.law(t), (1,))


class CoupledJoints(CoordinateRows):
    """Row of a `Coupler` between the coordinates of joints."""

    may_depend_on_time: ClassVar[bool] = False

    def residual(self, psi, t):
        return self.law.rows(psi[np.asarray(self.coordinates)])


class UserPositionRows(CoordinateRows):
    """Rows of the user's function of all coordinates and time."""

    def residual(self, psi, t):
        return jnp.atleast_1d(self.law.function(psi, t))


class UserVelocityRows(CoordinateRows):
    """Rows of the user's function of coordinates, velocities and time, affine in the velocities."""

    is_nonholonomic: ClassVar[bool] = True

    def slip(self, psi, u, t):
        return self.law.rows(psi, u, t)


class CableRow(CoordinateRows):
    """Row of an inextensible cable over frames: the length that is left of it (`kinematics._cable_rows`).

    Its multiplier is the tension, which pulls at the bodies of the frames.
    """

    frames: tuple[int, ...] = eqx.field(static=True)

    @property
    def may_depend_on_time(self) -> bool:  # type: ignore[override]
        """True where the length is a function of time."""
        return self.law.is_wound

    def depends_on_time(self, psi, u, t) -> bool:
        """True where the length is a function of time."""
        return self.law.is_wound


def coupled_joint_mask(topology, by_column):
    """Boolean mask (joints,) of the joints that a row couples and those between them; none for a single one.

    These carry the contact forces of a coupler: teeth, threads, cams.  Args: by_column (nv,): mask of its velocities.
    """
    joints = len(topology.joints)
    joint_of = np.arange(joints)[:, None] == np.array(topology.node_joint, int)[None]
    tied = (joint_of.astype(float) @ by_column.astype(float)) > 0
    of_body = np.eye(joints)[list(topology.body_joint)]  # the tree's joint of each body
    below = (
        of_body.T @ topology.bodies.path.T @ of_body
    )  # (joints, joints): how many bodies of the one hang on the other
    count, number = below @ tied.astype(float), tied.astype(float).sum()
    return (number > 1) & (count > 0) & ((count < number) | tied)


def coupled_names(topology, row: CoordinateRows) -> tuple[str, ...]:
    """Names of the joints of `coupled_joint_mask`, of a row that has `columns`."""
    tied = coupled_joint_mask(topology, np.isin(np.arange(topology.num_velocities), row.columns))
    return tuple(joint.name for joint, each in zip(topology.joints, tied, strict=True) if each)
