"""Bonds between rigid bodies: where they are, which twists they leave free, how their reactions are weighed."""

from collections.abc import Mapping, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import any_concrete, is_concrete, not_positive
from ..errors import ModelError
from ..math._linalg import safe_norm, skew
from ..runtime import as_dtype, jit
from ..tables import sentence_repr
from ..typing import ArrayLike
from ._network import BodyNetwork


def shift_wrench(wrench, point):
    """Wrenches (..., 6) about `point` (..., 3) from those about the origin."""
    force, moment = wrench[..., :3], wrench[..., 3:]
    return jnp.concatenate([force, moment - jnp.cross(point, force)], axis=-1)


def as_loads(bonds: "Bonds", loads: ArrayLike) -> Array:
    """Loads (p, 6) as an array.  Raises: ValueError for another shape."""
    loads, p = as_dtype(loads, bonds.position.dtype), len(bonds.network.bodies)
    if loads.shape != (p, 6):
        raise ValueError(f"loads have shape {loads.shape}; {p} bodies need one wrench of 6 each")
    return loads


class Bonds(eqx.Module):
    """The bonds of a network at one configuration; every number is a leaf.

    Attributes:
        position (q, 3): origin of each bond [m]; frame (q, 3, 3): its axes, the columns of a rotation.
        free (q, 6, f): columns are the twists (linear, angular) of the child relative to the parent that the bond
            leaves free, in its own axes about its own origin; unused columns are zero.
        effort (q, f): effort of springs and motors along each free twist on the child [N m or N].
        compliance (q, 6, 6): metric C of the wrench (force, moment) in its own axes about its own origin; what
            statics leaves open makes `1/2 sum w.C w` least.
        length (): characteristic length [m] that moments are divided by where they meet forces.
        undetermined: (force x y z, moment x y z) of every bond by `redundancy`; None where not computed.

    Source: S1 (26)-(29).
    """

    network: BodyNetwork = eqx.field(static=True)
    position: Float[Array, "q 3"]
    frame: Float[Array, "q 3 3"]
    free: Float[Array, "q 6 f"]
    effort: Float[Array, "q f"]
    compliance: Float[Array, "q 6 6"]
    length: Float[Array, ""]
    undetermined: tuple[tuple[bool, ...], ...] | None = eqx.field(static=True, default=None)

    __repr__, _repr_html_ = sentence_repr(
        lambda bonds: f"{', '.join(bonds.network.bonds)} of bodies {', '.join(bonds.network.bodies)}"
    )

    @classmethod
    def from_arrays(
        cls,
        bodies: Sequence[str],
        bonds: Mapping[str, tuple[str, str]],
        position: ArrayLike,
        frame: ArrayLike | None = None,
        carries: ArrayLike | None = None,
        compliance: ArrayLike | None = None,
        effort: ArrayLike | None = None,
        length: ArrayLike | None = None,
    ) -> "Bonds":
        """Bonds that carry some of the components force x, y, z, moment x, y, z in their own axes.

        Args:
            bodies: names; bonds: name -> (parent, child), "ground" being the ground; they number the rows below.
            position (q, 3) [m]; frame (q, 3, 3), default world axes; carries (q, 6) bool, default all (welds).
            compliance (q, 6): weight of each component's square, default 1 for forces and 1 / length^2 for moments.
            effort (q, 6): what springs and motors apply on the child in components that are not carried.
            length: default the root mean square distance of the bonds from their middle, or 1.

        Raises: ModelError for names, shapes, compliances that are not positive, efforts where the bond carries, and
        frames that are no rotations; under tracing such a frame is NaN.
        """
        network, q = BodyNetwork.from_names(bodies, bonds), len(bonds)
        position = jnp.asarray(position)
        dtype = position.dtype if jnp.issubdtype(position.dtype, jnp.floating) else jnp.result_type(float)
        eye = np.broadcast_to(np.eye(3), (q, 3, 3))
        carries = np.ones((q, 6), bool) if carries is None else np.asarray(carries, bool)
        given = {"position": (position, (q, 3)), "frame": (eye if frame is None else frame, (q, 3, 3))}
        given |= {"carries": (carries, (q, 6)), "effort": (np.zeros((q, 6)) if effort is None else effort, (q, 6))}
        given |= {} if compliance is None else {"compliance": (compliance, (q, 6))}
        _check(network, given)
        if frame is not None and not is_concrete(frame):
            frame = jnp.asarray(frame)
            rotates = _is_rotation(frame, jnp)[:, None, None]
            given["frame"] = (jnp.where(rotates, frame, jnp.nan), (q, 3, 3))
        position, frame, effort = (as_dtype(given[name][0], dtype) for name in ("position", "frame", "effort"))
        length = _spread_of_points(position) if length is None else as_dtype(length, dtype)
        if length.shape != () or not_positive(length) or any_concrete(lambda x: ~np.isfinite(x), length):
            raise ModelError([f"length must be one positive number, got {length}"])
        if compliance is None:
            compliance = jnp.tile(jnp.stack([jnp.ones((), dtype)] * 3 + [length**-2] * 3), (q, 1))
        compliance = as_dtype(compliance, dtype)[:, :, None] * jnp.eye(6, dtype=dtype)[None]
        free, chosen = _unit_twists(~carries)
        free = jnp.asarray(free, dtype)
        effort = jnp.take_along_axis(effort, chosen, axis=1) * jnp.sum(free, axis=1)
        return cls(network, position, frame, free, effort, compliance, length)

    @classmethod
    def from_twists(
        cls,
        network: BodyNetwork,
        position: Array,
        frame: Array,
        twists: Array,
        effort: Array,
        length: ArrayLike,
        compliance: Array | None = None,
    ) -> "Bonds":
        """Bonds from world twists about the world origin.

        Args: twists (q, 6, f): columns (linear, angular) span what each bond leaves free, of any number and length;
            zero ones are unused.  effort (q, f) = twists^T wrench.  Others as in `from_arrays`, compliance (q, 6, 6)
            as the field.
        """
        dtype, length = position.dtype, as_dtype(length, position.dtype)
        linear, angular = twists[:, :3], twists[:, 3:]
        linear = linear - jnp.einsum("qij,qjk->qik", jax.vmap(skew)(position), angular)
        local = [jnp.einsum("qji,qjk->qik", frame, part) for part in (linear, angular)]
        if compliance is None:
            weight = jnp.concatenate([jnp.ones(3, dtype), jnp.full(3, length**-2)])
            compliance = jnp.broadcast_to(jnp.diag(weight), (len(twists), 6, 6))
        return cls(network, position, frame, jnp.concatenate(local, axis=1), effort, compliance, length)

    @property
    @jit
    def twist_axes(self) -> Float[Array, "q 6 6"]:
        """Maps (q, 6, 6) from a twist in the bond's axes about its origin to the world twist about the world origin.

        Its transpose brings a world wrench to the bond: `G^T R^-1` of S1 (27).
        """
        arm = jnp.cross(self.position[:, None, :], self.frame.transpose(0, 2, 1)).transpose(0, 2, 1)
        lower = jnp.concatenate([jnp.zeros_like(self.frame), self.frame], axis=2)
        return jnp.concatenate([jnp.concatenate([self.frame, arm], axis=2), lower], axis=1)

    @jit
    def components(self, wrench: Array) -> Float[Array, "q 6"]:
        """Force x, y, z, moment x, y, z (q, 6) in the bonds' axes about their origins from world wrenches (q, 6).

        Source: S1 (29).
        """
        return jnp.einsum("qji,qj->qi", self.twist_axes, wrench)

    @jit
    def free_sizes(self) -> Float[Array, "q f"]:
        """Squared size (q, f) of each free twist [m^2], angles times the characteristic length; zero if unused."""
        weight = jnp.concatenate([jnp.ones(3, self.length.dtype), jnp.full(3, self.length**2)])
        size = jnp.einsum("i,qij->qj", weight, self.free**2)
        # 1e-12 of squares: a millionth of the bond's largest twist is rounding of a projector
        return jnp.where(size > 1e-12 * jnp.max(size, axis=1, keepdims=True, initial=0.0), size, 0.0)


def _unit_twists(is_free):
    """Unit twists (q, 6, f) along the free components (q, 6) of each bond, zero where it has less than f, and the
    components (q, f) they are along; f is the most that a bond has, and at least one."""
    size = max(int(is_free.sum(axis=1).max(initial=0)), 1)
    chosen = np.argsort(~is_free, axis=1, kind="stable")[:, :size]
    used = np.take_along_axis(is_free, chosen, axis=1)
    return (np.arange(6)[None, :, None] == chosen[:, None, :]) * used[:, None, :].astype(float), chosen


def _spread_of_points(position):
    if not len(position):
        return jnp.ones((), position.dtype)
    middle = jnp.mean(position, axis=0, keepdims=True)
    spread = safe_norm((position - middle).reshape(-1)) / np.sqrt(position.shape[0])
    return jnp.where(spread > 0.0, spread, 1.0)


def _is_rotation(frame, numpy):
    """True (q,) for each frame of (q, 3, 3) whose columns are orthonormal and right-handed."""
    product = numpy.einsum("qji,qjk->qik", frame, frame) - numpy.eye(3)[None]
    hand = numpy.sum(numpy.cross(frame[:, :, 0], frame[:, :, 1]) * frame[:, :, 2], axis=1)
    # loose: frames are often typed in with six digits, or in single precision
    return (numpy.max(numpy.abs(product), axis=(1, 2)) <= 1e-5) & (hand > 0)


def _check(network, given):
    faults = [
        f"{name} has shape {np.shape(value)}; {len(network.bonds)} bonds need {shape}"
        for name, (value, shape) in given.items()
        if np.shape(value) != shape
    ]
    if faults:
        raise ModelError(faults)
    for name, (value, _) in given.items():
        if not is_concrete(value):
            continue
        wrong = ~np.isfinite(value)
        if name == "compliance":
            wrong |= ~(np.asarray(value) > 0.0)
        if name == "frame":
            wrong |= (np.isfinite(value).all(axis=(1, 2)) & ~_is_rotation(np.asarray(value), np))[:, None, None]
        if name == "effort":
            wrong |= given["carries"][0] & (np.asarray(value) != 0.0)
        wrong = wrong.any(axis=tuple(range(1, wrong.ndim)))
        advice = {"compliance": "must be positive", "effort": "acts in a component that the bond carries"}
        advice = advice.get(name, "must be finite")
        if name == "frame" and np.all(np.isfinite(value)):
            advice = "must be a rotation: unit columns, orthogonal to each other, right-handed"
        faults += [f"bond {network.bonds[e]!r}: {name} {advice}" for e in np.nonzero(wrong)[0]]
    if faults:
        raise ModelError(faults)
