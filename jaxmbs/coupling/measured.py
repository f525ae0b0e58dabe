"""Networks of components of which some are known by measured transfer functions: what they answer by frequency."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import known
from ..errors import ModelError, UnknownNameError
from ..linear.dynamic_stiffness import dynamic_stiffness
from ..linear.labels import label, rows_of
from ..linear.questions import frequency_response as response_of
from ..linear.system import LinearSystem
from ..linear.transfer import TransferFunctions
from ..typing import ArrayLike
from .bonds import Bond
from .ties import Channels, Ties, component_of
from .transfer_functions import couple, with_stiffness
from .uncoupled import beside, check_alike


class MeasuredNetwork(eqx.Module):
    """Components joined by bonds, as `connect` makes it where some are `TransferFunctions`.

    It answers `frequency_response` at the measured frequencies, by names as of a `Network`: "rig.foot z".  What was
    not measured cannot be asked: neither modes nor motions.

    Attributes:
        components: by name, measured ones as receptances.
        bonds: by name.
        ties: `(name, what the bond ties)`.
    """

    components: dict[str, TransferFunctions | LinearSystem]
    bonds: dict[str, Bond]
    ties: tuple[tuple[str, Ties], ...] = eqx.field(static=True)

    def __init__(self, components: Mapping, bonds: Mapping[str, Bond], ties: Mapping[str, Ties]) -> None:
        self.components = {
            name: c.to("receptance") if isinstance(c, TransferFunctions) else c for name, c in components.items()
        }
        check_alike(self.measured)
        self.bonds, self.ties = dict(bonds), tuple(ties.items())

    def asked(self, question: str) -> Callable:
        """The method that answers a question.  Raises: ModelError for one that measurements cannot answer."""
        if question != "frequency_response":
            names = ", ".join(map(repr, self.measured))
            raise ModelError([f"{question} cannot be asked: {names} known by measurement; ask frequency_response"])
        return self.frequency_response

    @property
    def measured(self) -> dict[str, TransferFunctions]:
        """The components that are known by transfer functions, by name."""
        return {name: c for name, c in self.components.items() if isinstance(c, TransferFunctions)}

    @property
    def omega(self) -> Float[Array, " frequencies"]:
        """The measured frequencies [rad/s]."""
        return next(iter(self.measured.values())).omega

    def frequency_response(
        self,
        omega: ArrayLike,
        into: Sequence,
        out: Sequence,
        loss: ArrayLike = 0.0,
        **regular: Any,
    ) -> TransferFunctions:
        """Displacements at names for unit forces at names.

        Args:
            omega: (frequencies,) [rad/s], all or some of those measured.
            into, out: channels "rig.foot z" of measured components; of linear systems as of a `Network`.
            loss: loss factor of the stiffness of linear systems and bushings.
            regular: `rank`, `rcond`, `noise`, `weights` of `experiment.regular_inverse`, for noisy interfaces.

        Raises: UnknownNameError; ValueError for frequencies that were not measured.
        Source: S1 (1)-(3), (40)-(41).
        """
        places = self._places(omega)
        omega, loss = self.omega[places], jnp.asarray(loss, self.omega.dtype)
        rows, columns = self._channels(out, "outputs"), self._channels(into, "inputs")
        tied = [coordinate for _, ties in self.ties for end in ties.ends for coordinate in end]
        tied = [(name, channel_name(self.components[name], k)) for name, k in tied]
        parts = {}
        for name, c in self.components.items():
            sides = [list(dict.fromkeys(own for n, own in (*asked, *tied) if n == name)) for asked in (rows, columns)]
            if any(sides):
                parts[name] = _receptances(c, places, omega, loss, *sides)
        Y, pairs = beside(_alike(parts), "."), []
        for name, ties in self.ties:
            Y, more = self._bonded(Y, name, ties, loss)
            pairs += more
        Y = couple(Y, pairs, **regular) if pairs else Y
        return Y.at(*([".".join(channel) for channel in asked] for asked in (rows, columns)))

    def _bonded(self, Y, name, ties, loss):
        """With the channels of the bond's axes and the stiffness of a bushing; the pairs that a rigid bond ties."""
        bond = self.bonds[name]
        ends = [[f"{n}.{channel_name(self.components[n], k)}" for n, k in end] for end in ties.ends]
        if bond.axes is not None:
            for side, end in enumerate(end for end in ends if end):
                ends[side] = [f"{name}.{side}.{k}" for k in range(len(end))]  # no component bears the name of a bond
                Y = _turned(Y, end, ends[side], bond.axes)
        if bond.element is not None:
            channels = [*ends[0], *ends[1]]
            return with_stiffness(Y, channels, _impedance(bond.element, Y.omega, loss, len(channels))), []
        first, second = ends
        return Y, [(first[k], second[k] if second else None) for k in ties.kept]

    def _places(self, omega):
        """Which of the measured frequencies are asked."""
        own, asked = self.omega, jnp.asarray(omega, self.omega.dtype)
        if asked.ndim != 1:
            raise ValueError(f"omega has shape {asked.shape}, not (frequencies,)")
        if not known(own, asked):
            if asked.shape != own.shape:
                raise ValueError(f"traced: ask all {len(own)} measured frequencies, not {len(asked)}")
            return np.arange(len(own))
        own, asked = np.asarray(own), np.asarray(asked)
        places = np.argmin(np.abs(own[None, :] - asked[:, None]), axis=1)
        far = asked[np.abs(own[places] - asked) > 1e-6 * np.max(np.abs(own))]
        if len(far):
            raise ValueError(
                f"omega = {far[0]:.6g} rad/s was not measured: there are {len(own)} frequencies, "
                f"{own.min():.6g} to {own.max():.6g}, `net.omega`"
            )
        return places

    def _channels(self, names, side) -> list[tuple[str, str]]:
        """(component, channel) of names, all directions of a node among them."""
        found = []
        for name in names:
            component, own = component_of(name, self.components)
            c = self.components[component]
            if isinstance(c, LinearSystem):
                found += [(component, channel) for channel in c.outputs(own)[1]]
                continue
            faults, channels = [], getattr(c, side)
            rows = rows_of([own], [label(channel) for channel in channels], faults)
            if faults:
                raise UnknownNameError(f"{side} of {component!r}: {faults[0]}")
            found += [(component, channels[row]) for row in rows]
        return found


def channels_of(measured: TransferFunctions) -> Channels:
    """What bonds may tie: the channels that are driven and measured at one place."""
    return Channels(tuple(label(name) for name in _collocated(measured)))


def channel_name(component, k: int) -> str:
    """Of the interface coordinate number k."""
    if isinstance(component, TransferFunctions):
        return _collocated(component)[k]
    return component.label(component.interface[k])


def _collocated(measured):
    return [name for name in measured.outputs if name in measured.inputs]


def _receptances(c, places, omega, loss, rows, columns):
    if isinstance(c, TransferFunctions):
        some = TransferFunctions(omega, c.values[places], c.outputs, c.inputs)
        return some.at(rows, columns)
    return response_of(c, omega, into=columns, out=rows, loss=loss)


def _alike(parts):
    dtype = np.result_type(*(part.values.dtype for part in parts.values()))
    return {name: part.replace(part.values.astype(dtype)) for name, part in parts.items()}


def _turned(Y, names, own, axes):
    """With channels of a node's x y z (rx ry rz) resolved in axes."""
    turn = jnp.kron(jnp.eye(len(names) // 3), jnp.asarray(axes)).astype(Y.values.dtype)
    values = jnp.concatenate([Y.values, turn @ Y.values[:, Y.rows(names)]], axis=1)
    values = jnp.concatenate([values, values[:, :, Y.columns(names)] @ turn.T], axis=2)
    return TransferFunctions(Y.omega, values, [*Y.outputs, *own], [*Y.inputs, *own])


def _impedance(element, omega, loss, size):
    """(frequencies, size, size) of a bushing; of its first end alone where the second is held."""
    K = element.stiffness.astype(np.result_type(element.dtype, np.complex64))
    K = K * lax.complex(jnp.ones_like(loss), loss).astype(K.dtype)
    return jax.vmap(lambda w: dynamic_stiffness(K, element.damping, element.mass, w))(omega)[:, :size, :size]
