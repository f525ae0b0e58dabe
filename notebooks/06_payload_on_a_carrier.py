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

from jaxmbs import coupling, elements, fem, forces, linear, reductions, viz
from jaxmbs.coupling import equivalent_impulse, limit_loads, modal_pairs, peak_response
from jaxmbs.linear import natural_modes

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
stage = fem.Structure(
    {f"s{k}": (0.0, 0.0, 0.8 * k) for k in range(PIECES + 1)},
    {"tube": (tube(0.30, 0.004), [(f"s{k}", f"s{k + 1}") for k in range(PIECES)])},
    held={"s0": "all"},
)


def instrument(radius):
    nodes = {"foot": (0.0, 0.0, 0.0), "knee": (0.0, 0.0, 0.5), "top": (0.0, 0.0, 1.0), "arm": (0.7, 0.0, 0.5)}
    pairs = [("foot", "knee"), ("knee", "top"), ("knee", "arm")]
    boxes = elements.PointMass(6.0, inertia=0.05 * np.eye(3))
    return fem.Structure(nodes, {"mast": (tube(radius, 0.002), pairs), "boxes": (boxes, [("top",), ("arm",)])})


tall = fem.assemble(stage, interface=[f"s{PIECES}"])
fine = fem.assemble(instrument(0.03), interface=["foot"])
print(linear.check(fine))

# %% [markdown]
# ## Reduce, join, and see what it costs
# Craig-Bampton: interface motions and the modes of each structure with its interface held.

# %%
LOSS = 3e-4  # [s], damping in proportion to the stiffness: 1 % at 10 Hz
tall, fine = (s.with_damping(LOSS * s.stiffness) for s in (tall, fine))
payload = reductions.reduce(fine, reductions.CraigBampton(num_modes=6))
carrier = reductions.reduce(tall, reductions.CraigBampton(num_modes=8))
joined = coupling.join((carrier, payload), (tuple(range(6)), tuple(range(6))))
whole = coupling.join((tall, fine), (tuple(range(6)), tuple(range(6))))
reduced, full = joined.modes(), whole.modes()
print(f"{whole.mass.shape[0]} coordinates reduced to {joined.mass.shape[0]}")
for a, b in zip(reduced.frequencies[:8], full.frequencies[:8], strict=True):
    print(f"{a:8.3f} Hz, unreduced {b:8.3f}, error {100 * (a / b - 1):.4f} %")

# %% [markdown]
# ## What the bolts carry
# A gust pushes the middle of the stage for a moment. The motion of every mode is exact between the samples of the
# load; the reactions at the interface come with their balance.

# %%
step, count = 1e-3, 600 if FAST else 4000
t = step * np.arange(count)
pulse = np.where(t < 0.06, np.sin(np.pi * t / 0.06), 0.0)
middle = np.zeros(tall.num_rows)
middle[tall.rows(f"s{PIECES // 2} x")[0]] = 5000.0


def interface_loads(system, pulse):
    return coupling.modal_transient(system, step, (middle[:, None] * pulse[None, :], None)).reactions(system)


loads = interface_loads(joined, jnp.asarray(pulse))
print(f"the bonds' forces balance to {float(loads.residual):.1e}")
fig, axes = plt.subplots(2, 1, figsize=(7, 4.5), layout="constrained", sharex=True)
axes[0].plot(t, loads.forces[1][0], lw=0.8)
axes[0].set_ylabel("shear force [N]")
axes[1].plot(t, loads.forces[1][4], lw=0.8)
axes[1].set_ylabel("moment [N m]")
axes[1].set_xlabel("time [s]")

# %% [markdown]
# ## Limit values without a coupled run
# Every mode of the stage meets every mode of the instrument: a system of two masses with a closed-form answer to an
# impulse. Each mode of the stage gets the impulse that makes its own peak under the pulse; the pairs are summed.

# %%
alone = natural_modes(K=tall.stiffness, M=tall.mass, num=8)
pairs = modal_pairs(alone.omega, alone.shapes[np.array(tall.interface)], payload)
recovery = jnp.abs(
    payload.mass[:6, 6:] * jnp.diagonal(payload.stiffness)[6:][None, :]
)  # loads per modal displacement


@jax.jit
def both(pulse):
    """Peak interface loads of the instrument's elastic response: coupled transient, absolute sum, root of squares."""
    drive = alone.shapes.T @ middle
    peaks = jax.vmap(lambda w, f: peak_response(w, f * pulse, step))(alone.omega, drive)
    impulses = equivalent_impulse(alone.omega, peaks)
    limits = [limit_loads(recovery, pairs.peaks(impulses), how) for how in ("abs", "srss")]
    motion = coupling.modal_transient(joined, step, (middle[:, None] * pulse[None, :], None), ratios=0.0)
    own = joined.part(motion.displacement)[1][6:]
    truth = jnp.max(jnp.abs((payload.mass[:6, 6:] * jnp.diagonal(payload.stiffness)[6:][None, :]) @ own), axis=1)
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
arm, top = fine.rows("arm x")[0], tall.rows(f"s{PIECES} x")[0]
count = 300 if FAST else 1000
given = middle[:, None] * pulse[None, :count]
fig, ax = plt.subplots(figsize=(7, 3), layout="constrained")
links = ()
for label in ("free", "with stops"):
    motion = coupling.transient(joined, t[:count], (given, None), links)
    on_stage, on_instrument = joined.expand(motion.displacement)
    swing = on_instrument[arm] - on_stage[top]
    ax.plot(t[:count], 1e3 * swing, lw=0.8, label=label)
    moment = motion.reactions(joined).forces[1][4]
    print(f"{label:11s} highest moment in the interface {float(jnp.max(jnp.abs(moment))):6.1f} N m")
    half = float(jnp.max(jnp.abs(swing))) / 2
    links = (coupling.Link(forces.BumpStop(1e10, -half, half), {(1, arm): 1.0, (0, top): -1.0}),)
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
    own = reductions.reduce(own.with_damping(LOSS * own.stiffness), reductions.CraigBampton(num_modes=6))
    system = coupling.join((carrier, own), (tuple(range(6)), tuple(range(6))))
    return jnp.max(jnp.abs(interface_loads(system, jnp.asarray(pulse)).forces[1][4]))


value, slope = jax.jit(jax.value_and_grad(highest))(0.03)
print(f"highest moment {value:.1f} N m, {slope / 1e3:+.2f} N m per mm of radius")
