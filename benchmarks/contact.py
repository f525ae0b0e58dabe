"""Contacts beside closed forms, Exudyn and MuJoCo: errors and CPU time of bounce, roll, impact, lift-off, clearance.

The peers take fixed steps, in two sizes; Exudyn's slider-crank has its contact as a function in Python.
"""

import functools
import importlib.util

import common
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import contact as C

GRAVITY = 9.81
BALL = {"mass": 1.0, "stiffness": 1e6, "height": 0.1, "end": 1.0}
SLOPE, RADIUS = 0.35, 0.05
IMPACT = {
    "mass": 0.5,
    "radius": 0.05,
    "stiffness": 2e8,
    "speed": 0.8,
    "damping": 0.2,
    "restitution": 0.9035248661504409,
}
CAM = {"e": 0.01, "mass": 0.8, "spring": 6000.0, "preload": 40.0, "stiffness": 1e8}
OMEGA, TOP = 100.0, 80.0  # [rad/s], [N]
CRANK = {
    "crank": 0.05, "rod": 0.12, "speed": 20 * np.pi, "rod_mass": 0.21, "rod_inertia": 2.5e-4, "slider_mass": 0.14,
    "clearance": 2e-4, "damping": 5.0, "radius": 0.01,
    "stiffness": float(C.hertz_stiffness((0.01, -0.0102), (2.07e11, 2.07e11), (0.3, 0.3))),
}  # fmt: skip
TURN = np.linspace(0.0, 0.1, 2001)[1:]
HAS_EXUDYN, HAS_MUJOCO = (importlib.util.find_spec(name) is not None for name in ("exudyn", "mujoco"))


def sliding(name, body, axis="z", gravity=0.0):
    """A builder with a body on a slide."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -gravity))
    b.body(body, name["mass"])
    b.joint("z", mbs.Prismatic(axis), "ground", body)
    return b


# ------------------------------------------------------------------------------------------------------ bouncing ball
def bounce_height():
    """Height of the elastic ball at the end by its free flights and half sines."""
    m, k, h, t = (BALL[name] for name in ("mass", "stiffness", "height", "end"))
    v, w = np.sqrt(2 * GRAVITY * h), np.sqrt(k / m)
    touch = 2.0 / w * (np.pi - np.arctan(v * w / GRAVITY))
    t = (t - v / GRAVITY) % (touch + 2 * v / GRAVITY)
    if t < touch:
        return GRAVITY / w**2 * (np.cos(w * t) - 1.0) - v / w * np.sin(w * t)
    t -= touch
    return v * t - GRAVITY * t**2 / 2


def bouncing_ball(rtol):
    b = sliding(BALL, "ball", gravity=GRAVITY)
    b.contact("floor", C.SphereOnPlane(RADIUS), "ball", "ground", C.HuntCrossley(BALL["stiffness"], 1.0))
    system = b.build()
    start = mbs.State.at(system, {"z": RADIUS + BALL["height"]})

    def run(start):
        motion = mbs.simulate(system, start, ts=np.array([BALL["end"]]), rtol=rtol, atol=1e-3 * rtol)
        return motion.states.coordinates[0, 0] - RADIUS

    return run, start


def mujoco_ball(xml, end, read, step):
    """A MuJoCo model as a function that runs it to the end."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.timestep = step
    data = mujoco.MjData(model)

    def run():
        mujoco.mj_resetData(model, data)
        mujoco.mj_step(model, data, nstep=round(end / step))
        return read(data)

    return run


BOUNCE_XML = f"""<mujoco><option gravity="0 0 -{GRAVITY}" integrator="RK4" iterations="50" tolerance="1e-12"/>
<worldbody><geom type="plane" size="1 1 1" condim="1" solref="-{BALL["stiffness"]} 0" solimp="0.9999 0.9999 0.001"/>
<body pos="0 0 {RADIUS + BALL["height"]}"><joint type="slide" axis="0 0 1"/>
<geom type="sphere" size="{RADIUS}" mass="{BALL["mass"]}" condim="1" solref="-{BALL["stiffness"]} 0"
 solimp="0.9999 0.9999 0.001"/></body></worldbody></mujoco>"""


# ------------------------------------------------------------------------------------------------------- rolling ball
def rolling_ball(rtol):
    """Speed of a ball of 1 kg after one second on a slope, where it rolls."""
    b = mbs.SystemBuilder(gravity=GRAVITY * np.array([np.sin(SLOPE), 0.0, -np.cos(SLOPE)]))
    b.body("ball", 1.0, inertia=0.4 * RADIUS**2)
    b.joint("ball", mbs.Free(), "ground", "ball")
    force, depth = C.HuntCrossley(1e6, 1.0), GRAVITY * np.cos(SLOPE) / 1e6
    b.contact("slope", C.SphereOnPlane(RADIUS), "ball", "ground", force, 0.2)
    system = b.build()
    start = mbs.State.at(system, {"ball": (0.0, 0.0, RADIUS - depth, 1.0, 0.0, 0.0, 0.0)})

    def run(start):
        motion = mbs.simulate(system, start, ts=np.array([1.0]), rtol=rtol, atol=1e-2 * rtol, max_steps=100_000)
        return mbs.velocity(system, motion, "ball")[0, 0]

    return run, start


ROLL_XML = f"""<mujoco><option gravity="{GRAVITY * np.sin(SLOPE)} 0 -{GRAVITY * np.cos(SLOPE)}" integrator="RK4"
 iterations="50" tolerance="1e-12" cone="elliptic"/>
<worldbody><geom type="plane" size="9 9 1" friction="0.2 0 0" condim="3" solimp="0.9999 0.9999 0.001"/>
<body pos="0 0 {RADIUS}"><freejoint/><geom type="sphere" size="{RADIUS}" mass="1" friction="0.2 0 0" condim="3"
 solimp="0.9999 0.9999 0.001"/></body></worldbody></mujoco>"""


# ------------------------------------------------------------------------------------------------ impact and lift-off
def impact(rtol):
    """CT1: speed after an impact over the speed before."""
    b = sliding(IMPACT, "sphere")
    force = C.HuntCrossley(IMPACT["stiffness"], 1.5, IMPACT["damping"])
    b.contact("plane", C.SphereOnPlane(IMPACT["radius"]), "sphere", "ground", force)
    system = b.build()
    start = mbs.State.at(system, {"z": IMPACT["radius"]}, {"z": -IMPACT["speed"]})

    def run(start):
        motion = mbs.simulate(system, start, ts=np.array([0.0015]), rtol=rtol, atol=1e-3 * rtol)
        return motion.states.velocities[0, 0] / IMPACT["speed"]

    return run, start


def flat_follower(rtol):
    """CT2: force at the top of the eccentric's turn, the contact as stiff as Exudyn's."""
    b = sliding(CAM, "follower")
    b.body("cam", 1.0, inertia=1e-3)
    b.joint("cam", mbs.Revolute("y"), "ground", "cam", drive=mbs.Ramp(0.0, OMEGA))
    b.force("spring", mbs.SpringDamper(CAM["spring"], free_length=-CAM["e"], preload=CAM["preload"]), joint="z")
    downwards = np.diag([1.0, -1.0, -1.0])
    face = ("follower", mbs.Pose(np.array([0.0, 0.0, RADIUS]), downwards))
    pair, force = C.SphereOnPlane(RADIUS), C.HuntCrossley(CAM["stiffness"], 1.0)
    b.contact("face", pair, ("cam", (0.0, 0.0, -CAM["e"])), face, force)
    system = b.build()
    start = mbs.State.at(system, {"z": -CAM["e"] - cam_depth()})

    def run(start):
        ts = np.array([np.pi / OMEGA])
        motion = mbs.simulate(system, start, ts=ts, rtol=rtol, atol=1e-4 * rtol, max_steps=100_000)
        return mbs.dynamics.contact_load(system, motion, "face").normal_force[0, 0]

    return run, start


def cam_depth():
    """Depth at the bottom, where the follower starts in balance [m]."""
    return (CAM["preload"] + CAM["mass"] * CAM["e"] * OMEGA**2) / CAM["stiffness"]


# --------------------------------------------------------------------------------------------------------- clearance
def slider_crank_model():
    """A slider-crank whose wrist pin has clearance, and where it starts."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, 0.0))
    b.body("crank", 1.0, inertia=1e-4)
    b.body("rod", CRANK["rod_mass"], com=(CRANK["rod"] / 2, 0.0, 0.0), inertia=CRANK["rod_inertia"])
    b.body("slider", CRANK["slider_mass"], inertia=1e-4)
    b.joint("crank", mbs.Revolute("z"), "ground", "crank", drive=mbs.Ramp(0.0, CRANK["speed"]))
    b.joint("rod", mbs.Revolute("z"), "crank", "rod", parent_frame=(CRANK["crank"], 0.0, 0.0))
    b.joint("slide", mbs.Prismatic("x"), "ground", "slider")
    pair = C.JournalInBush(CRANK["radius"], CRANK["clearance"], 0.02, sections=1)
    force = C.HuntCrossley(CRANK["stiffness"], 1.5, CRANK["damping"])
    b.contact("pin", pair, "slider", ("rod", (CRANK["rod"], 0.0, 0.0)), force)
    system = b.build()
    turning = -CRANK["speed"] * (1.0 + CRANK["crank"] / CRANK["rod"])
    begin = {"rod": 0.0, "slide": CRANK["crank"] + CRANK["rod"]}
    return system, mbs.State.at(system, begin, {"rod": turning, "slide": 0.0})


def slider_crank(rtol):
    """Mean and peak load of a wrist pin with clearance in one turn."""
    system, start = slider_crank_model()

    def run(start):
        motion = mbs.simulate(system, start, ts=TURN, rtol=rtol, atol=1e-2 * rtol, max_steps=100_000)
        force = mbs.dynamics.contact_load(system, motion, "pin").normal_force[:, 0]
        return jnp.stack([jnp.mean(force), jnp.max(force)])

    return run, start


# --------------------------------------------------------------------------------------------------------------- rows
def peers(case, quick):
    """Functions of no argument by name."""
    found = {}
    if HAS_EXUDYN:
        import exudyn_contacts as E

        models = {
            "bouncing ball": (lambda: E.bouncing_ball(**BALL), (2_000, 20_000)),
            "CT1 impact": (exudyn_impact, (2_000, 20_000)),
            "CT2 force at lift": (
                lambda: E.flat_follower(CAM | {"depth": cam_depth()}, OMEGA, np.pi / OMEGA),
                (2_000, 20_000),
            ),
            "slider-crank with clearance": (lambda: E.slider_crank(CRANK, 0.1), (10_000, 50_000)),
        }
        if case in models:
            model, steps = models[case]
            found |= {f"Exudyn, {n} steps": functools.partial(model(), n) for n in steps[: 1 if quick else 2]}
    if HAS_MUJOCO:
        models = {
            "bouncing ball": (BOUNCE_XML, BALL["end"], lambda data: data.qpos[0] + BALL["height"]),
            "rolling ball": (ROLL_XML, 1.0, lambda data: data.qvel[0]),
        }
        if case in models:
            steps = (1e-4,) if quick else (1e-3, 1e-4, 1e-5)
            found |= {f"MuJoCo, {step:g} s": mujoco_ball(*models[case], step) for step in steps}
    return found


def exudyn_impact():
    """Its Hunt-Crossley model takes a restitution, of which the damping is `1.5 (1 - e) / v`."""
    import exudyn_contacts as E

    e = 1.0 - IMPACT["damping"] * IMPACT["speed"] / 1.5
    return E.impact(*(IMPACT[name] for name in ("mass", "radius", "stiffness", "speed")), e, 0.0015)


CASES = {  # model, true value, tolerances
    "bouncing ball": (bouncing_ball, bounce_height, (1e-6, 1e-9)),
    "rolling ball": (rolling_ball, lambda: 5 / 7 * GRAVITY * np.sin(SLOPE), (1e-5, 1e-7)),
    "CT1 impact": (impact, lambda: IMPACT["restitution"], (1e-6, 1e-9)),
    "CT2 force at lift": (flat_follower, lambda: TOP, (1e-7, 1e-9)),
}


def rows_of(case, model, truth, tolerances, quick):
    """Error and CPU seconds of a case at each tolerance, beside its peers."""
    rows, runs, errors = [], {}, {}
    for rtol in tolerances[:1] if quick else tolerances:
        run, start = model(rtol)
        program, _ = common.compiled(run, start)
        runs[f"rtol {rtol:g}"] = functools.partial(program, start)
    runs |= peers(case, quick)
    errors = {name: np.max(np.abs(np.asarray(run()) / truth - 1.0)) for name, run in runs.items()}
    seconds = common.cpu_seconds(runs, 1 if quick else 3, least=0.1)
    ours = [name for name in runs if name.startswith("rtol")]
    others = [name for name in runs if name not in ours] or [None]
    for name in ours:
        for peer in others:
            at = f"{case}, {name}"
            of_peer = (peer, errors.get(peer)), (peer, seconds.get(peer))
            rows.append(common.row(at, "error", errors[name], "", *of_peer[0]))
            rows.append(common.row(at, "one run", seconds[name], "s CPU", *of_peer[1]))
    return rows


def main():
    name = "slider-crank with clearance"
    options = common.parser(__doc__, *CASES, name).parse_args()
    rows = []
    for case, (model, truth, tolerances) in CASES.items():
        if common.wanted(options, case):
            rows += rows_of(case, model, truth(), tolerances, options.quick)
    if common.wanted(options, name):
        run, start = slider_crank(1e-11)
        truth = np.asarray(common.compiled(run, start)[0](start))
        rows += rows_of(name, slider_crank, truth, (1e-6, 1e-8), options.quick)
    common.report(rows, options)


if __name__ == "__main__":
    main()
