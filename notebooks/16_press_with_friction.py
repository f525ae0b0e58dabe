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
# # A toggle press whose pins rub
#
# Friction in every pin follows the pin's own load, and loads it. How much of the motor's work reaches the part, where
# does the press lock itself, and which links and pins need the least torque? At the end a brake squeals.

# %%
import os

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %% [markdown]
# ## The press
# A motor turns the upper link, which straightens against the lower one and pushes the ram down. The knee is a
# cylindrical joint and the ram's pin a ball: with four plane joints the loads across the plane would be open, and
# `build` would say that compliances share them.

# %%
FORCE, SPEED = 50e3, 0.01  # on the ram [N], of the motor [rad/s]
FIRST = {"upper": 0.30, "lower": 0.40, "radius": 0.03}  # lengths of links and radius of pins [m]
PINS = ("A", "B", "C")


def press(design, mu=0.12, like=None):
    """The press; x points down."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    for name in ("upper", "lower"):
        length = design[name]
        b.body(name, mass=8.0, com=(length / 2, 0, 0), inertia=mbs.inertia.rod(8.0, length))
    b.body("ram", mass=40.0, inertia=1.0)
    b.joint("A", mbs.Revolute("z"), "ground", "upper")
    b.joint("B", mbs.Cylindrical("z"), "upper", "lower", parent_frame=(design["upper"], 0, 0))
    b.joint("C", mbs.joints.Spherical(), "lower", "ram", parent_frame=(design["lower"], 0, 0))
    b.joint("guide", mbs.Prismatic("x"), "ground", "ram")
    for name in PINS:
        b.friction(
            f"rub {name}", name, mbs.friction.SmoothCoulomb(mu, transition_speed=1e-6), radius=design["radius"]
        )
    b.friction("rub guide", "guide", mbs.friction.SmoothCoulomb(mu, transition_speed=1e-6))
    b.force("part", mbs.Force((-FORCE, 0, 0)), on="ram")
    return b.build(cut=["C"], guess={"A": 0.6, "B": (0.0, -1.0), "guide": 0.6}, like=like)


first = press(FIRST)
print(mbs.check(first))

# %% [markdown]
# ## Torque and efficiency along the stroke
# The ram is within 20 mm of the end of its stroke. Motion impends against the force on the ram; the other limit is
# the torque at which the ram would come back. Where that is not positive, the press locks itself.

# %%
LEFT = np.linspace(20e-3**0.5, 0.02e-3**0.5, 5 if FAST else 25) ** 2  # way of the ram to the end of its stroke [m]


def angle_of(design, left):
    """Angle of the upper link, by the law of cosines."""
    a, b = design["upper"], design["lower"]
    height = a + b - left
    return jnp.arccos((a * a + height * height - b * b) / (2 * a * height))


def pose(system, design, left):
    angle = angle_of(design, left)
    knee = -angle - jnp.arcsin(design["upper"] / design["lower"] * jnp.sin(angle))
    guess = {"B": (0.0, knee), "guide": design["upper"] + design["lower"] - left}
    return mbs.State.at(system, A=angle, guess=guess, velocities={"A": -SPEED})


def stroke(design, mu):
    """The band of the motor's torque along the stroke."""
    system = press(design, mu, like=first)
    return jax.vmap(lambda left: mbs.analysis.impending_motion(system, pose(system, design, left), ["A"]))(LEFT)


run = mbs.jit(stroke, compile="quick")
fig, axes = plt.subplots(1, 2, figsize=(9, 3), layout="constrained")
for mu, color in ((0.05, "C0"), (0.12, "C1")):
    band = run(FIRST, mu)
    assert np.all(band.ok)
    axes[0].plot(1e3 * LEFT, -band.forward["A"][:, 0] / 1e3, color, label=f"presses, mu {mu}")
    axes[0].plot(1e3 * LEFT, -band.backward["A"][:, 0] / 1e3, color, ls=":", label=f"comes back, mu {mu}")
    axes[1].plot(1e3 * LEFT, band.efficiency, color, label=f"mu {mu}")
    locked = LEFT[np.asarray(band.self_locking)]
    print(
        f"mu {mu}: efficiency {band.efficiency[0]:.2f} to {band.efficiency[-1]:.2f}, locks itself in the last "
        f"{1e3 * max(locked, default=0.0):.2f} mm"
    )
axes[0].plot(1e3 * LEFT, -band.frictionless["A"][:, 0] / 1e3, "k--", label="without friction")
axes[0].set_ylabel("torque [kN m]")
axes[1].set_ylabel("efficiency")
for ax in axes:
    ax.set_xlabel("way to the end [mm]")
    ax.legend(fontsize=7)

# %% [markdown]
# Without friction the torque is that of virtual work, the force times the way of the ram per angle.

# %%
slopes = 1 / jax.vmap(jax.grad(angle_of, argnums=1), (None, 0))(FIRST, LEFT)
np.testing.assert_allclose(-band.frictionless["A"][:, 0], FORCE * slopes, rtol=1e-6)

# %% [markdown]
# ## Links and pins by gradients
# The least peak torque with all friction, where the motor swings by 0.45 rad at most and no pin carries more than
# 25 MPa (its load over 4 r^2, as it is as wide as thick). Thick pins carry more and rub more. The gradient goes
# through the pose, the reactions and the friction that they make.


# %%
def peak_torque(design):
    """Peak torque [kN m], and what the limits see."""
    system = press(design, like=first)
    states = jax.vmap(lambda left: pose(system, design, left))(LEFT)
    slow = jnp.zeros_like(states.velocities)
    loads = mbs.reactions(system, states, accelerations=slow, actuators=["A"])
    pin = jnp.stack([jnp.linalg.norm(loads[name].force, axis=-1) for name in PINS])
    seen = {"swing": angle_of(design, LEFT[0]), "pressure": jnp.max(pin) / 4e6 / design["radius"] ** 2}
    return jnp.max(-loads["A"].effort[..., 0]) / 1e3, seen


best = mbs.minimise(
    peak_torque,
    FIRST,
    bounds={"upper": (0.1, 0.5), "lower": (0.2, 0.6), "radius": (0.01, 0.05)},
    limits=[mbs.Limit("swing [rad]", "swing", upper=0.45), mbs.Limit("pressure [MPa]", "pressure", upper=25.0)],
    steps=2 if FAST else 40,
    tolerance=1e-4,
    gradient="forward",
    compile="quick",
    progress=False,
)
print(best.table())
assert FAST or best.ok
assert best.value < best.initial_value or FAST

# %%
after = run(best.design, 0.12)
fig, axes = plt.subplots(1, 2, figsize=(9, 3), layout="constrained")
for ax, name in zip(axes, ("torque [kN m]", "efficiency"), strict=True):
    for label, style, found in (("first", "-", band), ("best", "--", after)):
        values = -found.forward["A"][:, 0] / 1e3 if name.startswith("torque") else found.efficiency
        ax.plot(1e3 * LEFT, values, style, label=label)
    ax.set_xlabel("way to the end [mm]")
    ax.set_ylabel(name)
    ax.legend(fontsize=8)

# %% [markdown]
# ## A brake that sticks and slips
# A motor turns slowly and pulls a braked disc by a soft shaft. The brake's pads press with a preload, and friction at
# rest is larger than in motion: the disc sticks, the shaft winds up, and the disc jumps. At a higher speed it slides.

# %%
PADS, RADIUS, MU, RISE = 800.0, 0.12, 0.35, 1.5  # [N], [m]
SHAFT, DAMPING = 150.0, 0.6  # [N m/rad], [N m s/rad]
SLIDING = MU * PADS * RADIUS


def brake(speed):
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    b.body("disc", mass=5.0, inertia=0.04)
    b.joint("axle", mbs.Revolute("z"), "ground", "disc")
    b.friction("pads", "axle", mbs.friction.SmoothCoulomb(MU, MU * RISE, 2e-3), radius=RADIUS, preload=PADS)
    shaft = mbs.forces.Actuator(lambda x, v, t: SHAFT * (speed * t - x) + DAMPING * (speed - v))
    b.force("shaft", shaft, joint="axle")
    return b.build()


fig, axes = plt.subplots(1, 2, figsize=(9, 3), layout="constrained", sharey=True)
for ax, speed in zip(axes, (0.5, 8.0), strict=True):
    system = brake(speed)
    ts = np.linspace(0.0, 0.4 if FAST else 2.5, 40 if FAST else 500)
    motion = mbs.simulate(system, mbs.State.at(system), ts=ts, solver=mbs.ode.Rodas5P(), max_steps=20_000)
    assert motion.ok
    torque = SHAFT * (speed * ts - motion.states.coordinates[:, 0])
    ax.plot(ts, torque)
    ax.axhline(SLIDING, color="k", lw=0.7)
    ax.axhline(RISE * SLIDING, color="k", lw=0.7, ls=":")
    ax.set_title(f"motor at {speed} rad/s", fontsize=9)
    ax.set_xlabel("time [s]")
    late = torque[len(ts) // 2 :]
    assert FAST or (np.ptp(late) < 0.01 * SLIDING) == (speed > 1.0)
    heat = -motion.diagnostics.work["pads"][-1]
    print(
        f"{speed} rad/s: torque of the shaft {late.min():.1f} to {late.max():.1f} N m, heat of the pads {heat:.0f} J"
    )
axes[0].set_ylabel("torque of the shaft [N m]")
