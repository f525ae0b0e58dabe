"""Free motions of warmed elements, the forces that stop them, and what is left of forces and stresses."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...elements._base import as_real
from ...elements._shell_section import strain_rotation
from ...elements._solid import strain_components
from ...errors import ModelError
from ...fem import Structure
from ...fem._loads import _scatter_to_nodes
from ...typing import AnyArray
from ._lumped import MasslessGroup
from ._materials import Material, SolidMaterial
from ._shell_groups import ShellGroup


def free_motions(deck: Any, structure: Structure, temperatures: Float[Array, " nodes"]) -> dict[str, Array]:
    """Displacements (elements, k, c) by group in which warmed elements have no stress.

    An element is warmed by the mean of its nodes.  Strains of one material are uniform; layers bend as well.

    Raises: ModelError for curved shells of other materials than MAT1.
    """
    numbers = deck.numbers
    found, faults = {}, []
    for name, own in deck.elements.items():
        bare = own.of if isinstance(own, MasslessGroup) else own
        section = numbers.properties.get(getattr(bare, "property", ""))
        materials = _materials_of(section, numbers.materials)
        if not materials:
            continue
        group = structure.groups[name]
        mean = jnp.mean(temperatures[group.connections], axis=1)
        layered, stuff = hasattr(section, "ply_materials"), materials[0]
        if not layered and len(materials) == 1 and isinstance(stuff, Material | SolidMaterial):
            strain = jax.vmap(_tensor, (None, 0))(stuff, getattr(bare, "axes", None)) if _has_axes(bare) else None
            strain = jnp.eye(3) * stuff.expansion if strain is None else strain
            strain = jnp.broadcast_to(strain, (len(mean), 3, 3)) * (mean - stuff.reference)[:, None, None]
            found[name] = group.map(_stretched, structure.positions, strain)
        elif isinstance(bare, ShellGroup) and bare.kind < 5:
            forces = _shell_forces(bare, section, numbers.materials, mean)
            found[name] = group.map(_bent, structure.positions, forces)
        else:
            faults.append(f"{name}: thermal strains of curved shells are supported for MAT1 alone")
    if faults:
        raise ModelError(faults)
    return found


def thermal_forces(deck: Any, structure: Structure, temperatures: Float[Array, " nodes"]) -> Float[Array, "nodes 6"]:
    """Forces that make the strains of warming: stiffness of each element times its free motion.

    Those of quadrilaterals, curved shells and solids follow the temperatures between their nodes.
    """
    total = jnp.zeros((structure.num_nodes, 6))
    for name, motion in free_motions(deck, structure, temperatures).items():
        group = structure.groups[name]
        forces = group.map(lambda e, nodes, x: e.stiffness(nodes) @ x.reshape(-1), structure.positions, motion)
        nodal = temperatures[group.connections]
        if hasattr(group.element, "initial_load"):
            rest = _uneven_forces(deck, name, group, nodal)
            forces = forces + group.map(lambda e, nodes, x: e.initial_load(nodes, x), structure.positions, rest)
        elif hasattr(group.element, "thermal_load"):
            rest = nodal - jnp.mean(nodal, axis=1, keepdims=True), _expansions(deck, name, len(nodal))
            forces = forces + group.map(lambda e, at, T, a: e.thermal_load(at, a, T), structure.positions, *rest)
        total = total + _scatter_to_nodes(structure, group, forces)
    return total


def _uneven_forces(deck, name, group, corners):
    """Forces (elements, corners, 6) that the temperatures of the corners make beyond their mean, element axes."""
    own, numbers = deck.elements[name], deck.numbers
    bare = own.of if isinstance(own, MasslessGroup) else own
    section = numbers.properties[bare.property]
    of = lambda T: _shell_forces(bare, section, numbers.materials, T)
    rest = jax.vmap(of, 1, 1)(corners) - of(jnp.mean(corners, axis=1))[:, None]
    if not hasattr(group.element, "angle"):
        return rest
    turn = jax.vmap(strain_rotation)(group.element.angle)
    turned = jnp.einsum("eba,ekdb->ekda", turn, rest.reshape(*rest.shape[:2], 2, 3))
    return turned.reshape(rest.shape)


def _expansions(deck, name, count):
    """Strains per kelvin (elements, 6) of solids; of curved shells forces (elements, 3) per kelvin."""
    own, numbers = deck.elements[name], deck.numbers
    bare = own.of if isinstance(own, MasslessGroup) else own
    section = numbers.properties[bare.property]
    stuff = _materials_of(section, numbers.materials)[0]
    if isinstance(bare, ShellGroup):
        thickness = section.thickness if bare.thickness is None else bare.thickness
        return jnp.broadcast_to(thickness, (count,))[:, None] * (stuff.plane @ stuff.plane_expansion)[None]
    if _has_axes(bare):
        return strain_components(jax.vmap(_tensor, (None, 0))(stuff, bare.axes))
    return jnp.broadcast_to(stuff.expansion * jnp.array([1.0, 1, 1, 0, 0, 0]), (count, 6))


def recover(deck: Any, u: AnyArray, temperatures: Array | None, what: str) -> dict[str, Array]:
    """`forces`, `stresses` or `corner_stresses` of all elements that have them, less those of free motions."""
    structure, u = deck.structure, as_real(u)
    free = {} if temperatures is None else free_motions(deck, structure, temperatures)
    found = {}
    for name, group in structure.groups.items():
        element = group.element
        if name.startswith("mass of ") or not hasattr(element, what):
            continue
        at = u[group.connections, : element.coordinates] - free.get(name, 0.0)
        spread = [jnp.zeros((len(at), element.size), at.dtype)] if element.has_ends else []
        found[name] = group.map(lambda e, *rest: getattr(e, what)(*rest), structure.positions, at, *spread)
    return found


def ply_stresses(deck: Any, u: AnyArray, temperatures: Array | None) -> dict[str, Array]:
    """Stresses (elements, plies, 3, 3) of the plies of all PCOMP and PCOMPG, as `Laminate.ply_stresses` has them."""
    numbers, found = deck.numbers, {}
    for name, forces in recover(deck, u, temperatures, "forces").items():
        own = deck.elements[name]
        bare: Any = own.of if isinstance(own, MasslessGroup) else own
        section: Any = numbers.properties.get(getattr(bare, "property", ""))
        if not hasattr(section, "ply_materials"):
            continue
        group = deck.structure.groups[name]
        element = getattr(group.element, "of", group.element)
        mean = jnp.full(len(forces), section.reference)
        if temperatures is not None:
            mean = jnp.mean(temperatures[group.connections], axis=1)
        found[name] = jax.vmap(_plies, (None, None, 0, 0, 0))(
            section, numbers.materials, forces[:, :6], element.angle, mean
        )
    return found


def _plies(section, materials, forces, angle, temperature):
    back = strain_rotation(-angle)
    in_laminate = jnp.concatenate([back.T @ forces[:3], back.T @ forces[3:]])
    made = section.laminate(materials)
    whole = made.ply_stresses(in_laminate + section.thermal_forces(materials, temperature))
    free = section.ply_strains(materials, temperature)
    return whole - jnp.einsum("pab,pb->pa", made.moduli, free)[:, None]


def _materials_of(section, materials):
    """Materials of a property; none where it has none that expands."""
    own = [getattr(section, key, "") for key in ("material", "bending", "coupling")]
    names = getattr(section, "ply_materials", own)
    return [materials[name] for name in sorted({name for name in names if name})]


def _has_axes(bare):
    return getattr(bare, "axes", None) is not None and not isinstance(bare, ShellGroup)


def _tensor(stuff, axes):
    """Strain tensor per kelvin of a MAT9 in basic axes, whose own are rows."""
    xx, yy, zz, xy, yz, zx = stuff.expansion
    own = jnp.stack(
        [jnp.stack([xx, xy / 2, zx / 2]), jnp.stack([xy / 2, yy, yz / 2]), jnp.stack([zx / 2, yz / 2, zz])]
    )
    return axes.T @ own @ axes


def _stretched(element, nodes, strain):
    u = (nodes - jnp.mean(nodes, axis=0, keepdims=True)) @ strain
    return jnp.zeros((len(nodes), element.coordinates), nodes.dtype).at[:, :3].set(u)


def _shell_forces(own, section, materials, mean):
    """Forces (elements, 6) that warming makes where nothing moves, about the surface of the nodes."""
    thickness = own.thickness
    if thickness is None:
        thickness = jnp.broadcast_to(jnp.sum(section.thickness), mean.shape)
    forces = jax.vmap(lambda T, t: section.thermal_forces(materials, T, t))(mean, thickness)
    return forces if own.offset is None else forces.at[:, 3:].add(own.offset[:, None] * forces[:, :3])


def _bent(element, nodes, forces):
    """Motion of a flat shell whose strains and curvatures are those of these forces on its section."""
    own = element.layup
    B = jnp.zeros((3, 3), nodes.dtype) if own.coupling is None else own.coupling
    regular = lambda C: jnp.where(C[0, 0] > 0, C, jnp.eye(3, dtype=C.dtype))
    strains = jnp.linalg.solve(jnp.block([[regular(own.membrane), B], [B, regular(own.bending)]]), forces)
    R = strain_rotation(-element.angle)
    (xx, yy, xy), (kx, ky, kxy) = R @ strains[:3], R @ strains[3:]
    places, T = element.plane_coordinates(nodes)
    x, y = places.T
    w = -0.5 * (kx * x * x + ky * y * y + kxy * x * y)
    rows = [xx * x + xy / 2 * y, xy / 2 * x + yy * y, w, -ky * y - kxy / 2 * x, kx * x + kxy / 2 * y, 0.0 * x]
    return jnp.linalg.solve(T, jnp.stack(rows, axis=1).reshape(-1)).reshape(-1, 6)
