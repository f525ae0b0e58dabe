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
from ..drawings import Drawing, Symbol
from ..elements._base import as_real
from ..math._rotation import rotation_vector, rotation_vector_rate
from ..tables import sentence_repr
from ..typing import Convertible, Scalar, Vector3


class GeometricStiffening(eqx.Module):
    """Displacements of second order, `1/2 q^T Psi q`, by which an elastic body shortens where it bends.

    A load f does the work `f . 1/2 q^T Psi q = -1/2 q^T Phi^T K_g(f) Phi q` on them, with the geometric stiffness
    K_g(f) at the stress of f alone: what they contribute to Newton's law is the stiffening by inertia, by gravity and
    by the loads at interfaces.  Of their inertia the part that acts on rigid motions counts: they move the body as
    the rigid motion does that has their momenta, so that the kinetic energy stays positive.
    Source: Wallrapp and Schwertassek, Int. J. Numer. Meth. Eng. 32 (1991) 1833-1850.

    Attributes:
        moved: (6, m, m), rigid motions with the momenta of Psi, `(B^T M B)^-1 B^T M Psi`.
        turned: (6, 3, m, m), those with the momenta of Psi turned about each axis, `e_a x Psi`.
        interfaces: (m - modes, m, m), Psi at the other interfaces: their deformations beyond the elastic ones.
    """

    moved: Float[Array, "... 6 m m"]
    turned: Float[Array, "... 6 3 m m"]
    interfaces: Float[Array, "... k m m"]

    __repr__, _repr_html_ = sentence_repr(
        lambda stiffening: f"displacements of second order of {stiffening.moved.shape[-1]} deformations"
    )

    def twist(self, q: Array, flow: Array) -> Array:
        """Twist (6,) beyond that of the floating frame, linear in the flow."""
        return self.moved @ q @ flow[6:] + 0.5 * (self.turned @ q @ q) @ flow[:3]

    def momenta(self, q: Array, wrench: Array) -> Array:
        """Part (6 + m,) of the momenta on the flow from the momenta (6,) of rigid motions."""
        spin = 0.5 * wrench @ (self.turned @ q @ q)
        return jnp.concatenate([spin, jnp.zeros(3, q.dtype), wrench @ (self.moved @ q)])

    def slope(self, q: Array, flow: Array, wrench: Array) -> Array:
        """Derivative (m,) of `wrench . twist` by q."""
        moved = jnp.einsum("k,kij->ij", wrench, self.moved) @ flow[6:]
        return moved + jnp.einsum("k,a,kaij->ij", wrench, flow[:3], self.turned) @ q


def _names(interfaces):
    """Names of interfaces.  Raises: TypeError for what is no list of them."""
    if not isinstance(interfaces, tuple | list):
        raise TypeError(f"interfaces are names in a tuple, not {interfaces!r}")
    return tuple(interfaces)


def body_words(body: "ElasticBody") -> str:
    """An elastic body in words."""
    linear = "linear" if body.stiffening is None else "stiffened by its loads"
    names = ", ".join(body.interfaces)
    return f"interfaces {names}, {body.num_deformations} deformations, {body.num_modes} of them modes; {linear}"


class ElasticBody(eqx.Module):
    """The mechanics of an elastic body.

    Points move by `y = B V + sum_a Omega_a e_a x (Phi q) + Phi q_dot`, in the axes of the floating frame, with its
    twist V = (Omega, v) and rigid motions B: all of Newton's law but the stiffening by rotation and load (strains are
    linear), which `stiffening` adds.
    With `Y = [B, e_x x Phi, e_y x Phi, e_z x Phi, Phi]` and `z = (V, Omega_x q, Omega_y q, Omega_z q, q_dot)` the
    kinetic energy is `1/2 z^T (Y^T M Y) z`: one constant matrix.

    Attributes:
        inertia: Y^T M Y (6 + 4 m, 6 + 4 m).
        stiffness, damping: on the deformations (m, m).
        places: (interfaces - 1, 3) of the other interfaces in the floating frame, undeformed [m]; their axes agree.
        interfaces: names; the first carries the floating frame.
        stiffening: displacements of second order, or None where the body is linear.
    """

    inertia: Convertible[Float[Array, "k k"]] = eqx.field(converter=as_real, kw_only=True)
    stiffness: Convertible[Float[Array, "m m"]] = eqx.field(converter=as_real, kw_only=True)
    damping: Convertible[Float[Array, "m m"]] = eqx.field(converter=as_real, kw_only=True)
    places: Convertible[Float[Array, "others 3"]] = eqx.field(converter=as_real, kw_only=True)
    interfaces: tuple[str, ...] = eqx.field(static=True, kw_only=True, converter=_names)
    stiffening: GeometricStiffening | None = eqx.field(kw_only=True, default=None)

    __repr__, _repr_html_ = sentence_repr(lambda body: body_words(body))

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
        V = flow[:6] if self.stiffening is None else flow[:6] + self.stiffening.twist(q, flow)
        return jnp.concatenate([V, jnp.outer(flow[:3], q).reshape(-1), flow[6:]])

    def kinetic_energy(self, q: Array, flow: Array) -> Scalar:
        """`1/2 z^T Y^T M Y z` [J]."""
        z = self.speeds(q, flow)
        return 0.5 * z @ self.inertia @ z

    def momenta(self, q: Array, flow: Array) -> Array:
        """Derivative of the kinetic energy by the flow (6 + m,)."""
        h = self.inertia @ self.speeds(q, flow)
        pi = self._rigid_first(h, self._turned(h) @ q)
        return pi if self.stiffening is None else pi + self.stiffening.momenta(q, h[:6])

    def gyroscopic_loads(self, q: Array, flow: Array) -> Array:
        """Loads (6 + m,) beside the rates of the momenta: `V x* h` of the floating frame, `-dT/dq`."""
        h = self.inertia @ self.speeds(q, flow)
        spin, velocity = flow[:3], flow[3:6]
        angular, linear, slope = h[:3] + self._turned(h) @ q, h[3:6], spin @ self._turned(h)
        if self.stiffening is not None:
            angular = angular + self.stiffening.momenta(q, h[:6])[:3]
            slope = slope + self.stiffening.slope(q, flow, h[:6])
        moment = jnp.cross(spin, angular) + jnp.cross(velocity, linear)
        return jnp.concatenate([moment, jnp.cross(spin, linear), -slope])

    def strain_loads(self, q: Array, flow: Array) -> Array:
        """Loads (6 + m,) of stiffness and damping, `-K q - C q_dot`."""
        load = -self.stiffness @ self.elastic_deformations(q) - self.damping @ flow[6:]
        if self.stiffening is not None:
            at_interfaces = (self.stiffness @ self.elastic_deformations(q))[: len(self.stiffening.interfaces)]
            load = load + jnp.einsum("k,kij,j->i", at_interfaces, self.stiffening.interfaces, q)
        return jnp.concatenate([jnp.zeros(6, q.dtype), load])

    def gravity_loads(self, q: Array, gravity: Array) -> Array:
        """Loads (6 + m,) of gravity (3,) in the axes of the floating frame."""
        shapes = self._mean_shapes()
        moment = jnp.cross(self.first_moment(q), gravity)
        if self.stiffening is not None:
            shapes = shapes + self._second_moments() @ q
        return jnp.concatenate([moment, self.inertia[3, 3] * gravity, gravity @ shapes])

    def first_moment(self, q: Array) -> Vector3:
        """Mass times the place (3,) of the deformed centre of mass in the floating frame [kg m]."""
        rigid = self.inertia[3:6, :3]  # -m skew(c)
        first = jnp.stack([rigid[1, 2], rigid[2, 0], rigid[0, 1]]) + self._mean_shapes() @ q
        return first if self.stiffening is None else first + 0.5 * (self._second_moments() @ q @ q)

    def strain_energy(self, q: Array) -> Scalar:
        """`1/2 e^T K e` [J] of the elastic deformations e."""
        e = self.elastic_deformations(q)
        return 0.5 * e @ self.stiffness @ e

    def elastic_deformations(self, q: Array) -> Array:
        """Deformations (m,) that strain the body linearly: q without what interfaces move by bending alone."""
        if self.stiffening is None:
            return q
        bent = 0.5 * (self.stiffening.interfaces @ q @ q)
        return q.at[: len(bent)].add(-bent)

    def drawing(self) -> Drawing:
        """Rods from the first interface to the others, where no mesh of the body is given."""
        return tuple(Symbol("rod", (0, k)) for k in range(1, len(self.interfaces)))

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
        if self.stiffening is not None:
            shapes = {"moved": (6, m, m), "turned": (6, 3, m, m), "interfaces": (6 * others, m, m)}
            given = {name: getattr(self.stiffening, name).shape for name in shapes}
            found += [f"stiffening.{n} has shape {given[n]}, not {s}" for n, s in shapes.items() if given[n] != s]
        return found if self.num_modes >= 0 else [*found, "each interface but the first has six deformations"]

    def _turned(self, h):
        """The parts (3, m) of h = Y^T M y that belong to `e_a x Phi`."""
        return h[6 : 6 + 3 * self.num_deformations].reshape(3, -1)

    def _rigid_first(self, h, angular):
        return jnp.concatenate([h[:3] + angular, h[3:6], h[6 + 3 * self.num_deformations :]])

    def _second_moments(self):
        """Integral (3, m, m) of density times Psi."""
        return jnp.einsum("dk,kij->dij", self.inertia[3:6, :6], self.stiffening.moved)

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
