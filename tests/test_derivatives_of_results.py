"""Every field of every result has the right derivative, forward and reverse, or is a diagnostic that says so."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.analysis import Equilibrium, Linearisation
from jaxmbs.motion import Diagnostics, Motion, Peak
from jaxmbs.reaction import Reactions
from jaxmbs.vibration import Modes

#: By result: the fields without derivative; the docstring of their class says so.
DIAGNOSTICS = {
    Motion: (),
    Diagnostics: ("constraint_drift", "velocity_drift", "num_steps", "num_rejected"),
    mbs.State: ("residual", "rank_change", "branch"),
    Equilibrium: ("residual", "ok", "stable", "steps"),
    Linearisation: (),
    Modes: ("is_rigid", "rounding"),
    Peak: (),
    Reactions: ("residual", "ok"),
}
X = np.array([1.3, 0.4, 9.81, 0.2, 2.0])  # mass, damping, gravity, coordinate and velocity at the start


def circle(q, t):
    return q[:1] ** 2 + (q[1:] - 5.0) ** 2 - 25.0


def slide(x, like=None):
    """A bead on a circle of radius five, by a row of coordinates, with a damper and a spring."""
    b = mbs.SystemBuilder(gravity=jnp.stack([0.0 * x[2], -x[2], 0.0 * x[2]]))
    b.body("carriage", mass=0.5)
    b.body("bead", mass=x[0])
    b.joint("x", mbs.Prismatic("x"), "ground", "carriage")
    b.joint("y", mbs.Prismatic("y"), "carriage", "bead")
    b.constraint("circle", mbs.joints.PositionRows(circle))
    b.force("oil", mbs.SpringDamper(stiffness=1.0, damping=x[1]), joint="x")
    return b.build(like=like)


@functools.cache
def reference():
    return slide(X)


def started(x):
    """The system, and its state by hand: to assemble it takes longer than all else."""
    system, depth = slide(x, reference()), jnp.sqrt(25.0 - x[3] ** 2)
    state = jnp.stack([x[3], 5.0 - depth]), jnp.stack([x[4], x[3] * x[4] / depth])
    return system, mbs.State(jnp.zeros(()), *state)


def motion(x, mode, event=None, **options):
    """The times to save, the end and the start move with the parameters too."""
    system, state = started(x)
    ts = jnp.array([0.1, 0.3, 0.6]) * (1.0 + 0.1 * x[4])
    return mbs.simulate(system, state, t1=0.4 * x[4], ts=ts, event=event, gradient=mode, rtol=1e-12, atol=1e-12)


QUESTIONS = {
    "motion": motion,
    "motion by velocities": lambda x, mode: motion(x, mode, formulation="velocity"),
    "motion passing over": lambda x, mode: motion(x, mode, interpolate=True),
    "motion to an event": lambda x, mode: motion(x, mode, event=lambda s: s.coordinates[0] - 0.2 - 0.25 * x[4]),
    "motion beside an event": lambda x, mode: motion(x, mode, event=lambda s: s.coordinates[0] - 40.0),
    "equilibrium": lambda x, mode: mbs.equilibrium(*started(x)),
    "linearisation": lambda x, mode: mbs.linearise(*started(x), inputs=["x"], outputs=["y"]),
    "modes": lambda x, mode: mbs.modes(*started(x)),
    "peak": lambda x, mode: peak_of(x, mode, lambda s: s.velocities[0]),
    "peak at the end": lambda x, mode: peak_of(x, mode, lambda s: s.coordinates[0]),
    "reactions": lambda x, mode: mbs.reactions(*started(x)),
}


def peak_of(x, mode, quantity):
    system, _ = started(x)
    return mbs.motion.peak(system, motion(x, mode), quantity)


def numbers(result, wanted, path="", owner=None):
    """Floating leaves by their path: those with derivative, or those without."""
    if isinstance(result, dict):
        parts = result.items()
    elif hasattr(result, "__dataclass_fields__"):
        parts = [(name, getattr(result, name)) for name in result.__dataclass_fields__]
    elif hasattr(result, "_fields"):
        parts = zip(result._fields, result, strict=True)
    elif isinstance(result, jax.Array) and jnp.issubdtype(result.dtype, jnp.inexact):
        return {path: jnp.stack([result.real, jnp.imag(result)])} if owner is wanted else {}
    else:
        return {}
    found = {}
    for name, part in parts:
        kind = name not in DIAGNOSTICS.get(type(result), ()) and owner is not False
        found |= numbers(part, wanted, f"{path}.{name}", kind)
    return found


@pytest.mark.long
@pytest.mark.parametrize("name", QUESTIONS)
def test_every_field_has_the_slope_of_its_differences(name):
    ask, _ = QUESTIONS[name], reference()
    reverse = jax.jit(jax.jacrev(lambda x: numbers(ask(x, "reverse"), True)))(X)
    forward = jax.jit(jax.jacfwd(lambda x: numbers(ask(x, "forward"), True)))(X)
    value = jax.jit(lambda x: numbers(ask(x, "forward"), True))
    values, h = value(X), 1e-4
    steps = [[value(X + k * h * e) for k in (-2, -1, 1, 2)] for e in np.eye(len(X))]
    for path, y in values.items():
        found = [(a[path] - 8 * b[path] + 8 * c[path] - d[path]) / (12 * h) for a, b, c, d in steps]
        there = np.isfinite(y)  # nothing is saved after an event
        for slope in (reverse[path], forward[path]):
            np.testing.assert_allclose(slope[there], np.stack(found, -1)[there], rtol=2e-7, atol=2e-7, err_msg=path)
        assert there.any() or not y.size


@pytest.mark.parametrize("kind", [kind for kind, fields in DIAGNOSTICS.items() if fields])
def test_diagnostics_say_that_they_have_no_slope(kind):
    assert "without derivative" in " ".join(kind.__doc__.split())
