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
# # An arm is identified, and says what it hides
#
# Drawings of an arm of two links give lengths. Masses, centres, inertias and the friction of its joints are to be
# found from the torques of its motors: first along a chosen motion, then along the one that tells most.

# %%
import os

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs.identification import FourierMotion, best_excitation

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))
NOISE = 0.3  # of the torques [N m]

# %% [markdown]
# ## The arm
# Both joints turn about horizontal axes. A motor moves the links against dry and viscous friction.


# %%
def arm(u, like=None):
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    for link in ("upper", "fore"):
        turning = u[f"{link} inertia"]
        b.body(link, u[f"{link} mass"], (u[f"{link} centre"], 0, 0), (0.01, turning, turning), any_inertia=True)
    b.joint("shoulder", mbs.Revolute("y"), "ground", "upper")
    b.joint("elbow", mbs.Revolute("y"), "upper", "fore", parent_frame=mbs.Pose((0.5, 0, 0)))
    return b.build(like=like)


truth = {
    "upper mass": 6.0,
    "upper centre": 0.22,
    "upper inertia": 0.16,
    "fore mass": 3.5,
    "fore centre": 0.27,
    "fore inertia": 0.09,
    "dry": np.array([4.0, 2.0]),
    "viscous": np.array([1.5, 0.8]),
}
drawing = {name: 0.8 * np.asarray(value) for name, value in truth.items()}
like = arm(drawing)


def torques(u, motion):
    """Torques (60, 2) of the motors along a periodic motion [N m]."""
    system = arm(u, like)

    def at(q, v, a):
        friction = u["dry"] * jnp.tanh(v / 0.05) + u["viscous"] * v
        return mbs.inverse_dynamics(system, mbs.State(jnp.zeros(()), q, v), a) + friction

    return jax.vmap(at)(*motion.at(motion.times(60)))


# %% [markdown]
# ## A motion that somebody chose
# Both joints swing slowly. The torques are measured with noise.

# %%
PERIOD = 6.0
chosen = FourierMotion(
    jnp.array([-0.6, 0.9]), jnp.array([[0.4, 0.0], [0.0, 0.3]]), jnp.array([[0.0, 0.1], [0.2, 0.0]]), PERIOD
)
rng = np.random.default_rng(0)


def measured(motion):
    clean = np.asarray(torques(truth, motion))
    return clean + NOISE * rng.normal(size=clean.shape)


def identified(motion, data):
    return mbs.identify(lambda u: torques(u, motion), data, drawing, deviations=NOISE)


first = identified(chosen, measured(chosen))
print(first)

# %% [markdown]
# Of the six inertial numbers only four combinations act on the torques: two directions stay hidden whatever the
# motion. Others are seen badly, because this motion is slow. The verdict names them.

# %%
for direction in first.unseen:
    print(f"{direction.deviation:9.3g}  {direction.text}")

# %% [markdown]
# ## The motion that tells most
# Under limits of stroke, speed and acceleration, and of the torque of the motors. It adds to what is known already.

# %%
plan = best_excitation(
    torques,
    first.unknowns,
    stroke=((-1.4, -1.8), (1.0, 1.8)),
    speed=(2.5, 3.5),
    acceleration=(12.0, 18.0),
    period=PERIOD,
    harmonics=2 if FAST else 4,
    limits=mbs.Limit("torque", lambda m: torques(truth, m), -np.array([70.0, 25.0]), np.array([70.0, 25.0])),
    deviations=NOISE,
    known=first,
    steps=3 if FAST else 60,
    progress=False,
    compile="quick",
)
print(plan.summary())

# %%
ts = np.linspace(0.0, PERIOD, 300)
figure, axes = plt.subplots(1, 2, figsize=(10, 3.2))
for ax, motion, title in zip(axes, (chosen, plan.motion), ("chosen", "planned"), strict=True):
    ax.plot(ts, np.asarray(motion.at(ts)[0]))
    ax.set(xlabel="time [s]", ylabel="angle [rad]", title=f"The {title} motion")
axes[1].legend(["shoulder", "elbow"])
figure.tight_layout()

# %% [markdown]
# ## Both experiments, and a scale
# The two motions run side by side as experiments. What stays hidden needs another kind of measurement: both links are
# put on a scale, to 20 g.

# %%
padded = FourierMotion(
    chosen.offset,
    *(jnp.pad(x, ((0, 0), (0, plan.motion.sines.shape[1] - 2))) for x in (chosen.sines, chosen.cosines)),
    PERIOD,
)
motions = jax.tree.map(lambda *x: jnp.stack(x), padded, plan.motion)
records = np.stack([measured(padded), measured(plan.motion)])
both = mbs.identify(torques, records, drawing, deviations=NOISE, experiments=motions)
print(both.summary())

# %%
scale = {name: (truth[name], 0.02) if "mass" in name else None for name in drawing}
weighed = mbs.identify(torques, records, drawing, deviations=NOISE, experiments=motions, prior=scale)
print(weighed)
assert weighed.ok or FAST

# %%
sizes = np.concatenate([np.atleast_1d(truth[name]) for name in sorted(truth)])
figure, ax = plt.subplots(figsize=(9, 3.4))
places = np.arange(len(sizes))
for k, (found, label) in enumerate(((first, "chosen motion"), (both, "both motions"), (weighed, "and weighed"))):
    errors = np.where(np.isfinite(found.standard_errors), found.standard_errors, np.nan) / sizes
    ax.bar(places + 0.27 * (k - 1), 100 * errors, 0.25, label=label)
ax.set(yscale="log", ylabel="standard error [%]", title="What each experiment tells; no bar: hidden")
ax.set_xticks(places, weighed.names, rotation=35, ha="right")
ax.legend()
figure.tight_layout()

# %% [markdown]
# ## Does it predict?
# A third motion, which no experiment has seen: prediction and measurement differ by no more than the noise.

# %%
check = FourierMotion(
    jnp.array([0.2, -0.5]), jnp.array([[0.3, 1.0], [1.2, -0.6]]), jnp.array([[0.9, 0.2], [-0.7, 0.5]]), PERIOD
)
data, predicted = measured(check), np.asarray(torques(weighed.unknowns, check))
left = (data - predicted) / NOISE
print(f"root mean square of the differences over the noise: {np.sqrt(np.mean(left**2)):.2f}")
figure, ax = plt.subplots(figsize=(9, 3))
for k, name in enumerate(("shoulder", "elbow")):
    ax.plot(check.times(60), data[:, k], f"C{k}.", label=f"{name}, measured")
    ax.plot(check.times(60), predicted[:, k], f"C{k}", label=f"{name}, predicted")
ax.set(xlabel="time [s]", ylabel="torque [N m]", title="A motion that was not fitted")
ax.legend(ncol=2, loc="lower left")
figure.tight_layout()
assert FAST or np.sqrt(np.mean(left**2)) < 1.2
