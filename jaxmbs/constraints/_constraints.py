"""Constraint rows: residual f(psi, t) of loops, drives, couplers; Jacobian A with `A u = -f_t`, and their rates.

Row order: cut joints and two-frame constraints group by group, then drives, couplers and user rows.  Rows of velocity
alone (rolling, blades; nonholonomic) stand among them in A but not in f: `topology.position_rows` picks the others;
f_t is the value of a velocity row at rest.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ..kinematics._configuration import Configuration, VelocityKinematics
from ..kinematics._poses import coordinate_rate, frame_twists
from ..kinematics._wrench_targets import node_targets
from ..math._linalg import RowScale, skew
from ..model._rows import row_elements
from ..model._system import System
from ..runtime import gather_static
from . import _closures as closures
from . import _rows as rows


def residual(system: System, at: Configuration):
    """f(psi, t), shape (rows,): lengths [m], tangents of half angles, coordinates.  Source: S2 (1)-(2)."""
    return rows_together(system, at, closures.residual(system, at))


def residual_and_jacobian(system: System, at: Configuration):
    """`residual` (position rows,) and `jacobian` (rows, nv), with one evaluation of all rows."""
    if at.directions is None:
        parts, at = closures.residual_and_directions(system, at)
    else:
        parts = closures.residual(system, at)
    return rows_together(system, at, parts), jacobian(system, at)


def rows_together(system, at, parts):
    """Rows of the loops, then those of coordinates, as one vector."""
    if system.rows:
        parts = [*parts, rows.residual(system, at)]
    return jnp.concatenate(parts) if parts else jnp.zeros(0, at.psi.dtype)


def jacobian(system: System, at: Configuration):
    """Rows A (rows, nv) of the velocity constraints, `A u = -f_t`; A = f_psi T.  Source: S2 (3), (5)."""
    return jnp.concatenate([*closures.jacobian(system, at), rows.matrix(system, at)])


def row_scale(system: System) -> RowScale:
    """Scale of the rows: lengths in units of the characteristic length, others unchanged; rows by element."""
    unit = jnp.where(rows_are_lengths(system), 1.0 / system.length, 1.0)
    return RowScale(
        lax.stop_gradient(unit), np.unique(np.array(system.topology.row_joint, str), return_inverse=True)[1]
    )


def rows_are_lengths(system: System) -> np.ndarray:
    """Boolean mask (rows,) of the rows that are lengths [m]; others are angles, or in the unit of the user's row."""
    top = system.topology
    units = [unit for group in system.closures for _ in group.names for unit in group.kind.row_units]
    for row in row_elements(system.rows):
        sliding = row.group.law.is_length(tuple(top.node_kind[column] for column in row.columns))
        units += ["m" if sliding else "rad"] * len(row.places)
    return np.array([unit == "m" for unit in units], bool)


def time_rate(system: System, at: Configuration):
    """f_t (rows,): the rates of the rows at rest, nonzero for drives, paths and moving supports."""
    if not system.rows and not system.paths:
        return jnp.zeros(system.topology.num_rows, at.psi.dtype)
    rates = rows.time_rates(system, at.R, at.x, at.psi, at.t)
    still = jnp.zeros(system.topology.num_rows - rates.shape[0], rates.dtype)
    return jnp.concatenate([closures.time_rates(system, at) if system.paths else still, rates])


def _frame_rates(system, at):
    """Twists (frames, 6) of the nodes that carry the frames, and the rates of R and x that they give."""
    carried = frame_twists(system, at.V)
    spin = jax.vmap(skew)(carried[:, :3])
    return carried, jnp.einsum("fij,fjk->fik", spin, at.R), carried[:, 3:] + jnp.einsum("fij,fj->fi", spin, at.x)


def acceleration_bias(system: System, at: VelocityKinematics, V_dot):
    """gamma (rows,) with `A u_dot = gamma`: `-(A_dot u + d f_t/dt)` along the motion.

    Args: V_dot (nodes, 6): rates of the nodes' twists at zero accelerations.
    """
    twist, R_dot, x_dot = _frame_rates(system, at)
    twist_dot, psi_dot = frame_twists(system, V_dot), coordinate_rate(system.topology, at.psi, at.u)
    at = closures.with_rates(system, at)
    parts, (of_closures, of_rows) = [], closures.direction_rates(at, R_dot, x_dot, psi_dot)
    for group, D, D_dot in zip(system.closures, closures.directions(system, at), of_closures, strict=True):
        relative, relative_dot = (
            gather_static(v, group.second) - gather_static(v, group.first) for v in (twist, twist_dot)
        )
        rate = jnp.einsum("erk,ek->er", D_dot, relative) + jnp.einsum("erk,ek->er", D, relative_dot)
        parts.append(rate.reshape(-1))
    if system.paths:
        parts = [jnp.concatenate(parts) + closures.time_rates(system, at, (R_dot, x_dot))]
    if system.rows:
        rate = rows.rates(system, of_rows, twist, at.u)
        if rows.has_frames(system):
            rate = rate + rows.rates(system, rows.slopes(system, at), twist_dot, jnp.zeros_like(at.u))
        if rows.depend_on_time(system):
            moving = (R_dot, x_dot, psi_dot, jnp.ones_like(at.t))
            of_time = lambda *pose: rows.time_rates(system, *pose)
            rate = rate + jax.jvp(of_time, (at.R, at.x, at.psi, at.t), moving)[1]
        parts.append(rate)
    return -jnp.concatenate([jnp.zeros(0, at.psi.dtype), *parts])


def constraint_momentum_rate(system: System, at: VelocityKinematics, sigma):
    """Rate `A_dot^T sigma` of the constraint momentum with multipliers sigma (rows,), in three parts.

    Args: at: `closures.with_directions`.

    Returns: node wrenches D^T sigma (nodes, 6), their rates along the motion, and the part (nv,) inside of joints:
    `A_dot^T sigma = S_dot . subtrees(wrenches) + S . subtrees(rates) + part`.
    """
    wrenches = rates = jnp.zeros((system.topology.nodes.size, 6), at.psi.dtype)
    _, R_dot, x_dot = _frame_rates(system, at)
    psi_dot, owners = coordinate_rate(system.topology, at.psi, at.u), node_targets(system)
    of_closures, of_rows = closures.direction_rates(at, R_dot, x_dot, psi_dot)
    if system.closures:

        def on_nodes(directions):
            return closures.accumulate_wrenches(owners, system, closures.wrenches(system, directions, sigma))

        wrenches, rates = on_nodes(closures.directions(system, at)), on_nodes(of_closures)
    if rows.has_frames(system):
        wrenches = wrenches + owners.collect(*rows.wrenches(system, rows.slopes(system, at), sigma))
        rates = rates + owners.collect(*rows.wrenches(system, of_rows, sigma))
    return wrenches, rates, rows.column_efforts(system, of_rows, sigma)
