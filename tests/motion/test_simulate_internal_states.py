"""Motions with internal states of force elements, against exponentials of their linear equations."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

import jaxmbs as mbs
from jaxmbs import forces as F
from tests.models import four_bar_builder
from tests.state_laws import Lag

TIMES = np.linspace(0.05, 0.8, 6)
NUMBERS = {"mass": 2.0, "spring": 60.0, "series": 150.0, "oil": 9.0, "tau": 0.15, "command": 7.0}


def block(numbers=NUMBERS, like=None):
    """A block on a spring, Maxwell's element and a motor that follows its command late."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("block", mass=numbers["mass"])
    b.joint("x", mbs.Prismatic("x"), "ground", "block")
    b.force("spring", mbs.SpringDamper(numbers["spring"]), joint="x")
    b.force("rubber", F.Maxwell(numbers["series"], numbers["oil"]), joint="x")
    b.force("motor", Lag(numbers["tau"], numbers["command"]), joint="x")
    return b.build(like=like)


def begin(system, x=0.3):
    return mbs.State.at(system, x=x, velocities={"x": -0.5}, internal={"motor.force": 2.0})


def exact(numbers, times, x=0.3):
    """(x, v, stretch, force) at times (T,)."""
    m, k, s, c, tau, command = (float(numbers[name]) for name in NUMBERS)
    A = np.array(
        [[0, 1, 0, 0, 0], [-k / m, 0, -s / m, 1 / m, 0], [0, 1, -s / c, 0, 0], [0, 0, 0, -1 / tau, command / tau]]
        + [[0] * 5]
    )
    return np.array([expm(A * t) @ [x, -0.5, 0.0, 2.0, 1.0] for t in times])[:, :4]


def found(motion):
    parts = motion.states.coordinates[:, 0], motion.states.velocities[:, 0]
    return np.stack([*parts, motion.internal("rubber.stretch"), motion.internal("motor.force")], axis=1)


LONG = pytest.mark.long
ACCURATE = [
    pytest.param({}, id="canonical", marks=LONG),
    pytest.param({"formulation": "independent"}, id="independent", marks=LONG),
    pytest.param({"formulation": "velocity"}, id="velocity", marks=LONG),
    pytest.param({"interpolate": True, "rtol": 1e-11, "atol": 1e-11}, id="passing over saved times", marks=LONG),
    pytest.param({"loop": "diffeqsolve"}, id="diffeqsolve", marks=LONG),
    pytest.param({"solver": diffrax.Kvaerno5()}, id="Kvaerno5", marks=LONG),
    pytest.param({"solver": mbs.ode.Gauss4(), "dt": 0.01}, id="Gauss4", marks=LONG),
]


@pytest.mark.parametrize("options", ACCURATE)
def test_against_the_exponential(options):
    system = block()
    motion = mbs.simulate(system, begin(system), ts=TIMES, **options)
    np.testing.assert_allclose(found(motion), exact(NUMBERS, TIMES), atol=3e-7)
    end = [*motion.end.coordinates, *motion.end.velocities, *motion.end.internal.values]
    order = [entry for entry in motion.end.internal.entries]
    np.testing.assert_allclose(end, [*found(motion)[-1, :2], *(motion.internal(name)[-1] for name in order)])
    assert np.abs(motion.diagnostics.energy_residual).max() < 1e-6


@LONG
@pytest.mark.parametrize("solver", [mbs.ode.ImplicitMidpoint(), mbs.ode.SemiImplicitEuler()])
def test_order_of_fixed_steps(solver):
    """Halved steps leave a quarter of the error, or half."""
    system, order = block(), 1 if isinstance(solver, mbs.ode.SemiImplicitEuler) else 2
    run = lambda dt: mbs.simulate(system, begin(system), ts=TIMES[-1:], dt=dt, solver=solver)
    errors = [np.abs(found(run(dt)) - exact(NUMBERS, TIMES[-1:])).max() for dt in (4e-3, 2e-3)]
    np.testing.assert_allclose(errors[0] / errors[1], 2.0**order, rtol=0.15)


def slopes_of(function, numbers, step=1e-5):
    """Central differences by name."""
    moved = lambda name, h: {**numbers, name: numbers[name] * (1.0 + h)}
    return {
        name: (function(moved(name, step)) - function(moved(name, -step))) / (2.0 * step * numbers[name])
        for name in numbers
    }


MODES = [
    pytest.param("reverse", None, marks=LONG, id="reverse"),
    pytest.param("forward", None, marks=LONG, id="forward"),
    pytest.param("reverse", diffrax.Kvaerno5(), marks=LONG, id="implicit, reverse"),
    pytest.param("forward", diffrax.Kvaerno5(), marks=LONG, id="implicit, forward"),
]


@pytest.mark.parametrize(("mode", "solver"), MODES)
def test_gradients_by_each_parameter(mode, solver):
    """Of a sum over the saved states and the end, the internal ones with them."""
    system = block()

    def loss(numbers):
        new = block(numbers, like=system)
        motion = mbs.simulate(new, begin(new), ts=TIMES, gradient=mode, solver=solver)
        z, f = motion.internal("rubber.stretch"), motion.internal("motor.force")
        return jnp.sum(motion.states.coordinates[:, 0] + 3.0 * z + 0.1 * f**2) + motion.end.internal["motor.force"]

    def truth(numbers):
        x, _, z, f = exact(numbers, TIMES).T
        return np.sum(x + 3.0 * z + 0.1 * f**2) + f[-1]

    numbers = {name: jnp.asarray(value) for name, value in NUMBERS.items()}
    slopes = (jax.grad if mode == "reverse" else jax.jacfwd)(loss)(numbers)
    wanted = slopes_of(truth, NUMBERS)
    for name in NUMBERS:
        np.testing.assert_allclose(slopes[name], wanted[name], rtol=1e-5, err_msg=name)


@LONG
def test_derivatives_by_times_and_start():
    system = block()

    def force(start, t):
        state = mbs.State.at(system, x=0.3, velocities={"x": -0.5}, internal={"motor.force": start})
        return mbs.simulate(system, state, t1=t, ts=jnp.stack([t])).internal("motor.force")[0]

    by_start, by_time = jax.grad(force, argnums=(0, 1))(2.0, 0.4)
    np.testing.assert_allclose(by_start, np.exp(-0.4 / 0.15), rtol=1e-7)
    np.testing.assert_allclose(by_time, 5.0 / 0.15 * np.exp(-0.4 / 0.15), rtol=1e-7)


@LONG
def test_events_keep_or_change_internal_states():
    """A wall turns the velocity and leaves the states alone; a switch sets the force of the motor."""
    system = block()
    wall = mbs.motion.Event(
        lambda s: s.coordinates[0] - 0.2, lambda s: mbs.State(s.t, s.coordinates, -0.8 * s.velocities), name="wall"
    )

    def cut(s):
        values = jnp.where(jnp.asarray(s.internal.entries.index("motor.force")) == jnp.arange(2), 0.0, 1.0)
        internal = mbs.model.InternalStates(s.internal.values * values, s.internal.records)
        return mbs.State(s.t, s.coordinates, s.velocities, internal=internal)

    switch = mbs.motion.Event(lambda s: s.t - 0.5, cut, name="switch")
    motion = mbs.simulate(system, begin(system), ts=TIMES, event=[wall, switch])
    assert set(motion.events.named()) == {"wall", "switch"}
    force = np.asarray(motion.internal("motor.force"))[: len(TIMES)]
    late = TIMES > 0.5
    np.testing.assert_allclose(force[~late], 7.0 - 5.0 * np.exp(-TIMES[~late] / 0.15), atol=1e-7)
    np.testing.assert_allclose(force[late], 7.0 - 7.0 * np.exp(-(TIMES[late] - 0.5) / 0.15), atol=1e-7)
    assert np.abs(motion.diagnostics.energy_residual[: len(TIMES)]).max() < 1e-7


@LONG
def test_an_internal_state_can_end_a_motion():
    system = block()
    full = lambda s: s.internal["motor.force"] - 6.0
    motion = mbs.simulate(system, begin(system), t1=2.0, event=full)
    np.testing.assert_allclose(motion.end.t, 0.15 * np.log(5.0), atol=1e-8)
    np.testing.assert_allclose(motion.end.internal["motor.force"], 6.0, atol=1e-8)


class Runaway(Lag):
    """A rate that grows without bound where the command is positive."""

    def rate(self, x, v, s, t):
        return {"force": jnp.where(self.command > 0.0, s["force"] ** 2, -s["force"])}


@pytest.mark.long
def test_lanes_of_a_batch():
    """One lane escapes in finite time: its states are NaN after it, those of the others are theirs."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("block", mass=1.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "block")
    b.force("motor", Runaway(1.0, -1.0), joint="x")
    system = b.build()

    def run(command):
        new = eqx.tree_at(lambda s: s.forces[0].law.command, system, jnp.reshape(command, (1,)))
        state = mbs.State.at(new, internal={"motor.force": 2.0})
        return mbs.simulate(new, state, ts=TIMES, max_steps=200, throw=False)

    found = jax.vmap(run)(jnp.array([-1.0, 1.0, -1.0]))
    assert list(np.asarray(found.ok)) == [True, False, True]
    force = np.asarray(found.internal("motor.force"))
    np.testing.assert_allclose(force[[0, 2]], [2.0 * np.exp(-TIMES)] * 2, rtol=1e-7)
    kept = TIMES < 0.4  # 1 / (1/2 - t)
    np.testing.assert_allclose(force[1, kept], 1.0 / (0.5 - TIMES[kept]), rtol=1e-6)
    assert np.isnan(force[1, TIMES > 0.6]).all()


@LONG
def test_between_saved_times_and_tables():
    system = block()
    motion = mbs.simulate(system, begin(system), ts=np.linspace(0.0, 0.8, 81))
    state = motion.at(system, 0.333)
    truth = exact(NUMBERS, [0.333])[0]
    np.testing.assert_allclose(
        [state.internal["rubber.stretch"], state.internal["motor.force"]], truth[2:], atol=1e-8
    )
    data = motion.to_xarray()
    assert list(data["internal_state"].values) == list(state.internal.entries)
    assert dict(zip(data["internal_state"].values, data["unit"].values, strict=True))["motor.force"] == "N"
    assert "motor.force" in motion.to_pandas().columns and "motor.force" in repr(motion)


@LONG
def test_vector_field_of_a_user_s_own_loop():
    system = block()
    field = mbs.motion.vector_field(system, scale_at=begin(system))
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(field),
        diffrax.Dopri8(),
        0.0,
        TIMES[-1],
        None,
        field.start(begin(system)),
        saveat=diffrax.SaveAt(ts=TIMES),
        stepsize_controller=diffrax.PIDController(rtol=1e-9, atol=1e-9),
    )
    states = field.state(solution.ts, solution.ys)
    np.testing.assert_allclose(states.internal["motor.force"], exact(NUMBERS, TIMES)[:, 3], atol=1e-6)


def loaded_four_bar(numbers, like=None):
    """Twenty lags of the first order on the crank."""
    b = four_bar_builder()
    for k in range(20):
        b.force(f"lag {k}", Lag(numbers[0] * (1.0 + 0.1 * k), numbers[1] * (-1.0) ** k), joint="A")
    return b.build(like=like)


@LONG
def test_twenty_states_on_a_four_bar():
    """The crank feels the sum of forces known in closed form, as an actuator of that sum; gradient by differences."""
    numbers = jnp.array([0.1, 3.0])
    system = loaded_four_bar(numbers)
    start = lambda system: mbs.State.at(system, A=0.7, velocities={"A": 3.0}, guess={"B": -0.2, "D": 1.2})
    taus = 0.1 * (1.0 + 0.1 * np.arange(20))
    signs = (-1.0) ** np.arange(20)
    b = four_bar_builder()
    b.force("sum", mbs.Actuator(lambda x, v, t: jnp.sum(3.0 * signs * (1.0 - jnp.exp(-t / taus)))), joint="A")
    alone = b.build()
    motion = mbs.simulate(system, start(system), ts=TIMES)
    truth = mbs.simulate(alone, start(alone), ts=TIMES)
    np.testing.assert_allclose(motion.states.coordinates, truth.states.coordinates, atol=1e-7)
    np.testing.assert_allclose(motion.internal("lag 7.force"), -3.0 * (1.0 - np.exp(-TIMES / taus[7])), atol=1e-8)

    def load(numbers):
        new = loaded_four_bar(numbers, like=system)
        return jnp.linalg.norm(mbs.reactions(new, mbs.simulate(new, start(new), ts=TIMES).end)["C"].force)

    value = mbs.jit(load, compile="quick")
    slope = mbs.jit(jax.grad(load), compile="quick")(numbers)
    difference = [(value(numbers + d) - value(numbers - d)) / 2e-5 for d in 1e-5 * np.eye(2)]
    np.testing.assert_allclose(slope, difference, rtol=1e-5, atol=1e-5)


class Cylinder(F.AbstractScalarLaw):
    """A closed column of oil with a leak, its pressure in a unit of so many pascals."""

    unit: float = eqx.field(static=True)

    @property
    def internal_states(self):
        return {"p": F.InternalState(scale=1e6 / self.unit)}

    def rate(self, x, v, s, t):
        return {"p": (-1e9 / 1e-3 * 1e-3 * v - 3.0 * self.unit * s["p"]) / self.unit}

    def effort(self, x, v, s, t):
        return 1e-3 * self.unit * s["p"]


@pytest.mark.long
def test_tolerances_apply_to_the_state_over_its_scale():
    """The same steps, whether pressures are in Pa or in GPa."""
    motions = []
    for unit in (1.0, 1e9):
        b = mbs.SystemBuilder(gravity=(0, 0, 0))
        b.body("rod", mass=5.0)
        b.joint("x", mbs.Prismatic("x"), "ground", "rod")
        b.force("oil", Cylinder(unit), joint="x")
        system = b.build()
        state = mbs.State.at(system, internal={"oil.p": 2e6 / unit})
        motions.append(mbs.simulate(system, state, ts=TIMES, rtol=1e-6, atol=1e-6))
    pascal, giga = motions
    assert pascal.diagnostics.num_steps == giga.diagnostics.num_steps
    np.testing.assert_allclose(pascal.internal("oil.p"), 1e9 * giga.internal("oil.p"), rtol=1e-9)


class Bristle(F.AbstractScalarLaw):
    """LuGre's friction: a bristle of deflection z under the Stribeck curve g, `dz/dt = v - |v| z / g(v)`."""

    stiffness: jax.Array = eqx.field(converter=jnp.asarray)
    damping: jax.Array = eqx.field(converter=jnp.asarray)

    @property
    def internal_states(self):
        return {"z": F.InternalState((), "m", 1e-4)}

    def rate(self, x, v, s, t):
        g = (1.0 + 0.5 * jnp.exp(-((v / 0.01) ** 2))) / self.stiffness
        return {"z": v - jnp.sqrt(v**2 + 1e-16) * s["z"] / g}

    def effort(self, x, v, s, t):
        return -self.stiffness * s["z"] - self.damping * self.rate(x, v, s, t)["z"] - 0.4 * v


@LONG
def test_stick_and_slip():
    """Stick and slip of a block on a spring drawn along: explicit and implicit steps have one answer."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("block", mass=1.0)
    b.joint("x", mbs.Prismatic("x"), "ground", "block")
    b.force("pull", mbs.Actuator(lambda x, v, t: 2.0 * (0.1 * t - x)), joint="x")
    b.force("floor", Bristle(1e3, 10.0), joint="x")
    system = b.build()
    run = lambda **kw: mbs.simulate(system, mbs.State.at(system), ts=np.linspace(0.5, 12.0, 24), **kw)
    explicit, implicit = run(rtol=1e-8, atol=1e-8), run(rtol=1e-7, atol=1e-7, solver=diffrax.Kvaerno5())
    np.testing.assert_allclose(implicit.states.coordinates, explicit.states.coordinates, atol=2e-5)
    np.testing.assert_allclose(implicit.internal("floor.z"), explicit.internal("floor.z"), atol=2e-6)
    assert np.abs(np.diff(np.asarray(explicit.states.coordinates[:, 0]))).max() > 0.1  # it slips at once
