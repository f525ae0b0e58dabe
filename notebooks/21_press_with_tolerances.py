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
# # Tolerances of a press, and what each of them costs
#
# A toggle press closes to a depth that its links and its bearing decide. Which tolerances keep all presses but one in
# a thousand within a tenth of a millimetre, at least cost, and what does each of them cost?

# %%
import os

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

import jaxmbs as mbs
from jaxmbs.probability import Normal

jax.config.update("jax_enable_x64", True)
FAST = bool(os.environ.get("JAXMBS_FAST"))

# %% [markdown]
# ## The press
# A motor turns the upper link, which straightens against the lower one. At the end of the stroke the links are nearly
# in line: depth then depends on the lengths one to one, and little on the angle. `clearance` is that of all pins.

# %%
NOMINAL = {"upper": 0.30, "lower": 0.40, "bearing": 0.0, "clearance": 0.02e-3}  # [m]
END = 0.08  # angle of the upper link at the end of the stroke [rad]


def press(numbers, like=None):
    """The press; x points down, the bearing of the upper link is `bearing` below its place."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    for name in ("upper", "lower"):
        length = numbers[name]
        b.body(name, mass=8.0, com=(length / 2, 0, 0), inertia=mbs.inertia.rod(8.0, length))
    b.body("ram", mass=40.0, inertia=1.0)
    b.joint("A", mbs.Revolute("z"), "ground", "upper", parent_frame=(numbers["bearing"], 0, 0))
    b.joint("B", mbs.Cylindrical("z"), "upper", "lower", parent_frame=(numbers["upper"], 0, 0))
    b.joint("C", mbs.joints.Spherical(), "lower", "ram", parent_frame=(numbers["lower"], 0, 0))
    b.joint("guide", mbs.Prismatic("x"), "ground", "ram")
    return b.build(cut=["C"], guess={"A": 0.6, "B": (0.0, -1.0), "guide": 0.6}, like=like)


FIRST = press(NOMINAL)


def depth(numbers):
    """Depth [mm] of the ram at the end of its stroke."""
    system = press(numbers, like=FIRST)
    state = mbs.State.at(system, A=END)
    return 1e3 * (system.coordinates(state)["guide"] - numbers["clearance"])


WANTED = float(depth(NOMINAL))
print(f"depth {WANTED:.4f} mm")

# %% [markdown]
# ## Equal tolerances
# A tolerance is three standard deviations. With 0.05 mm on all lengths:

# %%
SHARE = 5e-4  # of presses on each side
BOUND = 0.1  # [mm]
PARTS = ("upper", "lower", "bearing")
PRICE = {"upper": 2.0, "lower": 2.0, "bearing": 5.0}  # cost of a tolerance of 0.1 mm; half of it costs twice as much


def spread(tolerance):
    """Distributions of the numbers, of tolerances [mm]."""
    lengths = {name: Normal(NOMINAL[name], 1e-3 * tolerance[name] / 3) for name in PARTS}
    return lengths | {"clearance": Normal(NOMINAL["clearance"], 3e-6)}


def cost(tolerance):
    return sum(PRICE[name] * 0.1 / tolerance[name] for name in PARTS)


equal = dict.fromkeys(PARTS, 0.05)
deep = mbs.design.reliability(lambda x: BOUND - (depth(x) - WANTED), spread(equal))
print(deep)

# %% [markdown]
# ## The cheapest tolerances
# The two bounds are limits with a probability; tolerances are the variables of the design.

# %%
over = lambda tolerance, x: depth(x) - WANTED
LIMITS = [
    mbs.Limit("too deep", over, upper=BOUND, probability=SHARE, variables=spread, unit="mm"),
    mbs.Limit("too shallow", over, lower=-BOUND, probability=SHARE, variables=spread, unit="mm"),
]
best = mbs.minimise(cost, equal, dict.fromkeys(PARTS, (0.01, 0.5)), limits=LIMITS, progress=False)
print(best.table())
assert best.ok

# %% [markdown]
# ## Is it true?
# The search is of the first order. A polynomial of the depth, whose error is stated, is sampled about the design
# points; and so is the press itself.

# %%
for limit in LIMITS:
    surrogate = limit.reliability(best.design, "pce")
    drawn = limit.reliability(best.design, "importance", samples=500 if FAST else 10_000)
    print(f"{limit.name}: {surrogate.probability:.3g} by a polynomial, {surrogate.surrogate_error:.1g} off,")
    print(f"{drawn.probability:.3g} by the press, in {drawn.confidence[0]:.3g} to {drawn.confidence[1]:.3g}")
    assert abs(surrogate.probability / SHARE - 1) < 0.1

# %% [markdown]
# ## What a tolerance costs
# At the optimum a tolerance costs what it is worth: its slope of the cost is the price of the bound times its slope
# of the percentile. The price of the bound says what a tenth more of it would save.

# %%
slopes = jax.grad(cost)({name: jnp.asarray(x) for name, x in best.design.items()})
for name in PARTS:
    print(f"{name}: 0.01 mm more saves {-0.01 * float(slopes[name]):.3f}")
found = LIMITS[0].reliability(best.design, "form")
saved = -0.01 * (best.limit("too deep").price - best.limit("too shallow").price)
print(f"a bound of {BOUND + 0.01:.2f} mm saves {saved:.3f} of {best.value:.3f}")
wider = [
    mbs.Limit(one.name, over, lower=one.lower and -BOUND - 0.01, upper=one.upper and BOUND + 0.01, probability=SHARE,
              variables=spread) for one in LIMITS
]  # fmt: skip
again = mbs.minimise(cost, best.design, dict.fromkeys(PARTS, (0.01, 0.5)), limits=wider, progress=False)
np.testing.assert_allclose(best.value - again.value, saved, rtol=0.15)

# %%
levels = np.array([1e-4, 1e-3, 1e-2] if FAST else [1e-5, 1e-4, 1e-3, 1e-2])
front = []
for level in levels:
    limits = [mbs.Limit(one.name, over, one.lower, one.upper, probability=level, variables=spread) for one in LIMITS]
    front.append(mbs.minimise(cost, best.design, dict.fromkeys(PARTS, (0.005, 1.0)), limits=limits, progress=False))
figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.0), layout="constrained")
mbs.viz.plot_importances(found, ax=left)
right.semilogx(2 * levels, [one.value for one in front], "o-")
right.set_xlabel("presses out of bounds [1]")
right.set_ylabel("cost of the tolerances [1]")
right.grid(alpha=0.3)
plt.show()
