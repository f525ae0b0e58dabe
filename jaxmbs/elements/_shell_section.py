"""`ShellSection`: stiffness and mass of a shell per length and per area, of one material or of layers."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..errors import ModelError
from ..tables import fields_repr
from ..typing import Convertible, ScalarLike
from ._base import as_optional_real, as_real
from ._shared_matrices import plane_stress


class ShellSection(eqx.Module):
    """Resultants of a shell: `N = A e + B k`, `M = B e + D k`, `Q = S g`.

    Strains e (xx, yy, xy) are those of the surface of the nodes, k its curvatures, g the transverse shear angles;
    N [N/m], M [N], Q [N/m] act per length.

    Attributes:
        membrane: A (3, 3) [N/m]; bending: D (3, 3) [N m]; shear: S (2, 2) [N/m].
        coupling: B (3, 3) [N], or None where membrane and bending are uncoupled.
        area_mass: [kg/m^2]; turning_mass: `int rho z^2 dz` [kg].

    Source: Jones, Mechanics of composite materials (1999), 4.2.
    """

    membrane: Convertible[Float[Array, "... 3 3"]] = eqx.field(converter=as_real)
    bending: Convertible[Float[Array, "... 3 3"]] = eqx.field(converter=as_real)
    shear: Convertible[Float[Array, "... 2 2"]] = eqx.field(converter=as_real)
    coupling: Convertible[Float[Array, "... 3 3"] | None] = eqx.field(converter=as_optional_real, default=None)
    area_mass: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.0)
    turning_mass: Convertible[Float[Array, "..."]] = eqx.field(converter=as_real, default=0.0)

    __repr__ = fields_repr

    def __check_init__(self):
        shapes = {"membrane": (3, 3), "bending": (3, 3), "shear": (2, 2), "coupling": (3, 3)}
        lead = jnp.shape(self.membrane)[:-2]
        faults = [
            f"{name} of shape {jnp.shape(value)} must be (..., {size[0]}, {size[1]})"
            for name, size in shapes.items()
            if (value := getattr(self, name)) is not None and jnp.shape(value) != (*lead, *size)
        ]
        faults += [
            f"{name} of shape {jnp.shape(value)} must be one number for each section {lead}"
            for name in ("area_mass", "turning_mass")
            if jnp.shape(value := getattr(self, name)) not in ((), lead)
        ]
        if faults:
            raise ModelError(faults, "the section of a shell")

    @staticmethod
    def isotropic(
        young: ScalarLike,
        poisson: ScalarLike,
        thickness: ScalarLike,
        density: ScalarLike = 0.0,
        shear_factor: ScalarLike = 5 / 6,
    ) -> "ShellSection":
        """Of one isotropic material."""
        young, poisson, t = as_real(young), as_real(poisson), as_real(thickness)
        E, area_mass = plane_stress(young, poisson), t * density
        S = shear_factor * t * young / (2.0 * (1.0 + poisson)) * jnp.eye(2, dtype=E.dtype)
        return ShellSection(t * E, t**3 / 12 * E, S, None, area_mass, area_mass * t**2 / 12)

    def rotate(self, angle: ScalarLike) -> "ShellSection":
        """The same section in axes from which its own are turned by `angle` [rad] about the normal."""
        R, c = strain_rotation(angle), rotation(angle)
        turn = lambda C: R.T @ C @ R
        coupling = None if self.coupling is None else turn(self.coupling)
        return ShellSection(
            turn(self.membrane),
            turn(self.bending),
            c.T @ self.shear @ c,
            coupling,
            self.area_mass,
            self.turning_mass,
        )

    def shift(self, offset: ScalarLike) -> "ShellSection":
        """The same section at a height `offset` [m] over the surface of the nodes, along the normal.

        Source: Jones, Mechanics of composite materials (1999), 4.2: strains there are `e + offset k`.
        """
        A, D, z = self.membrane, self.bending, as_real(offset)
        B = 0.0 * A if self.coupling is None else self.coupling
        turning = self.turning_mass + z**2 * self.area_mass
        return ShellSection(A, D + 2.0 * z * B + z**2 * A, self.shear, B + z * A, self.area_mass, turning)


def rotation(angle: ScalarLike) -> Array:
    """Matrix (2, 2) of the components of a vector in axes turned by `angle` [rad]."""
    c, s = jnp.cos(as_real(angle)), jnp.sin(as_real(angle))
    return jnp.stack([jnp.stack([c, s]), jnp.stack([-s, c])])


def strain_rotation(angle: ScalarLike) -> Array:
    """Matrix (3, 3) of strains xx, yy and the shear angle xy in axes turned by `angle` [rad].

    Source: Jones, Mechanics of composite materials (1999), 2.6.
    """
    c, s = jnp.cos(as_real(angle)), jnp.sin(as_real(angle))
    rows = [[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2.0 * c * s, 2.0 * c * s, c * c - s * s]]
    return jnp.stack([jnp.stack(row) for row in rows])


def squared_contraction(A: Array) -> Array:
    """Poisson's ratio squared of a membrane matrix A, `A12^2 / A11 A22`, zero where there is no membrane."""
    product = A[0, 0] * A[1, 1]
    return jnp.where(product > 0, A[0, 1] ** 2, 0.0) / jnp.where(product > 0, product, np.ones((), A.dtype))


def require_section(layup: Any) -> None:
    """Raises: TypeError for what is no section of a shell."""
    if not isinstance(layup, ShellSection):
        raise TypeError(f"layup is a ShellSection, as `Laminate(...).section()` gives, not {layup!r}")
