"""Objects of a scene: a mechanism, a structure or a network with its motion, as data for the player."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ...checks import no_such
from ...errors import ModelError, UnknownNameError
from ...flexible._recovery import deformations
from ...linear._system import LinearSystem
from ...model._system import System
from ...palette import COLORS
from ...typing import ScalarLike
from .._body_shapes import inertia_box
from .._drawable import slides
from .._element_arrows import arrows_along
from .._mesh import DisplayMesh, display_mesh, moving_meshes
from .._projection import load_axes
from .._things import things
from ._geometry import BAR_RADIUS, MechanismGeometry, pose_tracks
from ._joint_solids import RAIL
from ._shape_solids import shape_solids, solid_corners
from ._solid_library import SolidLibrary, encode_array
from ._trajectory import frame_trajectory

_THICKNESS = 0.02  # of planes and cams, relative to the extent of the trajectory
_RANK_TOLERANCE = 1e-7  # of the largest singular value: smaller ones vanish in the player's float32


class SceneObject:
    """One system and its motion: `ts` (T,), `points` (n, 3) that it reaches, `gravity`, `frequency` of a mode [Hz].

    `traceable` are the names whose paths can be drawn.
    """

    ts: np.ndarray
    points: np.ndarray
    gravity: np.ndarray | None = None
    frequency: float | None = None
    traceable: tuple[str, ...] = ()

    def contents(self, solids: SolidLibrary, radius: Any, up: Any, shapes: Mapping, traces: Iterable[str]) -> dict:
        """Bodies, solids, labels and meshes for the player, without arrows."""
        raise NotImplementedError

    def arrows(self, loads: Any, limits: Mapping) -> dict | None:
        """Places and forces (T, joints, 3) on the children, in world axes; None without loads."""
        return None


def scene_object(
    system: Any, motion: Any, structures: Any, scale: ScalarLike, stresses: Mapping | None = None
) -> SceneObject:
    """The scene object of a mechanism or a linear system.  Raises: TypeError for anything else."""
    if isinstance(system, System):
        return MechanismObject(system, motion, structures, scale, stresses or {})
    if isinstance(system, LinearSystem):
        if stresses:
            raise ModelError(["stresses colour the elastic bodies of a mechanism, not a linear system"])
        return StructureObject(system, motion, structures, scale)
    raise TypeError(f"a scene shows a System or a LinearSystem, not a {type(system).__name__}")


class MechanismObject(SceneObject):
    """A mechanism: bodies and joints, elastic bodies as meshes if their structures are given."""

    def __init__(self, system, motion, structures, scale, stresses):
        self.system, self.motion, self.scale = system, motion, scale
        self.frequency = getattr(motion, "frequency", None)
        self.trajectory = frame_trajectory(system, motion)
        self.ts, top = self.trajectory.ts, system.topology
        self.gravity = np.asarray(system.gravity, float)
        joined = {f for joint in top.joints for f in joint.frames}
        seen = sorted(joined | {f for f, n in enumerate(top.frame_names) if f > top.bodies.size and n})
        com = self.trajectory.x[:, 1 : top.bodies.size + 1] + np.einsum(
            "tbij,bj->tbi", self.trajectory.R[:, 1 : top.bodies.size + 1], np.asarray(system.com, float)
        )
        self.things = things(system)
        self.solids = shape_solids(self.things, self.trajectory, _THICKNESS * self.trajectory.extent)
        ends = [*solid_corners(self.solids, self.trajectory), *self._rail_ends()]
        self.points = np.concatenate([self.trajectory.x[:, seen].reshape(-1, 3), *self._boxes(com), *ends])
        self.traceable = top.frame_names
        self.elastic = {}
        given = dict(structures or {})
        names = [name for group in system.elastic for name in group.names]
        wrong = [no_such("elastic body", name, names) for name in given if name not in names]
        if wrong:
            raise UnknownNameError("; ".join(wrong))
        for name, (structure, frame) in given.items():
            q = np.atleast_2d(np.asarray(deformations(system, motion, name)[0]))
            self.elastic[name] = structure, frame, q[: len(self.ts)]
        self.stresses = {name: self._stress(name, values) for name, values in stresses.items()}

    def _rail_ends(self):
        """Ends (T, 3) of the rails of slides."""
        for slide in slides(self.system, self.trajectory):
            frame, beyond = slide.joint.frames[0], RAIL * BAR_RADIUS * self.trajectory.extent
            for far in (slide.reach[0] - beyond, slide.reach[1] + beyond):
                yield self.trajectory.x[:, frame] + far * self.trajectory.R[:, frame] @ slide.axis

    def _stress(self, name, values):
        """Sizes (T, nodes) of the stresses at the nodes of an elastic body."""
        if name not in self.elastic:
            raise UnknownNameError(no_such("elastic body with a structure", name, self.elastic))
        values = np.abs(np.atleast_2d(np.asarray(values, float)))[: len(self.ts)]
        wanted = len(self.ts), self.elastic[name][0].num_nodes
        if values.shape != wanted:
            raise ModelError([f"stresses of {name!r} have the shape {values.shape}, not {wanted}: instants, nodes"])
        return np.nan_to_num(values)

    @property
    def largest_stress(self) -> float:
        """The largest of all stresses [Pa]; zero without any."""
        return max((float(values.max(initial=0.0)) for values in self.stresses.values()), default=0.0)

    def _boxes(self, com):
        """Centres of bodies and face centres of their inertia boxes, (T, 3) each."""
        for body in range(com.shape[1]):
            yield com[:, body]
            edges, axes = inertia_box(self.system, body, self.trajectory.extent)
            for half in (0.5 * edges * axes).T:
                yield from (com[:, body] + sign * self.trajectory.R[:, body + 1] @ half for sign in (-1.0, 1.0))

    def contents(self, solids, radius, up, shapes, traces):
        top = self.system.topology
        own = dict(shapes) | dict.fromkeys(self.elastic)
        done = MechanismGeometry(self.system, self.things, self.trajectory, solids, radius, up, own)
        for k, name in enumerate(n for n in traces if n in top.frame_index):
            if len(self.ts) > 1:
                done.add_trace(name, self.trajectory.x[:, top.frame_index[name]], COLORS[(k + 3) % len(COLORS)])
        bodies = ["ground", *top.body_names, *(name for name, _ in done.points)]
        meshes = [self._mesh(name, *given) for name, given in self.elastic.items()]
        numbers = pose_tracks(self.trajectory, top.bodies.size)
        done.add_shapes(self.solids)
        if done.points:
            still = np.zeros((len(numbers), len(done.points), 7))
            still[..., :3], still[..., 6] = np.stack([x for _, x in done.points], axis=1), 1.0
            numbers = np.concatenate([numbers, still], axis=1)
        return {
            "bodies": bodies,
            "tracks": encode_array(numbers),
            "items": done.items,
            "tags": done.tags,
            "meshes": meshes,
        }

    def _mesh(self, name, structure, frame, q):
        """Mesh of an elastic body with its deformation shapes, in the axes of the first interface."""
        mesh, component, first = display_mesh(structure), frame.system, frame.body.interfaces[0]
        shapes = mesh.node_translations(frame.whole, frame.expand(frame.shapes.T))
        about = np.asarray(component.positions[component.nodes.index(first)], float)
        body = self.system.topology.body_names.index(f"{name}.{first}") + 1
        made = encode_mesh(name, mesh._replace(rest=mesh.rest - about), shapes, q, body, self.scale)
        if name in self.stresses:
            made["shares"] = encode_array(self.stresses[name] / (self.largest_stress or 1.0))
        return made

    def arrows(self, loads, limits):
        if loads is None or loads is False:
            return None
        joints = {} if loads is True else self._joint_arrows(loads)
        others = {name: pair for name, pair in self._element_arrows().items() if name not in joints}
        each = [(name, *pair) for name, pair in joints.items()]
        each += [(n, place[:, k], force[:, k]) for n, (place, force) in others.items() for k in range(place.shape[1])]
        names = [name for name, *_ in each]
        wrong = [no_such("joint", name, names) for name in limits if name not in names]
        if wrong:
            raise UnknownNameError("; ".join(wrong))
        none = np.zeros((len(self.ts), 0, 3))
        place, force = (np.stack([one[k] for one in each], axis=1) if each else none for k in (1, 2))
        bounds = [_load_limit(limits.get(name)) for name in names]
        return {"names": names, "place": place, "force": np.nan_to_num(force), "limits": bounds}

    def _joint_arrows(self, loads):
        """Places and forces (T, 3) of joints by name, on the children."""
        ends = {joint.name: joint.frames for joint in self.system.topology.joints}
        for group in self.system.closures:
            ends |= {name: pair for name, *pair in zip(group.names, group.first, group.second, strict=True)}
        (frame, side), found = load_axes(loads), {}
        for name in (name for name in loads if name in ends):
            force, (parent, child) = np.asarray(loads[name].force).reshape(-1, 3), ends[name]
            if len(force) < len(self.ts):
                raise ModelError("the loads belong to another motion: they have fewer instants")
            force = force[: len(self.ts)]
            if frame == "joint":
                force = np.einsum("tab,tb->ta", self.trajectory.R[:, child if side == "child" else parent], force)
            found[name] = self.trajectory.x[:, child], force if side == "child" else -force
        return found

    def _element_arrows(self):
        """Places and forces (T, k, 3) of contacts and cables by name; none of a mode."""
        found = {} if self.frequency is not None else arrows_along(self.system, self.motion)
        return {name: (place[: len(self.ts)], force[: len(self.ts)]) for name, (place, force) in found.items()}


def _load_limit(limit):
    """The limit of a load as a number; None without one or if it is infinite."""
    least = np.inf if limit is None else float(np.min(np.asarray(getattr(limit, "upper", limit), float)))
    if not least > 0.0:
        raise ValueError(f"a limit of a load must be positive, got {least}")
    return least if np.isfinite(least) else None


class StructureObject(SceneObject):
    """A structure: the mesh of a linear system, or those of all components of a network."""

    def __init__(self, system, motion, structures, scale):
        self.scale = scale
        self.frequency = getattr(motion, "frequency", None)
        x = np.asarray(getattr(motion, "displacement", motion), float)
        x = x[None] if x.ndim == 1 else x
        ts = np.asarray(getattr(motion, "ts", np.arange(len(x))), float)
        there = np.all(np.isfinite(x), axis=1) & np.isfinite(ts)
        if not np.any(there):
            raise ModelError(["the motion has no finite displacement"])
        x, self.ts = x[there], ts[there]
        self.meshes = moving_meshes(system, x, structures)
        if not self.meshes:
            raise ModelError("no component has positions: give structures by component")
        self.points = np.concatenate([(mesh.rest + scale * u).reshape(-1, 3) for mesh, u in self.meshes.values()])

    def contents(self, solids, radius, up, shapes, traces):
        still = np.tile([0.0, 0, 0, 0, 0, 0, 1], (len(self.ts), 1, 1))
        meshes = []
        for name, (mesh, u) in self.meshes.items():
            left, size, right = np.linalg.svd(u.reshape(len(u), -1), full_matrices=False)
            kept = size > _RANK_TOLERANCE * max(size.max(initial=0.0), 1e-300)
            basis = right[kept].reshape(-1, *mesh.rest.shape)
            meshes.append(encode_mesh(name or "structure", mesh, basis, left[:, kept] * size[kept], 0, self.scale))
        tags = [
            {"name": n, "body": 0, "point": p.tolist()}
            for mesh, _ in self.meshes.values()
            for n, p in zip(mesh.names, mesh.rest, strict=True)
        ]
        return {
            "bodies": ["ground"],
            "tracks": encode_array(still),
            "items": [],
            "tags": tags[:200],
            "meshes": meshes,
        }


def encode_mesh(
    name: str, mesh: DisplayMesh, basis: np.ndarray, amplitudes: np.ndarray, body: int, scale: ScalarLike
) -> dict:
    """Encode a mesh on a body, moving by amplitudes (T, m) times shapes (m, nodes, 3)."""
    moved = np.einsum("tm,mvc->tvc", amplitudes, basis)
    return {
        "name": name,
        "body": body,
        "rest": encode_array(mesh.rest),
        "faces": encode_array(mesh.faces, "<u4"),
        "edges": encode_array(mesh.edges, "<u4"),
        "bars": mesh.bars.tolist(),
        "balls": mesh.balls.tolist(),
        "basis": encode_array(basis),
        "amplitudes": encode_array(amplitudes),
        "scale": scale,
        "largest": float(np.max(np.linalg.norm(moved, axis=-1), initial=0.0)),
    }
