"""Removal of a test rig by computation, from measured support forces or a known rig."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..checks import distinct_names, require_numbers
from ..coupling._regularised_inverse import regularised_inverse
from ..coupling._transfer_functions import add_stiffness
from ..errors import ModelError
from ..linear._transfer import TransferFunctions
from ..math import _square as square
from ..quantities import Axis, Quantity, numbered
from ..reports import Report, reported
from ..typing import ArrayLike


@reported
class FreeResponse(NamedTuple):
    """Receptance of the free structure and the relative residual of the measured motions.

    Attributes:
        receptance: (frequencies, outputs, inputs) complex.
        residual: (frequencies,), the share of the motions that the receptance does not explain; rounding where there
            are only as many runs as inputs.
    """

    receptance: Complex[Array, "frequencies outputs inputs"]
    residual: Float[Array, " frequencies"]

    def report(self) -> Report:
        frequency = Axis("frequency", np.arange(len(self.residual)))
        output, channel = (
            numbered(*pair) for pair in zip(("output", "input"), self.receptance.shape[1:], strict=True)
        )
        return Report(
            [
                Quantity("residual", self.residual, "", (frequency,)),
                Quantity("receptance", self.receptance, "m/N", (frequency, output, channel)),
            ],
            f"{len(self.residual)} frequencies",
        )


def free_response(
    motions: ArrayLike,
    exciters: ArrayLike,
    supports: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    rcond: ArrayLike = 0.0,
    noise: ArrayLike = 0.0,
) -> FreeResponse:
    """Receptance of the free structure, `B_free = X (F + R)^+` over the runs at each frequency.

    Args:
        motions: X (frequencies, outputs, runs), complex amplitudes of any kind (displacement, acceleration).
        exciters: F (frequencies, inputs, runs), forces of the exciters on the structure [N].
        supports: R (frequencies, inputs, runs), measured forces of the supports on the structure [N], at the same
            inputs, or None.
        weights: (runs,), one over the standard deviation of each run's motions.
        rcond, noise: of `regularised_inverse`.

    The inputs are all points where a force acts, supports included; at least as many runs are needed, with exciters
    at different points or in different phases.

    Raises: ModelError for shapes that do not match and too few runs.
    Source: S1 (41), Figs 4-5.
    """
    require_numbers(motions=motions, exciters=exciters)
    motions, exciters = jnp.asarray(motions), jnp.asarray(exciters)
    supports, weights = (None if a is None else jnp.asarray(a) for a in (supports, weights))
    faults = _shape_faults(motions, exciters, supports, weights)
    if faults:
        raise ModelError(faults)
    force = exciters if supports is None else exciters + supports
    if weights is not None:
        w = weights.astype(force.dtype)[None, None, :]
        motions, force = motions * w, force * w
    B = motions @ regularised_inverse(force, rcond=rcond, noise=noise)
    rest, size = (jnp.sum(jnp.abs(a) ** 2, axis=(1, 2)) for a in (motions - B @ force, motions))
    safe = jnp.where(rest > 0, rest, 1.0)
    return FreeResponse(B, jnp.where(rest > 0, jnp.sqrt(safe / jnp.where(size > 0, size, 1.0)), 0.0))


def _shape_faults(motions, exciters, supports, weights):
    shapes = {"motions": motions.shape, "exciters": exciters.shape}
    if supports is not None:
        shapes["supports"] = supports.shape
    faults = [
        f"{name} have shape {s}, not (frequencies, channels, runs)" for name, s in shapes.items() if len(s) != 3
    ]
    if faults:
        return faults
    frequencies, inputs, runs = exciters.shape
    if supports is not None and supports.shape != exciters.shape:
        faults.append(f"supports have shape {supports.shape}, exciters {exciters.shape}: give zeros where none acts")
    if (motions.shape[0], motions.shape[2]) != (frequencies, runs):
        faults.append(f"motions have shape {motions.shape}, exciters {exciters.shape}: frequencies and runs differ")
    if runs < inputs:
        faults.append(f"{runs} runs are too few for {inputs} inputs: measure at least {inputs} different excitations")
    if weights is not None and weights.shape != (runs,):
        faults.append(f"weights have shape {weights.shape}, not ({runs},)")
    return faults


def remove_stiffness(measured: TransferFunctions, channels: Sequence[str], stiffness: ArrayLike) -> TransferFunctions:
    """Remove a rig of known dynamic stiffness from a measured structure: `(B^-1 - Z)^-1` at the channels.

    It is computed as `B + B Z (I - B Z)^-1 B`, which includes channels off the rig and needs no inverse of B.

    Args:
        channels: names of the channels at the rig, both outputs and inputs.
        stiffness: Z, (channels, channels) or (frequencies, channels, channels), force per displacement [N/m], complex
            with damping and mass: `K + i w C - w^2 M`.  With the opposite sign it adds a rig.

    Source: S1 (41).
    """
    require_numbers(stiffness=stiffness)
    Z = jnp.asarray(stiffness, measured.values.dtype)
    channels = distinct_names("channels", channels)
    n = len(channels)
    if Z.shape not in {(n, n), (len(measured.omega), n, n)}:
        raise ModelError([f"the rig's stiffness has shape {Z.shape}; {n} channels need ({n}, {n}) at each frequency"])
    B = measured.to("receptance")
    Z = Z if Z.ndim == 3 else Z[None]
    return add_stiffness(B, channels, -Z).to(measured.kind)


def measured_stiffness(
    measured: TransferFunctions, channels: Sequence[str] | None = None
) -> tuple[Float[Array, "frequencies n n"], Float[Array, "frequencies n n"]]:
    """Dynamic stiffness `H + j J` [N/m], the inverse of the receptance: real and imaginary parts.

    Returns: (H, J), each (frequencies, n, n).

    Raises: ModelError where outputs and inputs are not the same channels.  Source: S1 (41).
    """
    B = measured.to("receptance")
    channels = B.outputs if channels is None else distinct_names("channels", channels)
    B = B.at(channels, channels).values
    Z = jax.vmap(square.inverse)(B)
    return Z.real, Z.imag
