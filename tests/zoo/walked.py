"""What the functions of kinematics and dynamics answer at a state, and differences of it by neighbouring states."""

import functools

import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import constraints, dynamics
from jaxmbs.kinematics._poses import step_coordinates
from tests.zoo import driven_mechanisms as m

AT, FREE_LENGTH, H = ("bob", (0.1, 0.1, -0.3)), 0.2, 1e-3
SPRING = (("table", (0.3, 0.1, 0.4)), AT)
MODELS = {"quaternions": (m.quaternions, m.rolls, 7), "blade": (m.blade, m.cuts, 4), "loop": (m.loop, m.holds, 2)}
#: Of whose motion some functions know too little, and say so.
REFUSED = {
    "internal_kic_second_printed": ("quaternions",),
    "gyristor_field_direct": ("quaternions", "blade", "loop"),
    "hamiltonian_slopes": ("quaternions", "blade"),
}


@functools.partial(mbs.jit, compile="quick")
def first(system, state, p):
    """What a state is asked of, and its neighbours, for differences."""
    names, com = system.topology.body_names, system.com
    K, u_dot = mbs.constraints.kic(system, state), mbs.forward_dynamics(system, state)
    of_bodies = {
        "places": lambda n, at: mbs.position(system, state, (n, at)),
        "rotations": lambda n, at: mbs.rotation(system, state, n),
        "velocities": lambda n, at: mbs.velocity(system, state, (n, at)),
        "turning": lambda n, at: mbs.kinematics.angular_velocity(system, state, n),
    }
    found = {k: {n: ask(n, com[i]) for i, n in enumerate(names)} for k, ask in of_bodies.items()}
    return found | {
        "origin": mbs.position(system, state, "disk" if "disk" in names else "bob"),
        "end": (mbs.position(system, state, AT), mbs.velocity(system, state, AT)),
        "axes": mbs.rotation(system, state, "bob"),
        "base": (mbs.position(system, state, "table"), mbs.rotation(system, state, "table")),
        "accelerations": (
            mbs.dynamics.acceleration(system, state, AT),
            mbs.dynamics.angular_acceleration(system, state, "bob"),
        ),
        "jacobian": mbs.kinematics.jacobian(system, state, AT),
        "K": K,
        "Gi": constraints.internal_kic(system, state),
        "G": mbs.constraints.point_kic(system, state, AT)[0],
        "f": mbs.constraints.constraint_residual(system, state),
        "A": mbs.constraints.constraint_jacobian(system, state),
        "spring": dynamics.spring_vector(system, state, *SPRING),
        "net": dynamics.spring_displacement(system, state, *SPRING, FREE_LENGTH),
        "G_C": dynamics.spring_kic(system, state, *SPRING),
        "dynamics": u_dot,
        "mass": mbs.mass_matrix(system, state),
        "I_star": dynamics.inertia_field(system, state),
        "p": dynamics.generalised_momentum(system, state),
        "phi_dot": dynamics.independent_rates(system, state),
        "H": (dynamics.hamiltonian(system, state), dynamics.hamiltonian(system, state, p)),
        "energy": (mbs.dynamics.kinetic_energy(system, state), mbs.dynamics.potential_energy(system, state)),
        "e": {k: getattr(dynamics, f"{k}_effort")(system, state) for k in EFFORTS},
    }


EFFORTS = ("compliance", "gravity", "source", "resistance", "total")


@functools.partial(mbs.jit, compile="quick")
def second(system, state, p):
    """What is a derivative itself, and the efforts that keep motions."""
    own = mbs.forward_dynamics(system, state)[0]
    refused = _refused(system)
    return {
        "H": mbs.constraints.kic_second(system, state),
        "vector": constraints.kic_second_vector(system, state),
        "Hi": constraints.internal_kic_second(system, state),
        "printed": None
        if "internal_kic_second_printed" in refused
        else constraints.internal_kic_second_printed(system, state),
        "point": mbs.constraints.point_kic(system, state, AT)[1],
        "spring": dynamics.spring_kic_second(system, state, *SPRING),
        "GR": dynamics.gyristor_field(system, state),
        "state_equations": dynamics.state_equations(system, state),
        "R": dynamics.resistance_field(system, state),
        "slopes": None if "hamiltonian_slopes" in refused else dynamics.hamiltonian_slopes(system, state, p),
        "needs": (mbs.inverse_dynamics(system, state, own), mbs.inverse_dynamics(system, state, own + jnp.cos(own))),
        "held": mbs.inverse_dynamics(system, state, actuators=["base"])["base"],
    }


def _refused(system):
    """The functions that lack something of the system's motion."""
    name = "quaternions" if not system.topology.is_simple else "blade" if system.topology.slip_rows else "loop"
    return {function for function, models in REFUSED.items() if name in models}


class Walk:
    """A mechanism, what it answers at its state, and differences of that."""

    def __init__(self, name):
        build, self.slip, self.freedoms = MODELS[name]
        self.system, self.state = build(SPRING)
        self.names, self.p = self.system.topology.body_names, np.linspace(-0.7, 0.9, self.freedoms)
        self.v = self.values(self.state)
        self.s = jax.tree.map(np.asarray, second(self.system, self.state, self.p))
        independent = list(self.v["K"].independent)
        both = np.concatenate([self.v["A"], np.eye(len(self.state.velocities))[independent]])
        right = np.concatenate([np.zeros((len(self.v["A"]), self.freedoms)), np.eye(self.freedoms)])
        self.Gamma = np.linalg.lstsq(both, right, rcond=None)[0]
        self.dependent, self.u = list(self.v["K"].dependent), np.asarray(self.state.velocities)
        self.along = [self.slope(lambda s, g=g: self.moved(s * g)) for g in self.Gamma.T]
        self.rate = self.slope(lambda s: self.moved(s * self.u, s, s * self.v["dynamics"][0]))
        self.any = np.random.default_rng(5).normal(size=self.u.shape)
        self.aside = self.slope(lambda s: self.moved(s * self.any))
        faster = [self.slope(lambda s, g=g: self.moved(0.0 * g, 0.0, s * g)) for g in self.Gamma.T]
        self.resistance = -np.stack([one["e"]["resistance"] for one in faster], axis=-1)

    def values(self, state):
        found = jax.tree.map(np.asarray, first(self.system, state, self.p))
        return found | {"slip": self.slip(found)}

    def moved(self, step, dt=0.0, du=0.0):
        """The state after a step of the coordinates (nv,), of time and velocities (nv,)."""
        psi = step_coordinates(self.system.topology, self.state.coordinates, jnp.asarray(step))
        return mbs.State(self.state.t + dt, psi, self.state.velocities + du)

    def slope(self, path):
        """The derivative of all values along a path of states, by differences of fourth order."""
        ends = [self.values(path(k * H)) for k in (1, -1, 2, -2)]
        return jax.tree.map(lambda a, b, c, d: (8.0 * (a - b) - (c - d)) / (12.0 * H), *ends)

    def by_phi(self, *keys):
        """Slopes (..., N) of an entry by the independent coordinates."""
        return np.stack([functools.reduce(lambda x, k: x[k], keys, one) for one in self.along], axis=-1)

    def spins(self, *keys):
        """(3, N) angular velocities per independent velocity, of a rotation."""
        R = functools.reduce(lambda x, k: x[k], keys, self.v)
        return np.stack([axial(turn @ R.T) for turn in np.moveaxis(self.by_phi(*keys), -1, 0)], axis=-1)


def axial(W):
    return np.array([W[2, 1], W[0, 2], W[1, 0]])


walk = functools.cache(Walk)
