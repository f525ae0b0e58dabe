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
# # A robot from its URDF
#
# An arm is read from its URDF and gets a payload whose mass is a design variable. How does the peak torque grow with
# the payload, and what do the bearings carry along a path? Pinocchio, reading the same file, checks every number.

# %%
import os
import tempfile
from pathlib import Path

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pinocchio as pin

import jaxmbs as mbs

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %%
LINKS = {  # mass [kg], centre [m], principal inertias [kg m^2]
    "column": (6.0, (0, 0, 0.15), (0.06, 0.06, 0.02)),
    "upper": (4.0, (0.2, 0, 0.02), (0.006, 0.06, 0.06)),
    "fore": (2.5, (0.18, 0, 0), (0.003, 0.03, 0.03)),
    "hand": (0.8, (0.05, 0, 0.01), (0.0008, 0.001, 0.001)),
}
JOINTS = {  # parent, child, place, axis
    "turn": ("base", "column", (0, 0, 0.1), (0, 0, 1)),
    "shoulder": ("column", "upper", (0, 0, 0.3), (0, 1, 0)),
    "elbow": ("upper", "fore", (0.4, 0, 0), (0, 1, 0)),
    "wrist": ("fore", "hand", (0.36, 0, 0), (1, 0, 0)),
}


def spoken(numbers):
    return " ".join(map(str, numbers))


def link(name, mass, centre, inertia):
    ixx, iyy, izz = inertia
    return (
        f'<link name="{name}"><inertial><mass value="{mass}"/><origin xyz="{spoken(centre)}"/>'
        f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def joint(name, parent, child, place, axis):
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{spoken(place)}"/><axis xyz="{spoken(axis)}"/>'
        '<limit lower="-2.8" upper="2.8" velocity="3" effort="150"/></joint>'
    )


tool = '<link name="tool"/><joint name="flange" type="fixed"><parent link="hand"/><child link="tool"/>'
parts = [link(name, *numbers) for name, numbers in LINKS.items()]
parts += [joint(name, *numbers) for name, numbers in JOINTS.items()]
parts += ['<link name="base"/>', tool + '<origin xyz="0.12 0 0"/></joint>']
path = Path(tempfile.mkdtemp()) / "arm.urdf"
path.write_text('<robot name="arm">' + "".join(parts) + "</robot>")

robot = mbs.io.read_urdf(path)
print(robot)
print(robot.builder.build().describe())

# %% [markdown]
# The hand's flange is a fixed joint, so `tool` is a frame of the body `hand`. What is left out of the mechanism is
# listed: the limits, until `stops=` gives them a stiffness.
#
# ## A path
# All joints swing; the derivatives of the path are those of JAX.

# %%
NAMES = tuple(JOINTS)
AMPLITUDE, OMEGA = np.array([0.9, 0.6, 0.8, 1.2]), np.array([1.0, 1.5, 2.0, 1.0])


def q(t):
    return jnp.array([0.0, -0.3, 0.9, 0.0]) + AMPLITUDE * jnp.sin(OMEGA * t)


v = jax.jacfwd(q)
a = jax.jacfwd(v)
ts = jnp.linspace(0.0, 2 * np.pi, 17 if FAST else 201)
path_q, path_v, path_a = (jax.vmap(f)(ts) for f in (q, v, a))


# %% [markdown]
# ## Payload
# The mass is traced, so the model is built inside of the function that is differentiated. A body welded to the frame
# `tool` is the payload.


# %%
def loaded(mass):
    b = mbs.io.read_urdf(path).builder
    b.body("payload", mass=mass, com=(0, 0, 0.05), inertia=mass * jnp.array([2e-3, 2e-3, 1e-3]))
    b.joint("grip", mbs.Weld(), "hand", "payload", parent_frame="tool")
    return b.build()


@mbs.jit
def torques(mass):
    system = loaded(mass)
    return jax.vmap(lambda q, v, a: mbs.inverse_dynamics(system, mbs.State(0.0, q, v), a))(path_q, path_v, path_a)


def theirs(mass):
    """Pinocchio: torques (times, 4), and the force and moment that each joint carries (times, 4, 6)."""
    model = pin.buildModelFromUrdf(str(path))
    payload = pin.Inertia(mass, np.array([0, 0, 0.05]), mass * np.diag([2e-3, 2e-3, 1e-3]))
    place = pin.SE3(np.eye(3), np.array([0.12, 0, 0]))
    model.inertias[4] = model.inertias[4] + place.act(payload)
    data, effort, load = model.createData(), [], []
    for row in zip(*map(np.asarray, (path_q, path_v, path_a)), strict=True):
        effort.append(pin.rnea(model, data, *row).copy())
        load.append([np.concatenate([data.f[k].linear, data.f[k].angular]) for k in range(1, 5)])
    return np.array(effort), np.array(load)


MASS = 3.0
found, (expected, loads) = torques(MASS), theirs(MASS)
error = float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))
print(f"torques differ from Pinocchio's by {error:.1e} of the largest")
assert error < 1e-12

# %% [markdown]
# The peak torque at the shoulder and its derivative by the payload, forward mode beside differences of Pinocchio.


# %%
def peak(mass):
    return jnp.max(jnp.abs(torques(mass)[:, 1]))


def peak_of_theirs(mass):
    return np.max(np.abs(theirs(mass)[0][:, 1]))


slope, h = float(jax.jacfwd(peak)(MASS)), 1e-3
difference = (peak_of_theirs(MASS + h) - peak_of_theirs(MASS - h)) / (2 * h)
print(f"peak torque {float(peak(MASS)):.2f} N m, {slope:.6f} N m per kg (differences {difference:.6f})")
np.testing.assert_allclose(slope, difference, rtol=1e-8)

# %% [markdown]
# ## What the bearings carry
# The joints are driven along the path; the mechanism has no freedom left, and `reactions` gives force and moment of
# every joint. Pinocchio's are in the axes of the child link about the joint, as here with `frame="joint"`.

# %%
builder = mbs.io.read_urdf(path).builder
builder.body("payload", mass=MASS, com=(0, 0, 0.05), inertia=MASS * np.array([2e-3, 2e-3, 1e-3]))
builder.joint("grip", mbs.Weld(), "hand", "payload", parent_frame="tool")
for k, name in enumerate(NAMES):
    mean = float(q(0.0)[k])
    builder.drive(name, mbs.forces.Harmonic(mean=mean, amplitude=AMPLITUDE[k], omega=OMEGA[k]))
driven = builder.build()
start = mbs.State.at(driven, dict(zip(NAMES, q(0.0), strict=True)))
motion = mbs.simulate(driven, start, ts=ts)
reactions = mbs.reactions(driven, motion, frame="joint")
force = np.stack([reactions[name].force for name in NAMES], axis=1)
moment = np.stack([reactions[name].moment for name in NAMES], axis=1)
error = np.max(np.abs(np.concatenate([force, moment], -1) - loads), axis=(0, 1))
print("largest differences from Pinocchio [N, N m]:", np.array2string(error, precision=1))
assert np.max(error) < 1e-6 * np.max(np.abs(loads))

# %%
figure, axes = plt.subplots(1, 2, figsize=(10, 3.5), constrained_layout=True)
for k, name in enumerate(NAMES):
    axes[0].plot(ts, np.linalg.norm(force[:, k], axis=1), label=name)
    along = np.array(JOINTS[name][3])
    bending = moment[:, k] - (moment[:, k] @ along)[:, None] * along
    axes[1].plot(ts, np.linalg.norm(bending, axis=1), label=name)
axes[0].set(xlabel="t [s]", ylabel="bearing force [N]")
axes[1].set(xlabel="t [s]", ylabel="tilting moment [N m]")
axes[1].legend()
plt.show()

# %% [markdown]
# The grip is a joint as well: what the flange's bolts carry comes out by its name.

# %%
grip = np.linalg.norm(np.asarray(reactions["grip"].force), axis=1)
print(f"the flange carries between {grip.min():.1f} and {grip.max():.1f} N, {MASS * 9.81:.1f} N at rest")
