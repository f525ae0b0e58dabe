"""`Linearisation`: matrices of small motions about a state, with names of their rows."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..blocks import StateSpace
from ..errors import ModelError
from ..linear._system import LinearSystem
from ..quantities import matrix
from ..reports import Report, Reported, failures


class Linearisation(Reported, eqx.Module):
    """Small motions about a state.

    Attributes:
        mass: M (N, N), the inertia field I*.
        damping: C (N, N), of dampers and of the steady motion.
        gyroscopic: the part of C that the motion makes, `C - R` with R of S2 (74).
        stiffness: K (N, n) in total derivatives: springs, gravity, loads and the steady motion.  K and C are those at
            unchanged internal states of force elements.
        state_space: A, B, C, D.
        positions, velocities: columns of the independent coordinates and velocities (static); they differ (n > N)
            where rows of velocity restrict the motion.
        names: of the independent velocities (static), "pin", or "ball rx" of a joint with several.
        position_names: likewise of the independent coordinates, the same but where rows of velocity restrict the
            motion.
        internal_names: of the internal states, in their own units.
        input_names, output_names: of the columns of B and the rows of C (static).
        stiffening: by elastic body, the estimated relative error of its first frequency by stiffening that is left
            out, see `flexible.stiffening`.
    """

    mass: Float[Array, "N N"]
    damping: Float[Array, "N N"]
    gyroscopic: Float[Array, "N N"]
    stiffness: Float[Array, "N n"]
    state_space: StateSpace
    positions: tuple[int, ...] = eqx.field(static=True)
    velocities: tuple[int, ...] = eqx.field(static=True)
    names: tuple[str, ...] = eqx.field(static=True, default=())
    position_names: tuple[str, ...] = eqx.field(static=True, default=())
    internal_names: tuple[str, ...] = eqx.field(static=True, default=())
    input_names: tuple[str, ...] = eqx.field(static=True, default=())
    output_names: tuple[str, ...] = eqx.field(static=True, default=())
    stiffening: dict = eqx.field(default_factory=dict)

    def report(self) -> Report:
        rows, space = self.names, self.state_space
        of_states = dict(rows=self.state_names, columns=self.state_names)
        return Report(
            [
                matrix("mass", self.mass, "kg or kg m^2", rows, rows),
                matrix("damping", self.damping, "N s/m or N m s", rows, rows),
                matrix("stiffness", self.stiffness, "N/m or N m", rows, self.position_names),
                matrix("gyroscopic", self.gyroscopic, "N s/m or N m s", rows, rows)._replace(in_table=False),
                matrix("A", space.A, "", **of_states)._replace(in_table=False),
                matrix("B", space.B, "", self.state_names, self.input_names)._replace(in_table=False),
                matrix("C", space.C, "", self.output_names, self.state_names)._replace(in_table=False),
                matrix("D", space.D, "", self.output_names, self.input_names)._replace(in_table=False),
            ],
            f"{len(self.mass)} freedoms, {len(self.input_names)} inputs, {len(self.output_names)} outputs",
            failures(self.ok, "matrices are not finite"),
        )

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states x of `state_space` and of the rows of modes: coordinates "pin", then "rate of pin",
        then internal states "boom.p0"."""
        return (*self.position_names, *(f"rate of {name}" for name in self.names), *self.internal_names)

    @property
    def ok(self) -> Bool[Array, "..."]:
        """True if all matrices are finite: the state is assembled, and the independent set determines the motion."""
        parts = self.mass, self.damping, self.stiffness, *([self.state_space.A] if self.internal_names else [])
        return jnp.all(jnp.stack([jnp.all(jnp.isfinite(part), axis=(-2, -1)) for part in parts]), axis=0)

    @property
    def system(self) -> LinearSystem:
        """M, C and K by names of joints, all of them interface: a component that `connect` joins to others.

        Raises: ModelError where rows of velocity restrict the motion, which has more coordinates than velocities, and
            where force elements have internal states.
        """
        if self.internal_names:
            raise ModelError(
                [
                    "a mechanism whose force elements have internal states is no LinearSystem of M, C and K: take "
                    "its `state_space`, with rows named by `state_names`, or `modes` of it"
                ]
            )
        if self.positions != self.velocities:
            raise ModelError(
                [
                    "a mechanism that rolls or slides on edges has more coordinates than velocities and is no "
                    "LinearSystem: take its `state_space`, with rows named by `state_names`, or `modes` of it"
                ]
            )
        return LinearSystem(
            mass=self.mass,
            damping=self.damping,
            stiffness=self.stiffness,
            coordinates=self.names,
            interface=range(len(self.names)),
        )
