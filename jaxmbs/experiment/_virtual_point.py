"""Virtual point transformation: sensors and impacts around an interface as motions and loads of one point."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..checks import is_concrete
from ..elements import DIRECTIONS
from ..errors import ModelError
from ..linear._transfer import TransferFunctions
from ..math import _square as square
from ..quantities import Axis, Quantity, numbered
from ..reports import Report, reported
from ..runtime import as_array, as_dtype
from ..typing import ArrayLike


@reported
class VirtualPoint(NamedTuple):
    """Transfer functions at a virtual point, with the residuals of the transformation.

    Attributes:
        transfer: channels "name x", ..., "name rz" and those of flexible motions first, then those off the interface.
        motion_residual: (frequencies, inputs), share of the measured motion that the point's motions do not explain,
            0 to 1.
        force_residual: (frequencies, outputs), likewise of the forces.
    """

    transfer: TransferFunctions
    motion_residual: Float[Array, "frequencies inputs"]
    force_residual: Float[Array, "frequencies outputs"]

    def report(self) -> Report:
        found = self.transfer
        frequency = Axis("frequency", np.asarray(found.omega) / (2 * np.pi), "Hz")
        motions, forces = (
            numbered(n, x.shape[1]) for n, x in (("input", self.motion_residual), ("output", self.force_residual))
        )
        return Report(
            [
                Quantity("motion not explained", self.motion_residual, "", (frequency, motions)),
                Quantity("force not explained", self.force_residual, "", (frequency, forces)),
                *found.report().quantities,
            ],
            f"{len(found.outputs)} outputs, {len(found.inputs)} inputs",
        )


def rigid_channels(places: Sequence[tuple], point: ArrayLike) -> Float[Array, "channels 6"]:
    """Readings `[d, (r - p) x d]` of each channel per unit displacement and rotation of the point.

    Args: places: place (3,) [m] and direction (3,) of each channel; point: (3,) [m].

    The transpose gives the force and moment at the point of unit forces at the channels.  Source: S1 (14).
    """
    r, d = (jnp.stack([jnp.asarray(place[k]) for place in places]) for k in (0, 1))
    dtype = np.result_type(r.dtype, d.dtype, jnp.asarray(point).dtype, np.float32)
    r, d, p = r.astype(dtype), d.astype(dtype), jnp.asarray(point, dtype)
    d = d / jnp.linalg.norm(d, axis=1, keepdims=True)
    return jnp.concatenate([d, jnp.cross(r - p[None], d)], axis=1)


def flexible_channels(places: Sequence[tuple], point: ArrayLike, motion: Callable) -> Float[Array, " channels"]:
    """Readings (channels,) of a unit flexible motion `motion(r - p)` (3,) along the direction of each channel.

    Args: as of `rigid_channels`.  Source: S1 (14).
    """
    r, d = (jnp.stack([as_array(place[k]) for place in places]) for k in (0, 1))
    d = d / jnp.linalg.norm(d, axis=1, keepdims=True)
    return jnp.sum(d * jax.vmap(motion)(r - as_dtype(point, d.dtype)[None]), axis=1)


def virtual_point(
    measured: TransferFunctions,
    point: ArrayLike,
    sensors: Mapping[str, tuple],
    impacts: Mapping[str, tuple],
    name: str = "point",
    weights: ArrayLike | None = None,
    flexible: Mapping[str, Callable] | None = None,
) -> VirtualPoint:
    """Transform transfer functions to six coordinates of a point, `T_u Y T_f^T`, and flexible motions around it.

    `T_u = (R^T W R)^-1 R^T W` takes the motion nearest to the sensors, `T_f^T = R_f (R_f^T R_f)^-1` the smallest
    forces at the impacts that make up a load of the point.

    Args:
        point: (3,) [m].
        sensors, impacts: position [m] and direction by output and input name; at least as many as coordinates,
            not all on one line.
        weights: W (sensors,).
        flexible: by name, further motions of the interface: displacement (3,) at an arm (3,) from the point, such as
            `{"stretch": lambda r: r * jnp.array([1.0, 0, 0])}`; each becomes a coordinate "name stretch".

    Raises: ModelError for unknown channels, and positions that do not determine all coordinates.
    Source: S1 (14); M. van der Seijs et al., Mech. Syst. Signal Process. 96 (2017) 81; flexible motions: E. Pasma et
    al., Dynamics of Coupled Structures 4 (2018) 205.
    """
    rows, columns = measured.rows(tuple(sensors)), measured.columns(tuple(impacts))
    motions = dict(flexible or {})
    kept = 6 + len(motions)
    few = [f"{len(p)} {what}" for what, p in (("sensors", sensors), ("impacts", impacts)) if len(p) < kept]
    if few:
        raise ModelError([f"{count} are too few to determine {kept} coordinates" for count in few])
    R, Rf = (_channel_matrix(list(p.values()), point, motions) for p in (sensors, impacts))
    faults = [fault for what, M in (("sensors", R), ("impacts", Rf)) for fault in _rank_faults(what, M)]
    if faults:
        raise ModelError(faults)
    weighted = R if weights is None else R * as_dtype(weights, R.dtype)[:, None]
    dtype = measured.values.dtype
    T = square.solve(weighted.T @ R, weighted.T).astype(dtype)
    Tf = square.solve(Rf.T @ Rf, Rf.T).astype(dtype)
    R, Rf, Y = R.astype(dtype), Rf.astype(dtype), measured.values
    other_rows, other_columns = (
        np.setdiff1d(np.arange(len(names)), used)
        for names, used in ((measured.outputs, rows), (measured.inputs, columns))
    )
    tall = jnp.concatenate([T @ Y[:, rows], Y[:, other_rows]], axis=1)
    values = jnp.concatenate([tall[:, :, columns] @ Tf.T, tall[:, :, other_columns]], axis=2)
    own = [f"{name} {coordinate}" for coordinate in (*DIRECTIONS, *motions)]
    transfer = TransferFunctions(
        measured.omega,
        values,
        own + [measured.outputs[i] for i in other_rows],
        own + [measured.inputs[i] for i in other_columns],
        measured.kind,
    )
    moved, driven = Y[:, rows], Y[:, :, columns]
    return VirtualPoint(
        transfer,
        _residual_share(moved - R @ (T @ moved), moved, 1),
        _residual_share(driven - (driven @ Tf.T) @ Rf.T, driven, 2),
    )


def _channel_matrix(places, point, motions):
    R = rigid_channels(places, point)
    more = [flexible_channels(places, point, motion).astype(R.dtype)[:, None] for motion in motions.values()]
    return jnp.concatenate([R, *more], axis=1)


def _residual_share(rest, whole, axis):
    rest, whole = (jnp.sum(jnp.abs(a) ** 2, axis=axis) for a in (rest, whole))
    share = rest / jnp.where(whole > 0, whole, 1.0)
    return jnp.where(share > 0, jnp.sqrt(jnp.where(share > 0, share, 1.0)), 0.0)


def _rank_faults(what, R):
    """Faults of concrete positions that do not determine all coordinates; lengths are scaled by the largest arm."""
    if not is_concrete(R):
        return []
    R = np.asarray(R)
    if not np.all(np.isfinite(R)):
        return [f"places or directions of the {what}, or the point, are not finite"]
    size = np.concatenate([np.ones(3), np.full(3, np.abs(R[:, 3:6]).max()), np.abs(R[:, 6:]).max(axis=0)])
    s = np.linalg.svd(R / np.maximum(size, 1e-300)[None], compute_uv=False)
    rank, kept = int(np.sum(s > 1e-6 * s[0])), len(size)
    return (
        []
        if rank == kept
        else [f"the {what} determine only {rank} of {kept} coordinates: vary their positions and directions"]
    )
