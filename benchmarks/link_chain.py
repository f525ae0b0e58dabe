"""The chain of ten slender links of the trajectory benchmarks, for this library and for MuJoCo."""

import numpy as np
from cases import models

import jaxmbs as mbs

LINKS, LENGTH, MASS = 10, 0.3, 0.3
INERTIA = (0.00225, 0.00225, 2.25e-5)
START = np.array([np.pi / 3, 0.4] + [0.0] * (LINKS - 2))


def our_system():
    """Links hang along -z, hinges about y, x, y, ..."""
    return models.chain_10(LINKS, LENGTH, MASS)


def our_start(system):
    """The chain bent at its first two hinges, at rest."""
    return mbs.State.at(system, {f"hinge_{i}": angle for i, angle in enumerate(START)})


def mujoco_model(integrator="Euler", dt=1e-3):
    """The same chain; no contacts, no damping, no armature."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(_xml(integrator, dt))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP | mujoco.mjtDisableBit.mjDSBL_CONTACT
    return model


def _xml(integrator, dt):
    inertial = f'<inertial pos="0 0 {-LENGTH / 2}" mass="{MASS}" diaginertia="{" ".join(map(str, INERTIA))}"/>'
    bodies, ends = "", ""
    for i in range(LINKS):
        axis = ("0 1 0", "1 0 0")[i % 2]
        at = "0 0 0" if i == 0 else f"0 0 {-LENGTH}"
        bodies += f'<body name="link_{i}" pos="{at}">{inertial}<joint type="hinge" axis="{axis}"/>'
        ends += "</body>"
    option = f'<option timestep="{dt}" integrator="{integrator}" gravity="0 0 -9.81"/>'
    return f"<mujoco>{option}<worldbody>{bodies}{ends}</worldbody></mujoco>"
