"""Matrices of structures, written down by hand: chains, plane beams, and the pin-ended double cross."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxmbs.linear import LinearSystem


def kw(matrices):
    """K, M or K, M, C by name."""
    return dict(zip("KMC", matrices, strict=False))


def component(K, M, interface, C=None, **options):
    """A linear system of matrices."""
    return LinearSystem(mass=M, stiffness=K, damping=C, interface=interface, **options)


@partial(jax.jit, static_argnames=("n", "ends"))
def chain(n, k=1.0, m=1.0, ends=2):
    """K, M of n equal masses between equal springs; fixed at 0, 1 (the first) or 2 ends."""
    K = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[-1, -1] -= ends < 2
    K[0, 0] -= ends < 1
    return k * jnp.asarray(K), m * jnp.eye(n)


def beam_element(EI, rhoA, h):
    """Euler-Bernoulli beam in bending, coordinates w, slope at both ends."""
    k = jnp.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4.0]])
    m = jnp.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4.0]])
    unit = jnp.stack([jnp.ones_like(h), h, jnp.ones_like(h), h])
    scale = unit[:, None] * unit[None, :]
    return EI / h**3 * scale * k, rhoA * h / 420 * scale * m


@partial(jax.jit, static_argnames=("n", "fixed"))
def beam(n, EI=1.0, rhoA=1.0, length=1.0, fixed=0):
    """K, M of a beam of n elements; the first `fixed` coordinates (w, slope at the left end) are held."""
    k, m = beam_element(jnp.asarray(EI), jnp.asarray(rhoA), jnp.asarray(length / n))
    places = 2 * np.arange(n)[:, None] + np.arange(4)
    return tuple(_assemble(2 * n + 2, places, e)[fixed:, fixed:] for e in (k, m))


def _assemble(size, places, element):
    K = jnp.zeros((size, size))
    return K.at[places[:, :, None], places[:, None, :]].add(jnp.broadcast_to(element, (len(places), *element.shape)))


def bar_element(EA, rhoA, h):
    """Rod in tension with consistent mass."""
    return EA / h * jnp.array([[1, -1], [-1, 1.0]]), rhoA * h / 6 * jnp.array([[2, 1], [1, 2.0]])


@partial(jax.jit, static_argnames=("elements", "centre_held"))
def double_cross(elements, EI, EA, rhoA, length=5.0, centre_held=False):
    """K, M of eight arms in a plane from one centre at 45 degrees, far ends pinned (NAFEMS FV2), free coordinates."""
    h = jnp.asarray(length / elements)
    parts = [_frame(b, r) for b, r in zip(beam_element(EI, rhoA, h), bar_element(EA, rhoA, h), strict=True)]
    size, places, turns, held = 3 + 8 * 3 * elements, [], [], [0, 1] * centre_held
    for arm in range(8):
        c, s = np.cos(arm * np.pi / 4), np.sin(arm * np.pi / 4)
        turn = np.kron(np.eye(2), np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
        nodes = [0, *(1 + arm * elements + np.arange(elements))]
        held += [3 * nodes[-1], 3 * nodes[-1] + 1]
        for a, b in zip(nodes[:-1], nodes[1:], strict=True):
            places.append(np.r_[3 * a : 3 * a + 3, 3 * b : 3 * b + 3])
            turns.append(turn)
    places, turns = np.array(places), np.array(turns)
    free = np.setdiff1d(np.arange(size), held)
    made = []
    for part in parts:
        blocks = jnp.einsum("eai,ab,ebj->eij", turns, part, turns)
        made.append(
            jnp.zeros((size, size)).at[places[:, :, None], places[:, None, :]].add(blocks)[np.ix_(free, free)]
        )
    return tuple(made)


def _frame(bending, axial):
    """Axial and bending parts of an element (u, w, slope at both ends)."""
    b, a = np.array([1, 2, 4, 5]), np.array([0, 3])
    return jnp.zeros((6, 6)).at[np.ix_(b, b)].set(bending).at[np.ix_(a, a)].set(axial)
