"""`vector_field` under `diffrax.diffeqsolve`, and `simulate(loop="diffeqsolve")` against our loop, step by step."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix
import pytest

import jaxmbs as mbs
from tests.models import bar, four_bar

CONTROLLER = diffrax.PIDController(rtol=1e-9, atol=1e-9)
TIMES = jnp.array([0.0, 0.3, 0.7, 1.0])


@pytest.fixture(scope="module")
def swing():
    system = bar()
    return system, mbs.State.at(system, pin=0.3)


@pytest.fixture(scope="module")
def loop():
    system = four_bar(stiffness=3.0)
    return system, mbs.State.at(system, A=0.5, velocities={"A": 2.0})


def solve(field, y0, solver=None, **options):
    settings = {"stepsize_controller": CONTROLLER, "saveat": diffrax.SaveAt(ts=TIMES)} | options
    term, solver = diffrax.ODETerm(field), diffrax.Dopri8() if solver is None else solver
    return diffrax.diffeqsolve(term, solver, 0.0, 1.0, 1e-3, y0, **settings)


@pytest.mark.long
def test_a_pendulum_saved_at_times_at_steps_densely_and_by_a_function(swing):
    system, start = swing
    field = mbs.vector_field(system)
    saves = [
        diffrax.SubSaveAt(ts=TIMES),
        diffrax.SubSaveAt(steps=True, fn=lambda t, y, args: field.state(t, y).velocities),
    ]
    saved = diffrax.SaveAt(subs=saves, dense=True)
    solution = solve(field, field.start(start), saveat=saved, max_steps=64)
    states = field.state(solution.ts[0], solution.ys[0])
    motion = mbs.simulate(system, start, ts=np.asarray(TIMES))
    np.testing.assert_allclose(states.coordinates, motion.states.coordinates, atol=1e-8)
    np.testing.assert_allclose(states.velocities, motion.states.velocities, atol=1e-7)
    last = int(solution.stats["num_accepted_steps"]) - 1
    np.testing.assert_allclose(solution.ys[1][last], motion.end.velocities, atol=1e-8)
    np.testing.assert_allclose(solution.evaluate(0.7).coordinates, motion.states.coordinates[2], atol=1e-7)


@pytest.mark.long
def test_an_event_and_an_adjoint_of_diffrax(swing):
    """The time at which the bar hangs and its derivative by the start, as `simulate` has them."""
    system, _ = swing

    def hangs(x):
        field = mbs.vector_field(system)
        event = diffrax.Event(
            lambda t, y, args, **kw: y.coordinates[0] + np.pi / 2,
            optimistix.Newton(1e-12, 1e-12),
        )
        y0 = field.start(mbs.State.at(system, pin=x))
        end = solve(
            field, y0, event=event, saveat=diffrax.SaveAt(t1=True), adjoint=diffrax.RecursiveCheckpointAdjoint()
        )
        return end.ts[0]

    def ours(x):
        return mbs.simulate(
            system, mbs.State.at(system, pin=x), t1=1.0, event=lambda s: s.coordinates[0] + np.pi / 2
        ).end.t

    value, slope = jax.jit(jax.value_and_grad(hangs))(0.3)
    wanted, wanted_slope = jax.jit(jax.value_and_grad(ours))(0.3)
    np.testing.assert_allclose([value, slope], [wanted, wanted_slope], rtol=1e-6)
    h = 1e-5
    run = jax.jit(hangs)
    np.testing.assert_allclose(slope, (run(0.3 + h) - run(0.3 - h)) / (2 * h), rtol=1e-4)


@pytest.mark.long
@pytest.mark.parametrize("formulation", ["canonical", "independent", "velocity"])
def test_a_four_bar_in_every_formulation(loop, formulation):
    """Projected steps keep the loop closed; steps that are not drift by their error, and the readout closes it."""
    system, start = loop
    field = mbs.vector_field(system, formulation=formulation)
    y0 = field.start(start)
    motion = mbs.simulate(system, start, ts=np.asarray(TIMES))
    for solver in (diffrax.Dopri8(), mbs.ode.ProjectedSolver(diffrax.Dopri8(), field.project)):
        solution = solve(field, y0, solver)
        states = field.state(solution.ts, solution.ys)
        np.testing.assert_allclose(states.coordinates, motion.states.coordinates, atol=1e-7)
        np.testing.assert_allclose(states.velocities, motion.states.velocities, atol=1e-6)
        assert np.max(states.residual) < 1e-12
        work = field.work(solution.ys)
        np.testing.assert_allclose(work["spring"], motion.diagnostics.work["spring"], atol=1e-7)


@pytest.mark.long
def test_the_independent_field_is_the_papers(loop):
    """Rates of (p, phi) as `dynamics.independent_rates` has them; momenta in SI units."""
    system, start = loop
    field = mbs.vector_field(system, formulation="independent")
    y = field.start(start)
    assert y.momenta.shape == (system.topology.mobility,)
    rate = field(0.0, y)
    np.testing.assert_allclose(rate.coordinates, start.velocities, atol=1e-10)
    h = 1e-6
    moved = mbs.simulate(system, start, ts=[h, 2 * h])
    p = [field.start(state).momenta for state in (start, moved[0], moved[1])]
    np.testing.assert_allclose(rate.momenta, (-3 * p[0] + 4 * p[1] - p[2]) / (2 * h), rtol=1e-5)


@pytest.mark.long
@pytest.mark.parametrize("name", ["swing", "loop"])
def test_diffeqsolve_takes_our_steps(name, request):
    """At every step's number both loops have the same time and state; the steps land on the saved times."""
    system, start = request.getfixturevalue(name)
    times = np.linspace(0.0, 0.5, 26)
    for number in (1, 2, 5, 12, 20, 100):
        ours, theirs = (
            mbs.simulate(system, start, ts=times, loop=loop, max_steps=number, throw=False)
            for loop in ("jaxmbs", "diffeqsolve")
        )
        assert ours.end.t == theirs.end.t and ours.status is theirs.status
        assert ours.diagnostics.num_steps == theirs.diagnostics.num_steps
        assert ours.diagnostics.num_rejected == theirs.diagnostics.num_rejected
        np.testing.assert_allclose(theirs.end.coordinates, ours.end.coordinates, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(theirs.end.velocities, ours.end.velocities, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(theirs.states.coordinates, ours.states.coordinates, atol=1e-11)
    np.testing.assert_allclose(theirs.diagnostics.energy_residual, ours.diagnostics.energy_residual, atol=1e-11)


@pytest.mark.long
@pytest.mark.parametrize("options", [{"event": True}, {"dt": 0.01}, {"interpolate": True}, {"stiff": True}], ids=str)
def test_diffeqsolve_with_other_options(swing, options):
    """Events, fixed steps, interpolated times and an implicit solver: the same steps."""
    system, start = swing
    if options.pop("event", False):
        options["event"] = lambda s: s.coordinates[0] + 1.0
    if options.pop("stiff", False):
        options["solver"] = diffrax.Kvaerno5()
    ours, theirs = (mbs.simulate(system, start, t1=2.0, loop=loop, **options) for loop in ("jaxmbs", "diffeqsolve"))
    assert ours.diagnostics.num_steps == theirs.diagnostics.num_steps
    np.testing.assert_allclose(theirs.states.coordinates, ours.states.coordinates, atol=1e-10)
    np.testing.assert_allclose(theirs.end.t, ours.end.t, rtol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("mode", ["reverse", "forward"])
def test_derivatives_by_both_loops(loop, mode):
    like, _ = loop

    def angle(stiffness, name):
        system = four_bar(stiffness=stiffness, like=like)
        start = mbs.State.at(system, A=0.5, velocities={"A": 2.0})
        return mbs.simulate(system, start, ts=[0.3, 0.5], gradient=mode, loop=name).end.coordinates[0]

    derivative = jax.jacrev if mode == "reverse" else jax.jacfwd
    ours, theirs = (
        jax.jit(derivative(lambda k, name=name: angle(k, name)))(3.0) for name in ("jaxmbs", "diffeqsolve")
    )
    np.testing.assert_allclose(theirs, ours, rtol=1e-7)


def test_faults_by_name(swing):
    system, start = swing
    with pytest.raises(ValueError, match="formulation='lagrange' must be one of"):
        mbs.vector_field(system, formulation="lagrange")
    with pytest.raises(ValueError, match="loop='scipy' must be one of jaxmbs, diffeqsolve"):
        mbs.simulate(system, start, t1=1.0, loop="scipy")


def test_scaled_momenta_are_velocities_at_the_start(swing):
    system, _ = swing
    start = mbs.State.at(system, pin=0.3, velocities={"pin": 2.0})
    np.testing.assert_allclose(mbs.vector_field(system, scale_at=start).start(start).momenta, [2.0], rtol=1e-14)
