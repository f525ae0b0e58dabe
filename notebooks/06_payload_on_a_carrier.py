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
# # A payload on a carrier
#
# Two teams own two structures: a launcher's stage and the instrument that rides on it. Each is reduced by itself and
# joined at the interface; what the bolts carry follows from the coupled motion. Then the limit values that need no
# coupled run at all, against the truth.

# %%
import os

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs import elements, fem, forces, viz
from jaxmbs.coupling import connect, equivalent_impulse, limit_loads, modal_pairs, peak_response, rigid_bond
from jaxmbs.reductions import CraigBampton, reduce
from jaxmbs.vibration import CoordinateLaw, ModalSuperposition

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))


def tube(radius, wall):
    area, second = 2 * np.pi * radius * wall, np.pi * radius**3 * wall
    return elements.Beam(70e9, 27e9, area, second, second, 2 * second, density=2700.0)


# %% [markdown]
# ## The two structures
# The stage is a tall tube, clamped at its foot. The instrument is a slender mast with a side boom and two boxes; it
# is held nowhere but by the interface, which is one node with six coordinates and so just holds it.

# %%
PIECES = 4 if FAST else 8
HEIGHT, TOP, MIDDLE = 0.8 * PIECES, f"s{PIECES}", f"s{PIECES // 2}"
stage = fem.Structure(
    {f"s{k}": (0.0, 0.0, 0.8 * k) for k in range(PIECES + 1)},
    {"tube": (tube(0.30, 0.004), [(f"s{k}", f"s{k + 1}") for k in range(PIECES)])},
    held={"s0": "all"},
)


def instrument(radius):
    nodes = {"foot": (0.0, 0.0, 0.0), "knee": (0.0, 0.0, 0.5), "top": (0.0, 0.0, 1.0), "arm": (0.7, 0.0, 0.5)}
    nodes = {name: np.add(place, (0.0, 0.0, HEIGHT)) for name, place in nodes.items()}
    pairs = [("foot", "knee"), ("knee", "top"), ("knee", "arm")]
    boxes = elements.PointMass(6.0, inertia=0.05 * np.eye(3))
    return fem.Structure(nodes, {"mast": (tube(radius, 0.002), pairs), "boxes": (boxes, [("top",), ("arm",)])})


tall = fem.assemble(stage, interface=[TOP])
fine = fem.assemble(instrument(0.03), interface=["foot"])
print(mbs.check(fine))

# %% [markdown]
# ## Reduce, join, and see what it costs
# Craig-Bampton: interface motions and the modes of each structure with its interface held.

# %%
LOSS = 3e-4  # [s], damping in proportion to the stiffness: 1 % at 10 Hz
tall, fine = (s.with_damping(LOSS * s.stiffness) for s in (tall, fine))
carrier, payload = reduce(tall, CraigBampton(num_modes=8)), reduce(fine, CraigBampton(num_modes=6))
bolts = {"bolts": rigid_bond("payload.foot", f"stage.{TOP}")}
net = connect({"stage": carrier, "payload": payload}, bolts)
whole = connect({"stage": tall, "payload": fine}, bolts)
reduced, full = (mbs.modes(system, damped=False) for system in (net, whole))
print(f"{whole.num_rows} coordinates reduced to {net.num_rows}")
for a, b in zip(reduced.frequencies[:8], full.frequencies[:8], strict=True):
    print(f"{a:8.3f} Hz, unreduced {b:8.3f}, error {100 * (a / b - 1):.4f} %")

# %% [markdown]
# ## What the bolts carry
# A gust pushes the middle of the stage for a moment. The motion of every mode is exact between the samples of the
# load; the loads of the bolts on the instrument are evaluated by name.

# %%
step, count = 1e-3, 600 if FAST else 4000
t = step * np.arange(count)
pulse = np.where(t < 0.06, np.sin(np.pi * t / 0.06), 0.0)


def bolt_loads(net, pulse):
    gust = {f"stage.{MIDDLE} x": 5000.0 * pulse}
    return mbs.reactions(net, mbs.simulate(net, ts=t, forces=gust, solver=ModalSuperposition()))["bolts"]


bolt = bolt_loads(net, jnp.asarray(pulse))
fig, axes = plt.subplots(2, 1, figsize=(7, 4.5), layout="constrained", sharex=True)
axes[0].plot(t, bolt.force[:, 0], lw=0.8)
axes[0].set_ylabel("shear force [N]")
axes[1].plot(t, bolt.moment[:, 1], lw=0.8)
axes[1].set_ylabel("moment [N m]")
axes[1].set_xlabel("time [s]")

# %% [markdown]
# ## Limit values without a coupled run
# Every mode of the stage meets every mode of the instrument: a system of two masses with a closed-form answer to an
# impulse. Each mode of the stage gets the impulse that makes its own peak under the pulse; the pairs are summed.

# %%
alone = mbs.modes(tall, num=8, damped=False)
at_top, drive = tall.outputs(TOP)[0] @ alone.shapes, alone.shapes.T @ tall.load({f"{MIDDLE} x": 5000.0})
pairs = modal_pairs(alone.omega, at_top, payload)
b = payload.num_interface
recovery = payload.mass[:b, b:] * jnp.diagonal(payload.stiffness)[None, b:]  # loads per modal displacement
own_modes, _ = net.outputs(*(f"payload.normal {k}" for k in range(6)))


@mbs.jit
def both(pulse):
    """Peak interface loads of the instrument's elastic response: coupled transient, absolute sum, root of squares."""
    peaks = jax.vmap(lambda w, f: peak_response(w, f * pulse, step))(alone.omega, drive)
    impulses = equivalent_impulse(alone.omega, peaks)
    limits = [limit_loads(jnp.abs(recovery), pairs.peaks(impulses), how) for how in ("abs", "srss")]
    motion = mbs.simulate(
        net, ts=t, forces={f"stage.{MIDDLE} x": 5000.0 * pulse}, solver=ModalSuperposition(ratios=0.0)
    )
    truth = jnp.max(jnp.abs(motion.displacement @ own_modes.T @ recovery.T), axis=0)
    return truth, *limits


truth, above, root = both(jnp.asarray(pulse))
for name, k in (("shear x", 0), ("moment y", 4)):
    print(f"{name:9s} transient {truth[k]:8.1f}   absolute sum {above[k]:8.1f}   root of squares {root[k]:8.1f}")

# %% [markdown]
# The sums are estimates, not bounds. Over pulses of many lengths: how often, and by how much, do they fall short?

# %%
lengths = np.geomspace(0.01, 0.5, 6 if FAST else 60)
pulses = np.where(t[None] < lengths[:, None], np.sin(np.pi * t[None] / lengths[:, None]), 0.0)
found = [both(jnp.asarray(p)) for p in pulses]
peaks, above, root = (np.array([float(f[k][0]) for f in found]) for k in range(3))
fig, ax = plt.subplots(figsize=(7, 3.5), layout="constrained")
viz.plot_limit_values({"absolute sum": above, "root of squares": root}, peaks, lengths, ax=ax)
ax.set_xscale("log")
ax.set_xlabel("length of the pulse [s]")

# %% [markdown]
# ## A stop beside the arm
# The instrument's arm meets stops on the stage at half of its free swing. Modes no longer suffice: the joined system
# is integrated, and the stops' force is among those that the reactions answer.

# %%
arm, top = "payload.arm x", f"stage.{TOP} x"
both_ends, _ = net.outputs(arm, top)
count = 300 if FAST else 1000
gust = {f"stage.{MIDDLE} x": 5000.0 * pulse[:count]}
fig, ax = plt.subplots(figsize=(7, 3), layout="constrained")
laws = ()
for label in ("free", "with stops"):
    motion = mbs.simulate(net, ts=t[:count], forces=gust, laws=laws)
    on_instrument, on_stage = both_ends @ motion.displacement.T
    swing = on_instrument - on_stage
    ax.plot(t[:count], 1e3 * swing, lw=0.8, label=label)
    moment = mbs.reactions(net, motion)["bolts"].moment[:, 1]
    print(f"{label:11s} highest moment in the interface {float(jnp.max(jnp.abs(moment))):6.1f} N m")
    half = float(jnp.max(jnp.abs(swing))) / 2
    laws = (CoordinateLaw(forces.BumpStop(1e10, -half, half), {arm: 1.0, top: -1.0}),)
ax.set_xlabel("time [s]")
ax.set_ylabel("arm on the stage [mm]")
ax.legend(frameon=False)

# %% [markdown]
# ## A stiffer mast?
# The gradient of the highest moment in the interface by the radius of the instrument's tubes, through reduction,
# coupling and the transient.


# %%
def highest(radius):
    own = fem.assemble(instrument(radius), interface=["foot"])
    own = reduce(own.with_damping(LOSS * own.stiffness), CraigBampton(num_modes=6))
    system = connect({"stage": carrier, "payload": own}, bolts)
    return jnp.max(jnp.abs(bolt_loads(system, jnp.asarray(pulse)).moment[:, 1]))


value, slope = mbs.jit(jax.value_and_grad(highest))(0.03)
print(f"highest moment {value:.1f} N m, {slope / 1e3:+.2f} N m per mm of radius")
