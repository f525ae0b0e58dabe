"""Powers of every force element: mechanical, electric and fluid ones, and the balance of each."""

import equinox as eqx
import jax
import jax.numpy as jnp

from ..assembly._state import State
from ..dynamics._efforts import efforts_and_storage_powers, state_power
from ..dynamics._newton_euler import motion_with_friction
from ..forces._element_bonds import DOMAINS, SOURCES, bond_sums, power_into
from ..friction._bristles import bristle_storage
from ..kinematics._configuration import at_state, with_velocities
from ..kinematics._element_flows import element_flows
from ..kinematics._slips import slips_of
from ..model._changes import with_changes
from ..model._entry_points import check_system, states_of
from ..model._system import System
from ..motion._motion import Motion
from ..named_arrays import elements_of
from ..quantities import Quantity
from ..reports import Report, Reported
from ..runtime import jit
from ..signal_flow._acting_laws import acting_laws
from ..signal_flow._signals import with_signals
from ._circuits import circuit_powers
from ._inner_graph import group_bonds


class ElementPowers(Reported, eqx.Module):
    """Powers (...) [W] of every force element and of every part of a hydraulic circuit by name; leading axes for a
    motion.

    `supplied + exchanged = mechanical + stored + dissipated`.

    Attributes:
        mechanical: that the element feeds into the mechanism, effort times flow.
        stored: rate of its stored energy at constant time, from the law's potential.
        dissipated: heat, of laws that declare bonds that of their resistors.
        supplied: by its sources, such as a voltage or a pump.
        exchanged: what other elements give it through ports of their own, which is none of all together, and what oil
            carries that fills a chamber.
        domains: what its sources supply, by domain "electric", "fluid" and "mechanical".
        bonds: an `ElementBond` by name of the bond inside it; none where the law declares none.
    """

    mechanical: dict
    stored: dict
    dissipated: dict
    supplied: dict
    exchanged: dict
    domains: dict
    bonds: dict

    def report(self) -> Report:
        kinds = ("mechanical", "stored", "dissipated", "supplied", "exchanged")
        return Report(
            [Quantity(f"{name} {kind}", x, "W") for kind in kinds for name, x in getattr(self, kind).items()]
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the elements."""
        return tuple(self.mechanical)

    @property
    def residual(self) -> dict:
        """Missing power of the balance of each element [W].

        A test where the law declares bonds: heat and supply come from the bonds, the stored power from the potential
        and the rates of the internal states, the mechanical one from the effort.  Zero by construction elsewhere.
        """
        given = {name: self.supplied[name] + self.exchanged[name] for name in self.names}
        return {
            name: given[name] - self.mechanical[name] - self.stored[name] - self.dissipated[name] for name in given
        }

    @property
    def totals(self) -> dict:
        """Sum over all elements of each of the five powers by its name [W]."""
        kinds = ("mechanical", "stored", "dissipated", "supplied", "exchanged")
        return {kind: sum(getattr(self, kind).values()) for kind in kinds}

    def domain(self, domain: str) -> dict:
        """Supply of the sources of every element in one domain [W].  Raises: ValueError for an unknown domain."""
        if domain not in DOMAINS:
            raise ValueError(f"domain must be one of {', '.join(DOMAINS)}, not {domain!r}")
        return {name: parts[domain] for name, parts in self.domains.items()}


def element_powers(system: System, motion: State | Motion) -> ElementPowers:
    """Powers of every force element and of every part of hydraulic circuits, at a state or along a motion.

    Args: motion: a State, a Motion, or a State with one leading axis.

    The work of an element in the energy account of a motion is the integral of `supplied + exchanged - dissipated`.
    A pump on a joint is a force element there, "pump shaft", which exchanges its power with the pump.
    Of a law without `bonds` the effort beside that of the potential is supplied where it is a source, and heat
    otherwise.  The friction of joints is heat, by the name of the friction; what bends bristles, of joints and of
    contacts, is stored and not heat.  Elastic bodies, gravity and drives are not among them.

    Source: S2 (27)-(28), (56)-(76).
    """
    check_system(system)
    states = states_of(system, motion)
    return ElementPowers(*_all_powers(system, states, states.coordinates.ndim == 2))


@jit
def _all_powers(system, states, batched):
    one = lambda state: _powers(system, state)
    return jax.vmap(one)(states) if batched else one(states)


def _powers(system, state):
    system = with_changes(system, state)
    at = with_velocities(system, at_state(system, state, inertias=system.friction is not None), state.velocities)
    at = with_signals(system, at)
    circuits = [_part_powers(name, part) for name, part in circuit_powers(system, at).items()]
    found = [_group_powers(system, group, law, at) for group, law in acting_laws(system, at)] + circuits
    found += [] if system.friction is None else [_friction_powers(system, at)]
    return tuple({name: value for part in found for name, value in part[k].items()} for k in range(7))


def _group_powers(system, group, law, at):
    """The fields of `ElementPowers` for the elements of a group."""
    _, displacement, flow = element_flows(system, group, at, at.V, at.u)
    efforts, stored = efforts_and_storage_powers(group, law, displacement, flow, at.t)
    mechanical = jnp.sum(efforts * flow, axis=1)
    if group.internal:
        stored = stored + state_power(group, law, displacement, flow, at.t)
    if group.law.has_storage_beside:
        stored = stored + _powers_of(group, law, displacement, flow, at.t, "storage_beside")
    bonds = group_bonds(group, law, displacement, flow, at.t) if group.law.has_bonds else {}
    if bonds:
        heat, supplied, exchanged, _ = jax.vmap(bond_sums)(bonds)
        domains = jax.vmap(_supplied_by_domain)(bonds)
    else:
        heat, supplied = _split_rest(group, law, displacement, flow, at.t, mechanical + stored)
        exchanged = jnp.zeros_like(heat)
        domains = dict.fromkeys(DOMAINS, jnp.zeros_like(heat)) | {"mechanical": supplied}

    fields = mechanical, stored, heat, supplied, exchanged, domains, bonds
    return tuple(dict(elements_of(group.names, values)) for values in fields)


def _powers_of(group, law, displacement, flow, t, method):
    """Powers (n,) that a method of the law gives, of the arguments of its effort; zero where it gives none."""

    def of_one(law, x, f):
        law, arguments = group.port.law_and_arguments(law, x, f)
        found = getattr(law, method)(*arguments, t)
        return jnp.zeros(()) if found is None else found

    return jax.vmap(of_one)(law, displacement, flow)


def _friction_powers(system, at):
    """The fields of `ElementPowers` for the rubbing surfaces of joints: heat, and what bends bristles."""
    found = motion_with_friction(system, at)
    names, powers, none = system.friction.names, found.powers, jnp.zeros_like(found.powers)
    stored = none
    if at.bends is not None:
        stored = found.total * bristle_storage(system.friction, at.bends, slips_of(system, at).slip)
    fields = powers, stored, -powers - stored, none, none, dict.fromkeys(DOMAINS, none)
    return (
        *(dict(elements_of(names, values)) for values in fields),
        {n: {} for n in names},
    )


def _part_powers(name, part):
    """The fields of `ElementPowers` for an element or node of a circuit."""
    heat, supplied, exchanged, _ = bond_sums(part.bonds)
    values = jnp.zeros_like(part.stored), part.stored, heat, supplied, exchanged, _supplied_by_domain(part.bonds)
    return tuple({name: value} for value in (*values, part.bonds))


def _supplied_by_domain(bonds):
    """Power that the sources among the bonds of one element supply, by domain."""
    own = {domain: {} for domain in DOMAINS}
    for name, bond in bonds.items():
        own[bond.domain][name] = bond
    return {domain: -power_into(part, SOURCES) for domain, part in own.items()}


def _split_rest(group, law, displacement, flow, t, rest):
    """Heat and supply (n,) of laws without bonds, from their power beside what they store."""
    if not group.law.is_source:
        return -rest, jnp.zeros_like(rest)
    heat = _powers_of(group, law, displacement, flow, t, "dissipated") if group.internal else jnp.zeros_like(rest)
    return heat, rest + heat
