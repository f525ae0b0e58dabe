"""Cross section of a geometrically exact beam: stiffness, mass and inertia per length."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, faults_if, negative, not_positive
from ..math._spd import spd_solve
from ..tables import fields_repr
from ..typing import ArrayLike, Convertible, Scalar, ScalarLike
from ._fields import number, optional_number

#: Slope along the line of the wrench (force, moment) in its own section: the moment falls by `x_axis x force`.
_MOMENT_OF_FORCE = np.zeros((6, 6))
_MOMENT_OF_FORCE[4, 2], _MOMENT_OF_FORCE[5, 1] = 1.0, -1.0


class BeamSection(eqx.Module):
    """Cross section of a beam, x along its line, at the axis of its centres of mass.

    Attributes:
        stiffness: EA, GA along y and z [N], GJ, EI about y and z [N m^2]: (6,), of which some may be infinite (the
            shears, for a beam of Euler and Bernoulli), or a symmetric (6, 6) that couples them.
        mass: per length [kg/m].
        inertia: (3,) per length about x, y, z [kg m]; positive, as each section turns by itself.
        damping: time constant of the material, stress over strain rate divided by the stiffness [s], or None.
    """

    stiffness: Convertible[Float[Array, "..."]] = eqx.field(converter=number)
    mass: Convertible[Float[Array, ""]] = eqx.field(converter=number)
    inertia: Convertible[Float[Array, " 3"]] = eqx.field(converter=number)
    damping: Convertible[Float[Array, ""] | None] = eqx.field(converter=optional_number, default=None)

    __repr__ = fields_repr

    @classmethod
    def of_material(
        cls,
        young: ScalarLike,
        shear_modulus: ScalarLike,
        density: ScalarLike,
        area: ScalarLike,
        inertia_y: ScalarLike,
        inertia_z: ScalarLike,
        torsion: ScalarLike | None = None,
        shear: ArrayLike | None = (5 / 6, 5 / 6),
        damping: ScalarLike | None = None,
    ) -> "BeamSection":
        """A section of one material.

        Args:
            young, shear_modulus: [Pa]; density [kg/m^3]; area [m^2].
            inertia_y, inertia_z: second moments about y and z [m^4].
            torsion: torsion constant [m^4] (default: the polar second moment).
            shear: (2,) shear factors of the forces along y and z, or None: rigid in shear.
            damping: time constant [s].
        """
        polar = number(inertia_y) + number(inertia_z)
        shears = np.array([np.inf, np.inf]) if shear is None else number(shear) * shear_modulus * area
        rest = [young * number(area), *shears]
        rest += [
            shear_modulus * (polar if torsion is None else number(torsion)),
            young * inertia_y,
            young * inertia_z,
        ]
        inertia = density * jnp.stack([polar, number(inertia_y), number(inertia_z)])
        return cls(jnp.stack([number(x) for x in rest]), density * number(area), inertia, damping)

    @property
    def flexibility(self) -> Float[Array, "6 6"]:
        """Strains (6, 6) of unit forces and moments in the section [1/N, 1/(N m^2)]."""
        if self.stiffness.ndim == 1:
            return jnp.diag(1.0 / self.stiffness)
        return spd_solve((self.stiffness + self.stiffness.T) / 2, jnp.eye(6, dtype=self.stiffness.dtype))

    def element_stiffness(self, length: Scalar) -> Float[Array, "6 6"]:
        """Stiffness (6, 6) of a piece of a length [m] on the screw between its ends.

        The inverse of its flexibility `l C + l^3/12 N^T C N` under a wrench in its middle, whose moment changes along
        it by the force, N: exact for loads at the ends, so that bending does not lock.
        Source: MacNeal, Comput. Struct. 8 (1978) 175-183, residual bending flexibility.
        """
        C = self.flexibility
        N = jnp.asarray(_MOMENT_OF_FORCE, C.dtype)
        return spd_solve(length * C + length**3 / 12 * N.T @ C @ N, jnp.eye(6, dtype=C.dtype))

    def faults(self) -> list[str]:
        """Shapes and signs."""
        if self.stiffness.shape not in ((6,), (6, 6)) or self.mass.shape != () or self.inertia.shape != (3,):
            return ["stiffness must be (6,) or (6, 6), mass one number and inertia (3,)"]
        return faults_if(
            (any_concrete(_not_stiff, self.stiffness), "stiffness must be symmetric and positive definite"),
            (not_positive(self.mass), "mass must be positive [kg/m]"),
            (not_positive(self.inertia), "inertia must be positive [kg m]"),
            (
                any_concrete(lambda *x: ~np.all(np.isfinite(np.hstack(x))), self.mass, self.inertia),
                "it is not finite",
            ),
            (self.damping is not None and negative(self.damping), "damping must not be negative [s]"),
        )


def _not_stiff(stiffness):
    if stiffness.ndim == 1:
        return not np.all(stiffness > 0) or not np.all(np.isfinite(stiffness[3:]))
    if not np.all(np.isfinite(stiffness)) or np.abs(stiffness - stiffness.T).max() > 1e-6 * np.abs(stiffness).max():
        return True
    return bool(np.linalg.eigvalsh(stiffness)[0] <= 0.0)
