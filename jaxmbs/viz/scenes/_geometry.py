"""Geometry of a scene: solids of bodies, symbols of joints, springs and traces.  Body 0 is the ground."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...drawings import Ball, Box, Cylinder, Gear, Outline, Path, Wheel
from ...model._system import System
from ...palette import COLORS, PALE
from .._drawable import slides
from .._things import Thing
from ._body_solids import add_bodies
from ._element_solids import add_spans, add_threads, add_torsions
from ._joint_solids import add_joints
from ._shape_solids import ShapeSolid
from ._solid_library import SolidLibrary, rgba
from ._solids import rotation_to_axis, sweep_tube
from ._trajectory import FrameTrajectory

_CLEAR = 0.45  # opacity of surfaces through which one sees
_SHAPES = (Ball, Box, Cylinder, Gear, Outline, Path, Wheel)  # that show what a body looks like
BAR_RADIUS = 0.02  # of bars, relative to the extent of the scene, chosen by eye


def _shaped_frames(thing) -> set[int]:
    """Numbers of the frames of a thing whose bodies it shows."""
    return {shape.frame for shape in thing.shapes if isinstance(shape, _SHAPES)}


class MechanismGeometry:
    """Geometry of one mechanism; `radius` [m] is that of its bars, `up` (3,) the direction against gravity."""

    def __init__(
        self,
        system: System,
        things: list[Thing],
        film: FrameTrajectory,
        solids: SolidLibrary,
        radius: Any,
        up: np.ndarray,
        shapes: Mapping,
    ):
        self.system, self.things, self.top, self.trajectory = system, things, system.topology, film
        self.solids, self.r, self.up, self.shapes = solids, radius, up, shapes
        self.items: list[dict] = []
        self.tags: list[dict] = []
        self.shaped = {self.top.frame_body[thing.frames[f]] for thing in things for f in _shaped_frames(thing)}
        self.points: list[tuple[str, np.ndarray]] = []  # names and places (T, 3) of points that no body carries
        self.slides = slides(system, film)
        for add in (add_bodies, add_joints, add_spans, add_threads, add_torsions):
            add(self)

    def add_unit_solid(self, name, body, number, position, z, radius, length, color, alpha=1.0):
        """Add a unit solid on a body, from a position along z."""
        frame = np.eye(4)
        frame[:3, :3] = rotation_to_axis(np.asarray(z, float)) * [radius, radius, length]
        frame[:3, 3] = position
        item = {"name": name, "solid": number, "body": body, "local": frame.T.ravel().tolist()}
        self.items.append(item | {"color": rgba(color, alpha)})

    def add_solid(self, name, body, solid, color):
        self.items.append({"name": name, "solid": self.solids(solid), "body": body, "color": rgba(color)})

    def body_of(self, frame):
        return self.top.frame_body[frame] + 1

    def axis_in_body(self, frame, axis):
        """An axis of a frame, in the axes of its body."""
        return self.trajectory.R[0, self.body_of(frame)].T @ self.trajectory.R[0, frame] @ axis

    def is_elastic(self, name):
        """True for a part of an elastic body: an interface, the joint of one, or the modes."""
        return name.partition(".")[0] in {n for group in self.system.elastic for n in group.names}

    def add_shapes(self, found: list[ShapeSolid]):
        """Add the solids of things, last the clear ones, through which one sees what was drawn before."""
        for name, frame, solid, is_clear, color in sorted(found, key=lambda one: one.is_clear):
            if name in self.shapes:
                continue
            body, place = self.body_of(frame), self.trajectory.position_in_body(self.top, frame)
            local = np.eye(4)
            local[:3, :3] = self.trajectory.R[0, body].T @ self.trajectory.R[0, frame]
            local[:3, 3] = place
            shade = rgba(color or (COLORS[(body - 1) % len(COLORS)] if body else PALE), _CLEAR if is_clear else 1.0)
            item = {"name": name, "solid": self.solids(solid), "body": body, "local": local.T.ravel().tolist()}
            self.items.append(item | {"color": shade})

    def add_trace(self, name, points, color):
        """Add the path of points (T, 3) in the world."""
        solid = self.solids(sweep_tube(points, 0.2 * self.r, sides=5))
        self.items.append({"name": f"path of {name}", "solid": solid, "body": 0, "color": rgba(color), "trace": True})


def pose_tracks(film: FrameTrajectory, bodies: int) -> np.ndarray:
    """Position and quaternion x y z w (T, 1 + bodies, 7) of the ground and all bodies, of continuous sign."""
    R, x = film.R[:, : bodies + 1], film.x[:, : bodies + 1]
    q = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat().reshape(*R.shape[:2], 4)
    turned = np.sum(q[1:] * q[:-1], axis=-1) < 0
    signs = np.concatenate([np.ones((1, bodies + 1)), np.cumprod(np.where(turned, -1.0, 1.0), axis=0)])
    return np.concatenate([x, q * signs[..., None]], axis=-1)
