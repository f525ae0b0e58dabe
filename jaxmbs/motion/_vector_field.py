"""The equations of motion as a vector field for `diffrax.diffeqsolve`."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Float

from ..assembly._state import State
from ..checks import distinct_names, place_of
from ..constraints._mobility import with_mobility_at
from ..constraints._rows import is_rheonomic
from ..dynamics._efforts import element_names
from ..kinematics._configuration import at_state
from ..kinematics._poses import node_parameters, normalise
from ..model._changes import check_in_force
from ..model._entry_points import check_single_state, check_system
from ..model._system import System
from ..runtime import as_array, jit
from ..signal_flow._sampling import refuse_sampled
from ..signal_flow._signal_names import check_input_fields, signal_names
from ..signal_flow._signals import signals_at, with_inputs
from ..tables import sentence_repr
from ..typing import ArrayLike, ScalarLike
from ._accounts import gap
from ._formulation import Formulation, num_powers
from ._options import choose_formulation, class_of


class PhaseState(NamedTuple):
    """A point of phase space, and the work done on the way to it.

    Attributes:
        coordinates: (nq,).
        momenta: (nv,) of the canonical formulation, (N,) of the independent one; what another one has in their place,
            such as velocities; the internal states of force elements follow them.  Divided by the field's scale.
        work: (n,) [J] of every force element, and of all drives together.
    """

    coordinates: Float[Array, "..."]
    momenta: Float[Array, "..."]
    work: Float[Array, "..."]


class VectorField(eqx.Module):
    """The right-hand side `dy/dt = f(t, y, args)` of a mechanism; of one with `inputs` args are their values (k,).

    A pytree: parameters of the system have derivatives through `diffrax.ODETerm(field)`.

    Attributes: inputs: fields of force elements and blocks; signals: outputs (static).
    """

    equations: Formulation
    inputs: tuple[str, ...] = eqx.field(static=True, default=())
    signals: tuple[str, ...] = eqx.field(static=True, default=())

    __repr__, _repr_html_ = sentence_repr(
        lambda field: (
            f"rates of {type(field.equations).__name__} of {field.system!r}"
            + (f", with inputs {', '.join(field.inputs)}" if field.inputs else "")
        )
    )

    @property
    def system(self) -> System:
        """The mechanism."""
        return self.equations.system

    def __call__(self, t: ScalarLike, y: PhaseState, args: Any = None) -> PhaseState:
        """The rate of y; of a field with inputs at their values (k,), by default those that the fields have."""
        return PhaseState(*self._with_inputs(args).rate(jnp.asarray(t), tuple(y)))

    def outputs(self, t: ScalarLike, y: PhaseState, args: Any = None) -> Array:
        """The signals (m,) that were named as outputs, one after another, at y and inputs (k,)."""
        equations, t = self._with_inputs(args), jnp.asarray(t)
        at = equations.at(t, y.coordinates, y.momenta)
        values = signals_at(equations.system, at)
        return jnp.concatenate([jnp.zeros(0, at.psi.dtype), *(values[name].reshape(-1) for name in self.signals)])

    def _with_inputs(self, values):
        """The equations with values (k,) of the inputs.  Raises: ValueError for another number of them."""
        if not self.inputs or values is None:
            return self.equations
        values = as_array(values)
        if values.shape != (len(self.inputs),):
            raise ValueError(f"the inputs are {', '.join(self.inputs)}, as many numbers; got shape {values.shape}")
        system = with_inputs(self.system, dict(zip(self.inputs, values, strict=True)), replace=True)
        return eqx.tree_at(lambda e: e.system, self.equations, system)

    def start(self, state: State) -> PhaseState:
        """y of a state that satisfies the constraints.  Raises: as `kinematics.position` for the state of another
        system; ValueError for states with leading axes."""
        check_single_state(self.system, state)
        check_in_force(self.system, state)
        return _start(self.equations, state)

    def state(self, t: ArrayLike, y: PhaseState) -> State:
        """The state at a time t () or at times (T,), of y with the same leading axis: projected onto the constraints,
        with its residual there."""
        return _states(self.equations, jnp.asarray(t), y)

    def project(self, t: ScalarLike, y: PhaseState, args: Any = None) -> PhaseState:
        """y on the constraints: coordinates of the nearest pose, two Newton steps in the metric of assembly;
        velocities nearest in kinetic energy; quaternions of unit length.  Of a tree without quaternions y itself."""
        return _project(self.equations, jnp.asarray(t), y)

    def work(self, y: PhaseState) -> dict[str, Array]:
        """Work [J] of every force element by name, "drives" that of all driven joints and moving constraints."""
        names = element_names(self.system) + (("drives",) if is_rheonomic(self.system) else ())
        return {name: y.work[..., k] for k, name in enumerate(names)}


def vector_field(
    system: System,
    *,
    formulation: str | type[Formulation] = "canonical",
    scale_at: State | None = None,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
) -> VectorField:
    """The equations of motion for `diffrax.diffeqsolve`, with any of its `SaveAt`, events, controllers and adjoints.

    The term is `diffrax.ODETerm(field)` for `field = mbs.vector_field(system)`, the start `field.start(state)`, and
    `field.state(solution.ts, solution.ys)` gives the states of a solution.

    `jaxmbs.ode.ProjectedSolver(diffrax.Dopri8(), field.project)` keeps every step on the constraints, as
    `simulate` does; without it they drift by the error of the steps.

    Args:
        formulation: "canonical": coordinates (nq,) and momenta of all velocities (nv,); "independent": the momenta p
            (N,) of the independent coordinates phi, the equations of the paper; "velocity", "prescribed", or a
            `Formulation`.
        scale_at: a state at whose inertia the momenta are divided, so that they are in units of velocity, as
            `simulate` has them for its tolerances; default: momenta in SI units.
        inputs: fields of force elements and blocks that are functions of time, "motor.voltage", "loop.target": the
            argument `args` (k,) has their values in this order.
        outputs: names of measures, blocks and internal states, for `field.outputs(t, y, args)` (m,).

    Returns: a `jaxmbs.motion.VectorField`, to be called as `field(t, y, args)`, with `start(state)`, `state(t, y)`,
    `project(t, y)`, `outputs(t, y, args)` and `work(y)`; its y is a `jaxmbs.motion.PhaseState`.  Rate and outputs are
    pure functions: the mechanism is a block of any program of block diagrams.

    Raises: TypeError for what is no system, ValueError for an unknown formulation, UnknownNameError, ModelError for
    an input that a block drives.  Source: S2 (42)-(44).
    """
    check_system(system)
    refuse_sampled(system, "vector_field")
    chosen = class_of(choose_formulation(formulation, None, None))
    if scale_at is not None:
        check_single_state(system, scale_at)
        system = with_mobility_at(system, scale_at)
    inputs, outputs = distinct_names("inputs", inputs), distinct_names("outputs", outputs)
    check_input_fields(system, inputs)
    for name in outputs:
        place_of("signal", name, signal_names(system))
    return VectorField(_equations(system, chosen, scale_at), inputs, outputs)


@jit
def _equations(system, formulation, state):
    if state is not None:
        return formulation.begin(system, at_state(system, state), state.velocities, state.internal)[0]
    return formulation(system, node_parameters(system), jnp.ones((), system.gravity.dtype))


@jit
def _start(equations, state):
    at, system = at_state(equations.system, state), equations.system
    second = equations.start(system, at, state.velocities)[0]
    second = equations.join(second, state.internal)
    return PhaseState(state.coordinates, second, jnp.zeros(num_powers(system), second.dtype))


@jit
def _states(equations, t, y):
    if t.ndim:
        return jax.vmap(lambda t, y: _states(equations, t, y))(t, y)
    y, system = _project(equations, t, y), equations.system
    at = equations.at(t, y.coordinates, y.momenta)
    open_there = lax.stop_gradient(gap(system, at))
    return State(t, y.coordinates, at.u, open_there, system.topology.structure, internal=at.internal)


def _project(equations, t, y):
    if equations.system.has_constraints:
        return PhaseState(*equations.project(t, tuple(y)).y)
    return y._replace(coordinates=normalise(equations.system.topology, y.coordinates))
