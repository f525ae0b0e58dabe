"""Loads and friction of joints by name, with a verdict: are the loads unique, or does a joint jam?"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float

from ..assembly._state import State
from ..constraints import _closures as closures
from ..constraints._coupled_joints import coupled_joints, couplers_and_user_rows
from ..constraints._saddle_operator import constraint_operator
from ..errors import ModelError
from ..friction._normal_loads import contraction
from ..friction._surfaces import SURFACES, surface_rows
from ..kinematics._configuration import VelocityKinematics, at_state, with_velocities
from ..math._linalg import few_columns
from ..model._entry_points import state_function
from ..model._system import System
from ..quantities import Quantity, along_freedoms
from ..reports import Report, Reported, faults_in_short
from ..runtime import segment_sum_static
from ._joint_friction import FrictionSolution, carriers, joint_axes
from ._newton_euler import motion_with_friction, saddle_solver

#: Random vectors among which a component of a load is below the tolerance by chance with its third power.
_PROBES, _SEED, _TOLERANCE = 3, 5, {8: 1e-6, 4: 1e-3}
#: Least part of a random vector that a self-stress keeps; a smaller one is rounding.
_ROUNDING = 1e-3
#: Part of a joint in the loads that grow without bound, above which it jams.
_SHARE = 1e-3


class FrictionLoads(Reported, eqx.Module):
    """Loads of rubbing joints and their friction, each by the name of the joint.

    Attributes:
        loads: (...) [N] with the preload, summed over the places where the joint bears; (..., 2) of the two axes of a
            universal joint.  NaN where the mechanism jams.
        efforts: (..., n) [N or N m] of the friction along the joint's freedoms, on the child; of a planar joint along
            the axes of its parent.
        powers: (...) [W], never positive but where bristles spring back.
        contraction: (...) spectral radius of the derivative of the loads by the loads: from 1 on they have no unique
            solution.  Of a jam that at the solution that goes on from the last one, with negative or complex loads;
            NaN where none is found.
        jammed: (...) true for the joints whose loads have none, as those of a drawer pulled at its corner.
        shared: (...) true where redundant constraints leave the load open at this pose: they share it by least
            compliance, as `reactions` do.
        unique: (...) true where the load is the only one: the mechanism does not jam, statics alone determines the
            load, and no contact of a coupler is left out.
        t: (...) time [s].
    """

    loads: dict[str, Float[Array, "..."]]
    efforts: dict[str, Float[Array, "... n"]]
    powers: dict[str, Float[Array, "..."]]
    contraction: Float[Array, "..."]
    jammed: dict[str, Bool[Array, "..."]]
    shared: dict[str, Bool[Array, "..."]]
    unique: dict[str, Bool[Array, "..."]]
    t: Float[Array, "..."] | None = None

    def report(self) -> Report:
        jams = [f"{name} jams" for name, jammed in self.jammed.items() if np.any(jammed)]
        found = [Quantity("contraction", self.contraction)]
        for name, load in self.loads.items():
            is_pair = np.ndim(load) > np.ndim(self.contraction)
            found.append(
                along_freedoms(f"load of {name}", load, "N", "axis")
                if is_pair
                else Quantity(f"load of {name}", load, "N")
            )
            found.append(along_freedoms(f"friction of {name}", self.efforts[name]))
            found.append(Quantity(f"power of {name}", self.powers[name], "W"))
            found.append(Quantity(f"{name} is unique", self.unique[name]))
            for word, marks in (("jammed", self.jammed), ("shared", self.shared)):
                found.append(Quantity(f"{name} is {word}", marks[name], in_table=bool(np.any(marks[name]))))
        return Report(found, fault=faults_in_short(jams), t=self.t)


@state_function
def _joint_friction(system: System, state: State) -> FrictionLoads:
    at = closures.with_directions(system, with_velocities(system, at_state(system, state), state.velocities))
    found, f = motion_with_friction(system, at), system.joint_friction
    ratio = lax.stop_gradient(contraction(found.loads))
    jammed = ~found.loads.unique & _growing(lax.stop_gradient(found.loads.slope))
    shared, touched = _shared_loads(system, at, found), _touched_by_couplers(system, at)
    unique = found.loads.unique & ~(shared | touched)
    names = [system.topology.joints[j].name for j in f.joints]
    places = {name: [k for k, other in enumerate(names) if other == name] for name in names}
    efforts = _efforts_along(system, at, found)

    def by_joint(values, of=lambda x: x):
        return {name: of(values[np.array(k)]) for name, k in places.items()}

    one = lambda x: x[0] if len(x) == 1 else x
    return FrictionLoads(
        loads=by_joint(found.total, one),
        efforts={name: jnp.concatenate([efforts[k] for k in mine]) for name, mine in places.items()},
        powers=by_joint(found.powers, jnp.sum),
        contraction=ratio,
        jammed=by_joint(jammed, jnp.any),
        shared=by_joint(shared, jnp.any),
        unique=by_joint(unique, jnp.all),
        t=at.t,
    )


def joint_friction(system: System, state: State) -> FrictionLoads:
    """Loads and friction of all joints that rub, with their verdict.

    Args: state: a State, a Motion, or a State with leading axes, which the results have then in front.

    Raises: ModelError for a system without friction in its joints, and for the state of another system.
    """
    if getattr(system, "friction", None) is None and hasattr(system, "topology"):
        raise ModelError(
            ["no joint rubs: declare friction by SystemBuilder.friction(name, joint, mu)"], "the question"
        )
    return _joint_friction(system, state)


def _growing(C):
    """True (n,) for the surfaces that have part in the loads that grow: in rows and columns of high powers of |C|."""
    power = jnp.abs(C)
    for _ in range(8):
        power = power / jnp.maximum(jnp.max(power), jnp.finfo(C.dtype).tiny)
        power = few_columns(power, power)
    rows, columns = jnp.sum(power, axis=1), jnp.sum(power, axis=0)
    share = jnp.sqrt(rows * columns)
    return ~(share < _SHARE * jnp.max(share))


def _efforts_along(system, at, found: FrictionSolution):
    """Efforts (k,) of each surface's friction along the freedoms of its joint."""
    f, wrenches = system.joint_friction, []
    first, second = joint_axes(system.joint_friction, at, found.wrench)
    local = jnp.concatenate([first, second], axis=1)
    for k, kind in enumerate(f.kinds):
        effort = local[k, np.array(SURFACES[kind].freedoms)]
        wrenches.append(effort + f.pitch[k] * local[k, 5] if SURFACES[kind].is_thread else effort)
    return wrenches


def _touched_by_couplers(system: System, at: VelocityKinematics):
    """True (n,) for the surfaces of joints that couplers or rows of the user touch."""
    mine = np.array(system.joint_friction.joints)
    touched = np.zeros(len(mine), bool)
    for row in couplers_and_user_rows(system):
        touched = touched | coupled_joints(system, row, at)[mine]
    return jnp.asarray(touched)


def _shared_loads(system: System, at: VelocityKinematics, found: FrictionSolution):
    """True (n,) for the surfaces whose load self-stresses change, so that statics leaves it open."""
    f, top = system.joint_friction, system.topology
    if not system.closures:
        return jnp.zeros(len(f.joints), bool)
    rows, dtype = constraint_operator(system, at), at.u.dtype
    tried = jnp.asarray(np.random.default_rng(_SEED).normal(size=(_PROBES, top.num_rows)), dtype)
    efforts = jax.vmap(rows.efforts)(tried)
    # multipliers of accelerations have the sign of A^T y = -b
    stress = rows.unit[None] * tried + saddle_solver(system, at)[0](efforts, jnp.zeros_like(tried))[1]
    D = closures.directions(system, at)
    each = jax.vmap(lambda y: jnp.concatenate(closures.wrenches(system, D, y)))(lax.stop_gradient(stress))
    table = surface_rows(f.kinds, dtype)
    maps = jnp.asarray(carriers(system).closures[table.surface_of_load], dtype)
    loads = jnp.einsum("lk,lp,tpk->tl", found.surfaces.bears, maps, each)
    length = jnp.asarray(system.length, dtype)
    size = jnp.maximum(
        jnp.max(jnp.abs(each[..., 3:]), initial=0.0), jnp.max(jnp.abs(each[..., :3]) / length, initial=0.0)
    )
    size = jnp.maximum(size, _ROUNDING / length)
    of_surface = segment_sum_static(jnp.max(jnp.abs(loads), axis=0), table.surface_of_load, len(f.joints))
    return lax.stop_gradient(of_surface > _TOLERANCE[dtype.itemsize] * size)
