"""A few small systems of each kind, made when they are first asked for."""

from functools import cached_property

import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import blocksparse, coupling, elements, fem, flexible, linear, reductions, statics, vibration
from tests.models import four_bar, four_bar_state

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")


class Zoo:
    """Mechanisms, structures, components and measurements that examples share."""

    # mechanisms: a spring-loaded four-bar and a state of it, its motion, an elastic arm
    @cached_property
    def bars(self):
        return four_bar(stiffness=3.0, load=-2.0)

    @cached_property
    def state(self):
        return four_bar_state(self.bars)

    @cached_property
    def hanging(self):
        b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
        b.body("bob", 1.0, (0.5, 0.0, 0.0), (0.01, 0.1, 0.1))
        b.joint("pin", mbs.Revolute("z"), "ground", "bob")
        return b.build()

    @cached_property
    def rubbing(self):
        b = mbs.SystemBuilder(gravity=(0.0, -9.81, 0.0))
        b.body("bob", 1.0, (0.5, 0.0, 0.0), (0.01, 0.1, 0.1))
        b.joint("pin", mbs.Revolute("z"), "ground", "bob")
        b.friction("rub", "pin", 0.1, radius=0.02)
        return b.build()

    @cached_property
    def touching(self):
        b = mbs.SystemBuilder()
        b.body("ball", 1.0)
        b.joint("fall", mbs.Prismatic("z"), "ground", "ball")
        b.contact("touch", mbs.contact.SphereOnPlane(0.5), "ball", "ground", mbs.contact.HuntCrossley(1e4))
        return b.build()

    @cached_property
    def touching_state(self):
        return mbs.State.at(self.touching, fall=0.49)

    @cached_property
    def near_rest(self):
        return mbs.State.at(self.hanging, pin=-1.25)

    @cached_property
    def swinging(self):
        return mbs.State.at(self.hanging, pin=-1.25, velocities={"pin": 0.5})

    @cached_property
    def motion(self):
        return mbs.simulate(self.bars, self.state, ts=np.array([0.0, 0.1, 0.2]))

    @cached_property
    def lin(self):
        return mbs.linearise(self.bars, self.state, inputs=["A"], outputs=["D"])

    @cached_property
    def second(self):
        return mbs.constraints.kic_second(self.bars, self.state)

    @cached_property
    def powers(self):
        return mbs.bondgraph.bond_powers(self.bars, self.state)

    @cached_property
    def frame(self):
        beam = linear.LinearSystem(**self.free, positions={"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0)})
        return flexible.floating_frame(beam, ["a", "b"])

    @cached_property
    def elastic(self):
        b = mbs.SystemBuilder()
        b.elastic("arm", self.frame.body, motions={"b": mbs.Prismatic("z")})
        b.joint("pin", mbs.Revolute("y"), "ground", "arm.a")
        return b.build()

    @cached_property
    def arm_beam(self):
        beam = elements.Beam(8.0, 4.0, 1.0, 1.0, 1.0, 1.0, density=2.0)
        return fem.Structure({"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0)}, {"beam": (beam, [("a", "b")])})

    @cached_property
    def arm_frame(self):
        return flexible.floating_frame(self.arm_beam, ["a", "b"])

    @cached_property
    def arm(self):
        b = mbs.SystemBuilder()
        b.elastic("arm", self.arm_frame.body, motions={"b": mbs.Prismatic("z")})
        b.joint("pin", mbs.Revolute("y"), "ground", "arm.a")
        return b.build()

    @cached_property
    def arm_state(self):
        return mbs.State.at(self.arm, {"pin": 0.2, "arm.b": 1e-3}, velocities={"pin": 1.0})

    @cached_property
    def whip(self):
        return self._whip((0.0, 0.0, -9.81))

    @cached_property
    def blade(self):
        return self._whip((0.0, 0.0, 0.0))

    def _whip(self, gravity):
        b = mbs.SystemBuilder(gravity=gravity)
        section = mbs.forces.BeamSection([8.0, 4.0, 4.0, 2.0, 1.0, 1.0], 2.0, [0.5, 0.25, 0.25])
        b.beam("whip", section, [(0, 0, 0), (1, 0, 0)], 1)
        b.joint("pin", mbs.Revolute("y"), "ground", "whip.0")
        return b.build()

    @cached_property
    def whip_state(self):
        return mbs.State.at(self.whip, pin=0.25, velocities={"pin": 1.0})

    @cached_property
    def elastic_state(self):
        return mbs.State.at(self.elastic, {"pin": 0.2, "arm.b": 1e-3}, velocities={"pin": 1.0})

    # matrices: whole numbers, well conditioned
    K = np.array([[4.0, -1.0, 0.0, 0.0], [-1.0, 3.0, -1.0, 0.0], [0.0, -1.0, 3.0, -1.0], [0.0, 0.0, -1.0, 2.0]])
    M = np.diag([2.0, 1.0, 1.0, 3.0])
    C = 0.125 * K
    omega = np.array([0.25, 2.0])
    x = np.arange(12.0).reshape(3, 4)

    @cached_property
    def modes(self):
        return vibration.natural_modes(K=self.K, M=self.M)

    @cached_property
    def complex_modes(self):
        return vibration.complex_modes(K=self.K, C=self.C, M=self.M)

    @cached_property
    def chain(self):
        labels = ("a", "b", "c", "d")
        return linear.LinearSystem(mass=self.M, stiffness=self.K, damping=self.C, coordinates=labels, interface=["a"])

    @cached_property
    def small(self):
        return reductions.reduce(self.chain, reductions.CraigBampton(2))

    @cached_property
    def rest(self):
        return mbs.equilibrium(self.network, {"one.b": 1.0})

    @cached_property
    def network(self):
        parts = {"one": self.chain, "two": self.chain}
        return coupling.connect(parts, {"bolt": coupling.rigid_bond("one.a", "two.a")})

    # elements
    nodes = {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0), "c": (2.0, 0.0, 0.0)}
    beam = elements.Beam(8.0, 4.0, 2.0, 1.0, 1.0, 2.0, density=1.0)

    @cached_property
    def structure(self):
        parts = {"beams": (self.beam, [("a", "b"), ("b", "c")])}
        return fem.Structure(self.nodes, parts, held={"a": "all"})

    @cached_property
    def free(self):
        parts = {"beam": (self.beam, [("a", "b")])}
        free = fem.Structure({name: self.nodes[name] for name in "ab"}, parts)
        K, M = fem.assemble_dense(free)
        return {"stiffness": K, "mass": M, "coordinates": [(n, d) for n in "ab" for d in DIRECTIONS]}

    @cached_property
    def free_beam(self):
        places = {name: self.nodes[name] for name in "ab"}
        return linear.LinearSystem(**self.free, positions=places, interface=["a"])

    @cached_property
    def plate(self):
        nodes = {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0), "c": (1.0, 1.0, 0.0), "d": (0.0, 1.0, 0.0)}
        shell = elements.Quadrilateral(8.0, 0.25, 0.5, density=1.0)
        return fem.Structure(nodes, {"shell": (shell, [("a", "b", "c", "d")])}, held={"a": "all"})

    # blocks
    @cached_property
    def pattern(self):
        return blocksparse.Pattern(4, 1, [(0, 1), (1, 2), (2, 3)])

    @cached_property
    def blocks(self):
        return linear.block_matrices(self.K, self.M, size=1)

    @cached_property
    def factor(self):
        return blocksparse.factor(self.blocks[0])

    @cached_property
    def long_blocks(self):
        n = 16
        K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
        return linear.block_matrices(K, np.eye(n), size=1)

    # networks of bodies
    @cached_property
    def bonds(self):
        ends = {"left": ("ground", "table"), "right": ("ground", "table")}
        return statics.Bonds.from_arrays(["table"], ends, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])

    loads = np.array([[0.0, 0.0, 4.0, 0.0, 1.0, 0.0]])

    # measurements
    values = np.array([[[2.0 + 1.0j, 0.5j], [0.5j, 1.0 - 0.5j]], [[1.0 - 1.0j, 0.25], [0.25, 2.0 - 0.5j]]])

    @cached_property
    def measured(self):
        return linear.TransferFunctions(self.omega, self.values, ["p", "q"], ["p", "q"])

    @cached_property
    def table(self):
        """Six sensors and six impacts around a point."""
        return {f"s{k}": (np.roll([1.0, 0.5, 0.0], k) * (1 + k), np.roll([0.0, 0.0, 1.0], k // 2)) for k in range(8)}

    @cached_property
    def campaign(self):
        names = list(self.table)
        random = np.random.default_rng(0)
        values = random.normal(size=(2, len(names), len(names))) + 1j * random.normal(
            size=(2, len(names), len(names))
        )
        return linear.TransferFunctions(self.omega, values, names, names)

    ts = np.array([0.0, 0.1, 0.2])

    @cached_property
    def zeros(self):
        return jnp.zeros(3)
