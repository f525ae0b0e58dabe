"""The four-bars of `batch_of_motions.py`: a table of designs, our study of one design, and the same in MuJoCo."""

import copy

import diffrax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs

IMPOSSIBLE = 0.1  # share of designs whose ground is too long
LENGTHS = {"crank": 0.2, "coupler": 0.5, "rocker": 0.4, "ground": 0.5}
BARS = ("crank", "coupler", "rocker")
START, END, SAVED = 0.3, 1.0, 101  # crank angle [rad], end [s], saved states
SOLVERS = {  # and whether its steps pass over saved times
    "Dopri5 over": (diffrax.Dopri5(), True),
    "Dopri8 over": (diffrax.Dopri8(), True),
    "Dopri8": (diffrax.Dopri8(), False),
}


def table(number, seed=0):
    """Lengths within 20 % [m], masses as large as the lengths [kg]; one design in ten cannot be assembled."""
    random = np.random.default_rng(seed)
    lengths = {name: length * random.uniform(0.8, 1.2, number) for name, length in LENGTHS.items()}
    lengths["ground"] *= np.where(random.uniform(size=number) < IMPOSSIBLE, 4.0, 1.0)
    return lengths | {f"{name} mass": lengths[name].copy() for name in BARS}


def build(design, like=None):
    """The four-bar that hangs on two ground pins."""
    crank, coupler, rocker = ((design[name], 0.0, 0.0) for name in BARS)
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    for name in BARS:
        mass, length = design[f"{name} mass"], design[name]
        b.body(name, mass=mass, com=(length / 2.0, 0.0, 0.0), inertia=mbs.inertia.rod(mass, length))
    b.joint("A", mbs.Revolute("y"), "ground", "crank")
    b.joint("B", mbs.Revolute("y"), "crank", "coupler", parent_frame=crank)
    b.joint("C", mbs.Revolute("y"), "coupler", "rocker", parent_frame=coupler, child_frame=rocker)
    b.joint("D", mbs.Revolute("y"), "ground", "rocker", parent_frame=(design["ground"], 0.0, 0.0))
    return b.build(like=like)


NOMINAL = build(LENGTHS | {f"{name} mass": LENGTHS[name] for name in BARS})


def begin(design):
    """The mechanism and its state at rest."""
    system = build(design, like=NOMINAL)
    return system, mbs.State.at(system, A=START)


def feasible(row):
    """Whether the bars reach each other."""
    return begin(row["bars"])[1].ok


def run(design, solver, rtol):
    """One motion from rest, saved at 101 times."""
    system, start = begin(design)
    method, over = SOLVERS[solver]
    options = {"rtol": rtol, "atol": rtol, "solver": method, "interpolate": over}
    return system, start, mbs.simulate(system, start, ts=jnp.linspace(0.0, END, SAVED), **options)


def answers(start, motion, peaks):
    """What the study keeps of a motion: of its states every fifth, from the last one back."""
    path = motion.states.coordinates[::-5]
    steps = motion.diagnostics.num_steps + motion.diagnostics.num_rejected
    ok = motion.ok & jnp.all(jnp.isfinite(path))
    return {"start": start.coordinates, "path": path, "peaks": peaks, "steps": steps, "ok": ok}


def saved_peaks(system, motion):
    """Largest force [N] of every pin at the saved times."""
    loads = mbs.reactions(system, motion)
    return jnp.stack([jnp.max(jnp.linalg.norm(loads[name].force, axis=-1)) for name in "ABCD"])


def study(solver):
    """Function of {"bars": design, "rtol": number} to the peaks of all pins."""

    def one(row):
        system, start, motion = run(row["bars"], solver, row["rtol"])
        return answers(start, motion, saved_peaks(system, motion))

    return one


def motion_only(solver):
    """As `study`, without any load."""

    def one(row):
        _, start, motion = run(row["bars"], solver, row["rtol"])
        return answers(start, motion, jnp.zeros(4))

    return one


def largest(solver):
    """As `study`: the largest load of all pins [N], for its gradient by every length and mass."""

    def one(bars, rtol):
        system, start, motion = run(bars, solver, rtol)
        peaks = saved_peaks(system, motion)
        return jnp.max(peaks), answers(start, motion, peaks)

    return one


# ------------------------------------------------------------------------------------------------------------ MuJoCo
XML = """<mujoco><option gravity="0 0 -9.81" integrator="RK4" iterations="50" tolerance="1e-12">
<flag contact="disable"/></option><worldbody>
<body name="crank"><joint name="A" axis="0 1 0"/><inertial pos=".1 0 0" mass=".2" diaginertia="1e-9 .01 .01"/>
<site name="A"/>
<body name="coupler" pos=".2 0 0"><joint name="B" axis="0 1 0"/>
<inertial pos=".25 0 0" mass=".5" diaginertia="1e-9 .01 .01"/><site name="B"/>
<site name="C1" pos=".5 0 0"/></body></body>
<body name="rocker" pos=".5 0 0"><joint name="D" axis="0 1 0"/>
<inertial pos=".2 0 0" mass=".4" diaginertia="1e-9 .01 .01"/>
<site name="D"/><site name="middle" pos=".2 0 0"/><site name="C2" pos=".4 0 0"/></body></worldbody>
<equality><connect site1="C1" site2="C2"/></equality>
<sensor><force site="A"/><force site="B"/><force site="D"/><accelerometer site="middle"/></sensor></mujoco>"""
# The loop is a `connect` between two sites: with `anchor` MuJoCo takes the second point from the zero pose, which is
# not closed.  The load of C is that of the rocker less D's: its mass times what its accelerometer feels.


def models(designs, dt):
    """One MuJoCo model for each design, its constraint as stiff as the step allows."""
    import mujoco

    first = mujoco.MjModel.from_xml_string(XML)
    data, found = mujoco.MjData(first), []
    for k in range(len(designs["crank"])):
        model = copy.copy(first)
        model.opt.timestep, model.eq_solref[0] = dt, (2.0 * dt, 1.0)
        model.eq_solimp[0, :3] = 0.9999, 0.9999, 0.001
        for name in BARS:
            length, mass, body = designs[name][k], designs[f"{name} mass"][k], model.body(name)
            body.mass, body.ipos[0] = mass, length / 2.0
            body.inertia[:] = (1e-9, mass * length**2 / 12.0, mass * length**2 / 12.0)
        model.body("coupler").pos[0], model.body("rocker").pos[0] = designs["crank"][k], designs["ground"][k]
        model.site("C1").pos[0], model.site("C2").pos[0] = designs["coupler"][k], designs["rocker"][k]
        model.site("middle").pos[0] = designs["rocker"][k] / 2.0
        mujoco.mj_setConst(model, data)
        found.append(model)
    return found


def rolled_out(designs, start, dt, threads, end=END):
    """A function that runs all designs in MuJoCo's threads from our coordinates: (end (B, 3), peaks (B, 4))."""
    import mujoco
    from mujoco import rollout

    every = models(designs, dt)
    data = [mujoco.MjData(every[0]) for _ in range(threads)]
    A, B, C = np.asarray(start).T
    zero = np.zeros(len(A))
    state = np.stack([zero, A, B, A + B + C, zero, zero, zero], axis=1)  # time, angles, rates
    steps, each = round(end / dt), max(1, round(end / dt / (SAVED - 1)))

    def call():
        states, sensed = rollout.rollout(every, data, state, nstep=steps + 1)
        forces = sensed[:, ::each].reshape(len(A), -1, 4, 3)
        on_rocker = np.asarray(designs["rocker mass"])[:, None, None] * forces[:, :, 3] - forces[:, :, 2]
        loads = np.stack([forces[:, :, 0], forces[:, :, 1], on_rocker, forces[:, :, 2]], axis=2)
        return states[:, steps - 1, 1:4], np.linalg.norm(loads, axis=3).max(axis=1)

    return call
