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
# # A blade that stiffens, and a rod that whips
#
# The pull of its own rotation stiffens a blade. A connecting rod of a fast engine is bent by its own inertia, and
# pushed and pulled by its piston as well. Both are one elastic body each: its stress over a turn is limited, and the
# lightest rod is found by gradients.

# %%
import os

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs import analysis, elements, fem, flexible, viz

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))
YOUNG, SHEAR, DENSITY = 71e9, 27e9, 2700.0  # aluminium


def strip(length, width, thickness):
    """A bar along x of rectangular section: its width in z, and for each element its thickness in y [m]."""
    x = np.linspace(0.0, length, len(thickness) + 1)

    def bar(t):
        corner = jnp.stack([t, jnp.full((), width)]) / 2
        return elements.Beam(
            YOUNG,
            SHEAR,
            width * t,
            inertia_y=width**3 * t / 12,
            inertia_z=width * t**3 / 12,
            torsion=(width * t) ** 3 / (3.6 * (width**2 + t**2)),
            density=DENSITY,
            reference=(0.0, 1.0, 0.0),
            fibres=jnp.stack([corner, corner * np.array([-1.0, 1.0])]),
        )

    pairs = [(str(k), str(k + 1)) for k in range(len(thickness))]
    nodes = {str(k): (float(place), 0.0, 0.0) for k, place in enumerate(x)}
    return fem.Structure(nodes, {"strip": ([bar(t) for t in thickness], pairs)})


# %% [markdown]
# ## Campbell diagram of a blade
# The blade is flat in the plane of rotation: it flaps out of the plane softly and lags in it stiffly. Each speed has
# its own steady motion and the modes about it. Marks are the frequencies of Wright, Smith, Thresher and Wang (1982)
# for a beam of this section.

# %%
LENGTH, WIDTH, THIN = 1.0, 0.06, 0.008
plate = strip(LENGTH, THIN, jnp.full(12, WIDTH))
frame = flexible.floating_frame(plate, ("0",), num_modes=3 if FAST else 6, stiffening=True)
b = mbs.SystemBuilder(gravity=(0, 0, 0))
b.elastic("blade", frame.body)
b.joint("shaft", mbs.Revolute("z"), "ground", "blade.0")
turning = b.build()

unit = np.sqrt(YOUNG * THIN**2 / 12 / DENSITY) / LENGTH**2  # of flapping [rad/s]
speeds = np.linspace(0.0, 12.0 * unit, 3 if FAST else 13)
diagram = analysis.campbell(turning, speeds, "shaft")
FLAP = {0: 3.51602, 4: 5.58500, 8: 9.25684, 12: 13.17015}

fig, ax = plt.subplots(figsize=(7, 4.5), layout="constrained")
viz.plot_campbell(diagram.speeds, diagram.frequencies, orders=(1, 2, 3), ax=ax)
ax.plot(unit * np.array(list(FLAP)), unit * np.array(list(FLAP.values())) / (2 * np.pi), "ko", ms=4)
for order in (2, 3):
    meet = np.asarray(diagram.critical_speeds(order))
    print(f"{order} excitations a turn meet a mode at", (meet[np.isfinite(meet)] * 30 / np.pi).round(), "rpm")
found = 2 * np.pi * np.min(diagram.frequencies[-1]) / unit
print(f"first flap at the highest speed {found:.4f}, published {FLAP[12]}")
assert FAST or abs(found / FLAP[12] - 1) < 5e-3

# %% [markdown]
# ## A rod at 3000 turns a minute
# A crank drives a piston through a flat rod. The motor comes to speed within two turns; the third is looked at. The
# rod is as thick as is said at its crank pin, in its middle and at its piston pin [mm]. Tension and thrust of the
# piston stiffen and soften it.

# %%
CRANK, ROD, DEPTH, PISTON = 0.05, 0.4, 0.03, 0.3  # lengths and width [m], mass [kg]
COUNT, SPEED, TURN = 6, 100 * np.pi, 0.02
PLACES = np.array([0.0, 0.5, 1.0])  # of the three thicknesses, along the rod
FIRST = {"thickness": jnp.array([8.0, 8.0, 8.0])}


def rod(design):
    places = (np.arange(COUNT) + 0.5) / COUNT
    return strip(ROD, DEPTH, 1e-3 * jnp.interp(places, PLACES, design["thickness"]))


def angle(t):
    """Angle of the crank: up to speed within two turns of that speed, smoothly."""
    s = jnp.clip(t / (2 * TURN), 0.0, 1.0)
    return SPEED * (2 * TURN * (s**3 - s**4 / 2) + jnp.maximum(t - 2 * TURN, 0.0))


def engine(mesh, like=None):
    frame = flexible.floating_frame(mesh, ("0", str(COUNT)), num_modes=1, damping_ratio=0.03, stiffening=True)
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("crank", 1.0, inertia=1e-3)
    b.elastic("rod", frame.body, motions={str(COUNT): mbs.Planar("z")})
    b.body("piston", PISTON, inertia=1e-4)
    b.joint("shaft", mbs.Revolute("z"), "ground", "crank", drive=angle)
    b.joint("crank pin", mbs.Revolute("z"), "crank", "rod.0", parent_frame=(CRANK, 0, 0))
    b.joint("guide", mbs.Prismatic("x"), "ground", "piston", parent_frame=(CRANK + ROD, 0, 0))
    b.joint("piston pin", mbs.Revolute("z"), f"rod.{COUNT}", "piston")
    return b.build(cut=["piston pin"]) if like is None else b.build(cut=["piston pin"], like=like), frame


first, _ = engine(rod(FIRST))
print(mbs.check(first))

# %% [markdown]
# ## Stress over a turn
# The thrust of the piston alone would stress the rod by a few MPa. Its own inertia across it bends it twice a turn.

# %%
INSTANTS = np.linspace(2 * TURN, 3 * TURN, 9 if FAST else 61)


def run(design):
    """Motion and stresses of the third turn."""
    mesh = rod(design)
    system, frame = engine(mesh, like=first)
    options = {"rtol": 1e-6, "atol": 1e-7, "gradient": "forward", "throw": False}
    motion = mbs.simulate(system, mbs.State.at(system), ts=INSTANTS, **options)
    return motion, flexible.stresses(system, motion, "rod", frame, mesh)


def peaks(design):
    """Mass of the rod [kg], and the largest equivalent stresses [MPa] of its corners over the turn."""
    motion, stress = run(design)
    mass = DENSITY * DEPTH * ROD * 1e-3 * jnp.mean(jnp.interp(np.linspace(0.0, 1.0, 61), PLACES, design["thickness"]))
    return mass, {"stress": 1e-6 * jnp.ravel(stress.envelope().highest["strip"])}


look = mbs.jit(run, compile="quick")
motion, stress = look(FIRST)
assert np.all(motion.status == 0)
history = 1e-6 * stress.measure("signed_von_mises")["strip"]
print(
    f"largest stress {1e-6 * float(stress.envelope().peak):.0f} MPa, in the middle {history[:, 2, 2].max():.0f} MPa"
)

# %% [markdown]
# ## The lightest rod under a stress limit
# Its thickness at three places, so that no corner exceeds 120 MPa. Gradients go through the finite elements, their
# reduction, the motion and the stresses.

# %%
best = mbs.minimise(
    peaks,
    FIRST,
    bounds={"thickness": (4.0, 20.0)},
    limits=[mbs.Limit("stress [MPa]", "stress", upper=120.0)],
    steps=1 if FAST else 30,
    tolerance=1e-3,
    gradient="forward",
    compile="quick",
    progress=False,
)
print(best.table())
print("thickness [mm]", np.round(best.design["thickness"], 2))
assert FAST or best.ok

# %% [markdown]
# The middle becomes thick and the ends thin, as they carry little.

# %%
motion, after = look(best.design)
fig, axes = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
turn = 360 * (INSTANTS - INSTANTS[0]) / TURN
for found, color, label in ((stress, "C1", "first"), (after, "C0", "best")):
    values = 1e-6 * found.measure("von_mises")["strip"]
    axes[0].plot(turn, values.max(axis=(1, 2)), color, label=label)
    ends = 1e-6 * found.envelope().highest["strip"].max(axis=1)
    axes[1].step(
        1e3 * ROD * np.arange(COUNT + 1) / COUNT, np.append(ends, ends[-1]), color, where="post", label=label
    )
axes[0].set(xlabel="angle of the crank [deg]", ylabel="largest von Mises stress [MPa]", xticks=np.arange(0, 361, 90))
axes[1].set(xlabel="place along the rod [mm]", ylabel="largest over the turn [MPa]")
for ax in axes:
    ax.axhline(120.0, color="0.5", ls="--", lw=0.9)
    ax.legend(frameon=False)

# %% [markdown]
# The rod at the instant of its largest stress, coloured by it, and the machine as a page for the browser.

# %%
worst = int(jnp.argmax(jnp.max(after.at_nodes(), axis=1)))
mesh = rod(best.design)
system, frame = engine(mesh, like=first)
at_worst = jax.tree.map(lambda x: x[worst], motion.states)
x = frame.expand(flexible.displacements(system, at_worst, "rod", frame))
ax = viz.plot_structure(mesh, x, "xy", values=1e-6 * after.at_nodes()[worst], label="von Mises stress [MPa]")

# %%
page = viz.scene(
    system,
    motion,
    None,
    structures={"rod": (mesh, frame)},
    stresses={"rod": after.at_nodes()},
    title="A rod that whips",
)
page  # noqa: B018
