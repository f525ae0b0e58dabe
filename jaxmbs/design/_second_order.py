"""Reliability of the second order: curvatures of a limit state at its design point."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax
from jax.scipy.special import ndtr
from jax.scipy.stats import norm
from jaxtyping import Float

from ..math._eigen import eigh
from ._design_point import DesignPoint


def curvature_matrix(limit: Callable, point: DesignPoint, reverse: bool) -> Float[Array, "n n"]:
    """Curvature of the limit state over the plane across the design point, positive where it bends towards the side
    that fails; zero along the direction of the point."""
    size = jnp.sqrt(point.gradient @ point.gradient)
    normal = point.gradient / size
    hessian = jax.jacfwd(jax.grad(limit) if reverse else jax.jacfwd(limit))(point.u)
    across = jnp.eye(len(normal)) - jnp.outer(normal, normal)
    return across @ hessian @ across / size


class SecondOrder(NamedTuple):
    """Probabilities of failure by curvatures (n,) of the limit state at its design point.

    Attributes:
        tvedt: of the paraboloid with these curvatures, exact; breitung, hohenbichler: after Breitung, and after
            Hohenbichler and Rackwitz.  nan where the surface bends more than a sphere about the medians: the point is
            then not the nearest failure.
        curvatures: (n,) with a zero for the direction of the point.
    """

    tvedt: Array
    breitung: Array
    hohenbichler: Array
    curvatures: Array


def second_order(index: Array, curvature: Float[Array, "n n"]) -> SecondOrder:
    """Probabilities of failure of the second order.

    Source: Breitung 1984, Asymptotic approximations for multinormal integrals, (25); Hohenbichler and Rackwitz 1988,
    Improvement of second-order reliability estimates by importance sampling, (17); Tvedt 1990, Distribution of
    quadratic forms in normal space.
    """
    curvatures = eigh(curvature, jnp.eye(len(curvature)))[0]
    first = ndtr(-index)
    is_nearest = jnp.all(1.0 + index * curvatures > 0.0)
    corrected = [first / jnp.sqrt(_product(s, curvatures)) for s in (index, norm.pdf(index) / first)]
    tvedt = _paraboloid(index, curvatures)
    tvedt, breitung, hohenbichler = (jnp.where(is_nearest, x, jnp.nan) for x in (tvedt, *corrected))
    return SecondOrder(tvedt, breitung, hohenbichler, curvatures)


def _product(slope, curvatures):
    factors = 1.0 + slope * curvatures
    return jnp.prod(jnp.where(factors > 0.0, factors, jnp.nan))


def _paraboloid(index, curvatures):
    """Probability that `u_1 > index + sum(curvature u^2) / 2`: its moment generating function, integrated along a
    line through its saddle point, where nothing oscillates and the trapezoidal rule has all digits.
    """
    least = jnp.min(curvatures)
    end = jnp.where(least < 0.0, -1.0 / jnp.where(least < 0.0, least, -1.0), jnp.inf)  # where it is infinite
    wanted = 0.5 * (index + jnp.sqrt(index**2 + 4.0))  # the saddle point of a plane
    real = lax.stop_gradient(jnp.where(wanted < 0.9 * end, wanted, 0.5 * (jnp.maximum(index, 0.0) + end)))
    t = jnp.linspace(0.0, 12.0, 481)
    s = lax.complex(jnp.broadcast_to(real, t.shape), t)
    b, kappa = (lax.complex(x, jnp.zeros_like(x)) for x in (index, curvatures))
    bent = jnp.sum(jnp.log(1.0 + s[:, None] * kappa[None]), axis=1)
    values = jnp.real(jnp.exp(0.5 * s**2 - s * b - 0.5 * bent - jnp.log(s))) * jnp.where(t > 0.0, 1.0, 0.5)
    return jnp.sum(values) * (t[1] - t[0]) / jnp.pi
