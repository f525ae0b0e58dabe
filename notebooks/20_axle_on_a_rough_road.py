# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # A transport machine on a rough road, from the tyres to the hardpoints
#
# A ladder frame of finite elements, reduced to its brackets; powertrain and cab on rubber mounts; an axle of two
# wheels on five links each, with rolling tyres. It drives over a road of class C. What do the hardpoints carry, how
# long do they live, and how light can the links be while they live long enough and the wheels still point straight?

# %%
import os
import tempfile
from pathlib import Path

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs import elements, fatigue, fem, flexible, vehicles, viz

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %% [markdown]
# ## The axle by its hardpoints
# Left wheel; x forwards, y outwards, z up [m]. Links 1 to 4 hold the wheel, link 5 is the toe link.

# %%
POINTS = {
    **{"I1": (0.40, 0.45, 0.42), "O1": (0.06, 0.86, 0.38), "I2": (-0.42, 0.45, 0.43), "O2": (-0.10, 0.86, 0.39)},
    **{"I3": (0.35, 0.50, 0.74), "O3": (0.04, 0.84, 0.72), "I4": (-0.30, 0.50, 0.74), "O4": (-0.08, 0.84, 0.72)},
    **{"I5": (-0.26, 0.42, 0.560), "O5": (-0.24, 0.86, 0.530)},
    **{"AI": (0.0, 0.84, 0.50), "AO": (0.0, 1.00, 0.50), "S": (0.02, 0.66, 1.00), "D": (0.02, 0.80, 0.44)},
}
POINTS = {name: jnp.array(x) for name, x in POINTS.items()}
LINKS = [f"link_{k}" for k in range(1, 6)]
SIDES = {"left": (1.0, "L2"), "right": (-1.0, "R2")}  # with the bracket of the frame
RADIUS, SPEED, LOAD = 0.50, 20.0, 21.5e3  # of the wheel [m]; [m/s]; on a wheel [N]
STEEL, YOUNG, SHEAR = 7850.0, 210e9, 81e9

rig = vehicles.kc_rig(vehicles.five_link(POINTS, RADIUS))
travel = np.linspace(-0.08, 0.08, 9)

# %% [markdown]
# ## The frame
# Rails of box section with cross members and the payload over the axle. It is reduced to six interfaces: the brackets
# of the axle (L2, R2), the rear mounts of cab and powertrain (L4, R4), and the front (L6, R6).


# %%
def box(width, height, wall, **options):
    """A beam of box section."""
    inner = width - 2 * wall, height - 2 * wall
    second = [
        (a * b**3 - c * d**3) / 12 for (a, b), (c, d) in (((width, height), inner), ((height, width), inner[::-1]))
    ]
    around = (width - wall) * (height - wall)
    torsion = 2 * wall * around**2 / (width + height - 2 * wall)
    area = width * height - inner[0] * inner[1]
    return elements.Beam(YOUNG, SHEAR, area, second[0], second[1], torsion, STEEL, **options)


PLACES = (-1.2, -0.45, 0.0, 0.45, 1.4, 2.6, 3.6, 4.2)  # of the nodes along the rails [m]
NODES = {f"{rail}{k}": (x, y, 0.95) for rail, y in (("L", 0.45), ("R", -0.45)) for k, x in enumerate(PLACES)}
INTERFACES = ("L2", "R2", "L4", "R4", "L6", "R6")
structure = fem.Structure(
    NODES,
    {
        "rails": (
            box(0.08, 0.25, 0.008, reference=(0.0, 1.0, 0.0), line_mass=120.0),
            [(f"{rail}{k}", f"{rail}{k + 1}") for rail in "LR" for k in range(len(PLACES) - 1)],
        ),
        "cross members": (
            box(0.08, 0.16, 0.006, reference=(1.0, 0.0, 0.0)),
            [(f"L{k}", f"R{k}") for k in (0, 1, 3, 4, 6, 7)],
        ),
        "payload": (elements.PointMass(400.0), [(f"{rail}{k}",) for rail in "LR" for k in (1, 2, 3)]),
    },
)
frame = flexible.floating_frame(fem.assemble(structure), INTERFACES, num_modes=4, damping_ratio=0.03)

# %% [markdown]
# ## The machine
# Links are bars with balls in rubber at their ends: springs along them, in series with the bar of their area. Under
# each wheel runs a belt at the speed of travel, which the road lifts: the machine stays in its place while its tyres
# roll.

# %%
TYRE = vehicles.LinearTyre(
    2.5e5, 1.5e5, nominal_load=LOAD, radius=RADIUS + 0.5 * LOAD / 8e5, stiffness=8e5, vertical_damping=8e2
)
SPIN = float(SPEED / TYRE.rolling_radius(LOAD, SPEED / RADIUS, None))
MOUNTED = {
    "powertrain": (900.0, (2.9, 0.0, 1.0), (60.0, 150.0, 140.0), 1.5e6, (3.5, 2.2), 0.35, 0.95),
    "cab": (700.0, (2.6, 0.0, 1.8), (300.0, 350.0, 300.0), 2.0e5, (3.6, 1.5), 0.45, 1.2),
}


def on_frame(node, x):
    """A point of the frame near one of its interfaces."""
    return f"frame.{node}", jnp.asarray(x) - jnp.asarray(NODES[node])


def machine(design, like=None):
    """The whole machine; `design`: areas of the links [cm^2] and the height of I5 [m]."""
    b = mbs.SystemBuilder()
    b.elastic("frame", frame.body, position=NODES["L2"])
    b.joint("frame", mbs.Free(), "ground", "frame.L2", at=NODES["L2"])
    for name, (mass, com, inertia, k, xs, y, z) in MOUNTED.items():
        b.body(name, mass, com=com, inertia=inertia)
        b.joint(name, mbs.Free(), "ground", name)
        mount = mbs.Bushing((k, k, k, 0, 0, 0), (4e-3 * k, 4e-3 * k, 4e-3 * k, 0, 0, 0))
        for node, x in (("L6", xs[0]), ("R6", xs[0]), ("L4", xs[1]), ("R4", xs[1])):
            at = (x, y if node[0] == "L" else -y, z)
            b.force(f"{name} mount {node}", mount, between=(on_frame(node, at), (name, at)))
            b.measure(f"{name} mount {node}", force=f"{name} mount {node}", axis="z")
    for node, y in (("L6", 0.45), ("R6", -0.45)):
        at = (4.0, y, 0.95)
        axle = mbs.Bushing((2e5, 2e5, 1.6e5, 0, 0, 0), (1e4, 1e4, 1.2e4, 0, 0, 0), preload=(0, 0, -8850.0, 0, 0, 0))
        b.force(f"front axle {node}", axle, between=(("ground", at), on_frame(node, at)))
    for side, (sign, node) in SIDES.items():
        H = corner(b, design, side, sign, lambda x, node=node: on_frame(node, x), 120.0)
        belt = f"{side} belt"
        b.body(belt, 1.0, inertia=0.1)
        b.joint(belt, mbs.Prismatic("x"), f"{side} road", belt, drive=mbs.forces.Ramp(0.0, -SPEED))
        upright, tyre = f"{side} upright", vehicles.Tyre(TYRE)
        vehicles.mount_wheel(b, side, upright, H["AO"], 60.0, (3.0, 6.0, 3.0), tyre, road=belt)
    return b.build(like=like)


def corner(b, design, side, sign, on_body, mass):
    """An upright on five elastic links and a spring, and the road under it; its hardpoints."""
    H = {name: x * jnp.array([1.0, sign, 1.0]) for name, x in hardpoints(design).items()}
    upright, road = f"{side} upright", f"{side} road"
    b.body(upright, mass, com=H["AO"], inertia=(6.0, 8.0, 6.0))
    b.joint(f"{side} float", mbs.Free(), "ground", upright)
    b.body(road, 1.0, inertia=0.1)
    b.joint(road, mbs.Prismatic("z"), "ground", road, drive=mbs.forces.Constant(0.0))
    for k, name in enumerate(LINKS):
        inner, outer = H[f"I{k + 1}"], H[f"O{k + 1}"]
        length = jnp.linalg.norm(inner - outer)
        stiffness = 1.0 / (1.0 / 1.5e7 + length / (YOUNG * 1e-4 * design["area"][k]))
        law = mbs.SpringDamper(stiffness, 2e-4 * stiffness, length)
        b.force(f"{side} {name}", law, between=(on_body(inner), (upright, outer)))
    length = jnp.linalg.norm(H["S"] - H["D"])
    law = mbs.SpringDamper(1.6e5, 9e3, length + 0.13)
    b.force(f"{side} spring", law, between=(on_body(H["S"]), (upright, H["D"])))
    for name in (*LINKS, "spring"):
        b.measure(f"{side} {name}", force=f"{side} {name}")
    return H


def hardpoints(design):
    return POINTS | {"I5": POINTS["I5"].at[2].set(design["height"])}


FIRST = {"area": jnp.full(5, 5.0), "height": jnp.asarray(0.560)}
like = machine(FIRST)
rolling = {f"{side} spin": SPIN for side in SIDES}
steady = mbs.equilibrium(like, mbs.State.at(like, velocities=rolling), moving=list(rolling))
print(steady.reason, "-", like.topology.mobility, "freedoms")

# %% [markdown]
# ## Loads and lives of the hardpoints
# The machine linearised about its steady rolling, on both tracks of the road, coherent as on a surface. Each link
# carries one force, from its hardpoint on the frame to that on the upright; its stress is that over its area, its
# damage follows from the spectrum (Dirlik). So do the vertical forces in the mounts of powertrain and cab, and the
# damage of their brackets.

# %%
OUT = [f"left {name}" for name in (*LINKS, "spring")]
MOUNTS = [f"{name} mount {node}" for name in MOUNTED for node in ("L6", "L4")]
TRACKS = {"left road": (0.0, 1.0), "right road": (0.0, -1.0)}
ROAD = vehicles.RandomRoad.of_class("C")
BAND = (0.3, 60.0)  # [Hz]
SEAT, BRACKET = 8.0, 3.0  # areas at the seat of the spring and at a mount [cm^2]


def damage_of(system, rest, design, mounts=()):
    """The linearised machine, and the damage of its hardpoints over 1000 km."""
    linear = mbs.linearise(system, rest.state, inputs=list(TRACKS), outputs=[*OUT, *mounts])
    areas = zip([*OUT, *mounts], [*design["area"], SEAT, *[BRACKET] * len(mounts)], strict=True)
    curves = {name: fatigue.SN(1e12 * (1e2 * area) ** 5, 5.0) for name, area in areas}  # welds, of forces [N]
    mix = {"class C": vehicles.RoadShare(ROAD, SPEED, 1.0)}
    return linear, vehicles.road_mix_damage(linear, mix, TRACKS, curves, 1e6, lowest=BAND[0], highest=BAND[1])


def ride(design):
    """The whole machine, its steady rolling, its linearisation and the damage."""
    system = machine(design, like=like)
    rest = mbs.equilibrium(system, steady.state, moving=list(rolling))
    return system, rest, *damage_of(system, rest, design, MOUNTS)


before = ride(FIRST)
print(before[3])

# %% [markdown]
# ## A sketch for the search
# A search asks for loads many times. It has a sketch of the machine: one rigid frame that heaves and rolls, tyres
# that are springs. Lives of the sketch are corrected by those of the whole machine at the first design; what comes
# out is asked of the whole machine again.


# %%
def sketch(design, like=None):
    b = mbs.SystemBuilder()
    b.body("frame", 4100.0, com=(0.0, 0.0, 1.1), inertia=(1500.0, 2500.0, 3000.0))
    b.body("slide", 1.0)
    b.joint("heave", mbs.Prismatic("z"), "ground", "slide")
    b.joint("roll", mbs.Revolute("x"), "slide", "frame", at=(0.0, 0.0, 0.9))
    for side, (sign, _) in SIDES.items():
        H = corner(b, design, side, sign, lambda x: ("frame", x), 180.0)
        foot = H["AO"] * jnp.array([1.0, 1.0, 0.0])
        tyre = mbs.SpringDamper(8e5, 8e2, RADIUS + LOAD / 8e5)
        b.force(f"{side} tyre", tyre, between=((f"{side} road", foot), (f"{side} upright", H["AO"])))
    return b.build(like=like)


like_sketch = sketch(FIRST)
standing = mbs.equilibrium(like_sketch, mbs.State.at(like_sketch))


def life_of_sketch(design):
    """Decimal logarithms of the lives of the links [km]."""
    system = sketch(design, like=like_sketch)
    rest = mbs.equilibrium(system, standing.state)
    return jnp.log10(damage_of(system, rest, design)[1].life[: len(LINKS)] / 1e3)


def life_of(answer):
    return jnp.log10(answer[3].life[: len(LINKS)] / 1e3)


correction = life_of(before) - life_of_sketch(FIRST)
print("correction of the logarithms", np.round(correction, 2))

# %% [markdown]
# ## As light as life and toe allow
# Every link lives 200 000 km on this road; toe changes by at most 0.45 degrees over 80 mm of travel, both ways.


# %%
def mass(design):
    """Of the links of a side [kg]."""
    H = hardpoints(design)
    lengths = jnp.stack([jnp.linalg.norm(H[f"I{k}"] - H[f"O{k}"]) for k in range(1, 6)])
    return jnp.sum(STEEL * 1e-4 * design["area"] * lengths)


def toe(design):
    """Change of the toe over the travel [deg]."""
    found = rig.curves(travel, hardpoints={"I5": hardpoints(design)["I5"]}).toe
    return jnp.rad2deg(found - found[len(travel) // 2])


def values(design):
    return mass(design), {"life": life_of_sketch(design) + correction, "toe": toe(design)}


LIMITS = [
    mbs.Limit("life [log km]", "life", lower=np.log10(2e5)),
    mbs.Limit("toe [deg]", "toe", lower=-0.45, upper=0.45),
]
best = mbs.minimise(
    values,
    FIRST,
    bounds={"area": (jnp.full(5, 1.0), jnp.full(5, 15.0)), "height": (0.5, 0.62)},
    limits=LIMITS,
    steps=2 if FAST else 60,
    tolerance=1e-3,
    compile="quick",
    progress=False,
)
print(best.table())
light = mass(best.design)
print(f"{float(mass(FIRST)):.2f} kg, then {float(light):.2f} kg; areas", np.round(best.design["area"], 2), "cm^2")
assert FAST or (best.ok and light < mass(FIRST))

# %% [markdown]
# ## Before and after, of the whole machine

# %%
after = ride(best.design)
print(after[3])
print("lives of the links, 1000 km:", np.round(10.0 ** (np.asarray(life_of(after)) - 3), 0))
assert FAST or np.all(np.asarray(life_of(after)) > np.log10(2e5))
f = np.geomspace(*BAND, 200)
inputs, coherence = vehicles.wheel_inputs(ROAD, SPEED, TRACKS, *BAND)
fig, axes = plt.subplots(1, 3, figsize=(12, 3.5), layout="constrained")
for style, name, answer, design in (("--", "first", before, FIRST), ("-", "best", after, best.design)):
    spectra = mbs.random_response(answer[2], inputs, coherence=coherence)
    for k, (out, levels) in enumerate(zip([*OUT, *MOUNTS], np.asarray(spectra.psd(f)).T, strict=True)):
        label = out.removeprefix("left ") if style == "-" else None
        axes[k // len(OUT)].loglog(f, levels, style, color=f"C{k % len(OUT)}", lw=1, label=label)
    axes[2].plot(1e3 * travel, toe(design), style, color="k", lw=1, label=name)
axes[0].set(xlabel="frequency [Hz]", ylabel="force at the hardpoint [N$^2$/Hz]")
axes[1].set(xlabel="frequency [Hz]", ylabel="force in the mount [N$^2$/Hz]")
axes[0].legend(fontsize=8)
axes[1].legend(fontsize=8)
axes[2].set(xlabel="wheel travel [mm]", ylabel="change of toe [deg]")
axes[2].legend()

# %% [markdown]
# ## The report, and the machine to be turned
# The report has the machine, the optimum and the lives; the scene the frame as a mesh, the tyres on their road and
# the forces at the contacts as arrows.

# %%
final, rest = after[:2]
folder = Path(tempfile.mkdtemp())
page = mbs.report(
    folder / "axle.html",
    final,
    title="Transport machine",
    state=rest.state,
    optimum=best,
    hardpoints=after[3],
    forces=spectra,
)
print(page.name, page.stat().st_size // 1024, "kB")
solids = {
    "powertrain": [viz.Solid.box((1.1, 0.55, 0.5), "#8795a1").placed((2.85, 0.0, 1.05))],
    "cab": [viz.Solid.box((1.7, 1.7, 1.3), "#c9a227").placed((2.75, 0.0, 2.0))],
    **{f"{name} mount {node}": [] for name in MOUNTED for node in ("L4", "R4", "L6", "R6")},
}
scene = viz.scene(
    final,
    rest.state,
    folder / "machine.html",
    loads=True,
    shapes=solids,
    structures={"frame": (structure, frame)},
    title="Machine on its tyres",
)
