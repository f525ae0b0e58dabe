"""Derivatives of a cable's length by the poses of its frames, in closed form from its tangents.

A span of direction e adds `e . (v_end - v_start)` to the rate of the length, with the velocities of the points of
the bodies under its ends: the points of contact themselves are stationary where the path is the shortest one.  On a
sheave whose span leaves the plane of the wheel they are not, as the groove holds the cable: the length has the slope
`r (sense - e . u)` by the angle of contact, with the tangent u of the circle.  That angle follows from the condition
that the span is at right angles to the radius, whose multiplier adds a force along the radius.
"""

import jax.numpy as jnp
import numpy as np
from jax import Array


def length_slopes(layout, radii: Array, axes: Array, x: Array, path) -> tuple[Array, Array]:
    """Derivatives (n, 3) of the length by the places of the frames and by small turns of them, in world axes.

    Args:
        radii: (n,), zero at points; axes: (n, 3) in world axes; x: (n, 3) places of the frames.
        path: the `CablePath` through them.
    """
    first, second = layout.spans
    e, span = path.directions, path.end - path.start
    pull, moments = e, None
    is_sheave = np.array([kind == "sheave" for kind in layout.kinds])
    if is_sheave.any():
        multipliers = _contact_multipliers(layout, is_sheave, radii, axes, path, e, span)
        normals = path.normals
        pull = e + jnp.einsum("ms,msi->mi", multipliers, normals)
        moments = jnp.cross(multipliers[..., None] * normals, span[:, None])
    on_first, on_second = jnp.cross(path.start - x[first], -pull), jnp.cross(path.end - x[second], pull)
    if moments is not None:
        on_first, on_second = on_first + moments[:, 0], on_second + moments[:, 1]
    zero = jnp.zeros_like(x)
    return zero.at[second].add(pull).at[first].add(-pull), zero.at[first].add(on_first).at[second].add(on_second)


def _contact_multipliers(layout, is_sheave, radii, axes, path, e, span):
    """Multipliers (m, 2) of the two conditions of each span, zero at points, cylinders and spheres."""
    first, second = layout.spans
    sense, own = np.asarray(layout.senses, float), np.stack([is_sheave[first], is_sheave[second]])
    n, m = path.normals[:, 0], path.normals[:, 1]
    u, v = jnp.cross(axes[first], n), jnp.cross(axes[second], m)
    r, q = radii[first], radii[second]
    dot = lambda a, b: jnp.sum(a * b, axis=1)  # noqa: E731
    slope = (
        jnp.where(own[0], r * (sense[first] - dot(e, u)), 0.0),
        jnp.where(own[1], q * (dot(e, v) - sense[second]), 0.0),
    )
    both = own[0] & own[1]
    aa, bb = (jnp.where(mask, value, 1.0) for mask, value in zip(own, (dot(u, span), dot(v, span)), strict=True))
    ab, ba = jnp.where(both, q * dot(n, v), 0.0), jnp.where(both, -r * dot(m, u), 0.0)
    det = aa * bb - ab * ba
    safe = jnp.where(det == 0, 1.0, det)
    return jnp.stack([(ba * slope[1] - bb * slope[0]) / safe, (ab * slope[0] - aa * slope[1]) / safe], axis=1)
