"""Networks with components known by measured transfer functions only, solved by frequency."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float

from ..checks import distinct_names, is_concrete
from ..errors import UnknownNameError
from ..linear._labels import find_rows, format_label, parse_label
from ..linear._system import LinearSystem
from ..linear._transfer import TransferFunctions
from ..runtime import as_dtype
from ..tables import sentence_repr
from ..typing import ArrayLike
from ..vibration._direct_response import dynamic_stiffness
from ..vibration._system_analysis import frequency_response as response_of
from ._bond_loads import BondLoad, BondLoads
from ._bonds import Bond
from ._rigid_body import RigidBody
from ._ties import Channels, Ties, split_component
from ._transfer_functions import add_stiffness, couple_transfer, coupling_forces
from ._uncoupled_transfer import block_diagonal, check_compatible


class _CoupledTransfer(NamedTuple):
    """Transfer functions before and after the rigid bonds, channels of the bonds, and requested channels."""

    apart: TransferFunctions
    together: TransferFunctions
    pairs: list
    bushings: dict
    asked: list


class MeasuredNetwork(eqx.Module):
    """Components joined by bonds, as `connect` makes it where some are `TransferFunctions`.

    It answers `frequency_response` at the measured frequencies, by names as of a `Network`: "rig.foot z", and
    `reactions` of that.  What was not measured cannot be asked: neither modes nor motions.

    Attributes:
        components: by name, measured ones as receptances.
        bonds: by name.
        ties: pairs (name of the bond, its `Ties`).
    """

    components: dict[str, TransferFunctions | LinearSystem]
    bonds: dict[str, Bond]
    ties: tuple[tuple[str, Ties], ...] = eqx.field(static=True)

    __repr__, _repr_html_ = sentence_repr(lambda network: network._words())

    def _words(self):
        measured = self.measured
        names = (f"{name} ({'measured' if name in measured else 'a model'})" for name in self.components)
        hertz = np.asarray(self.omega) / (2 * np.pi)
        return (
            f"{', '.join(names)}, joined by {', '.join(self.bonds) or 'nothing'}; {hertz.size} frequencies from "
            f"{hertz.min():.4g} to {hertz.max():.4g} Hz"
        )

    def __init__(self, components: Mapping, bonds: Mapping[str, Bond], ties: Mapping[str, Ties]) -> None:
        self.components = {
            name: c.to("receptance") if isinstance(c, TransferFunctions) else c for name, c in components.items()
        }
        check_compatible(self.measured)
        self.bonds, self.ties = dict(bonds), tuple(ties.items())

    @property
    def measured(self) -> dict[str, TransferFunctions]:
        """Components that are known by transfer functions, by name."""
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
            regular: `rank`, `rcond`, `noise`, `weights` of `coupling.regularised_inverse`, for noisy interfaces.

        Raises: UnknownNameError; ValueError for frequencies that were not measured.
        Source: S1 (1)-(3), (40)-(41).
        """
        into, out = distinct_names("into", into), distinct_names("out", out)
        coupled = self._couple_components(omega, into, out, loss, regular)
        return coupled.together.at(*coupled.asked)

    def reactions(self, response: TransferFunctions, loss: ArrayLike = 0.0, **regular: Any) -> BondLoads:
        """Loads of the bonds for unit forces at the inputs of a `frequency_response` of this network.

        Args: loss, regular: as given to `frequency_response`.

        Returns: loads (frequencies, inputs, k) by bond; `residual` is the largest gap between coordinates tied by
        rigid bonds, relative to the largest motion there: rounding, except for a truncated or damped inverse.
        Source: S1 (1)-(2), (25).
        """
        coupled = self._couple_components(response.omega, response.inputs, (), loss, regular)
        columns = coupled.together.columns(coupled.asked[1])
        rigid = iter(())
        residual = jnp.zeros((), self.omega.dtype)
        if coupled.pairs:
            forces = coupling_forces(coupled.apart, coupled.pairs, **regular)[:, :, columns]
            rigid = iter(jnp.moveaxis(forces, 1, 0))
            residual = _largest_gap(coupled.together, coupled.pairs)
        bonds = {}
        for name, ties in self.ties:
            if name in coupled.bushings:
                channels, Z = coupled.bushings[name]
                moved = coupled.together.values[:, coupled.together.rows(channels)][:, :, columns]
                f = -jnp.swapaxes(Z[:, :, : len(channels)] @ moved, 1, 2)
                first, second = jnp.split(f, 2, axis=-1)
            else:
                along = {k: next(rigid) for k in ties.kept}
                zero = jnp.zeros((len(response.omega), len(columns)), coupled.together.values.dtype)
                first = jnp.stack([along.get(k, zero) for k in range(len(ties.labels))], axis=-1)
                second = -first
            bonds[name] = BondLoad(first, second, ties.labels)
        return BondLoads(bonds, residual)

    def _couple_components(self, omega, into, out, loss, regular):
        places = self._places(omega)
        omega, loss = self.omega[places], as_dtype(loss, self.omega.dtype)
        asked = self._channels(out, "outputs"), self._channels(into, "inputs")
        tied = [coordinate for _, ties in self.ties for end in ties.ends for coordinate in end]
        tied = [(name, channel_name(self.components[name], k)) for name, k in tied]
        parts = {}
        for name, c in self.components.items():
            sides = [list(dict.fromkeys(own for n, own in (*side, *tied) if n == name)) for side in asked]
            if any(sides):
                parts[name] = _component_receptance(c, places, omega, loss, *sides)
        Y, pairs, bushings = block_diagonal(_unify_dtypes(parts), "."), [], {}
        for name, ties in self.ties:
            Y, ends = self._ends(Y, name, ties)
            element = self.bonds[name].element
            if element is None:
                pairs += [(ends[0][k], ends[1][k] if ends[1] else None) for k in ties.kept]
            else:
                bushings[name] = [*ends[0], *ends[1]], _bushing_impedance(element, omega, loss).astype(Y.values.dtype)
        for channels, Z in bushings.values():
            Y = add_stiffness(Y, channels, Z[:, : len(channels), : len(channels)])  # a second end in the ground rests
        names = [[".".join(channel) for channel in side] for side in asked]
        return _CoupledTransfer(Y, couple_transfer(Y, pairs, **regular) if pairs else Y, pairs, bushings, names)

    def _ends(self, Y, name, ties):
        """Channels of a bond's ends; in its axes, if it has any, as additional channels."""
        bond = self.bonds[name]
        ends = [[f"{n}.{channel_name(self.components[n], k)}" for n, k in end] for end in ties.ends]
        for side, end in enumerate(ends):
            if end and bond.axes is not None:
                ends[side] = [f"{name}.{side}.{k}" for k in range(len(end))]  # no component bears the name of a bond
                Y = _append_resolved_channels(Y, end, ends[side], bond.axes)
        return Y, ends

    def _places(self, omega):
        """Indices of the requested frequencies among the measured ones."""
        measured, asked = self.omega, as_dtype(omega, self.omega.dtype)
        if asked.ndim != 1:
            raise ValueError(f"omega has shape {asked.shape}, not (frequencies,)")
        if not is_concrete(measured, asked):
            if asked.shape != measured.shape:
                raise ValueError(
                    f"under tracing all {len(measured)} measured frequencies must be given, not {len(asked)}"
                )
            return np.arange(len(measured))
        measured, asked = np.asarray(measured), np.asarray(asked)
        places = np.argmin(np.abs(measured[None, :] - asked[:, None]), axis=1)
        far = asked[np.abs(measured[places] - asked) > 1e-6 * np.max(np.abs(measured))]
        if len(far):
            raise ValueError(
                f"omega = {far[0]:.6g} rad/s was not measured: there are {len(measured)} frequencies, "
                f"{measured.min():.6g} to {measured.max():.6g}, `net.omega`"
            )
        return places

    def _channels(self, names, side) -> list[tuple[str, str]]:
        """Pairs (component, channel) of names, a node giving all its directions."""
        pairs = []
        for name in names:
            component, node = split_component(name, self.components)
            c = self.components[component]
            if isinstance(c, LinearSystem):
                pairs += [(component, channel) for channel in c.outputs(node)[1]]
                continue
            faults, channels = [], getattr(c, side)
            rows = find_rows([node], [parse_label(channel) for channel in channels], faults)
            if faults:
                raise UnknownNameError(f"{side} of {component!r}: {faults[0]}")
            pairs += [(component, channels[row]) for row in rows]
        return pairs


def bond_channels(measured: TransferFunctions) -> Channels:
    """Channels that bonds may tie: those that are both driven and measured."""
    return Channels(tuple(parse_label(name) for name in _collocated_channels(measured)))


def channel_name(component, k: int) -> str:
    """Name of the interface coordinate number k of a component."""
    if isinstance(component, TransferFunctions):
        return _collocated_channels(component)[k]
    channels = component.channels if isinstance(component, RigidBody) else component
    return format_label(channels.coordinates[channels.interface[k]])


def _collocated_channels(measured):
    return [name for name in measured.outputs if name in measured.inputs]


def _component_receptance(c, places, omega, loss, rows, columns):
    if isinstance(c, TransferFunctions):
        some = TransferFunctions(omega, c.values[places], c.outputs, c.inputs)
        return some.at(rows, columns)
    return response_of(c, omega, into=columns, out=rows, loss=loss)


def _unify_dtypes(parts):
    dtype = np.result_type(*(part.values.dtype for part in parts.values()))
    return {name: part.with_values(part.values.astype(dtype)) for name, part in parts.items()}


def _append_resolved_channels(Y, names, own, axes):
    """Append channels with the coordinates x y z (rx ry rz) of a node resolved in axes."""
    turn = jnp.kron(jnp.eye(len(names) // 3), jnp.asarray(axes)).astype(Y.values.dtype)
    values = jnp.concatenate([Y.values, turn @ Y.values[:, Y.rows(names)]], axis=1)
    values = jnp.concatenate([values, values[:, :, Y.columns(names)] @ turn.T], axis=2)
    return TransferFunctions(Y.omega, values, [*Y.outputs, *own], [*Y.inputs, *own])


def _bushing_impedance(element, omega, loss):
    """Dynamic stiffness (frequencies, 2 k, 2 k) of a bushing."""
    K = element.stiffness.astype(np.result_type(element.dtype, np.complex64))
    K = K * lax.complex(jnp.ones_like(loss), loss).astype(K.dtype)
    return jax.vmap(lambda w: dynamic_stiffness(K, element.damping, element.mass, w))(omega)


def _largest_gap(Y, pairs):
    first = Y.values[:, Y.rows([one for one, _ in pairs])]
    others = [None if other is None else Y.values[:, Y.rows([other])[0]] for _, other in pairs]
    second = jnp.stack([jnp.zeros_like(first[:, 0]) if x is None else x for x in others], axis=1)
    size = jnp.max(jnp.abs(Y.values))
    return jnp.max(jnp.abs(first - second)) / jnp.where(size > 0, size, 1.0)
