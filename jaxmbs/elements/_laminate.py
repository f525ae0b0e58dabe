"""`Laminate`: layers of a shell by classical theory, their stresses and reserve factors."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, not_positive
from ..errors import ModelError
from ..tables import fields_repr
from ..typing import ArrayLike, Convertible, ScalarLike
from ._base import as_optional_real, as_real
from ._shell_section import ShellSection, rotation, strain_rotation


class Laminate(eqx.Module):
    """Plies from the face -z to the face +z.

    Attributes:
        thickness: (plies,) [m]; angle: (plies,) from the x axis of the laminate to the fibres [rad].
        moduli: (plies, 3, 3) plane stress elasticity in the axes of each ply [Pa], see `orthotropic`.
        shear: (plies, 2, 2) moduli of the transverse shear angles 1z, 2z [Pa].
        density: (plies,) [kg/m^3].
        bottom: z of the face -z [m]; by default half of the thickness below the surface of the nodes.
        area_mass: of what is not structure [kg/m^2].
    """

    thickness: Convertible[Float[Array, " plies"]] = eqx.field(converter=as_real)
    angle: Convertible[Float[Array, " plies"]] = eqx.field(converter=as_real)
    moduli: Convertible[Float[Array, "plies 3 3"]] = eqx.field(converter=as_real)
    shear: Convertible[Float[Array, "plies 2 2"]] = eqx.field(converter=as_real)
    density: Convertible[Float[Array, " plies"]] = eqx.field(converter=as_real)
    bottom: Convertible[Float[Array, ""] | None] = eqx.field(converter=as_optional_real, default=None)
    area_mass: Convertible[Float[Array, ""]] = eqx.field(converter=as_real, default=0.0)

    __repr__ = fields_repr

    def __check_init__(self):
        plies = jnp.shape(self.thickness)[:1]
        shapes = {"thickness": plies, "angle": plies, "moduli": (*plies, 3, 3), "shear": (*plies, 2, 2)}
        shapes |= {"density": plies, "bottom": (), "area_mass": ()}
        given = {name: value for name in shapes if (value := getattr(self, name)) is not None}
        faults = [
            f"{name} of shape {jnp.shape(value)} must be {shapes[name]}, for {plies} plies"
            for name, value in given.items()
            if jnp.shape(value) != shapes[name]
        ]
        if faults or not plies:
            raise ModelError(faults or ["thickness is a list, a number for each ply"], "the laminate")

    @property
    def heights(self) -> Float[Array, " faces"]:
        """z of the faces of all plies (plies + 1,) [m]."""
        above = jnp.concatenate([jnp.zeros(1, self.thickness.dtype), jnp.cumsum(self.thickness)])
        return above - above[-1] / 2 if self.bottom is None else above + self.bottom

    def turned_moduli(self) -> Float[Array, "plies 3 3"]:
        """Elasticity of the plies in the axes of the laminate.  Source: Jones (1999), 2.6."""
        R = jnp.stack([strain_rotation(angle) for angle in self.angle])
        return jnp.swapaxes(R, 1, 2) @ self.moduli @ R

    def section(self) -> ShellSection:
        """A, B, D and the transverse shear of the laminate.

        Source: Jones, Mechanics of composite materials (1999), 4.2.
        """
        z, Q = self.heights, self.turned_moduli()
        power = lambda n: (z[1:] ** n - z[:-1] ** n) / n
        A, B, D = (jnp.einsum("p,pab->ab", power(n), Q) for n in (1, 2, 3))
        mass = jnp.sum(self.density * power(1)) + self.area_mass
        return ShellSection(A, D, self._transverse_shear(Q), B, mass, jnp.sum(self.density * power(3)))

    def _transverse_shear(self, Q):
        """Stiffness (2, 2) of the shear flow that cylindrical bending about each axis leaves.

        The flow `g(z) = int E (z - n) dz / D` of a unit shear force does the work `int g^2 / G dz / 2`, n the height
        of the neutral surface, E the modulus of each ply along the axis.
        Source: Whitney, J. Appl. Mech. 40 (1973) 302-304.
        """
        z, t = self.heights, self.thickness
        R = jnp.stack([rotation(angle) for angle in self.angle])
        G = jnp.swapaxes(R, 1, 2) @ self.shear @ R
        stiffness = []
        points, weights = np.polynomial.legendre.leggauss(3)  # g^2 is of the fourth degree
        for d in range(2):
            E = Q[:, d, d]
            middle = (z[1:] + z[:-1]) / 2
            neutral = jnp.sum(E * t * middle) / jnp.sum(E * t)
            D = jnp.sum(E * ((z[1:] - neutral) ** 3 - (z[:-1] - neutral) ** 3)) / 3
            flow = jnp.cumsum(E * t * (middle - neutral)) - E * t * (
                middle - neutral
            )  # at the lower face of each ply
            at = z[:-1, None] + t[:, None] * (1.0 + points[None]) / 2
            within = E[:, None] * ((at - neutral) ** 2 - (z[:-1, None] - neutral) ** 2) / 2
            g = (flow[:, None] + within) / D
            stiffness.append(1.0 / jnp.sum(g**2 * weights[None] / 2 * t[:, None] / G[:, d, d][:, None]))
        return jnp.diag(jnp.stack(stiffness))

    def ply_stresses(self, forces: ArrayLike) -> Float[Array, "plies 3 3"]:
        """Stresses 11, 22, 12 [Pa] of all plies at their lower face, middle and upper face, in their own axes.

        Args: forces: (6,) Nxx Nyy Nxy Mxx Myy Mxy per length [N/m, N], in the axes of the laminate.
        Source: Jones, Mechanics of composite materials (1999), 4.2.
        """
        section, z = self.section(), self.heights
        B = jnp.asarray(section.coupling)
        whole = jnp.block([[section.membrane, B], [B, section.bending]])
        strain = jnp.linalg.solve(whole, as_real(forces))
        at = jnp.stack([z[:-1], (z[:-1] + z[1:]) / 2, z[1:]], axis=1)
        local = strain[None, None, :3] + at[:, :, None] * strain[None, None, 3:]
        R = jnp.stack([strain_rotation(angle) for angle in self.angle])
        return jnp.einsum("pab,pbc,pkc->pka", self.moduli, R, local)


def orthotropic(young_1: ArrayLike, young_2: ArrayLike, poisson_12: ArrayLike, shear_12: ArrayLike) -> Array:
    """Plane stress elasticity (3, 3) [Pa] of a ply, in the axes of its fibres.

    Args: young_1, young_2: along and across the fibres [Pa]; poisson_12: contraction across by a stress along them;
    shear_12: modulus [Pa].
    Source: Jones, Mechanics of composite materials (1999), 2.4.
    """
    E1, E2, nu, G = (as_real(value) for value in (young_1, young_2, poisson_12, shear_12))
    E1, zero = E1 + 0.0 * E2, jnp.zeros_like(E1)
    det = 1.0 - nu**2 * E2 / E1
    rows = [[E1 / det, nu * E2 / det, zero], [nu * E2 / det, E2 / det, zero], [zero, zero, G + zero]]
    return jnp.stack([jnp.stack(row) for row in rows])


def tsai_wu_reserve(stresses: ArrayLike, strengths: ArrayLike, interaction: ScalarLike = 0.0) -> Array:
    """Factor by which stresses 11, 22, 12 (..., 3) may grow until the criterion of Tsai and Wu is reached.

    Args: strengths: (5,) Xt, Xc, Yt, Yc, S [Pa], all positive; interaction: F12 [1/Pa^2].
    Source: Tsai and Wu, J. Compos. Mater. 5 (1971) 58-80.
    """
    s, (Xt, Xc, Yt, Yc, S) = _checked(stresses, strengths, interaction)
    one, two, shear = s[..., 0], s[..., 1], s[..., 2]
    linear = (1.0 / Xt - 1.0 / Xc) * one + (1.0 / Yt - 1.0 / Yc) * two
    square = one**2 / (Xt * Xc) + two**2 / (Yt * Yc) + shear**2 / S**2 + 2.0 * interaction * one * two
    return _positive_root(square, linear)


def hill_reserve(stresses: ArrayLike, strengths: ArrayLike) -> Array:
    """Factor by which stresses 11, 22, 12 (..., 3) may grow until the criterion of Hill is reached.

    Args: strengths: (5,) Xt, Xc, Yt, Yc, S [Pa], all positive; tension or compression by the sign of each stress.
    Source: Jones, Mechanics of composite materials (1999), 2.9.
    """
    s, (Xt, Xc, Yt, Yc, S) = _checked(stresses, strengths)
    one, two, shear = s[..., 0], s[..., 1], s[..., 2]
    X, Y = jnp.where(one >= 0, Xt, Xc), jnp.where(two >= 0, Yt, Yc)
    square = one**2 / X**2 - one * two / X**2 + two**2 / Y**2 + shear**2 / S**2
    return _positive_root(square, jnp.zeros_like(square))


def _checked(stresses, strengths, interaction=0.0):
    """Stresses (..., 3) and strengths (5,).  Raises: ModelError."""
    s, limits, shape = as_real(stresses), as_real(strengths), jnp.shape(interaction)
    faults = faults_if(
        (s.ndim < 1 or s.shape[-1] != 3, f"stresses of shape {s.shape} must be (..., 3): 11, 22, 12"),
        (limits.shape != (5,), f"strengths of shape {limits.shape} must be (5,): Xt, Xc, Yt, Yc, S"),
        (not_positive(limits), "strengths must be positive"),
        (shape != () or any_concrete(jnp.isinf, interaction), "the interaction must be one finite number"),
    )
    if faults:
        raise ModelError(faults, "the reserve of a ply")
    return s, limits


def _positive_root(square, linear):
    """Positive root f of `square f^2 + linear f = 1`, infinite without stress."""
    loaded = square > 0
    a = jnp.where(loaded, square, 1.0)
    root = 2.0 / (linear + jnp.sqrt(linear**2 + 4.0 * a))
    return jnp.where(loaded, root, jnp.inf)
