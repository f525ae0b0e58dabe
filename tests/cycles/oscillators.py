"""Oscillators of one freedom that several tests share."""

import equinox as eqx
import jax
import jax.numpy as jnp

import jaxmbs as mbs


class CubicAndPush(eqx.Module):
    """`F cos(w t) - k3 x^3`."""

    k3: jax.Array
    F: jax.Array
    w: jax.Array

    def __call__(self, x, v, t):
        return self.F * jnp.cos(self.w * t) - self.k3 * x**3


class VanDerPol(eqx.Module):
    """`mu (1 - x^2) v - x`."""

    mu: jax.Array

    def __call__(self, x, v, t):
        return self.mu * (1.0 - x**2) * v - x


def slide(m, like, **forces):
    """A mass on a slide with force laws along it."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("mass", mass=m)
    b.joint("x", mbs.Prismatic("x"), "ground", "mass")
    for name, law in forces.items():
        b.force(name, law, joint="x")
    return b.build(like=like)


def duffing(m=1.0, c=0.1, k=1.0, k3=0.5, F=0.3, w=1.5, like=None):
    """The forced oscillator of case PO1."""
    law = CubicAndPush(*map(jnp.asarray, (k3, F, w)))
    return slide(m, like, spring=mbs.SpringDamper(stiffness=k, damping=c), rest=mbs.Actuator(law))


def van_der_pol(mu=1.0, like=None):
    return slide(1.0, like, law=mbs.Actuator(VanDerPol(jnp.asarray(mu))))
