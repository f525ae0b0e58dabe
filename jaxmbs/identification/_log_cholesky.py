"""Inertias of rigid bodies by ten unknowns without bounds: every value is a body that can exist."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..checks import require_reals
from ..errors import ModelError
from ..typing import ArrayLike


def log_cholesky(mass: ArrayLike, com: ArrayLike, inertia: ArrayLike) -> np.ndarray:
    """Unknowns (10,) of a rigid body's inertia, of which `from_log_cholesky` is the inverse.

    Args:
        mass: [kg], positive; com: centre of mass (3,) [m].
        inertia: about the centre of mass, three principal values or (3, 3) [kg m^2], of a body with volume.

    Raises: ModelError for an inertia that no body with volume has.
    Source: Rucker and Wensing, Smooth parameterization of rigid-body inertia (2022).
    """
    for number in (mass, com, inertia):
        require_reals(number)
    m, c, inertia = (np.asarray(x, float) for x in (mass, com, inertia))
    inertia = np.diag(inertia) if inertia.shape == (3,) else inertia
    if m.shape != () or c.shape != (3,) or inertia.shape != (3, 3) or not np.allclose(inertia, inertia.T):
        raise ModelError(
            ["give a mass, a centre of mass (3,) and a symmetric inertia (3, 3) or (3,)"], "log_cholesky"
        )
    if not (np.isfinite(m) and np.all(np.isfinite(c)) and np.all(np.isfinite(inertia))):
        raise ModelError(["mass, centre of mass and inertia must be finite"], "log_cholesky")
    spread = 0.5 * np.trace(inertia) * np.eye(3) - inertia  # second moments of the mass, about its centre
    if not (m > 0 and np.linalg.eigvalsh(spread)[0] > 0):
        text = "the mass must be positive, and each principal moment less than the sum of the others"
        raise ModelError([f"no body with volume has this inertia: {text}"], "log_cholesky")
    upper = np.linalg.cholesky(spread[::-1, ::-1] / m)[::-1, ::-1]  # spread = m upper upper^T
    scales = np.log(np.diagonal(upper))
    return np.concatenate([[0.5 * np.log(m)], scales, upper[[0, 1, 0], [1, 2, 2]], c])


def from_log_cholesky(unknowns: ArrayLike) -> dict[str, Array]:
    """Mass, centre of mass and inertia of unknowns (10,): `b.body("link", **from_log_cholesky(u["link"]))`.

    The unknowns are half the logarithm of the mass; three logarithms and three shears (xy, yz, xz) of the Cholesky
    factor of the second moments over the mass; and the centre of mass [m].  Every mass is positive, and the second
    moments are positive definite: the principal moments satisfy the triangle inequality.

    Returns: dict of `mass` () [kg], `com` (3,) [m], `inertia` (3, 3) about the centre of mass [kg m^2].
    Source: Rucker and Wensing (2022).
    """
    u = jnp.asarray(unknowns)
    if u.shape != (10,):
        raise ModelError([f"the unknowns of an inertia have shape (10,), not {u.shape}"], "from_log_cholesky")
    mass = jnp.exp(2 * u[0])
    d, (xy, yz, xz) = jnp.exp(u[1:4]), u[4:7]
    upper = jnp.diag(d).at[jnp.array([0, 1, 0]), jnp.array([1, 2, 2])].set(jnp.stack([xy, yz, xz]))
    spread = mass * upper @ upper.T
    return {"mass": mass, "com": u[7:], "inertia": jnp.trace(spread) * jnp.eye(3) - spread}
