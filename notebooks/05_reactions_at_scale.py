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
# # Reactions at scale
#
# Which loads does each joint carry, which of them does statics determine at all, and which dimension moves the peak?
# First a scissor lift, loop upon loop, over a motion. Then a boom of a thousand bodies, solved in milliseconds, with
# the derivative by the place of every joint. Last, hundreds of elastic components in blocks.

# %%
import os
import time

import equinox as eqx
import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs import fem, statics
from jaxmbs.coupling import Components, connect, coupled_response, rigid_bond
from jaxmbs.elements import Beam

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %% [markdown]
# ## A scissor lift
# Every stage is two bars that cross at a pin; their ends are pinned to the next stage. The first bar's foot is fixed,
# the other one's rides on a slide that is pulled in. The design is where the holes of the pins sit in the bars.

# %%
STAGES, LENGTH = (1 if FAST else 2), 1.0
PIN = mbs.Revolute(axis="z")
START = LENGTH * np.cos(0.3)  # place of the slide


def lift(offsets, like=None):
    """`offsets`: by pin, how far its hole in the bar is off its place, along the bar and across it [m]."""
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    rod = dict(mass=4.0, com=(LENGTH / 2, 0, 0), inertia=mbs.inertia.rod(4.0, LENGTH))
    at = lambda pin, x: jnp.append(jnp.array([x, 0.0]) + offsets[pin], 0.0)
    b.body("slide", mass=2.0, inertia=0.01)
    b.joint("pull", mbs.Prismatic(axis="x"), "ground", "slide", drive=mbs.Ramp(START, -0.25))
    for k in range(STAGES):
        b.body(f"a{k}", **rod)
        b.body(f"b{k}", **rod)
        if k == 0:
            b.joint("foot", PIN, "ground", "a0")
            b.joint("heel", PIN, "slide", "b0")
        else:
            b.joint(f"left{k}", PIN, f"b{k - 1}", f"a{k}", parent_frame=at(f"left{k}", LENGTH))
        b.joint(
            f"middle{k}",
            PIN,
            f"a{k}",
            f"b{k}",
            parent_frame=at(f"middle{k}", LENGTH / 2),
            child_frame=(LENGTH / 2, 0, 0),
        )
        if k > 0:
            b.joint(f"right{k}", PIN, f"a{k - 1}", f"b{k}", parent_frame=at(f"right{k}", LENGTH))
    b.force("load", mbs.Force((0, -2000.0, 0)), on=(f"a{STAGES - 1}", (LENGTH, 0, 0)))
    return b.build(like=like)


pins = [f"middle{k}" for k in range(STAGES)] + [f"{side}{k}" for k in range(1, STAGES) for side in ("left", "right")]
straight = {pin: jnp.zeros(2) for pin in pins}
system = lift(straight)
print(system.describe())

# %% [markdown]
# ## What is determined
# In space a planar loop is held more often than needed. Forces in the plane are determined; what the pins do to each
# other out of the plane is not, and `unique_...` says so. It is shared by the compliance of the joints.

# %%
open_angle = np.pi - 2 * 0.3
guess = (
    {"pull": START, "foot": 0.3, "heel": np.pi - 0.3}
    | {f"middle{k}": open_angle for k in range(STAGES)}
    | {f"left{k}": -open_angle for k in range(1, STAGES)}
)
guess |= {f"right{k}": open_angle for k in range(1, STAGES)}
guess = {name: angle for name, angle in guess.items() if name not in system.topology.cut_joints}
state = mbs.State.at(system, guess=guess)
loads = mbs.reactions(system, state)
for name, load in loads.items():
    determined = [*load.unique_force, *load.unique_moment]
    print(f"{name:8s} force {np.round(np.asarray(load.force), 1)} N, determined {np.array(determined, int)}")
print("rest of equilibrium [N]:", float(loads.residual))

# %% [markdown]
# ## Over a motion
# The lift rises; its motion is prescribed, so it is evaluated and not integrated.

# %%
times = jnp.linspace(0.0, 1.6, 5 if FAST else 60)
motion = mbs.simulate(system, state, ts=times)
along = mbs.reactions(system, motion)
fig, ax = plt.subplots(figsize=(7, 3.5), layout="constrained")
for name in ["foot", "heel", *pins]:
    ax.plot(times, jnp.linalg.norm(along[name].force, axis=1) / 1e3, label=name)
ax.set_xlabel("time [s]")
ax.set_ylabel("force in the pin [kN]")
ax.legend(frameon=False, ncols=2)
print(f"pull of the slide at the start: {float(along['pull'].effort[0, 0]):.0f} N")

# %% [markdown]
# ## Which hole moves the peak
# The peak of all pins' forces over the motion, and its gradient by both coordinates of every hole.


# %%
def peak(offsets):
    lifted = lift(offsets, like=system)
    loads = mbs.reactions(lifted, mbs.simulate(lifted, mbs.State.at(lifted, guess=guess), ts=times[::10]))
    return jnp.max(jnp.stack([jnp.linalg.norm(loads[name].force, axis=1) for name in pins]))


value, slope = mbs.jit(jax.value_and_grad(peak))(straight)
print(f"peak {value / 1e3:.2f} kN")
for pin, by in slope.items():
    print(f"{pin:8s} {float(by[0]) / 1e3:+8.1f} N per mm along its bar, {float(by[1]) / 1e3:+8.1f} N per mm across")

# %% [markdown]
# ## A thousand bodies
# A boom of two rails, a thousand rigid pieces welded end to end, with hinged rungs between them: hundreds of loops.
# No builder is needed: names, pairs, places and the components that each bond carries.

# %%
PIECES = 20 if FAST else 500
rails = [("ground" if i == 0 else f"{rail}{i - 1}", f"{rail}{i}") for rail in "ul" for i in range(PIECES)]
rungs = [(f"u{i}", f"l{i}") for i in range(1, PIECES)]
bodies = [f"{rail}{i}" for rail in "ul" for i in range(PIECES)]
height = lambda i: 1.0 - 0.8 * np.asarray(i) / PIECES
places = [(i * 0.1, side * height(i) / 2, 0.0) for side in (1, -1) for i in range(PIECES)]
places += [(i * 0.1 + 0.05, 0.0, 0.0) for i in range(1, PIECES)]
carries = np.ones((len(places), 6), bool)
carries[2 * PIECES :, 5] = False  # the rungs' hinges turn about z
bonds = statics.Bonds.from_arrays(
    bodies, {f"{a}-{b}": (a, b) for a, b in rails + rungs}, np.array(places), carries=carries, length=1.0
)
weight = np.tile([0.0, -1.0, 0.0], (2 * PIECES, 1))  # 1 N per piece, 100 N at the tip
weight[PIECES - 1, 1] -= 100.0
middle = np.array([((i + 0.5) * 0.1, side * height(i) / 2, 0.0) for side in (1, -1) for i in range(PIECES)])
needed = -np.concatenate([weight, np.cross(middle, weight)], axis=1)


def placed(position):
    return eqx.tree_at(lambda b: b.position, bonds, position)


solve = mbs.jit(lambda position: statics.bond_reactions(placed(position), needed))
found = jax.block_until_ready(solve(bonds.position))
start = time.perf_counter()
found = jax.block_until_ready(solve(bonds.position))
print(f"{len(bodies)} bodies, {bonds.network.num_loops} loops: {1e3 * (time.perf_counter() - start):.1f} ms")
print(f"equilibrium holds to {float(found.relative_residual):.1e} of the largest reaction")

# %% [markdown]
# The derivative of the root mean square moment in the rails by the place of every joint costs about as much again.


# %%
@mbs.jit
def bending(position):
    moments = statics.bond_reactions(placed(position), needed).components[: 2 * PIECES, 5]
    return jnp.sqrt(jnp.mean(moments**2))


by_place = mbs.jit(jax.grad(bending))(bonds.position)
fig, axes = plt.subplots(2, 1, figsize=(7, 5), layout="constrained", sharex=True)
x = np.asarray(bonds.position)[:, 0]
for rail, label in ((slice(0, PIECES), "upper rail"), (slice(PIECES, 2 * PIECES), "lower rail")):
    axes[0].plot(x[rail], found.components[rail, 0] / 1e3, label=label)
axes[0].set_ylabel("force along the rail [kN]")
axes[0].legend(frameon=False)
axes[1].plot(x[: 2 * PIECES], by_place[: 2 * PIECES, 1], ".", ms=3, label="rails")
axes[1].plot(x[2 * PIECES :], by_place[2 * PIECES :, 1], ".", ms=3, label="rungs")
axes[1].set_xlabel("along the boom [m]")
axes[1].set_ylabel("d(rms moment)/d(height) [N]")
axes[1].set_yscale("symlog", linthresh=1e-2)
axes[1].legend(frameon=False)

# %% [markdown]
# ## What the boom leaves open
# A frame of so many loops is redundant many times over. The count is made once, on the host, for a shorter boom here.

# %%
few = statics.Bonds.from_arrays(
    ["u0", "u1", "l0", "l1"],
    {"u0": ("ground", "u0"), "u1": ("u0", "u1"), "l0": ("ground", "l0"), "l1": ("l0", "l1"), "rung": ("u1", "l1")},
    [[0, 0.5, 0], [0.1, 0.5, 0], [0, -0.5, 0], [0.1, -0.5, 0], [0.15, 0, 0]],
    carries=[[True] * 6] * 4 + [[True] * 5 + [False]],
    length=1.0,
)
count = statics.redundancy(few)
print(f"{count.redundant} reactions are open (rank {count.rank} of {6 * few.network.num_loops})")
for name, components in count.components.items():
    print(f"{name:5s}", ", ".join(components))

# %% [markdown]
# ## Hundreds of elastic components
# A network of components is large in another way. `connect` stores one of many bonds in blocks, so that a row of bars
# that stretch, bend and turn at every bolt is solved as fast as it is long.

# %%
BARS = 30 if FAST else 300
TUBE = Beam(210e9, 80e9, 0.05, 5e-3, 5e-3, 1e-2, 7850.0)
beam = fem.assemble(
    fem.Structure({"a": (0.0, 0, 0), "m": (0.5, 0, 0), "b": (1.0, 0, 0)}, {"tube": (TUBE, [("a", "m"), ("m", "b")])}),
    interface=["a", "b"],
)


def row(factors):
    bars = {f"bar{k}": beam.replace(stiffness=f * beam.stiffness) for k, f in enumerate(factors)}
    bonds = {"wall": rigid_bond("bar0.a")}
    bonds |= {f"bolts{k}": rigid_bond(f"bar{k - 1}.b", f"bar{k}.a") for k in range(1, len(factors))}
    return connect(bars, bonds, places=False)


net = row(np.ones(BARS))
print(repr(net).splitlines()[0])
push = {f"bar{BARS - 1}.b z": 1000.0}


def rest_and_loads():
    rest = mbs.equilibrium(net, push)
    return rest, mbs.reactions(net, rest)


jax.block_until_ready(rest_and_loads())
start = time.perf_counter()
rest, loads = jax.block_until_ready(rest_and_loads())
print(f"rest and all loads: {1e3 * (time.perf_counter() - start):.0f} ms")
print(f"moment at the wall {float(loads['wall'].moment[1]) / 1e3:.1f} kN m, by statics {BARS:.1f} kN m")

# %% [markdown]
# Where components come as one array and their joints by number, `coupled_response` needs no names. The answer has the
# forces at both ends of every bar; its derivative by all stiffnesses is one more solution.

# %%
order = np.array([*beam.interface, *beam.interior])
matrix = jnp.asarray(beam.stiffness)[np.ix_(order, order)]
nodes = tuple((k - 1, k) for k in range(BARS))  # -1 is the ground
tip = jnp.zeros((BARS, 6)).at[-1, 2].set(1000.0)


@mbs.jit
def sag(factors):
    group = Components(nodes, factors[:, None, None] * matrix[None], jnp.zeros((BARS, len(matrix))))
    return coupled_response([group], tip).interface[-1, 2]


value, slope = mbs.jit(jax.value_and_grad(sag))(jnp.ones(BARS))
there = float(rest.displacement @ net.outputs(f"bar{BARS - 1}.b z")[0][0])
print(f"sag {float(value):.4f} m, of the network {there:.4f} m")
print(f"ten per cent more stiffness in the first bar: {0.1 * float(slope[0] / value):+.2%} of it")
