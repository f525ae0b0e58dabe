"""What the tests of pictures share: a four-bar with springs in closed form, and a crane with everything on it."""

from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import elements, fem
from jaxmbs.assembly._state import State
from jaxmbs.kinematics._poses import neutral_coordinates
from tests.models import PIN, four_bar, four_bar_angles

TURN = np.linspace(0.0, 2 * np.pi, 49)


def turning_four_bar(angles=TURN):
    """The four-bar of `tests.models` and one turn of its crank at 1 rad/s."""
    system = four_bar(stiffness=20.0)
    columns = np.stack([four_bar_angles(angle) for angle in angles])
    psi = np.zeros((len(angles), 3))
    for k, name in enumerate("ABD"):
        psi[:, system.topology.joints[system.topology.joint_index[name]].first_coordinate] = columns[:, k]
    zeros = jnp.zeros(len(angles))
    states = State(jnp.asarray(angles), jnp.asarray(psi), jnp.zeros_like(jnp.asarray(psi)), zeros)
    return system, SimpleNamespace(ts=angles, states=states)


def made_up_loads(ts, names="ABCD"):
    """Forces (T, 3) that turn with the crank, in closed form."""
    turning = np.stack([np.cos(ts), np.sin(ts), 0.0 * ts], axis=1)
    waves = {name: (100.0 + 40.0 * k) * (1.0 + 0.5 * np.sin(2 * ts + k))[:, None] for k, name in enumerate(names)}
    return {name: SimpleNamespace(force=w * turning, moment=0.1 * w * turning) for name, w in waves.items()}


def everything():
    """A mechanism with a body on every kind of joint, and every kind of law that is drawn; two states of it."""
    b = mbs.SystemBuilder()
    kinds = {
        "mast": mbs.Revolute("z"),
        "ram": mbs.Prismatic("x"),
        "sleeve": mbs.Cylindrical("y"),
        "nut": mbs.Screw("z", pitch=0.05),
        "ball": mbs.Spherical(),
        "cross": mbs.Universal(),
        "puck": mbs.Planar("z"),
        "bird": mbs.Free(),
        "plate": mbs.Weld(),
    }
    for k, (name, kind) in enumerate(kinds.items()):
        b.body(name, 1.0, com=(0.0, 0.1, 0.3), inertia=(0.02, 0.03, 0.01))
        b.joint(f"{name} joint", kind, "ground", name, parent_frame=(0.5 * (k % 3), 0.5 * (k // 3), 0.0))
    b.body("barrel", 1.0, com=(0.1, 0, 0), inertia=0.01)
    b.body("rod", 0.5, com=(-0.1, 0, 0), inertia=0.01)
    b.joint("foot", PIN, "mast", "barrel", parent_frame=(0.0, 0.0, 0.4))
    b.joint("cylinder", mbs.Prismatic("x"), "barrel", "rod")
    b.force("strut", mbs.SpringDamper(100.0, 3.0), between=("ball", "cross"))
    b.force("dashpot", mbs.SpringDamper(damping=3.0), between=("nut", "puck"))
    b.force("muscle", mbs.Actuator(lambda x, v, t: 0.0 * x), between=("ram", "mast"))
    b.force("mount", mbs.Bushing((1e3, 10.0)), between=("sleeve", "plate"))
    b.constraint("link", mbs.joints.Distance(0.5), between=("puck", "ball"))
    system = b.build()
    psi = np.tile(neutral_coordinates(system.topology), (3, 1))
    top = system.topology
    psi[:, top.joints[top.joint_index["cylinder"]].first_coordinate] = (0.5, 0.6, 0.7)
    psi[:, top.joints[top.joint_index["ram joint"]].first_coordinate] = (0.0, 0.1, 0.2)
    psi[:, top.joints[top.joint_index["mast joint"]].first_coordinate] = (0.0, 0.5, 1.0)
    zeros = jnp.zeros((3, top.num_velocities))
    return system, State(jnp.arange(3.0), jnp.asarray(psi), zeros, jnp.zeros(3))


def plate(nx=6, ny=3, held=True):
    """A cantilever plate of shells with a stiffening bar at its end."""
    nodes, quads = {}, []
    for i in range(nx + 1):
        for j in range(ny + 1):
            nodes[f"{i}.{j}"] = (0.5 * i / nx, 0.2 * j / ny, 0.0)
    for i in range(nx):
        for j in range(ny):
            quads.append([f"{i}.{j}", f"{i + 1}.{j}", f"{i + 1}.{j + 1}", f"{i}.{j + 1}"])
    bars = [[f"{nx}.{j}", f"{nx}.{j + 1}"] for j in range(ny)]
    shell = elements.Quadrilateral(70e9, 0.33, 0.004, density=2700.0)
    bar = elements.Beam(210e9, 80e9, 1e-4, 8e-10, 8e-10, 1.4e-9, density=7800.0)
    clamp = {f"0.{j}": "all" for j in range(ny + 1)} if held else {}
    return fem.Structure(nodes, {"plate": (shell, quads), "bar": (bar, bars)}, held=clamp)
