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
# # The bond graph and where the power goes
#
# A mechanism as the paper draws it: one junction of the independent velocities, inertias behind transformers,
# springs, dampers and sources beside it. Every bond carries effort times flow; no junction keeps any.

# %%
import os

import jax
import matplotlib.pyplot as plt
import numpy as np
from IPython.display import SVG, display

import jaxmbs as mbs
from jaxmbs import viz
from jaxmbs.bondgraph import junction_residual

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %%
b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
b.body("arm", mass=1.0, com=(0.3, 0, 0), inertia=0.03)
b.body("tip", mass=0.5, com=(0.2, 0, 0), inertia=0.01)
b.joint("shoulder", mbs.Revolute(axis="z"), "ground", "arm")
b.joint("elbow", mbs.Revolute(axis="z"), "arm", "tip", parent_frame=(0.6, 0, 0))
b.force("spring", mbs.SpringDamper(stiffness=8.0, damping=0.15), joint="elbow")
b.force("motor", mbs.Actuator(lambda x, v, t: 3.0 * jax.numpy.sin(4.0 * t)), joint="shoulder")
system = b.build()

# %% [markdown]
# ## Three views of one mechanism

# %%
for view in ("detailed", "inertia", "hamiltonian"):
    graph = mbs.bondgraph.bond_graph(system, view)
    print(view, len(graph.elements), "elements; dependent inertias:", graph.dependent)
    display(SVG(viz.draw_bond_graph(graph)))

# %% [markdown]
# ## Powers along a motion

# %%
state = mbs.State.at(system, shoulder=0.4)
motion = mbs.simulate(system, state, t1=0.5 if FAST else 5.0)
powers = mbs.bondgraph.bond_powers(system, motion, "detailed")
gap = max(float(np.max(np.abs(value))) for value in junction_residual(powers).values())
print("largest power that a junction keeps [W]:", gap)
assert gap < 1e-9
viz.plot_power(motion, mbs.bondgraph.bond_powers(system, motion, "hamiltonian"), by="kind")
plt.gcf().set_size_inches(7, 5)
