"""Elastic cable over points, sheaves, cylinders and spheres: tension from its length, capstan friction."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jax import Array
from jaxtyping import Float

from ..checks import faults_if, may_be_nonzero, negative, not_positive
from ..drawings import Drawing
from ..math._vector import VectorComponents, cross, dot, norm
from ..runtime import constant_product, gather_static
from ..typing import ArrayLike, Convertible, Scalar, ScalarLike
from ._base import AbstractPathLaw, PathKinematics
from ._cable_drawing import cable_drawing, middles
from ._cable_friction import Models, cable_friction_faults, friction_of_elements, tension_ratios
from ._cable_path import CablePath, PathLayout
from ._cable_route import CableRoute, CableState
from ._fields import number, optional_number
from ._one_sided import one_sided, one_sided_integral, one_sided_slope, passive_sum
from ._readings import Arrows, Reading
from ._signals import Constant, as_signal, value_and_rate
from ._validity import Margin


class Cable(CableRoute, AbstractPathLaw):
    """Elastic cable along a path of points, sheaves, cylinders and spheres; see `SystemBuilder.cable`.

    Its tension is `k (length - free length) + pretension + c rate`; where `slack`, never below zero, with a smooth
    corner (C2).  The effort is that tension times the derivative of the length by the poses of all frames, so a
    motion without friction and damping keeps its energy.  With friction the tensions of the spans differ by
    `exp(mu(slip) wrap)` at each element (Euler and Eytelwein), and their mean by length is the
    tension of the elastic law: friction takes energy at every slip.  Wheels have no friction in their bearings unless
    their joints do.  A cable leaves a wheel between two points, goes straight past it and comes back; a wheel beside
    another one would pull at a cable that has left it, which `validity` says.

    Attributes:
        kinds: of each element, "point", "sheave", "cylinder" or "sphere".
        radii: (c,) of the elements that are no points, in order [m].
        axes: (c, 3) unit vectors in their frames' axes, about which the cable turns in the positive sense on its way;
            of spheres about along them.
        turns: (c,) whole turns about them beside the wrap.
        closed: True for a belt, whose last element is followed by the first.
        slack: True if the cable takes no compression.
        stiffness: k [N/m], positive; or
        axial_stiffness: modulus times cross section [N], which is divided by the free length.
        damping: c >= 0 [N s/m].
        free_length: length without tension [m]: a number, or a function of time for a winch that pays out at the
            first element; its work is then input.
        pretension: tension at the free length [N].
        friction: models of `jaxmbs.friction` at the elements: a list (n,) of them with None where there is none, or
            coefficients (n,) of `SmoothCoulomb`; None for none.
        transition: half of the stretch over which a cable becomes slack [m].
        drum_radius: of a drum at the first element that pays out `drum_radius` times the angle of its joint, and
            feels the tension of the first span times it [m], negative where it winds in; None for no drum.
    """

    slack: bool = eqx.field(static=True, default=True)
    stiffness: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)
    axial_stiffness: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)
    damping: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    free_length: Convertible[Callable] = eqx.field(converter=as_signal, default=1.0)
    pretension: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    friction: Convertible[Models | None] = eqx.field(converter=friction_of_elements, default=None)
    transition: Convertible[Scalar] = eqx.field(converter=number, default=1e-4)
    drum_radius: Convertible[Scalar | None] = eqx.field(converter=optional_number, default=None)

    @property
    def is_wound(self) -> bool:
        """True if the free length is a function of time."""
        return not isinstance(self.free_length, Constant)

    @property
    def is_source(self) -> bool:  # type: ignore[override]
        """True for a winch, whose work is input."""
        return self.is_wound

    @property
    def stores(self) -> bool:
        """True unless the free length changes in time."""
        return not self.is_wound

    @property
    def largest_damping(self) -> ArrayLike:
        return self.damping

    @property
    def dissipates(self) -> bool:
        """True for damping, friction, or a winch."""
        return self.is_wound or self.friction is not None or may_be_nonzero(self.damping)

    def drawing(self) -> Drawing:
        """The cable, its wheels and its drum."""
        return cable_drawing(self, None if self.drum_radius is None else abs(float(self.drum_radius)))

    def paid_out(self, angle: ScalarLike, rate: ScalarLike) -> "Cable":
        """This cable when its drum has turned by an angle [rad], with the free length that is then off the drum."""
        assert self.drum_radius is not None and isinstance(self.free_length, Constant)
        free = _PaidOut(self.free_length.value + self.drum_radius * angle, self.drum_radius * rate)
        return eqx.tree_at(lambda law: law.free_length, self, free)

    def pull(self, frames: PathKinematics, t: ScalarLike) -> "CablePull":
        """The cable at one instant, for `wrench`, `storage_power` and `state`."""
        path, rate, *slopes = self.length_and_rate(frames)
        k, stretch, paid = self._stretch(path.length, t)
        elastic = self._elastic(k, stretch)
        tension = self._tension(elastic, stretch, rate - paid)
        each = None if self.friction is None else self._tensions(path, tension, paid, frames)
        return CablePull(path, rate, slopes[0], slopes[1], elastic, tension, each)

    def wrench(self, frames: PathKinematics, t: ScalarLike) -> tuple[Float[Array, "n 3"], Float[Array, "n 3"]]:
        """Minus the tension times the derivative of the length, and friction at the points of contact."""
        return self.pull(frames, t).wrench(self.layout)

    def wrench_and_storage_power(
        self, frames: PathKinematics, t: ScalarLike
    ) -> tuple[tuple[Float[Array, "n 3"], Float[Array, "n 3"]], Scalar]:
        """Both of the same `pull`."""
        pull = self.pull(frames, t)
        return pull.wrench(self.layout), self._storage_power(pull)

    def potential(self, rotations: Float[Array, "n 3 3"], positions: Float[Array, "n 3"], t: ScalarLike) -> Scalar:
        """`k/2 (x^2 - x_0^2)` with the stretch x that makes the tension k x, zero where slack [J]."""
        if self.is_wound:
            return jnp.zeros((), positions.dtype)
        return self._stored(self.path(rotations, positions).length, t)

    def _stored(self, length, t):
        """Stored energy at a length [J]."""
        k, stretch, _ = self._stretch(length, t)
        return k * (one_sided_integral(stretch, self.transition) if self.slack else stretch**2 / 2)

    def storage_power(self, frames: PathKinematics, t: ScalarLike) -> Scalar:
        """Elastic tension times the rate of the length [W]."""
        return self._storage_power(self.pull(frames, t))

    def _storage_power(self, pull):
        return jnp.zeros_like(pull.rate) if self.is_wound else pull.elastic * pull.rate

    def state(self, frames: PathKinematics, t: ScalarLike) -> CableState:
        """Length, tensions and wrap."""
        pull = self.pull(frames, t)
        return CableState.of(self.layout, pull.path, pull.rate, pull.tension, pull.each_tension)

    def report(self, *args: Any) -> dict[str, Reading]:
        """Length, tensions and wrap, of the arguments of `wrench`."""
        return self.state(*args).readings

    def arrows(self, *args: Any) -> Arrows:
        """Forces on the bodies of all elements, of the arguments of `wrench`."""
        frames, t = args
        pull = self.pull(frames, t)
        return Arrows(middles(self.layout, pull.path), pull.wrench(self.layout)[0])

    def validity(self, frames: PathKinematics, t: ScalarLike) -> dict[str, Margin]:
        """Margins of the path."""
        return self.path_margins(frames.rotations, frames.positions)[1]

    def potential_and_validity(self, frames: PathKinematics, t: ScalarLike) -> tuple[Scalar, dict[str, Margin]]:
        """Both of the same path."""
        path, margins = self.path_margins(frames.rotations, frames.positions)
        stored = jnp.zeros((), frames.positions.dtype) if self.is_wound else self._stored(path.length, t)
        return stored, margins

    def _stretch(self, length, t):
        """(k, stretch that makes the tension k stretch, rate of the free length)."""
        free, paid = self._free_length_and_rate(t)
        k = self.stiffness if self.stiffness is not None else self.axial_stiffness / free
        return k, length - free + self.pretension / k, paid

    def _free_length_and_rate(self, t):
        if isinstance(self.free_length, _PaidOut):
            return self.free_length.value, self.free_length.rate
        return value_and_rate(self.free_length, t)

    def _tension(self, elastic, stretch, rate):
        resisting = self.damping * rate
        if not self.slack:
            return elastic + resisting
        return passive_sum(elastic, resisting * one_sided_slope(stretch, self.transition))

    def _elastic(self, k, stretch):
        return k * (one_sided(stretch, self.transition) if self.slack else stretch)

    def _tensions(self, path, tension, paid, frames):
        """Tensions (m,) of the spans, whose mean by length is the tension."""
        layout, motion = self.layout, tuple(VectorComponents.of(part) for part in frames[1:])
        ends = zip((path.start, path.end), layout.ends(motion), strict=True)
        first, second = (v + cross(w, point - x) for point, (x, w, v) in ends)
        spans, arc, directions = path.mixed(layout)
        parting = dot(directions, second - first)
        bend = path.wrap + _bend_at_points(layout, directions)
        wrap = jnp.where(bend > 0, bend, 0.0)
        share = spans + sum(layout.ends(arc)) / 2
        share = share / jnp.sum(share)
        ratios = tension_ratios(self.friction, wrap, share, parting, paid, self.closed)
        return tension * ratios / jnp.sum(share * ratios)

    def faults(self) -> list[str]:
        """Radii, stiffness and length are positive; damping and friction are not negative."""
        found = super().faults() + faults_if(
            ((self.stiffness is None) == (self.axial_stiffness is None), "give stiffness= or axial_stiffness="),
            (
                any(not_positive(k) for k in (self.stiffness, self.axial_stiffness) if k is not None),
                "stiffness must be positive",
            ),
            (negative(self.damping), "damping must not be negative"),
            (
                isinstance(self.free_length, Constant) and not_positive(self.free_length.value),
                "free_length must be positive",
            ),
            (
                self.drum_radius is not None and (self.is_wound or self.stiffness is None or self.closed),
                "a cable on a drum is open and takes stiffness= and a free_length that is a number",
            ),
            (not_positive(self.transition), "transition must be positive"),
        )
        return found + cable_friction_faults(self.friction, len(self.kinds), self.closed) + self.route_faults()


class CablePull(NamedTuple):
    """An elastic cable at one instant.

    Attributes:
        path: its way; rate: of its length [m/s].
        on_places, on_turns: derivatives (n, 3) of the length by places and turns of the frames.
        elastic: () tension without that of the damping; tension: () with it, the mean along the cable [N].
        tensions: (m,) of the spans; None without friction, where they are equal.
    """

    path: CablePath
    rate: Array
    on_places: Float[Array, "n 3"]
    on_turns: Float[Array, "n 3"]
    elastic: Array
    tension: Array
    tensions: Array | None

    @property
    def each_tension(self) -> Array:
        """Tensions (m,) of the spans."""
        if self.tensions is None:
            return jnp.broadcast_to(self.tension, self.path.spans.shape)
        return self.tensions

    def wrench(self, layout: PathLayout) -> tuple[Array, Array]:
        """Forces [N] and moments [N m] (n, 3) on the frames, in world axes, each about its frame's origin."""
        force, moment, path = self.on_places * -self.tension, self.on_turns * -self.tension, self.path
        if self.tensions is not None:
            more = self.tensions - self.tension
            pull = path.directions * more
            if (past := path.bypass) is not None:
                pull = pull * layout.at_spans(past.wheel, 1.0)
                both = gather_static(more, layout.before_free_wheels) + gather_static(more, layout.free_wheels)
                straight = past.directions * (past.direct * both / 2)
                force = force - constant_product(layout.beside_free_wheels, straight.rows)
            first, second = (element.place for element in path.elements)
            force = force - constant_product(layout.reaches - layout.begins, pull.rows)
            on_first, on_second = cross(path.start - first, pull), cross(path.end - second, pull)
            moment = moment + constant_product(layout.begins, on_first.rows)
            moment = moment - constant_product(layout.reaches, on_second.rows)
        return force, moment


class _PaidOut(Constant):
    """The free length off a drum at this instant, with its rate."""

    rate: Array


def _bend_at_points(layout, directions):
    """Angles (n,) by which the cable changes direction at points between its ends, zero at circles and ends."""
    before, after = layout.of_inner(directions, directions)
    points = layout.inner(layout.elements("point")) > 0
    sine, cosine = norm(cross(before, after)), dot(before, after)
    return layout.from_inner(jnp.arctan2(jnp.where(points, sine, 0.0), jnp.where(points, cosine, 1.0)))
