"""The four-post rig: heights of four posts over a road in time, and responses to their motions over frequency."""

from collections.abc import Iterable, Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..analysis import Linearisation
from ..checks import any_concrete, distinct_names, no_such, not_positive, shape_of
from ..errors import ModelError
from ..forces import Spline
from ..forces._fields import number
from ..math import _square as square
from ..quantities import Axis, Quantity
from ..reports import Report, Reported
from ..typing import ArrayLike, ScalarLike, WordedError

CORNERS = ("front left", "front right", "rear left", "rear right")
#: Heights of the four posts in each motion of the rig, by name.
_MOTIONS = {"heave": (1, 1, 1, 1), "pitch": (1, 1, -1, -1), "roll": (1, -1, 1, -1), "warp": (1, -1, -1, 1)}
_TRACKS = ("left", "right")


def post_heights(
    x: ArrayLike, tracks: ArrayLike, speed: ScalarLike, wheels: Mapping[str, tuple[ScalarLike, str]]
) -> dict[str, Spline]:
    """Heights of posts that move as the road moves under a car, as functions of time by name of the wheel.

    Args:
        x: (points,) rising places along the road [m]; the hindmost wheel is at the first one at time zero.
        tracks: (points, 2) heights of the left and the right track [m], as of `RandomRoad.profile`; or (points,).
        speed: > 0 [m/s].
        wheels: by name, as "front left" of a `car`, the place along the vehicle, forwards [m], and "left" or "right".

    `car(..., posts=heights.get)` puts a car on them.  Raises: ModelError with every fault.
    """
    shape = shape_of(tracks)
    faults = [f"wheel {name!r} must be like (1.2, 'left')" for name, at in wheels.items() if not _is_place(at)]
    if not_positive(speed) or shape_of(speed):
        faults.append("speed must be one positive number")
    if len(shape_of(x)) != 1 or shape not in (shape_of(x), (*shape_of(x), 2)):
        faults.append(f"x must be (points,) and tracks (points, 2) or (points,), not {shape_of(x)} and {shape}")
    if any_concrete(lambda x: ~(np.diff(x, prepend=-np.inf) > 0.0), x):
        faults.append("x must rise")
    if faults or not wheels:
        raise ModelError(faults or ["wheels must be {name: (place, 'left' or 'right')}"], "the posts")
    heights, last = number(tracks), jnp.min(jnp.stack([number(place) for place, _ in wheels.values()]))
    of_track = lambda track: heights if heights.ndim == 1 else heights[:, _TRACKS.index(track)]
    times = lambda place: (number(x) - number(x)[0] - (number(place) - last)) / number(speed)
    return {name: Spline(times(place), of_track(track)) for name, (place, track) in wheels.items()}


def _is_place(at):
    return isinstance(at, tuple | list) and len(at) == 2 and shape_of(at[0]) == () and at[1] in _TRACKS


class FourPost(Reported, eqx.Module):
    """Responses on the four-post rig.

    Attributes:
        frequencies: (n,) [Hz].
        transfer: (n, outputs, motions) complex, over the height of the posts [per m].
        outputs, motions: names (static).
    """

    frequencies: Float[Array, " n"]
    transfer: Complex[Array, "n outputs motions"]
    outputs: tuple[str, ...] = eqx.field(static=True)
    motions: tuple[str, ...] = eqx.field(static=True)

    def report(self) -> Report:
        axes = (Axis("frequency", np.asarray(self.frequencies), "Hz"), Axis("output", self.outputs))
        return Report([Quantity("transfer", self.transfer, "1/m", (*axes, Axis("motion", self.motions)))])


def four_post(
    linearisation: WordedError[Linearisation],
    frequencies: ArrayLike,
    posts: Iterable[str] | None = None,
    motions: Iterable[str] = tuple(_MOTIONS),
) -> FourPost:
    """Responses of a car on the four-post rig to heave, pitch, roll and warp of its posts.

    Args:
        linearisation: of a car on posts, `linearise(system, state, inputs=[...posts], outputs=...)`.
        frequencies: (n,) [Hz], positive.
        posts: the inputs that are the posts at front left, front right, rear left and rear right; by default those
            of `car(posts=...)`, "front left post" and so on.
        motions: "heave" (all up), "pitch" (front up, rear down), "roll" (left up, right down), "warp" (front left and
            rear right up, the others down); each post moves by one height.

    Raises: ModelError with every fault.
    """
    if not isinstance(linearisation, Linearisation):
        raise ModelError(["the rig takes small motions about a state: linearise the car first"], "the rig")
    posts = distinct_names("posts", [f"{name} post" for name in CORNERS] if posts is None else posts)
    motions, names = distinct_names("motions", motions), linearisation.input_names
    faults = [no_such("input", name, names) for name in posts if name not in names]
    faults += [no_such("motion", name, _MOTIONS) for name in motions if name not in _MOTIONS]
    faults += [] if len(posts) == len(CORNERS) else [f"posts must be four, not {len(posts)}"]
    faults += [] if len(shape_of(frequencies)) == 1 else ["frequencies must be (n,)"]
    faults += ["frequencies must be positive"] if not_positive(frequencies) else []
    if faults:
        raise ModelError(faults, "the rig")
    A, B, C, D = linearisation.state_space
    columns = np.array([names.index(name) for name in posts])
    shapes = jnp.asarray(np.array([_MOTIONS[name] for name in motions], float).T.reshape(len(CORNERS), -1), B.dtype)
    B, D = B[:, columns] @ shapes, D[:, columns] @ shapes
    f = number(frequencies)

    def response(w: Any) -> Any:
        rate = jax.lax.complex(jnp.zeros_like(w), w)
        a, b, c, d = (x.astype(rate.dtype) for x in (A, B, C, D))
        return rate**2 * (c @ square.solve(rate * jnp.eye(len(a), dtype=a.dtype) - a, b) + d)

    return FourPost(f, jax.vmap(response)(2.0 * np.pi * f), linearisation.output_names, motions)
