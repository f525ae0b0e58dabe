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
# # From a pendulum to Hamilton's equations
#
# A mechanism of one joint shows all that the engine integrates: coordinates `q`, momenta `p = I* q_dot`, and
#
# $$\dot p = GR\,\dot q + Q, \qquad \dot q = I^{*-1} p .$$

# %%
import os

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs import viz
from jaxmbs.dynamics import generalised_momentum, gyristor_field, inertia_field, state_equations

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %% [markdown]
# ## One joint
# The inertia field is a number, and the gyristor is zero: nothing changes the inertia seen from the pin.

# %%
b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
b.body("bob", mass=2.0, com=(0, -0.8, 0), inertia=0.01)
b.joint("pin", mbs.Revolute(axis="z"), "ground", "bob")
pendulum = b.build()
state = mbs.State.at(pendulum, pin=1.0, velocities={"pin": 0.5})
print(pendulum.describe())
print("I* =", inertia_field(pendulum, state), " GR =", gyristor_field(pendulum, state))
p_dot, phi_dot, _ = state_equations(pendulum, state)
print("p_dot =", p_dot, " by hand:", -2.0 * 9.81 * 0.8 * np.sin(1.0))

# %% [markdown]
# ## Two joints
# With an elbow the inertia depends on the pose. The gyristor turns velocities into efforts; it moves energy between
# the joints, and `p_dot = GR phi_dot + Q` holds with a plus sign.

# %%
b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
b.body("upper", mass=1.0, com=(0, -0.5, 0), inertia=0.02)
b.body("lower", mass=1.0, com=(0, -0.5, 0), inertia=0.02)
b.joint("shoulder", mbs.Revolute(axis="z"), "ground", "upper")
b.joint("elbow", mbs.Revolute(axis="z"), "upper", "lower", parent_frame=(0, -1.0, 0))
double = b.build()
state = mbs.State.at(double, shoulder=1.5, elbow=0.7, velocities={"shoulder": 1.0, "elbow": -2.0})
with np.printoptions(precision=4, suppress=True):
    print("I* =\n", np.asarray(inertia_field(double, state)))
    print("GR =\n", np.asarray(gyristor_field(double, state)))

# %% [markdown]
# The rate of the momentum along a motion is what the state equations say: a check by differences.

# %%
h = 1e-5
motion = mbs.simulate(double, state, ts=[0.0, h], rtol=1e-12, atol=1e-12)
first, second = (jax.tree.map(lambda x, k=k: x[k], motion.states) for k in (0, 1))
slope = (generalised_momentum(double, second) - generalised_momentum(double, first)) / h
print("differences:", slope, " state equations:", state_equations(double, state)[0])

# %% [markdown]
# ## The motion keeps its energy

# %%
motion = mbs.simulate(double, state, t1=2.0 if FAST else 20.0)
ax = viz.plot_energy(motion)
plt.gcf().set_size_inches(7, 4)
print("largest residual [J]:", float(jnp.max(jnp.abs(motion.diagnostics.energy_residual))))
assert float(jnp.max(jnp.abs(motion.diagnostics.energy_residual))) < 1e-6
