"""State equations of driven systems, against rates of the momenta along the motion; what is refused elsewhere."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import dynamics
from jaxmbs.bondgraph import graph_state_equations as of_the_graph
from jaxmbs.constraints._kic import dependent_columns
from jaxmbs.kinematics._poses import coordinate_rate


def cart(drive):
    """A pendulum of two links on a driven cart, or on a driven turntable."""
    b = mbs.SystemBuilder(gravity=(0.0, 0.0, -9.81))
    kind = mbs.Prismatic("x") if drive == "slide" else mbs.Revolute("z")
    b.body("cart", mass=1.5, inertia=0.2)
    b.joint("base", kind, "ground", "cart", drive=mbs.Harmonic(0.3, 2.0, 0.4))
    for name, parent, at in (("one", "cart", (0.2, 0.0, 0.0)), ("two", "one", (0.0, 0.0, -0.5))):
        b.body(name, mass=0.8, com=(0.0, 0.0, -0.3), inertia=(0.02, 0.03, 0.04))
        b.joint(name, mbs.Revolute("y"), parent, name, parent_frame=at)
    b.force("oil", mbs.SpringDamper(stiffness=2.0, damping=0.3), joint="two")
    return b.build()


@pytest.mark.slow
@pytest.mark.parametrize("drive", ["slide", "turntable"])
def test_momentum_rates_of_driven_systems(drive):
    system = cart(drive)
    state = mbs.State.at(system, {"one": 0.4, "two": -0.7}, velocities={"one": 1.3, "two": 0.6}, t=0.37)

    def momentum(psi, u, t):
        return dynamics.generalised_momentum(system, mbs.State(t, psi, u))

    u_dot = mbs.forward_dynamics(system, state)[0]
    psi, u = state.coordinates, state.velocities
    along = coordinate_rate(system.topology, psi, u), u_dot, jnp.ones(())
    wanted = jax.jvp(momentum, (psi, u, state.t), along)[1]
    p_dot, phi_dot, q_dot = dynamics.state_equations(system, state)
    np.testing.assert_allclose(p_dot, wanted, rtol=1e-10)
    np.testing.assert_allclose(p_dot, of_the_graph(system, state)[0], rtol=1e-10)
    np.testing.assert_allclose(phi_dot, dynamics.independent_rates(system, state), rtol=1e-12)
    np.testing.assert_allclose(q_dot, u[dependent_columns(system)], rtol=1e-12)
    with pytest.raises(
        mbs.ModelError, match="gyristor_field_direct: the motion has drives .base., or rows that read"
    ):
        dynamics.gyristor_field_direct(system, state)


def test_quaternions_and_rolling_are_refused():
    b = mbs.SystemBuilder()
    b.body("ball", mass=1.0, com=(0.1, 0, 0), inertia=(0.1, 0.2, 0.3))
    b.joint("socket", mbs.Spherical(), "ground", "ball")
    system = b.build()
    state = mbs.State.at(system, velocities={"socket": (1.0, 2.0, 3.0)})
    for ask in (dynamics.gyristor_field_direct, dynamics.hamiltonian_slopes):
        with pytest.raises(mbs.ModelError, match=f"{ask.__name__}: the velocities of socket are no rates"):
            ask(system, state)
