"""Costs of elastic bodies, beside rigid ones and with gradients.

A four-bar with an elastic coupler beside the rigid one from import to reactions, in cold processes without flags; a
batch of thicknesses of an elastic link with gradients; a reduced plate and its derivative by every thickness.
"""

import json
import subprocess
import sys
import time

START = time.process_time()
CHILD = sys.argv[1:2] == ["--child"]
if CHILD:  # a process like a user's, without flags and without a cache
    import os

    os.environ["JAXMBS_BENCHMARK_ENVIRONMENT"] = "user"

import common  # noqa: I001, E402
import jax  # noqa: E402
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402

import jaxmbs as mbs  # noqa: E402
from jaxmbs import elements, fem, flexible  # noqa: E402

YOUNG, DENSITY = 7e10, 2700.0
GROUND, CRANK, COUPLER, ROCKER = 1.0, 0.3, 0.9, 0.7
SIDE, MODES, BARS = 0.02, 8, 8


# ------------------------------------------------------------------------------------------- links and mechanisms
def bar(length, thickness, count=BARS, width=SIDE):
    """A bar along x of `count` beams, thin in y."""
    area, polar = width * thickness, width**3 * thickness / 12
    fibres = jnp.stack([jnp.stack([0.5 * thickness, 0.0 * thickness])])
    beam = elements.Beam(
        YOUNG,
        2.6e10,
        area,
        polar,
        width * thickness**3 / 12,
        polar,
        DENSITY,
        reference=(0.0, 1.0, 0.0),
        fibres=fibres,
    )
    x = np.linspace(0.0, length, count + 1)
    nodes = np.stack([x, 0 * x, 0 * x], axis=1)
    return fem.Structure(nodes, {"bar": (beam, [(k, k + 1) for k in range(count)])})


def four_bar(elastic, mass=0.972):
    """A four-bar in a plane under its weight, its coupler rigid or elastic."""
    b, x = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0)), np.array([1.0, 0.0, 0.0])
    for name, length in (("crank", CRANK), ("rocker", ROCKER)):
        b.body(name, mass=1.0, com=x * length / 2, inertia=mbs.inertia.rod(1.0, length))
    start, end, at = "coupler", "coupler", x * COUPLER
    if elastic:
        mesh = bar(COUPLER, jnp.array(SIDE))
        frame = flexible.floating_frame(mesh, ("0", str(BARS)), num_modes=MODES, damping_ratio=0.01)
        b.elastic("coupler", frame.body, motions={str(BARS): mbs.Planar("z")})
        start, end, at = "coupler.0", f"coupler.{BARS}", 0.0 * x
    else:
        b.body("coupler", mass=mass, com=x * COUPLER / 2, inertia=mbs.inertia.rod(mass, COUPLER))
    pin = mbs.Revolute("z")
    b.joint("A", pin, "ground", "crank")
    b.joint("B", pin, "crank", start, parent_frame=x * CRANK)
    b.joint("D", pin, "ground", "rocker", parent_frame=x * GROUND)
    b.joint("C", pin, end, "rocker", parent_frame=at, child_frame=x * ROCKER)
    return b.build(cut=["C"])


def child(kind):
    """CPU seconds of one cold process up to the reactions of a second's motion, and the largest force of a pin."""
    system = four_bar(kind == "elastic")
    state = mbs.State.at(system, A=0.7, guess={"B": -0.2, "D": 1.2}, velocities={"A": 3.0})
    motion = mbs.simulate(system, state, t1=1.0, rtol=1e-6, atol=1e-6)
    force = jnp.max(jnp.linalg.norm(mbs.reactions(system, motion)["A"].force, axis=-1))
    print(
        json.dumps(
            {"force": float(force), "steps": int(motion.diagnostics.num_steps), "CPU": time.process_time() - START}
        )
    )


def four_bar_rows(quick):
    """The elastic four-bar beside the rigid one."""
    found = {}
    for kind in ("rigid", "elastic"):
        runs = []
        for _ in range(1 if quick else 3):
            command = [sys.executable, __file__, "--child", kind]
            runs.append(json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout))
        found[kind] = min(runs, key=lambda run: run["CPU"])
    case = f"four-bar, coupler of {MODES} modes"
    pairs = {
        "import to reactions": ("CPU", "s CPU", "ratio <= 2"),
        "largest force of a pin": ("force", "N", ""),
        "steps": ("steps", "", ""),
    }
    return [
        common.row(case, metric, found["elastic"][key], unit, "rigid", found["rigid"][key], goal)
        for metric, (key, unit, goal) in pairs.items()
    ]


# -------------------------------------------------------------------------------------------- a hundred thicknesses
def thickness_rows(quick):
    """Peak stress at the hub of links that turn by a motor, and its slope by the thickness, in one batch."""
    ts, number = np.linspace(0.0, 0.5, 26), 4 if quick else 100

    def turn(t):
        return 1.5 * (t - jnp.sin(4 * jnp.pi * t) / (4 * jnp.pi))

    def declared(mesh, like=None):
        frame = flexible.floating_frame(mesh, ("0",), num_modes=3, damping_ratio=0.02, stiffening=True)
        b = mbs.SystemBuilder()
        b.elastic("link", frame.body)
        b.joint("hub", mbs.Revolute("z"), "ground", "link.0", drive=turn)
        return frame, b.build() if like is None else b.build(like=like)

    nominal = declared(bar(1.0, jnp.array(0.01)))[1]

    def peak(thickness):
        mesh = bar(1.0, thickness)
        frame, system = declared(mesh, nominal)
        options = {"rtol": 1e-6, "atol": 1e-8, "gradient": "forward", "throw": False}
        motion = mbs.simulate(system, mbs.State.at(system), ts=ts, **options)
        return flexible.stresses(system, motion, "link", frame, mesh).envelope().peak

    def both(thickness):
        return jax.jvp(peak, (thickness,), (jnp.ones_like(thickness),))

    thicknesses = np.linspace(0.008, 0.016, number)
    begin = time.process_time()
    many = mbs.jit(jax.vmap(both))
    first = jax.block_until_ready(many(thicknesses))
    whole = time.process_time() - begin
    again = common.cpu_seconds({"run": lambda: many(thicknesses)}, 1)["run"]
    step = 1e-5
    ends = [many(thicknesses + way)[0] for way in (step, -step)]
    error = jnp.median(jnp.abs((ends[0] - ends[1]) / (2 * step) / first[1] - 1))  # far from kinks
    case = f"{number} thicknesses of an elastic link"
    return [
        common.row(case, "peaks and slopes with compilation", whole, "s CPU", goal="" if quick else "<= 60"),
        common.row(case, "peaks and slopes", again, "s CPU"),
        common.row(case, "slope beside differences, median", error, "1"),
    ]


# --------------------------------------------------------------------------------------------------------- a plate
def plate(thicknesses, n):
    """A square plate of n x n shells of unlike thickness, stiffened by bars at two edges."""
    nodes, name = {}, {}
    for i, x in enumerate(np.linspace(0.0, 1.0, n + 1)):
        for j, y in enumerate(np.linspace(0.0, 1.0, n + 1)):
            name[i, j] = f"{i}.{j}"
            nodes[name[i, j]] = (x, y, 0.0)
    quads = [[name[i, j], name[i + 1, j], name[i + 1, j + 1], name[i, j + 1]] for i in range(n) for j in range(n)]
    shells = [elements.Quadrilateral(YOUNG, 0.33, t, density=DENSITY) for t in thicknesses]
    bars = elements.Beam(2.1e11, 8e10, 1e-4, 8e-10, 8e-10, 1.4e-9)
    edges = [[name[i, j], name[i, j + 1]] for i in (0, n) for j in range(n)]
    return fem.Structure(nodes, {"plate": (shells, quads), "bars": (bars, edges)}), (name[0, n // 2], name[n, n // 2])


def plate_rows(quick):
    """`floating_frame` of a plate, and the gradient of a number of its body by the thickness of every element."""
    n = 3 if quick else 17

    def stiffness(thicknesses):
        mesh, interfaces = plate(thicknesses, n)
        body = flexible.floating_frame(mesh, interfaces, num_modes=4).body
        return jnp.log(jnp.trace(body.stiffness[6:, 6:])) + 1e-3 * jnp.trace(body.inertia)

    at = jnp.full(n * n, 0.004)
    seconds = {}
    for kind, function in {"value": stiffness, "gradient": jax.value_and_grad(stiffness)}.items():
        compiled = mbs.jit(function)
        begin = time.process_time()
        jax.block_until_ready(compiled(at))
        seconds[f"{kind}, first call"] = time.process_time() - begin
        seconds[kind] = common.cpu_seconds({"run": lambda compiled=compiled: compiled(at)}, 1 if quick else 3)["run"]
    case, goals = f"plate of {6 * (n + 1) ** 2} coordinates", {"value": "<= 5", "gradient": "ratio <= 3"}
    rows = []
    for kind in ("value", "gradient"):
        more = {} if kind == "value" else {"peer": "value", "peer_value": seconds["value"]}
        rows.append(common.row(case, kind, seconds[kind], "s CPU", goal="" if quick else goals[kind], **more))
        rows.append(common.row(case, f"{kind}, first call", seconds[f"{kind}, first call"], "s CPU"))
    return rows


def main():
    common.run_cases(__doc__, {"four-bar": four_bar_rows, "thicknesses": thickness_rows, "plate": plate_rows})


if __name__ == "__main__":
    child(sys.argv[2]) if CHILD else main()
