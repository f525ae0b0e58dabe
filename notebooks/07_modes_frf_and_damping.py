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
# # Modes, transfer functions and damping of a structure
#
# A mast of steel tubes: from elements to modes, from modes to transfer functions, and from their level to the tube
# that would lower it.

# %%
import os

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs import elements, fem, linear, vibration
from jaxmbs.vibration import complex_modes, effective_masses, mac, natural_modes, rayleigh_from_ratios
from jaxmbs.vibration import rayleigh_damping as rayleigh

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %% [markdown]
# ## A mast of tubes
# Four legs in storeys, rings between them, one diagonal in every face. Nodes have names; the tubes' radii are the
# design.

# %%
STOREYS, WIDTH, HEIGHT = (2 if FAST else 4), 0.8, 1.0
corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * WIDTH
nodes = {f"{k}{c}": (*corners[c], HEIGHT * k) for k in range(STOREYS + 1) for c in range(4)}
legs = [(f"{k}{c}", f"{k + 1}{c}") for k in range(STOREYS) for c in range(4)]
rings = [(f"{k}{c}", f"{k}{(c + 1) % 4}") for k in range(1, STOREYS + 1) for c in range(4)]
braces = [(f"{k}{c}", f"{k + 1}{(c + 1) % 4}") for k in range(STOREYS) for c in range(4)]


def tube(radius, wall=0.003):
    area, second = 2 * np.pi * radius * wall, np.pi * radius**3 * wall
    return elements.Beam(210e9, 81e9, area, second, second, 2 * second, density=7850.0)


def mast(radii):
    """One radius [m] for the legs, the rings and the braces of every storey: (3, storeys)."""
    groups = {}
    for kind, (name, pairs) in enumerate((("legs", legs), ("rings", rings), ("braces", braces))):
        groups[name] = ([tube(radii[kind, k // 4]) for k in range(len(pairs))], pairs)
    groups["antenna"] = (elements.PointMass(15.0), [(f"{STOREYS}0",)])
    return fem.Structure(nodes, groups, held={f"0{c}": "all" for c in range(4)})


radii = jnp.full((3, STOREYS), 0.02)
K, M = fem.assemble_dense(mast(radii))
labels = mast(radii).labels
print(f"{len(labels)} coordinates")

# %% [markdown]
# ## Modes
# The effective masses say how much of the mast each mode moves as a whole.

# %%
modes = natural_modes(K=K, M=M, num=10)
motions = linear.rigid_motions(mast(radii).positions)
directions = jnp.stack([fem.gather_rows(mast(radii), motions[:, :, d]) for d in range(3)], axis=1)
shares = effective_masses(modes, M, directions)
print("   Hz     effective mass x, y, z [kg]")
for f, row in zip(modes.frequencies, shares, strict=True):
    print(f"{f:7.2f}   {row[0]:8.2f} {row[1]:8.2f} {row[2]:8.2f}")

# %% [markdown]
# ## Damping
# Rayleigh damping of 1 % at 10 Hz and at 100 Hz. Complex modes give the ratio of every mode, exactly.

# %%
by_mass, by_stiffness = rayleigh_from_ratios((2 * np.pi * 10.0, 0.01), (2 * np.pi * 100.0, 0.01))
C = rayleigh(K=K, M=M, by_mass=by_mass, by_stiffness=by_stiffness)
damped = complex_modes(K=K, C=C, M=M)
frequencies, ratios = damped.omega / (2 * np.pi), damped.damping_ratios
for k in np.argsort(np.asarray(frequencies))[:12:2]:  # pairs
    print(f"{frequencies[k]:7.2f} Hz  damping {100 * ratios[k]:.2f} %")

# %% [markdown]
# ## A transfer function
# A shaker pushes at the first storey; the antenna's acceleration is asked. Four modes, with and without the static
# residual of the others, against all modes.

# %%
where = {label: row for row, label in enumerate(labels)}
into, out = where["10", "x"], where[f"{STOREYS}0", "x"]
hertz = np.linspace(2.0, 120.0, 60 if FAST else 600)
omega = jnp.asarray(2 * np.pi * hertz)
exact = vibration.receptance(K=K, M=M, omega=omega, out=(out,), into=(into,), C=C)[:, 0, 0]
four = vibration.receptance(K=K, M=M, omega=omega, out=(out,), into=(into,), C=C, num=4)[:, 0, 0]
bare = vibration.receptance(K=K, M=M, omega=omega, out=(out,), into=(into,), C=C, num=4, residual=False)[:, 0, 0]
fig, ax = plt.subplots(figsize=(7, 3.5), layout="constrained")
for values, style, label in (
    (exact, "k", "all modes"),
    (four, "--", "four modes and residual"),
    (bare, ":", "four modes"),
):
    ax.semilogy(hertz, jnp.abs(values) * omega**2, style, label=label)
ax.set_xlabel("frequency [Hz]")
ax.set_ylabel("acceleration per force [1/kg]")
ax.legend(frameon=False)

# %% [markdown]
# ## Which tube quietens the antenna
# The root mean square acceleration per force over the band, and its gradient by every radius, in one reverse sweep.


# %%
def level(radii):
    K, M = fem.assemble_dense(mast(radii))
    C = rayleigh(K=K, M=M, by_mass=by_mass, by_stiffness=by_stiffness)
    found = vibration.receptance(K=K, M=M, omega=omega, out=(out,), into=(into,), C=C)[:, 0, 0]
    return jnp.sqrt(jnp.mean((jnp.abs(found) * omega**2) ** 2))


value, slope = mbs.jit(jax.value_and_grad(level))(radii)
print(f"level {value:.4f} 1/kg; change in per cent for one millimetre of radius:")
for name, row in zip(("legs", "rings", "braces"), slope, strict=True):
    print(f"{name:7s}", "  ".join(f"storey {k}: {float(100 * v / value / 1e3):+6.2f} %" for k, v in enumerate(row)))

# %% [markdown]
# ## The same modes?
# After a change of the legs: the modal assurance criterion of the first modes before and after.

# %%
K, M = fem.assemble_dense(mast(radii.at[0].mul(1.3)))
changed = natural_modes(K=K, M=M, num=10)
likeness = mac(modes.shapes, changed.shapes)
fig, ax = plt.subplots(figsize=(4, 3.5), layout="constrained")
picture = ax.imshow(likeness, vmin=0, vmax=1, cmap="Greys")
ax.set_xlabel("mode, stiffer legs")
ax.set_ylabel("mode, as it was")
fig.colorbar(picture, ax=ax, label="MAC")
