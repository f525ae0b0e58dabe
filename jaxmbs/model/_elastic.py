"""Elastic bodies: a reduced substructure in a floating frame.

The floating frame is that of the first interface.  Deformations q are the displacements and rotation vectors of the
other interfaces seen from it, in its axes, then the modal coordinates.  Flows are `(Omega, v, q_dot)`: the twist of
the floating frame in its own axes and the rates of q; loads and momenta are dual to them.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete
from ..elements._base import as_real
from ..math._rotation import rotation_vector, rotation_vector_rate
from ..typing import Convertible, Scalar, Vector3


class ElasticBody(eqx.Module):
    """The mechanics of an elastic body.

    Points move by `y = B V + sum_a Omega_a e_a x (Phi q) + Phi q_dot`, in the axes of the floating frame, with its
    twist V = (Omega, v) and rigid motions B: all of Newton's law but the stiffening by rotation (strains are linear).
    With `Y = [B, e_x x Phi, e_y x Phi, e_z x Phi, Phi]` and `z = (V, Omega_x q, Omega_y q, Omega_z q, q_dot)` the
    kinetic energy is `1/2 z^T (Y^T M Y) z`: one constant matrix.

    Attributes:
        inertia: Y^T M Y (6 + 4 m, 6 + 4 m).
        stiffness, damping: on the deformations (m, m).
        places: (interfaces - 1, 3) of the other interfaces in the floating frame, undeformed [m]; their axes agree.
        interfaces: names; the first carries the floating frame.
    """

    inertia: Convertible[Float[Array, "k k"]] = eqx.field(converter=as_real, kw_only=True)
    stiffness: Convertible[Float[Array, "m m"]] = eqx.field(converter=as_real, kw_only=True)
    damping: Convertible[Float[Array, "m m"]] = eqx.field(converter=as_real, kw_only=True)
    places: Convertible[Float[Array, "others 3"]] = eqx.field(converter=as_real, kw_only=True)
    interfaces: tuple[str, ...] = eqx.field(static=True, kw_only=True)

    @property
    def num_deformations(self) -> int:
        return self.stiffness.shape[-1]

    @property
    def num_modes(self) -> int:
        return self.num_deformations - 6 * (len(self.interfaces) - 1)

    def deformations(self, R: Array, x: Array, modal: Array) -> Array:
        """q (m,) at world rotations R (interfaces, 3, 3) and positions x (interfaces, 3), modal coordinates."""
        moved = (x[1:] - x[:1]) @ R[0] - self.places
        turned = jax.vmap(lambda r: rotation_vector(R[0].T @ r))(R[1:])
        return jnp.concatenate([jnp.concatenate([moved, turned], axis=1).reshape(-1), modal])

    def flow(self, R: Array, x: Array, q: Array, V: Array, rates: Array) -> Array:
        """Flow (6 + m,) at world twists V (interfaces, 6) about the world origin; R (3, 3) of the floating frame.

        Linear in V and the modal rates; `load -> jax.linear_transpose` of it loads the interfaces.
        """
        spin, velocity = V[:, :3] @ R, (V[:, 3:] + jnp.cross(V[:, :3], x)) @ R
        moving = velocity[1:] - velocity[:1] - jnp.cross(spin[:1], (x[1:] - x[:1]) @ R)
        vectors = q[: 6 * (len(self.interfaces) - 1)].reshape(-1, 6)[:, 3:]
        turning = jax.vmap(rotation_vector_rate)(vectors, spin[1:] - spin[:1])
        relative = jnp.concatenate([moving, turning], axis=1).reshape(-1)
        return jnp.concatenate([spin[0], velocity[0], relative, rates])

    def speeds(self, q: Array, flow: Array) -> Array:
        """z (6 + 4 m,), linear in the flow."""
        return jnp.concatenate([flow[:6], jnp.outer(flow[:3], q).reshape(-1), flow[6:]])

    def kinetic_energy(self, q: Array, flow: Array) -> Scalar:
        """`1/2 z^T Y^T M Y z` [J]."""
        z = self.speeds(q, flow)
        return 0.5 * z @ self.inertia @ z

    def momenta(self, q: Array, flow: Array) -> Array:
        """Derivative of the kinetic energy by the flow (6 + m,)."""
        h = self.inertia @ self.speeds(q, flow)
        return self._rigid_first(h, self._turned(h) @ q)

    def gyroscopic_loads(self, q: Array, flow: Array) -> Array:
        """Loads (6 + m,) beside the rates of the momenta: `V x* h` of the floating frame, `-dT/dq`."""
        h = self.inertia @ self.speeds(q, flow)
        spin, velocity = flow[:3], flow[3:6]
        angular, linear = h[:3] + self._turned(h) @ q, h[3:6]
        moment = jnp.cross(spin, angular) + jnp.cross(velocity, linear)
        return jnp.concatenate([moment, jnp.cross(spin, linear), -spin @ self._turned(h)])

    def strain_loads(self, q: Array, flow: Array) -> Array:
        """Loads (6 + m,) of stiffness and damping, `-K q - C q_dot`."""
        return jnp.concatenate([jnp.zeros(6, q.dtype), -self.stiffness @ q - self.damping @ flow[6:]])

    def gravity_loads(self, q: Array, gravity: Array) -> Array:
        """Loads (6 + m,) of gravity (3,) in the axes of the floating frame."""
        shapes = self._mean_shapes()
        moment = jnp.cross(self.first_moment(q), gravity)
        return jnp.concatenate([moment, self.inertia[3, 3] * gravity, gravity @ shapes])

    def first_moment(self, q: Array) -> Vector3:
        """Mass times the place (3,) of the deformed centre of mass in the floating frame [kg m]."""
        rigid = self.inertia[3:6, :3]  # -m skew(c)
        return jnp.stack([rigid[1, 2], rigid[2, 0], rigid[0, 1]]) + self._mean_shapes() @ q

    def strain_energy(self, q: Array) -> Scalar:
        """`1/2 q^T K q` [J]."""
        return 0.5 * q @ self.stiffness @ q

    def faults(self) -> list[str]:
        """Shapes that do not agree, and numbers that are not finite."""
        m, others = self.num_deformations, len(self.interfaces) - 1
        k, shapes = 6 + 4 * m, {"stiffness": (m, m), "damping": (m, m), "places": (others, 3)}
        found = []
        for name, shape in ({"inertia": (k, k)} | shapes).items():
            value = getattr(self, name)
            if value.shape != shape:
                where = f"{m} deformations and {others + 1} interfaces"
                found.append(f"{name} has shape {value.shape}, {where} need {shape}")
            elif any_concrete(lambda x: ~np.isfinite(x), value):
                found.append(f"{name} is not finite")
        return found if self.num_modes >= 0 else [*found, "each interface but the first has six deformations"]

    def _turned(self, h):
        """The parts (3, m) of h = Y^T M y that belong to `e_a x Phi`."""
        return h[6 : 6 + 3 * self.num_deformations].reshape(3, -1)

    def _rigid_first(self, h, angular):
        return jnp.concatenate([h[:3] + angular, h[3:6], h[6 + 3 * self.num_deformations :]])

    def _mean_shapes(self):
        """Integral (3, m) of density times Phi."""
        return self.inertia[3:6, 6 + 3 * self.num_deformations :]


class ElasticGroup(eqx.Module):
    """Elastic bodies of one shape, stacked: frames of their interfaces, columns and coordinates of their modes."""

    names: tuple[str, ...] = eqx.field(static=True)
    frames: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    columns: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    coordinates: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    body: ElasticBody
