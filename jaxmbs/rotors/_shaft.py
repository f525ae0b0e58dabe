"""Shafts of circular sections: mass, gyroscopic matrix and stiffness of bending in one plane.

Coordinates of a station are deflection and slope (of the section, where it shears); both planes have equal matrices.
"""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from ..checks import any_concrete, check_count, faults_if
from ..errors import ModelError
from ..runtime import as_array
from ..tables import fields_repr
from ..typing import ArrayLike, Convertible

_MOST = 10_000


class Shaft(eqx.Module):
    """A shaft of cylindrical and tubular sections between stations.

    Attributes:
        stations: (N + 1,) places along the axis [m], rising.
        outer, inner: (N,) radii of the sections [m], inner by default 0.
        young [Pa]; density [kg/m^3].
        poisson: ratio; with it sections shear (Timoshenko, with Cowper's shear factor), without it they do not.
        divisions: number of elements of each section, one or (N,) (static).  Equal lengths are best: very short
            elements cost digits, a thousandth of the largest nine of them.

    Euler-Bernoulli or Timoshenko elements with the rotary inertia of sections, consistent mass.  Source: Nelson, A
    finite rotating shaft element using Timoshenko beam theory (1980); Cowper, The shear coefficient in Timoshenko's
    beam theory (1966).

    Raises: ModelError for places that do not rise, radii that are no tube, numbers that are not positive.
    """

    stations: Convertible[Float[Array, " stations"]] = eqx.field(converter=as_array)
    outer: Convertible[Float[Array, " sections"]] = eqx.field(converter=as_array)
    inner: Convertible[Float[Array, " sections"]] = eqx.field(converter=as_array)
    young: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)
    density: Convertible[Float[Array, ""]] = eqx.field(converter=as_array)
    poisson: Array | None
    divisions: tuple[int, ...] = eqx.field(static=True)

    __repr__ = fields_repr

    def __init__(
        self,
        stations: ArrayLike,
        outer: ArrayLike,
        inner: ArrayLike = 0.0,
        young: ArrayLike = 2.1e11,
        density: ArrayLike = 7850.0,
        poisson: ArrayLike | None = None,
        divisions: int | Sequence[int] = 1,
    ) -> None:
        self.stations = as_array(stations)
        shape = (max(self.stations.size - 1, 0),)
        outer, inner = (as_array(x) for x in (outer, inner))
        divisions = [divisions] * shape[0] if isinstance(divisions, int) else list(divisions)
        for number in divisions:
            check_count("divisions", number, 1)
        if any(number > _MOST for number in divisions):
            raise ModelError([f"divisions must be at most {_MOST} elements in a section"], "the shaft")
        faults = faults_if(
            (self.stations.ndim != 1 or self.stations.size < 2, "stations must be at least two places"),
            (any_concrete(lambda x: ~(np.diff(x) > 0), self.stations), "stations must rise along the axis"),
            (len(divisions) != shape[0], f"divisions must be one number or {shape[0]}, one for each section"),
            *((x.shape not in ((), shape), f"{n} must be one radius or {shape[0]}") for n, x in _both(outer, inner)),
            (
                any_concrete(lambda a, b: ~((b >= 0) & (a > b)), outer, inner),
                "outer radii must be above the inner ones",
            ),
            *(
                (
                    any_concrete(lambda v: ~(np.isfinite(v) & (v > 0)), x) or np.ndim(x) > 0,
                    f"{n} must be one positive number",
                )
                for n, x in (("young", young), ("density", density))
            ),
            (
                poisson is not None and any_concrete(lambda v: ~((v > -1.0) & (v <= 0.5)), poisson),
                "poisson must lie between -1 and 0.5",
            ),
        )
        if faults:
            raise ModelError(faults, "the shaft")
        self.outer, self.inner = (jnp.broadcast_to(x, shape) for x in (outer, inner))
        self.young, self.density = as_array(young), as_array(density)
        self.poisson = None if poisson is None else as_array(poisson)
        self.divisions = tuple(int(k) for k in divisions)

    @property
    def num_nodes(self) -> int:
        """Number of nodes: stations and the places between them."""
        return sum(self.divisions) + 1

    def node(self, station: int) -> int:
        """Number of the node at a station."""
        return sum(self.divisions[:station])

    def plane(self) -> tuple[Array, Array, Array]:
        """Mass, gyroscopic matrix and stiffness (2 nodes, 2 nodes) of one plane: `M r'' - i W G r' + K r = f` for the
        complex deflection `r = x + i y` at the speed W."""
        section = np.repeat(np.arange(len(self.divisions)), self.divisions)
        lengths = jnp.diff(self.stations)[section] / jnp.asarray(
            np.array(self.divisions)[section], self.stations.dtype
        )
        outer, inner = self.outer[section], self.inner[section]
        parts = jax.vmap(self._element)(lengths, outer, inner)
        n, places = 2 * self.num_nodes, 2 * np.arange(lengths.shape[0])[:, None] + np.arange(4)
        rows, columns = places[:, :, None], places[:, None, :]
        M, G, K = (jnp.zeros((n, n), x.dtype).at[rows, columns].add(x) for x in parts)
        return M, G, K

    def _element(self, l, outer, inner):
        """The same of one element (4, 4)."""
        area, bending = jnp.pi * (outer**2 - inner**2), jnp.pi / 4.0 * (outer**4 - inner**4)
        p, E, rho = self._shear_ratio(l, area, bending, inner / outer), self.young, self.density
        K = _symmetric([12.0, 6.0, -12.0, 6.0, 4.0 + p, -6.0, 2.0 - p, 12.0, -6.0, 4.0 + p])
        mass = _symmetric(
            [
                *(13 / 35 + 7 * p / 10 + p**2 / 3, 11 / 210 + 11 * p / 120 + p**2 / 24),
                *(9 / 70 + 3 * p / 10 + p**2 / 6, -(13 / 420 + 3 * p / 40 + p**2 / 24)),
                *(1 / 105 + p / 60 + p**2 / 120, 13 / 420 + 3 * p / 40 + p**2 / 24, -(1 / 140 + p / 60 + p**2 / 120)),
                *(
                    13 / 35 + 7 * p / 10 + p**2 / 3,
                    -(11 / 210 + 11 * p / 120 + p**2 / 24),
                    1 / 105 + p / 60 + p**2 / 120,
                ),
            ]
        )
        a, b, c = 1 / 10 - p / 2, 2 / 15 + p / 6 + p**2 / 3, -1 / 30 - p / 6 + p**2 / 6
        rotary = _symmetric([6 / 5, a, -6 / 5, a, b, -a, c, 6 / 5, -a, b])
        unit = jnp.stack([jnp.ones_like(l), l, jnp.ones_like(l), l])
        scale = unit[:, None] * unit[None, :]
        spins = rho * bending / l / (1.0 + p) ** 2 * scale * rotary
        return (
            rho * area * l / (1.0 + p) ** 2 * scale * mass + spins,
            2.0 * spins,
            E * bending / l**3 / (1.0 + p) * scale * K,
        )

    def _shear_ratio(self, l, area, bending, m):
        """Flexibility of shear over that of bending, of an element; m: inner over outer radius."""
        if self.poisson is None:
            return jnp.zeros_like(l)
        nu, both = self.poisson, (1.0 + m**2) ** 2
        kappa = 6.0 * (1.0 + nu) * both / ((7.0 + 6.0 * nu) * both + (20.0 + 12.0 * nu) * m**2)
        shear = self.young / (2.0 * (1.0 + nu))
        return 12.0 * self.young * bending / (kappa * shear * area * l**2)


def _both(outer, inner):
    return ("outer", outer), ("inner", inner)


def _symmetric(upper):
    """A symmetric matrix (4, 4) of its upper triangle by rows."""
    like = (
        next(x for x in upper if not isinstance(x, float)) if any(not isinstance(x, float) for x in upper) else None
    )
    values = jnp.stack([jnp.asarray(x, None if like is None else like.dtype) for x in upper])
    rows, columns = np.triu_indices(4)
    place = np.zeros((4, 4), int)
    place[rows, columns] = place[columns, rows] = np.arange(10)
    return values[place]
