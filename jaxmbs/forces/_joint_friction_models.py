"""Models of friction in joints: the friction of a surface over the load that its joint carries."""

from typing import ClassVar

import equinox as eqx

from ..checks import faults_if, negative, not_positive
from ..typing import Convertible, Scalar
from ._fields import number, value_faults


class AbstractJointFriction(eqx.Module):
    """Interface of the models that `SystemBuilder.friction` takes as `model`.

    `mu`, `static_ratio` and `transition_speed` are given there; a model adds the numbers that it alone has.
    """

    key: ClassVar[str]

    def numbers(self) -> dict[str, Scalar]:
        """The numbers of the model by their names in `model.JointFriction`."""
        return {}

    def faults(self) -> list[str]:
        """Faults of its numbers."""
        return value_faults(self)


class SmoothCoulomb(AbstractJointFriction):
    """Smooth Coulomb friction with a bump of static friction: below the transition speed the surface creeps.

    `mu N tanh(s / transition_speed) (1 + (static_ratio - 1) exp(-(s / (10 transition_speed))^2))`, slip s, load N.
    """

    key: ClassVar[str] = "coulomb"


class BrownMcPhee(AbstractJointFriction):
    """Friction of Brown and McPhee, whose greatest value is at the transition speed.

    `mu N (tanh(4 w) + (static_ratio - 1) w / (w^2/4 + 3/4)^2)`, w = s / transition_speed, of slip s and load N.

    Source: Brown and McPhee 2016.
    """

    key: ClassVar[str] = "brown-mcphee"


class BearingFriction(AbstractJointFriction):
    """Friction of a rolling bearing: a part that follows the load as `SmoothCoulomb`, a viscous part, and its seals.

    Give the bearing's mean radius as the `radius` of the friction; `mu` is then the coefficient of rolling friction,
    0.001 to 0.003.  The moment is `radius (mu N + seal) tanh(s / transition_speed) + radius viscous s`, s = radius
    times the rate.

    Attributes:
        viscous: friction over slip, of the grease >= 0 [N s/m].
        seal: friction of the seals at the radius, without load >= 0 [N].
    """

    viscous: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    seal: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    key: ClassVar[str] = "bearing"

    def numbers(self) -> dict[str, Scalar]:
        """Viscous part and seals."""
        return {"viscous": self.viscous, "seal": self.seal}

    def faults(self) -> list[str]:
        """Every part dissipates."""
        return super().faults() + faults_if(
            (negative(self.viscous), "viscous must not be negative"),
            (negative(self.seal), "seal must not be negative"),
        )


class JointLuGre(AbstractJointFriction):
    """LuGre friction of a joint, its bristles pressed by the joint's own load: sticks, breaks away and slides.

    `dz/dt = v - |v| z sigma0 / g(v)`, `g = mu (1 + (static_ratio - 1) exp(-(v / transition_speed)^2))`, and the
    friction is `N (sigma0 z + sigma1 dz/dt + sigma2 v)` at a load N.  The bend z [m] is an internal state,
    "NAME.bristle", a vector where a surface slips along several directions.  Unlike the smooth models it holds at
    rest.  Stiff: take an implicit solver.  Source: Canudas de Wit, Olsson, Astrom and Lischinsky (1995).

    Attributes:
        sigma0: stiffness of the bristles over the load > 0 [1/m].
        sigma1: their damping over the load >= 0 [s/m].
        sigma2: viscous friction over the load >= 0 [s/m].
    """

    sigma0: Convertible[Scalar] = eqx.field(converter=number)
    sigma1: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    sigma2: Convertible[Scalar] = eqx.field(converter=number, default=0.0)
    key: ClassVar[str] = "lugre"

    def numbers(self) -> dict[str, Scalar]:
        """Stiffness, damping and viscous part over the load."""
        return {"stiffness": self.sigma0, "damping": self.sigma1, "viscous": self.sigma2}

    def faults(self) -> list[str]:
        """Every part dissipates."""
        return super().faults() + faults_if(
            (not_positive(self.sigma0), "sigma0 must be positive"),
            (negative(self.sigma1), "sigma1 must not be negative"),
            (negative(self.sigma2), "sigma2 must not be negative"),
        )
