"""Constraint rows on coordinates and velocities: driven joints, couplers, the user's functions.

Rows between frames are `ClosureGroup`s.  A new kind of row says its residual, or its slip if it restricts velocities
alone, and whether it may depend on time; rates and efforts follow from those by differentiation.
"""

from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np


class CoordinateRows(eqx.Module):
    """Rows of one item; `columns` are the velocity columns it reads, `coordinates` theirs (all of them: empty)."""

    name: str = eqx.field(static=True)
    columns: tuple[int, ...] = eqx.field(static=True)
    coordinates: tuple[int, ...] = eqx.field(static=True)
    law: Any

    restricts_velocity_alone: ClassVar[bool] = False
    may_depend_on_time: ClassVar[bool] = True

    def depends_on_time(self, psi, u, t) -> bool:
        """Whether the rows read the time, by their traced code."""
        traced = jax.make_jaxpr(lambda t: (self.residual(psi, t), self.slip(psi, u, t)))(t).jaxpr
        return any(traced.invars[0] is x for equation in traced.eqns for x in equation.invars)

    def residual(self, psi, t):
        """(k,) zero where the coordinates psi (nq,) keep the rows."""
        return jnp.zeros(0, psi.dtype)

    def slip(self, psi, u, t):
        """(k,) zero where the velocities u (nv,) keep rows of velocity alone."""
        return jnp.zeros(0, psi.dtype)


class Drive(CoordinateRows):
    """A joint's coordinate follows a signal of time."""

    def residual(self, psi, t):
        return psi[np.asarray(self.coordinates)] - jnp.reshape(self.law(t), (1,))


class CoupledJoints(CoordinateRows):
    """A `Coupler` between the coordinates of joints."""

    may_depend_on_time: ClassVar[bool] = False

    def residual(self, psi, t):
        return self.law.rows(psi[np.asarray(self.coordinates)])


class UserRows(CoordinateRows):
    """The user's function of all coordinates and time."""

    def residual(self, psi, t):
        return jnp.atleast_1d(self.law.function(psi, t))


class UserVelocityRows(CoordinateRows):
    """The user's function of coordinates, velocities and time, linear in the velocities."""

    restricts_velocity_alone: ClassVar[bool] = True

    def slip(self, psi, u, t):
        return self.law.rows(psi, u, t)


def joints_tied(topology, by_column):
    """The joints (joints,) bool that a row ties and those between them on the tree; none where it ties one alone.

    These carry what touches in a coupler: teeth, threads, cams.  Args: by_column (nv,) bool: velocities it looks at.
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
    """Names of `joints_tied` by a row that says its columns."""
    tied = joints_tied(topology, np.isin(np.arange(topology.num_velocities), row.columns))
    return tuple(joint.name for joint, each in zip(topology.joints, tied, strict=True) if each)
