"""Scalar laws over the length of a path: beside the cable of the same numbers, and in closed form."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.forces import Attachment, BumpStop, Maxwell, PathForce, Winch, WrapCylinder

R, K = 0.1, 200.0
POSES = jnp.stack([jnp.eye(3)] * 2), jnp.array([[0.0, 0, 0], [2.0, 0, 0]])


def straight(law):
    """Between two points."""
    return PathForce(("point", "point"), jnp.zeros(0), jnp.zeros((0, 3)), jnp.zeros(0), law=law)


def hung(law=None, **numbers):
    """A block that slides along z, on a path over a drum at its side."""
    b = mbs.SystemBuilder()
    b.body("block", 2.0)
    b.joint("z", mbs.joints.Prismatic("z"), "ground", "block")
    ends = Attachment(("ground", (-0.3, 0, 0))), Attachment(("block", (R, 0, -0.5)))
    path = [ends[0], WrapCylinder(("ground", (0, 0, 0)), R, "+", "y"), ends[1]]
    b.cable("rope", path, law=law, **numbers)
    return b


@pytest.mark.slow
def test_a_spring_is_a_cable_that_does_not_become_slack():
    spring = hung(mbs.SpringDamper(K, 3.0, 0.7)).build()
    cable = hung(stiffness=K, damping=3.0, free_length=0.7, slack=False).build()
    for z, v in ((-0.2, 0.5), (0.1, -0.3)):
        found = [mbs.forward_dynamics(s, mbs.State.at(s, {"z": z}, {"z": v}))[0] for s in (spring, cable)]
        np.testing.assert_allclose(*found, rtol=1e-12)
    state = mbs.State.at(spring, {"z": 0.0})
    motion = mbs.simulate(spring, state, ts=np.linspace(0.0, 0.5, 3))
    assert motion.ok and float(np.max(np.abs(motion.diagnostics.energy_residual))) < 1e-6
    reports = mbs.dynamics.element_reports(spring, state).results["rope"]
    length = np.sqrt(0.3**2 - R**2) + R * (np.pi / 2 + np.arcsin(R / 0.3)) + 0.5
    np.testing.assert_allclose(reports["length"].value, length, rtol=1e-9)


def test_states_and_faults():
    law = straight(Maxwell(4.0, 2.0))
    assert set(law.internal_states) == {"stretch"} and law.stores and not law.is_source
    at = mbs.forces.PathKinematics(*POSES, jnp.zeros((2, 3)), jnp.array([[0.0] * 3, [1.0, 0, 0]]))
    force, moment = law.wrench(at, {"stretch": jnp.array(0.5)}, 0.0)
    np.testing.assert_allclose(force, [[2.0, 0, 0], [-2.0, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(law.rate(at, {"stretch": jnp.array(0.5)}, 0.0)["stretch"], 1.0 - 2.0 * 0.5)
    b = hung(BumpStop(1.0, upper=-0.2))
    assert any("upper is a distance" in fault for fault in b.faults())
    b = hung(mbs.SpringDamper(1.0), stiffness=3.0)
    assert any("a cable with law= takes no stiffness" in fault for fault in b.faults())
    b = mbs.SystemBuilder()
    b.cable("rope", [Winch("ground", "z", 0.1), Attachment("ground")], law=mbs.SpringDamper(1.0))
    assert any("it takes no Winch and no friction" in fault for fault in b.faults())


def test_gradient_by_a_number_of_the_law():
    def pull(k):
        return straight(mbs.SpringDamper(k, 0.0, 1.5)).potential(*POSES, 0.0)

    np.testing.assert_allclose(jax.grad(pull)(3.0), 0.5**2 / 2)
