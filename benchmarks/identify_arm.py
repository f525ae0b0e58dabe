"""Armatures of the arm of MuJoCo's own system identification, from its motion: error and CPU seconds beside MuJoCo's.

The arm, its actuators and the first values are those of the integration test of `mujoco.sysid`, which needs
`pip install 'mujoco[sysid]'`.  The record is MuJoCo's fourth-order Runge-Kutta motion at a twentieth of the model's
time step, so that neither side is fitted to its own integration error.
"""

import tempfile
import time
from pathlib import Path

import common
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import sysid
from mujoco.sysid.tests import test_integration as theirs

import jaxmbs as mbs

AMPLITUDES = np.array([5.0, 4.0, 3.0, 2.0, 1.0])
RATES = 2 * np.pi * np.array([0.5, 0.7, 0.4, 0.9, 0.6])
PHASES = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
FINER = 20
FIRST = 0.01


def efforts(t, xp=np):
    """Efforts (5,) of the actuators."""
    return AMPLITUDES * xp.sin(RATES * t + PHASES)


def record(duration):
    """Times (k,) and sensors (k, 10): five angles, then five rates."""
    spec = mujoco.MjSpec.from_string(theirs.ARM_XML)
    step = spec.option.timestep
    spec.option.timestep, spec.option.integrator = step / FINER, mujoco.mjtIntegrator.mjINT_RK4
    model = spec.compile()
    data = mujoco.MjData(model)

    def control(model, data):
        data.ctrl[:] = efforts(data.time)

    rows = []
    mujoco.set_mjcb_control(control)
    try:
        for k in range(round(duration / step) * FINER):
            if k % FINER == 0:
                rows.append(np.concatenate([data.qpos, data.qvel]))
            mujoco.mj_step(model, data)
    finally:
        mujoco.set_mjcb_control(None)
    return step * np.arange(len(rows)), np.stack(rows)


def by_mujoco(ts, sensors, finer=1):
    """Function that runs MuJoCo's identification, returns the armatures (5,); `finer`: the model's time step over
    that used, then with the fourth-order integrator."""
    spec = mujoco.MjSpec.from_string(theirs.ARM_XML)
    if finer > 1:
        spec.option.timestep, spec.option.integrator = spec.option.timestep / finer, mujoco.mjtIntegrator.mjINT_RK4
    model = spec.compile()
    data = mujoco.MjData(model)
    initial = sysid.create_initial_state(model, data.qpos, data.qvel, data.act)
    fine = np.linspace(ts[0], ts[-1], (len(ts) - 1) * finer + 1)
    control = sysid.TimeSeries(fine, np.stack([efforts(t) for t in fine]))
    measured = sysid.TimeSeries.from_names(ts[1:], sensors[1:], model)

    def run():
        params = sysid.ParameterDict()
        for name in theirs.JOINT_NAMES:
            change = lambda s, p, n=name: setattr(s.joint(n), "armature", p.value[0])
            params.add(
                sysid.Parameter(f"{name}_armature", nominal=0.1, min_value=0.001, max_value=1.0, modifier=change)
            )
            params[f"{name}_armature"].value[:] = FIRST
        sequence = sysid.ModelSequences("arm", spec, "record", initial, control, measured)
        residual = sysid.build_residual_fn(models_sequences=[sequence])
        found, _ = sysid.optimize(initial_params=params, residual_fn=residual, optimizer="mujoco", verbose=False)
        return found.as_vector()

    return run


def by_jaxmbs(ts, sensors, rtol):
    """Function that runs ours, returns an `Identification`."""
    controls = {
        f"act{k + 1}": lambda t, k=k: AMPLITUDES[k] * jnp.sin(RATES[k] * t + PHASES[k]) for k in range(len(RATES))
    }

    def build(u, like=None):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "arm.xml"
            path.write_text(theirs.ARM_XML)
            builder = mbs.io.read_mjcf(path, armature="drop", controls=controls).builder
        for name in theirs.JOINT_NAMES:  # MuJoCo's armature turns in the ground
            builder.body(f"{name}.rotor", 2 * u[name], inertia=u[name] * np.array([0.5, 0.5, 1.0]))
            builder.joint(f"{name}.rotor", mbs.Revolute("z"), "ground", f"{name}.rotor")
            builder.constraint(f"{name}.gear", mbs.Coupler({name: 1.0, f"{name}.rotor": -1.0}))
        return builder.build(like=like)

    first = dict.fromkeys(theirs.JOINT_NAMES, FIRST)
    like = build(first)
    joints = [like.topology.joints[like.topology.joint_index[name]] for name in theirs.JOINT_NAMES]
    rows = np.array([joint.first_velocity for joint in joints])
    start = mbs.State.at(like)

    def predict(u):
        system = build(u, like)
        options = {"rtol": rtol, "atol": rtol, "gradient": "forward", "interpolate": True}
        motion = mbs.simulate(system, start, ts=ts, **options)
        return jnp.concatenate([motion.states.coordinates[:, rows], motion.states.velocities[:, rows]], axis=1)

    bounds = dict.fromkeys(first, (0.001, 1.0))
    return lambda: mbs.identify(predict, sensors, first, bounds)


def worst(found):
    """Largest error of the armatures (5,) [kg m^2]."""
    return float(np.max(np.abs(found - np.array([theirs.TRUE_ARMATURE[name] for name in theirs.JOINT_NAMES]))))


def main() -> None:
    options = common.parser(__doc__).parse_args()
    ts, sensors = record(0.2 if options.quick else 2.0)
    theirs_run = by_mujoco(ts, sensors)
    peer = worst(theirs_run())
    finer = 2 if options.quick else 25
    finer_run = by_mujoco(ts, sensors, finer)
    begin = time.process_time()
    finer_error, finer_seconds = worst(finer_run()), time.process_time() - begin
    rows = []
    for rtol in (1e-3,):
        ours = by_jaxmbs(ts, sensors, rtol)
        begin = time.process_time()
        found = ours()
        first = time.process_time() - begin
        times = common.cpu_seconds({"ours": ours, "theirs": theirs_run}, rounds=1 if options.quick else 3)
        case, other = f"rtol {rtol:g}", f"mujoco, step / {finer}"
        rows += [
            common.row(case, "largest error", worst(found.values), "kg m^2", "mujoco", peer, goal="1.0"),
            common.row(case, "CPU seconds", times["ours"], "s", "mujoco", times["theirs"], goal="0.1"),
            common.row(case, "largest error", worst(found.values), "kg m^2", other, finer_error),
            common.row(case, "CPU seconds", times["ours"], "s", other, finer_seconds, goal="0.1"),
            common.row(case, "first call, with compilation", first, "s"),
            common.row(case, "directions seen", found.rank),
        ]
    common.report(rows, options)


if __name__ == "__main__":
    main()
