"""Reactions of a spatial row of redundant loops, shared by the network of bonds, against the dense solution."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs

#: More loops than the network's dense method takes, and few enough for the dense saddle system.
LOOPS = 22
NAMES = ("A2", "A3", "A4", "left_3", "right_3", "right_5")
#: Compliances by name in the order of `NAMES`.  A bond without any is rigid, alone in its chain of the loop or not.
COMPLIANCES = {
    "default": np.ones((6, 1)),
    "elastic": np.random.default_rng(0).uniform(0.2, 3.0, (6, 6)),
    "rigid links": np.array([1.0, 1.0, 1.0, 0.0, 0.0, 1.0])[:, None],
    "rigid bearings": np.array([1.0, 0.0, 0.0, 1.0, 1.0, 0.0])[:, None],
    "rigid in some axes": np.array([[1, 1, 1, 1, 1, 1], [0, 0, 0, 1, 1, 1], [1, 1, 1, 0, 0, 0]] * 2, float),
}


def row(mass=1.0):
    """A row of four-bars with cranks of uneven masses beside their plane; one pin is doubled and one crank driven."""
    random, b = np.random.default_rng(3), mbs.SystemBuilder(gravity=(1.0, -9.0, 3.0))
    pin, off = mbs.Revolute(axis="z"), lambda: 0.3 * random.random()
    for i in range(LOOPS + 1):
        b.body(
            f"crank_{i}", mass=mass + off(), com=(0.1, 0.5, off()), inertia=(0.1, 0.2, 0.15), position=(i, 0.0, 0.0)
        )
        b.joint(f"A{i}", pin, "ground", f"crank_{i}", at=(i, 0.0, off()))
    b.joint("A3 doubled", pin, "ground", "crank_3", at=(3.0, 0.0, -0.4))
    for i in range(LOOPS):
        b.body(f"coupler_{i}", mass=1.0, com=(0.5, 0.0, off()), inertia=(0.1, 0.1, 0.2), position=(i, 1.0, 0.0))
        b.joint(f"left_{i}", pin, f"crank_{i}", f"coupler_{i}", at=(i, 1.0, 0.1))
        b.joint(f"right_{i}", pin, f"coupler_{i}", f"crank_{i + 1}", at=(i + 1.0, 1.0, off()))
    b.drive("A0", lambda t: 0.5 * t * t - 0.4)
    return b.build()


@pytest.fixture(scope="module")
def posed():
    """The row and its state with all cranks at -0.4 rad."""
    system = row()
    value = {"A": -0.4, "l": 0.4}  # of cranks and couplers, which stay level
    psi = jnp.array([value[name[0]] for name, *_ in system.topology.structure])
    return system, mbs.State(jnp.zeros(()), psi, 0.0 * psi, structure=system.topology.structure)


@pytest.fixture(scope="module")
def by(posed):
    def solved(method):
        def loads(C):
            compliance = {name: C[k] for k, name in enumerate(NAMES)}
            return mbs.reactions(*posed, frame="joint", compliance=compliance, method=method)

        return loads

    return {method: jax.jit(solved(method)) for method in ("dense", "frontal")} | {"traced": solved("frontal")}


@pytest.mark.long
@pytest.mark.parametrize("case", COMPLIANCES)
def test_as_the_dense_way(posed, by, case):
    weight = np.array([1.0, 1.0, 1.0, *[posed[0].length ** -2] * 3]) if case != "elastic" else 1.0
    C = jnp.array(np.broadcast_to(COMPLIANCES[case] * weight, (6, 6)))
    dense, sparse = by["dense"](C), by["frontal"](C)
    assert dense.ok and sparse.ok
    size = float(jnp.max(jnp.abs(dense.joints.force)))
    for part in ("force", "moment", "unique_force", "unique_moment"):
        np.testing.assert_allclose(getattr(sparse.joints, part), getattr(dense.joints, part), atol=1e-9 * size)


@pytest.mark.long
def test_gradient_by_compliances_and_batches(by):
    """Reverse mode against central differences, and two sets of compliances at once."""

    def value(C):
        loads = by["traced"](C)["A3"]
        return jnp.sum(loads.force**2) + jnp.sum(loads.moment**2)

    C = jnp.array(COMPLIANCES["elastic"])
    slope, value_of = jax.jit(jax.grad(value))(C), jax.jit(value)
    for k, axis in ((1, 2), (1, 3), (2, 4), (3, 2)):
        step = jnp.zeros((6, 6)).at[k, axis].set(1e-4)
        central = (value_of(C + step) - value_of(C - step)) / 2e-4
        np.testing.assert_allclose(slope[k, axis], central, rtol=1e-5, atol=1e-7 * float(jnp.max(jnp.abs(slope))))
    together = jax.jit(jax.vmap(jax.grad(value)))(jnp.stack([C, 2.0 * C]))
    np.testing.assert_allclose(together[0], slope, atol=1e-9 * float(jnp.max(jnp.abs(slope))))
