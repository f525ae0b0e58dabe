"""Straight beam in space, Euler-Bernoulli or Timoshenko, with end offsets and releases."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import is_concrete, repeated
from ..math._spd import spd_solve
from ..typing import Convertible
from ._base import DIRECTIONS, AbstractElement, as_optional_real, as_real
from ._shared_matrices import axes_along, axes_transformation, gauss_points, rigid_arm

# Bending in one plane, coordinates v1, slope1 l, v2, slope2 l: what does not depend on the shear ratio p, and what
# multiplies it.  The deflection is (DEFLECTION[0] + p DEFLECTION[1]) / (1 + p) at the points of quadrature.
_BENDING = np.array([[12.0, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
_BENDING_SHEAR = np.array([[0.0, 0, 0, 0], [0, 1, 0, -1], [0, 0, 0, 0], [0, -1, 0, 1]])
_POINTS, _WEIGHTS = gauss_points(4, 1)
_S, _W = (_POINTS[:, 0] + 1) / 2, _WEIGHTS / 2
_DEFLECTION = (
    np.stack([1 - 3 * _S**2 + 2 * _S**3, _S - 2 * _S**2 + _S**3, 3 * _S**2 - 2 * _S**3, _S**3 - _S**2], axis=1),
    np.stack([1 - _S, (_S - _S**2) / 2, _S, (_S**2 - _S) / 2], axis=1),
)
_SLOPE = (
    np.stack([6 * (_S**2 - _S), 1 - 4 * _S + 3 * _S**2, 6 * (_S - _S**2), 3 * _S**2 - 2 * _S], axis=1),
    np.stack([0 * _S, 1 - _S, 0 * _S, _S], axis=1),
)
# First and second derivatives of the deflection by the place in [0, 1]
_TILT = (
    np.stack([6 * (_S**2 - _S), 1 - 4 * _S + 3 * _S**2, 6 * (_S - _S**2), 3 * _S**2 - 2 * _S], axis=1),
    np.stack([0 * _S - 1, (1 - 2 * _S) / 2, 0 * _S + 1, (2 * _S - 1) / 2], axis=1),
)
_BEND = (
    np.stack([12 * _S - 6, 6 * _S - 4, 6 - 12 * _S, 6 * _S - 2], axis=1),
    np.stack([0 * _S, 0 * _S - 1, 0 * _S, 0 * _S + 1], axis=1),
)
_PLANE_Y, _PLANE_Z = np.array([1, 5, 7, 11]), np.array([2, 4, 8, 10])  # rz = dv/dx, ry = -dw/dx
_SIGN_Z = np.array([1.0, -1.0, 1.0, -1.0])


class Beam(AbstractElement):
    """Two-node beam: exact static stiffness, consistent mass of the same shapes.

    Local axes: x from the first node to the second, y towards `reference`, z by the right hand.  Forces: those on the
    beam at its ends [N], then moments [N m], of the first end, then of the second, positive along local axes: in
    tension Fx2 is positive, Fx1 negative.  Stresses [Pa]: tension positive.

    With `shear` it is Timoshenko's beam with spins inertia, without it Euler-Bernoulli's with neither.
    Source: Przemieniecki, Theory of matrix structural analysis (1968), 5.6; Friedman and Kosmatka, Comput. Struct. 47
    (1993) 473-481 for the mass.

    Attributes:
        young, shear_modulus: [Pa]; area [m^2]; density [kg/m^3].
        inertia_z: second moment for bending in the local x-y plane, inertia_y: in the x-z plane [m^4].
        torsion: torsion constant [m^4].
        shear: (2,) shear factors of the forces along y and z (5/6 for a rectangle), or None.
        reference: (3,) vector in the local x-y plane, world axes; None, for sections alike in y and z: any.
        offsets: (2, 3) from the nodes to the beam's ends, world axes [m], or None.
        releases: names of end coordinates that carry no force: "rz1", "ry2", "x1", ...
        fibres: (p, 2) points y, z of the section whose stress is asked [m].
        line_mass: mass that is no part of the section, on its axis [kg/m].
        fibre_shears: (p, 2, 3) shear stresses xy and xz of each fibre by the shear forces Qy, Qz [1/m^2] and the
            torque [1/m^3] of the section, or None: stresses then have no shear.  Of a round section of second polar
            moment J, torque makes `(-z, y) / J`.
    """

    young: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    shear_modulus: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    area: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    inertia_y: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    inertia_z: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    torsion: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real)
    density: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.0)
    shear: Convertible[Float[Array, "... 2"] | None] = eqx.field(converter=as_optional_real, default=None)
    reference: Convertible[Float[Array, "... 3"] | None] = eqx.field(converter=as_optional_real, default=None)
    offsets: Convertible[Float[Array, "... 2 3"] | None] = eqx.field(converter=as_optional_real, default=None)
    releases: tuple[str, ...] = eqx.field(static=True, default=())
    fibres: Convertible[Float[Array, "... p 2"]] = eqx.field(converter=as_real, default=((0.0, 0.0),))
    line_mass: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.0)
    fibre_shears: Convertible[Float[Array, "... p 2 3"] | None] = eqx.field(converter=as_optional_real, default=None)

    num_nodes = 2
    has_ends = True
    force_labels = tuple(f"{name}{end}" for end in (1, 2) for name in ("Fx", "Fy", "Fz", "Mx", "My", "Mz"))
    stress_labels = ("axial stress of each fibre at end 1, then at end 2; then shears xy, then xz",)
    nonnegative_fields = ("young", "shear_modulus", "area", "inertia_y", "inertia_z", "torsion", "density", "shear")
    nonnegative_fields += ("line_mass",)

    def __check_init__(self):
        if not isinstance(self.releases, tuple | list):
            raise TypeError(f"releases are names in a tuple, ('rz1',), not {self.releases!r}")
        if self.offsets is not None and self.offsets.shape[-2:] != (2, 3):
            raise ValueError(f"offsets have the shape (2, 3), not {self.offsets.shape}")
        possible = {f"{d}{end}" for end in (1, 2) for d in DIRECTIONS}
        wrong = [name for name in self.releases if name not in possible]
        if wrong:
            raise ValueError(f"releases {wrong} are not among {sorted(possible)}")
        if twice := repeated(self.releases):
            raise ValueError(f"releases {list(twice)} are given twice")
        for d in ("x", "y", "z", "rx"):
            if {f"{d}1", f"{d}2"} <= set(self.releases):
                raise ValueError(f"a beam released in {d} at both ends is a mechanism: release one end")

    @property
    def positive_fields(self) -> tuple[str, ...]:  # type: ignore[override]
        """Fields that must not be zero: those without which it has no stiffness, or by which it divides."""
        return ("young", "area", *(() if self.shear is None else ("shear", "shear_modulus")))

    def faults(self) -> list[str]:
        """Messages also for a section that differs in y and z without a reference that orients it."""
        pairs = [(self.inertia_y, self.inertia_z)] + ([] if self.shear is None else [tuple(self.shear.T)])
        uneven = any(is_concrete(y, z) and not np.allclose(y, z, rtol=1e-6, atol=0) for y, z in pairs)
        p = self.fibres.shape[-2]
        if self.fibre_shears is not None and self.fibre_shears.shape[-3:] != (p, 2, 3):
            return [f"fibre_shears must be ({p}, 2, 3), as there are {p} fibres"]
        if self.reference is None and uneven:
            return [*super().faults(), "its section differs in y and z: give a reference vector that orients it"]
        return super().faults()

    def _axes(self, nodes):
        """Length, axes (3, 3), and (12, 12) end motions in local axes from those of the nodes."""
        offsets = jnp.zeros_like(nodes) if self.offsets is None else self.offsets
        line = nodes[1] + offsets[1] - nodes[0] - offsets[0]
        axes = axes_along(line, self.reference)
        R = axes_transformation(axes)
        T = jax.scipy.linalg.block_diag(R @ rigid_arm(offsets[0]), R @ rigid_arm(offsets[1]))
        return jnp.linalg.norm(line), axes, T

    def _planes(self, length):
        """Bending stiffness E I and shear ratio `12 E I / (k G A l^2)` of the x-y and the x-z plane."""
        EI = (self.young * self.inertia_z, self.young * self.inertia_y)
        if self.shear is None:
            return [(e, jnp.zeros_like(length)) for e in EI]
        GA = self.shear_modulus * self.area * length**2
        return [(e, 12.0 * e / (self.shear[i] * GA)) for i, e in enumerate(EI)]

    def _local_stiffness(self, length):
        bar = np.array([[1.0, -1.0], [-1.0, 1.0]])
        K = jnp.zeros((12, 12), length.dtype)
        K = _add_block(K, [0, 6], self.young * self.area / length * jnp.asarray(bar, K.dtype))
        K = _add_block(K, [3, 9], self.shear_modulus * self.torsion / length * jnp.asarray(bar, K.dtype))
        for (EI, ratio), plane, sign in zip(self._planes(length), (_PLANE_Y, _PLANE_Z), (1.0, _SIGN_Z), strict=True):
            scale = _rotation_scale(length, sign) / length
            shape = jnp.asarray(_BENDING, K.dtype) + ratio * jnp.asarray(_BENDING_SHEAR, K.dtype)
            K = _add_block(K, plane, EI / (length * (1.0 + ratio)) * jnp.outer(scale, scale) * shape)
        return K

    def _local_mass(self, length):
        bar = np.array([[1 / 3, 1 / 6], [1 / 6, 1 / 3]])
        line, mass = self.density * length, (self.density * self.area + self.line_mass) * length
        M = jnp.zeros((12, 12), length.dtype)
        M = _add_block(M, [0, 6], mass * jnp.asarray(bar, M.dtype))
        M = _add_block(M, [3, 9], line * (self.inertia_y + self.inertia_z) * jnp.asarray(bar, M.dtype))
        inertias = (self.inertia_z, self.inertia_y)
        for i, (plane, sign) in enumerate(((_PLANE_Y, 1.0), (_PLANE_Z, _SIGN_Z))):
            ratio, scale = self._planes(length)[i][1], _rotation_scale(length, sign)
            M = _add_block(M, plane, mass * jnp.outer(scale, scale) * _shape_products(_DEFLECTION, ratio))
            if self.shear is not None:
                scale = scale / length
                M = _add_block(
                    M, plane, line * inertias[i] * jnp.outer(scale, scale) * _shape_products(_SLOPE, ratio)
                )
        return M

    def _released(self, K):
        """End motions (12, 12) of the beam from those of its end frames, released ones condensed.  Source: S1 (6)."""
        free = [
            i for i, name in enumerate(f"{d}{end}" for end in (1, 2) for d in DIRECTIONS) if name in self.releases
        ]
        T = jnp.eye(12, dtype=K.dtype)
        if not free:
            return T
        held = [i for i in range(12) if i not in free]
        follow = -spd_solve(K[np.ix_(free, free)], K[np.ix_(free, held)])
        return T.at[np.array(free), np.array(free)].set(0.0).at[np.ix_(free, held)].set(follow)

    def _matrices(self, nodes):
        """Length, axes, local stiffness, and local end motions (12, 12) of the beam from those of the nodes."""
        length, axes, T = self._axes(nodes)
        K = self._local_stiffness(length)
        return length, axes, K, self._released(K) @ T

    def stiffness(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Stiffness `T^T k_e T`, exact for loads at the nodes."""
        _, _, K, T = self._matrices(nodes)
        return T.T @ K @ T

    def mass(self, nodes: Float[Array, "k 3"]) -> Float[Array, "n n"]:
        """Consistent mass `T^T m_e T`."""
        length, _, _, T = self._matrices(nodes)
        return T.T @ self._local_mass(length) @ T

    def forces(
        self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"], load: Array | None = None
    ) -> Float[Array, " f"]:
        """Forces and moments (12,) on the beam at its two ends, local axes. Source: S1 (30).

        Args: load: (12,) of loads distributed over the beam (`line_load`, weight), which the ends carry too.
        """
        _, axes, K, T = self._matrices(nodes)
        found = K @ T @ u.reshape(-1)
        if load is None:
            return found
        arms = jnp.zeros_like(nodes) if self.offsets is None else self.offsets
        ends = [
            axes_transformation(axes) @ rigid_arm(-arm).T @ part
            for arm, part in zip(arms, load.reshape(2, 6), strict=True)
        ]
        return found - jnp.concatenate(ends)

    def stresses(
        self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"], load: Array | None = None
    ) -> Float[Array, " s"]:
        """Axial stress (2 p,) of the fibres at both ends, `N/A - M_z y/I_z + M_y z/I_y`; with `fibre_shears` then the
        shears xy, and xz (6 p in all).  Source: S1 (30)."""
        return self.stresses_of_ends(self.forces(nodes, u, load))

    def stresses_of_ends(self, forces: Float[Array, " f"]) -> Float[Array, " s"]:
        """Stresses as `stresses` from the forces and moments (12,) on the two ends, local axes."""
        y, z = self.fibres[:, 0], self.fibres[:, 1]
        sections = (-forces[:6], forces[6:])  # N, Qy, Qz, T, My, Mz at end 1, at end 2
        axial = [N / self.area - Mz * y / self.inertia_z + My * z / self.inertia_y for N, *_, My, Mz in sections]
        if self.fibre_shears is None:
            return jnp.concatenate(axial)
        shears = [self.fibre_shears @ section[1:4] for section in sections]
        return jnp.concatenate([*axial, *(one[:, k] for k in (0, 1) for one in shears)])

    def stress_tensors(self, stresses: Array) -> Float[Array, "... points 6"]:
        """Tensors of the fibres at end 1, then at end 2: uniaxial without `fibre_shears`."""
        columns, places = (1, np.array([0])) if self.fibre_shears is None else (3, np.array([0, 3, 5]))
        parts = jnp.moveaxis(stresses.reshape(*stresses.shape[:-1], columns, -1), -2, -1)
        return jnp.zeros((*parts.shape[:-1], 6), stresses.dtype).at[..., places].set(parts)

    def geometric_stiffness(self, nodes: Float[Array, "k 3"], u: Float[Array, "k c"]) -> Float[Array, "n n"]:
        """Of tension N, torque T, shear forces and moments: lateral, torsional and coupled buckling.

        The work of the section's stress on the strains of second order is `1/2 N (v'^2 + w'^2 + i^2 phi'^2)
        - phi' (M_y v' + M_z w') + phi (Q_y w' - Q_z v') + 1/2 T (w' v'' - v' w'')` per length, with
        `i^2 = (I_y + I_z) / A`, for sections with two axes of symmetry.
        Source: Yang and McGuire, J. Struct. Eng. 112 (1986) 853-877, without the terms of axial strain.
        """
        length, _, K, T = self._matrices(nodes)
        tension, Qy, Qz, torque, My, Mz = (K @ T @ u.reshape(-1))[6:]
        turn, turn_rate, v, w, v2, w2 = self._shape_rows(length)
        from_end = (1.0 - jnp.asarray(_S, length.dtype)) * length
        one = jnp.ones_like(from_end)

        def work(a, b, factor):
            part = jnp.einsum("q,qi,qj->ij", jnp.asarray(_W, length.dtype) * length * factor, a, b)
            return 0.5 * (part + part.T)

        Kg = tension * (work(v, v, one) + work(w, w, one))
        Kg = Kg + tension * (self.inertia_y + self.inertia_z) / self.area * work(turn_rate, turn_rate, one)
        Kg = Kg - 2.0 * (work(turn_rate, v, My - Qz * from_end) + work(turn_rate, w, Mz + Qy * from_end))
        Kg = Kg + 2.0 * (Qy * work(turn, w, one) - Qz * work(turn, v, one))
        return T.T @ (Kg + torque * (work(w, v2, one) - work(v, w2, one))) @ T

    def _shape_rows(self, length):
        """Rows (q, 12) of phi, phi', v', w', v'', w'' from the motions of the ends in local axes."""
        s, zero = jnp.asarray(_S, length.dtype), jnp.zeros((len(_S), 12), length.dtype)
        turn = zero.at[:, np.array([3, 9])].set(jnp.stack([1 - s, s], axis=1))
        rate = zero.at[:, np.array([3, 9])].set(jnp.asarray([[-1.0, 1.0]], length.dtype) / length)
        planes, rows = [(_PLANE_Y, 1.0), (_PLANE_Z, _SIGN_Z)], [turn, rate]
        for (a, b), power in ((_TILT, 1), (_BEND, 2)):
            for (_, ratio), (plane, sign) in zip(self._planes(length), planes, strict=True):
                shape = (jnp.asarray(a, s.dtype) + ratio * jnp.asarray(b, s.dtype)) / (1.0 + ratio)
                rows.append(zero.at[:, plane].set(shape * _rotation_scale(length, sign)[None] / length**power))
        return rows

    def line_load(self, nodes: Float[Array, "k 3"], q: Array) -> Array:
        """Consistent load (12,) of a uniform force q (3,) [N/m] in world axes. Source: S1 (18)."""
        length, axes, _, T = self._matrices(nodes)
        x, y, z = axes @ q * length
        f = jnp.zeros(12, nodes.dtype).at[np.array([0, 6])].set(x / 2)
        share = jnp.asarray([1 / 2, 1 / 12, 1 / 2, -1 / 12], nodes.dtype)
        f = (
            f.at[_PLANE_Y]
            .set(y * share * _rotation_scale(length, 1.0))
            .at[_PLANE_Z]
            .set(z * share * _rotation_scale(length, _SIGN_Z))
        )
        return T.T @ f

    def span(self, nodes: Float[Array, "k 3"]) -> tuple[Any, Array]:
        """Length [m] and axes (3, 3), rows x y z, of the beam between the ends of its offsets."""
        length, axes, _ = self._axes(nodes)
        return length, axes

    def span_load(self, nodes: Float[Array, "k 3"], at: Array, forces: Array, moments: Array) -> Array:
        """Consistent load (12,) of forces (q, 3) [N] and moments (q, 3) [N m] in world axes.

        They act at shares `at` (q,) of the length.  Deflections and rotations of the ends are exact.
        Source: Przemieniecki (1968), 5.
        """
        length, axes, _, T = self._matrices(nodes)
        (x, y, z), (turn, about_y, about_z) = (axes @ forces.T), (axes @ moments.T)
        f = jnp.zeros(12, nodes.dtype)
        for places, along in ((np.array([0, 6]), x), (np.array([3, 9]), turn)):
            f = f.at[places].set(jnp.stack([jnp.sum((1.0 - at) * along), jnp.sum(at * along)]))
        planes = (_PLANE_Y, 1.0, y, about_z), (_PLANE_Z, _SIGN_Z, z, -about_y)
        for (_, ratio), (plane, sign, across, bend) in zip(self._planes(length), planes, strict=True):
            deflection, rotation = _shapes_at(at, ratio)
            work = across @ deflection + bend @ rotation / length
            f = f.at[plane].set(work * _rotation_scale(length, sign))
        return T.T @ f

    degeneracy = "its ends meet, or its reference lies along it"

    def is_degenerate(self, nodes: np.ndarray) -> np.ndarray:
        """Flags of beams without length, or without a plane for the local axes."""
        line = nodes[:, 1] - nodes[:, 0]
        if self.offsets is not None and is_concrete(self.offsets):
            offsets = np.asarray(self.offsets)
            line = line + offsets[..., 1, :] - offsets[..., 0, :]
        length = np.linalg.norm(line, axis=1)
        if self.reference is None or not is_concrete(self.reference):
            return length == 0
        reference = np.asarray(self.reference)
        size = length * np.linalg.norm(reference, axis=-1)
        return np.linalg.norm(np.cross(line, reference), axis=1) <= 1e-9 * size


def _add_block(matrix, places, part):
    return matrix.at[np.ix_(places, places)].add(part)


def _rotation_scale(length, sign):
    """Scale (4,) of deflections and rotations of a plane: 1, l, 1, l with the signs of the plane."""
    one = jnp.ones_like(length)
    return jnp.stack([one, length, one, length]) * jnp.asarray(np.broadcast_to(sign, 4), length.dtype)


def _shapes_at(s, ratio):
    """Deflections (q, 4) and rotations times the length (q, 4) at places s (q,) in [0, 1]."""
    bubble, zero = (s - s**2) / 2.0, 0.0 * s
    bent = jnp.stack([1.0 - 3.0 * s**2 + 2.0 * s**3, s - 2.0 * s**2 + s**3, 3.0 * s**2 - 2.0 * s**3, s**3 - s**2], 1)
    sheared = jnp.stack([1.0 - s, bubble, s, -bubble], 1)
    turned = jnp.stack([6.0 * (s**2 - s), 1.0 - 4.0 * s + 3.0 * s**2, 6.0 * (s - s**2), 3.0 * s**2 - 2.0 * s], 1)
    held = jnp.stack([zero, 1.0 - s, zero, s], 1)
    return (bent + ratio * sheared) / (1.0 + ratio), (turned + ratio * held) / (1.0 + ratio)


def _shape_products(shapes, ratio):
    """Integrals (4, 4) over [0, 1] of products of shapes `(a + p b) / (1 + p)`."""
    a, b = shapes
    parts = [np.einsum("q,qi,qj->ij", _W, *pair) for pair in ((a, a), (a, b), (b, b))]
    aa, ab, bb = (jnp.asarray(part, ratio.dtype) for part in (parts[0], parts[1] + parts[1].T, parts[2]))
    return (aa + ratio * ab + ratio**2 * bb) / (1.0 + ratio) ** 2
