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
# # Designs in batches
#
# Which design carries the least load? Eight designs at a time are simulated, their joint loads found, and all of it
# differentiated by every number of the design, so that an optimiser of optax improves all eight together. First a
# linkage of rigid links, then an arm whose pieces are finite elements and whose bond forces come from the motion.

# %%
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import optax

import jaxmbs as mbs
from jaxmbs.coupling import connect, rigid_bond
from jaxmbs.elements import Beam
from jaxmbs.fem import Structure, assemble
from jaxmbs.flexible import carried_loads, mass_properties

jax.config.update("jax_enable_x64", True)

# %% [markdown]
# ## A linkage
# A four-bar that swings against a spring. The design is the length of its crank, the mass of its coupler and the
# stiffness of the spring; the load is the root mean square force in all pins. The reactions come from the graph of
# bodies, at a cost linear in their number.

# %%
PIN = mbs.Revolute(axis="z")


def linkage(design, like=None):
    length, mass, stiffness = design
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    b.body("crank", mass=1.0, com=(length / 2, 0, 0), inertia=(0.01, 0.1, 0.1))
    b.body("coupler", mass=mass, com=(0.45, 0, 0), inertia=(0.01, 0.1, 0.1))
    b.body("rocker", mass=1.5, com=(0.35, 0, 0), inertia=(0.01, 0.1, 0.1))
    b.joint("A", PIN, "ground", "crank")
    b.joint("B", PIN, "crank", "coupler", parent_frame=(length, 0, 0))
    b.joint("D", PIN, "ground", "rocker", parent_frame=(1.0, 0, 0))
    b.joint("C", PIN, "coupler", "rocker", parent_frame=(0.9, 0, 0), child_frame=(0.7, 0, 0))
    b.force("spring", mbs.SpringDamper(stiffness=stiffness, damping=0.1), joint="D")
    return b.build(like=like)


first = linkage((0.3, 2.0, 3.0))


def pin_load(design):
    system = linkage(design, like=first)
    start = mbs.State.at(system, A=0.7, velocities={"A": 2.0}, guess={"B": -0.4, "D": 1.4})
    motion = mbs.simulate(system, start, ts=jnp.linspace(0.05, 0.5, 10), rtol=1e-6, atol=1e-6)
    loads = mbs.reactions(system, motion, method="block-sparse")
    force = jnp.stack([load.force for _, load in loads.items()])
    return jnp.sqrt(jnp.mean(jnp.sum(force**2, axis=-1)))


def improve(objective, designs, low, high, rate, steps=20):
    """Values (steps, designs) and the last designs: Adam inside of bounds, all designs at once."""
    rule = optax.adam(rate)

    @mbs.jit
    def step(designs, memory):
        values, slopes = jax.vmap(jax.value_and_grad(objective))(designs)
        change, memory = jax.vmap(rule.update)(slopes, memory)
        return jnp.clip(designs + change, low, high), memory, values

    memory, history = jax.vmap(rule.init)(designs), []
    for _ in range(steps):
        designs, memory, values = step(designs, memory)
        history.append(np.asarray(values))
    return np.array(history), designs


spread = 1.0 + 0.1 * np.random.default_rng(0).uniform(-1.0, 1.0, (8, 3))
linkages = jnp.array([0.3, 2.0, 3.0]) * spread
low, high = jnp.array([0.2, 1.0, 0.5]), jnp.array([0.4, 4.0, 10.0])
pin_loads, better_linkages = improve(pin_load, linkages, low, high, rate=0.02)
for k in (0, -1):
    print("rms force in the pins [N]:", np.round(pin_loads[k], 2))

# %% [markdown]
# ## An arm of finite elements
# Six tubes, three beam elements each, welded end to end: one body each in the mechanism, with the mass of its own
# elements. A motor swings the arm with a payload at its tip. `carried_loads` puts weight, inertia and the payload's
# reaction on the nodes; `connect` joins the tubes by named bonds, whose forces are asked. The design is the radius of
# every tube.

# %%
PIECES, END = 6, "3"
STEP = 1.0 / PIECES
NODES = jnp.stack([jnp.linspace(0.0, STEP, 4), jnp.zeros(4), jnp.zeros(4)], axis=1)
names = [f"tube{k}" for k in range(PIECES)]
BONDS = {"hub": rigid_bond("tube0.0")}  # held at the hub
BONDS |= {f"weld{k}": rigid_bond(f"tube{k}.0", f"tube{k - 1}.{END}") for k in range(1, PIECES)}


@jax.vmap
def tube(radius):
    area, inertia = jnp.pi * radius**2, jnp.pi * radius**4 / 4.0
    beam = Beam(7e10, 2.7e10, area, inertia, inertia, 2.0 * inertia, 2700.0, reference=(0, 1, 0))
    return assemble(Structure(NODES, {"beam": (beam, [(0, 1), (1, 2), (2, 3)])}))


def arm(tubes):
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    for k, (name, component) in enumerate(zip(names, tubes, strict=True)):
        mass, centre, inertia = mass_properties(component)
        b.body(name, mass=mass, com=centre, inertia=inertia)
        if k:
            b.joint(f"weld{k}", mbs.Weld(), names[k - 1], name, parent_frame=(STEP, 0, 0))
    b.body("payload", mass=2.0)
    b.joint("hub", mbs.Revolute("y"), "ground", names[0])
    b.joint("grip", mbs.Weld(), names[-1], "payload", parent_frame=(STEP, 0, 0))
    b.force("motor", mbs.Actuator(lambda x, v, t: -60.0 * jnp.sin(6.0 * t)), joint="hub")
    return b.build()


def bond_forces(radii):
    """What the bonds carry along the motion, the tip's deflection, and the mechanism with its motion."""
    tubes = tube(radii)  # one LinearSystem, its matrices with an axis of pieces
    tubes = [jax.tree.map(lambda x: x[k], tubes) for k in range(PIECES)]  # noqa: B023
    system = arm(tubes)
    motion = mbs.simulate(system, mbs.State.at(system), ts=jnp.linspace(0.05, 0.5, 10), rtol=1e-6, atol=1e-6)
    components = dict(zip(names, tubes, strict=True))
    loads = carried_loads(system, motion, components, {"grip": (names[-1], END)})
    placed = [t.with_interface("0", END).translate((k * STEP, 0, 0)) for k, t in enumerate(tubes)]
    net = connect(dict(zip(names, placed, strict=True)), BONDS)
    rest = mbs.equilibrium(net, loads)
    (row,), _ = net.outputs(f"{names[-1]}.{END} z")
    return mbs.reactions(net, rest), rest.displacement @ row, system, motion


def arm_load(radii):
    """Root mean square moment at the hub [N m], and of the tip's deflection in millimetres."""
    carried, tip, *_ = bond_forces(radii)
    return jnp.sqrt(jnp.mean(carried["hub"].moment[:, 1] ** 2)) + 1e3 * jnp.sqrt(jnp.mean(tip**2))


spread = 1.0 + 0.1 * np.random.default_rng(1).uniform(-1.0, 1.0, (8, PIECES))
arm_loads, better_arms = improve(arm_load, 0.02 * jnp.asarray(spread), 0.01, 0.04, rate=1e-3)
for k in (0, -1):
    print("moment at the hub and deflection:", np.round(arm_loads[k], 2))

# %% [markdown]
# The bond at the hub carries what multibody dynamics finds there, all three forces and all three moments.

# %%
carried, _, system, motion = mbs.jit(bond_forces)(better_arms[0])
hub = mbs.reactions(system, motion, frame="joint")["hub"]
both = np.concatenate([hub.force, hub.moment], axis=1)
difference = np.abs(np.asarray(carried["hub"].on_first) - both).max()
print(f"bond and joint differ by {difference:.1e} of {np.abs(both).max():.0f}")

# %%
fig, axes = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")
for ax, values, label in zip(axes, (pin_loads, arm_loads), ("linkage: force in the pins [N]", "arm"), strict=True):
    ax.plot(values, lw=1)
    ax.set_xlabel("step")
    ax.set_title(label)
