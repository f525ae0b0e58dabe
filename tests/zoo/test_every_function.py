"""Every function of kinematics and dynamics, of mechanisms with a drive, quaternions, rows of velocity, a coupler and
a loop: against differences of places, energies and momenta along the motion and along what the rows allow."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import assembly, constraints, dynamics, kinematics, reaction, signal_flow
from tests.zoo import driven_mechanisms as m
from tests.zoo.walked import EFFORTS, FREE_LENGTH, MODELS, REFUSED, SPRING, H, axial, walk


def _on_bodies(w, translational, rotational):
    """Sum over bodies `m a_t^T b_t + a_r^T I b_r` of pairs of matrices by body, and of velocities."""
    total = 0.0
    for i, n in enumerate(w.names):
        R = w.v["rotations"][n]
        I = R @ np.asarray(w.system.inertia[i]) @ R.T
        total = total + float(w.system.mass[i]) * np.dot(*translational(n)) + rotational(n)[0] @ I @ rotational(n)[1]
    return total


def _inertia(w):
    return _on_bodies(
        w,
        lambda n: (w.by_phi("places", n).T, w.by_phi("places", n)),
        lambda n: (w.spins("rotations", n).T, w.spins("rotations", n)),
    )


def _momentum(w):
    v = w.v
    return _on_bodies(
        w,
        lambda n: (w.by_phi("places", n).T, v["velocities"][n]),
        lambda n: (w.spins("rotations", n).T, v["turning"][n]),
    )


def _kinetic(w):
    v = w.v
    both = [(lambda n, k=k: (v[k][n], v[k][n])) for k in ("velocities", "turning")]
    return 0.5 * _on_bodies(w, *both)


def _gyristor(w):
    K, K_dot = w.v["K"], w.rate["K"]
    return _on_bodies(
        w,
        lambda n: (K_dot.translational[n].T, K.translational[n]),
        lambda n: (K_dot.rotational[n].T, K.rotational[n]),
    )


def _hamiltonian(w):
    """(of the state, of other momenta) by `p.phi_dot - L`."""
    M, b = w.v["mass"], w.u - w.Gamma @ w.v["phi_dot"]
    I, c = w.Gamma.T @ M @ w.Gamma, w.Gamma.T @ M @ b
    found = []
    for p in (w.v["p"], w.p):
        phi_dot = np.linalg.solve(I, p - c)
        u = w.Gamma @ phi_dot + b
        found.append((p @ phi_dot - 0.5 * u @ M @ u, phi_dot))
    return found


def _second_of_bodies(w, H):
    for n in w.names:
        for kind in ("translational", "rotational"):
            slopes = np.stack([getattr(one["K"], kind)[n] for one in w.along], axis=-1)
            yield getattr(H, kind)[n], np.swapaxes(slopes, 0, 1)
    yield H.internal, w.by_phi("Gi")


def _closes(w):
    """Second differences of the rows along the motion, and the rate of the slips."""
    u, a = w.u, w.v["dynamics"][0]
    ends = [w.values(w.moved(s * u + s * s / 2 * a, s, s * a))["f"] for s in (-2 * H, -H, 0.0, H, 2 * H)]
    return np.dot([-1.0, 16.0, -30.0, 16.0, -1.0], ends) / (12.0 * H * H)


def _gap(w):
    return w.v["end"][0] - w.v["base"][0] - w.v["base"][1] @ SPRING[0][1]


def _on_bonds(w):
    """The loads of joints and contacts by the network of bonds, and by the multipliers."""
    own = mbs.reactions(w.system, w.state, frame="joint")
    for name, load in mbs.statics.bond_reactions(*mbs.reaction.reaction_bonds(w.system, w.state)).items():
        yield load.force, own[name].force
        yield load.moment, own[name].moment


#: By function pairs of what it answers and what that should be.
CHECKS = {
    "position": lambda w: [(w.v["base"][0][0], 0.0 if w.freedoms == 7 else m.DRIVE(0.3))],
    "rotation": lambda w: [(w.v["base"][1][0, 0], np.cos(m.DRIVE(0.3)) if w.freedoms == 7 else 1.0)],
    "velocity": lambda w: [(w.v["end"][1], w.rate["end"][0]), (w.v["slip"], 0.0)],
    "angular_velocity": lambda w: [(w.v["turning"]["bob"], axial(w.rate["axes"] @ w.v["axes"].T))],
    "acceleration": lambda w: [(w.v["accelerations"][0], w.rate["end"][1])],
    "angular_acceleration": lambda w: [(w.v["accelerations"][1], w.rate["turning"]["bob"])],
    "jacobian": lambda w: [
        (w.v["jacobian"] @ w.any, np.append(w.aside["end"][0], axial(w.aside["axes"] @ w.v["axes"].T)))
    ],
    "constraint_residual": lambda w: [(w.v["f"], 0.0), (w.rate["f"], 0.0), (w.by_phi("f"), 0.0)],
    "constraint_jacobian": lambda w: [
        (w.v["A"][list(w.system.topology.position_rows)] @ w.any, w.aside["f"]),
        (np.linalg.matrix_rank(w.v["A"]), len(w.u) - w.freedoms),
    ],
    "forward_dynamics": lambda w: [(_closes(w), 0.0), (w.rate["slip"], 0.0)],
    "inverse_dynamics": lambda w: [
        (w.s["needs"][0], w.v["A"].T @ w.v["dynamics"][1]),
        (w.s["needs"][1] - w.s["needs"][0], w.v["mass"] @ np.cos(w.v["dynamics"][0])),
        (w.s["held"], w.v["dynamics"][1][w.system.topology.row_joint.index("base")]),
    ],
    "kic": lambda w: [
        pair
        for n in w.names
        for pair in (
            (w.v["K"].translational[n], w.by_phi("places", n)),
            (w.v["K"].rotational[n], w.spins("rotations", n)),
        )
    ],
    "internal_kic": lambda w: [(w.v["Gi"], w.Gamma[w.dependent])],
    "internal_kic_second": lambda w: [(w.s["Hi"], w.by_phi("Gi"))],
    "internal_kic_second_printed": lambda w: [(w.s["printed"], w.by_phi("Gi"))],
    "kic_second": lambda w: _second_of_bodies(w, w.s["H"]),
    "kic_second_vector": lambda w: _second_of_bodies(w, w.s["vector"]),
    "kic_rate": lambda w: [
        (
            mbs.constraints.kic_rate(w.s["H"].rotational["bob"], w.v["phi_dot"]),
            _at_fixed_time(w)["K"].rotational["bob"],
        )
    ],
    "point_kic": lambda w: [
        (w.v["G"], np.concatenate([w.by_phi("end", 0), w.spins("axes")])),
        (w.s["point"], np.swapaxes(w.by_phi("G"), 0, 1)),
    ],
    "spring_vector": lambda w: [(w.v["spring"][0], _gap(w)), (w.v["spring"][1], w.by_phi("spring", 0))],
    "spring_displacement": lambda w: [
        (w.v["net"][0], _gap(w) * (1.0 - FREE_LENGTH / np.linalg.norm(_gap(w)))),
        (w.v["net"][1], w.by_phi("net", 0)),
    ],
    "spring_kic": lambda w: [(w.v["G_C"], np.outer(_gap(w), _gap(w) @ w.by_phi("spring", 0)) / (_gap(w) @ _gap(w)))],
    "spring_kic_second": lambda w: [(w.s["spring"], np.swapaxes(w.by_phi("G_C"), 0, 1))],
    "count_mobility": lambda w: [(constraints.count_mobility(w.system, w.state).mobility, w.freedoms)],
    "with_mobility_at": lambda w: [(constraints.with_mobility_at(w.system, w.state) is w.system, True)],
    "kinetic_energy": lambda w: [(w.v["energy"][0], _kinetic(w))],
    "mass_matrix": lambda w: [(w.u @ w.v["mass"] @ w.u, 2.0 * _kinetic(w)), (w.v["I_star"], _inertia(w))],
    "inertia_field": lambda w: [(w.v["I_star"], _inertia(w)), (w.Gamma.T @ w.v["mass"] @ w.Gamma, _inertia(w))],
    "generalised_momentum": lambda w: [(w.v["p"], _momentum(w))],
    "independent_rates": lambda w: [(w.v["phi_dot"], w.u[list(w.v["K"].independent)])],
    "gyristor_field": lambda w: [(w.s["GR"], _gyristor(w))],
    "gyristor_field_direct": lambda w: [],
    "state_equations": lambda w: [
        (w.s["state_equations"][0], w.rate["p"]),
        (w.s["state_equations"][1], w.v["phi_dot"]),
        (w.s["state_equations"][2], w.u[w.dependent]),
    ],
    "hamiltonian": lambda w: [(found, h) for found, (h, _) in zip(w.v["H"], _hamiltonian(w), strict=True)],
    "hamiltonian_slopes": lambda w: [
        (w.s["slopes"][0], w.by_phi("H", 1)),
        (w.s["slopes"][1], _hamiltonian(w)[1][1]),
    ],
    "potential_energy": lambda w: [
        (w.v["e"]["compliance"] + w.v["e"]["gravity"], -w.by_phi("energy", 1)),
        (w.v["energy"][1], 20.0 * (np.linalg.norm(_gap(w)) - FREE_LENGTH) ** 2 - _weight(w, "places")),
    ],
    "compliance_effort": lambda w: [(w.v["e"]["compliance"], -40.0 * w.v["G_C"].T @ w.v["net"][0])],
    "gravity_effort": lambda w: [(w.v["e"]["gravity"], _weight(w, "by_phi"))],
    "source_effort": lambda w: [
        (w.v["e"]["source"], m.SPIN * w.v["rotations"]["pinion"][:, 0] @ w.spins("rotations", "pinion"))
    ],
    "resistance_effort": lambda w: [(w.v["e"]["resistance"], _resistance(w))],
    "resistance_field": lambda w: [(w.s["R"], w.resistance)],
    "reaction_bonds": _on_bonds,
    "total_effort": lambda w: [(w.v["e"]["total"], sum(w.v["e"][k] for k in EFFORTS[:-1]))],
}
#: What depends on none of these traits, or has its own tests of all of them: `test_balances`, `test_reactions`.
ELSEWHERE = {"left_product", "plane_mix", "quadratic", "right_product", "reactions", "branch", "signals"}
ELSEWHERE |= {"joint_friction", "contact_load", "cable_states", "validity", "element_reports"}


def _at_fixed_time(w):
    """Rates along the part of the motion that the independent velocities make."""
    return w.slope(lambda s: w.moved(s * (w.Gamma @ w.v["phi_dot"])))


def _weight(w, what):
    """Mass times place along gravity, or its slopes."""
    each = [w.by_phi("places", n) if what == "by_phi" else w.v["places"][n] for n in w.names]
    return sum(float(k) * np.asarray(w.system.gravity) @ x for k, x in zip(w.system.mass, each, strict=True))


def _resistance(w):
    """Of the damper of the spring and of the brake, by the rates of their lengths, drives included."""
    n = _gap(w) / np.linalg.norm(_gap(w))
    wheel = w.system.columns("wheel")
    by_spring = -0.7 * (n @ w.rate["spring"][0]) * (n @ w.by_phi("spring", 0))
    return by_spring - 0.3 * w.u[wheel][0] * w.Gamma[wheel][0]


of_models = pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.long) for name in MODELS])


def test_every_function_is_walked():
    functions = {
        f"{name}"
        for room in (kinematics, constraints, signal_flow, assembly, dynamics, reaction)
        for name in room.__all__
        if not isinstance(getattr(room, name), type)
    }
    assert functions == {*CHECKS, *ELSEWHERE, "states_along"}


@of_models
def test_every_function(name):
    """All are looked at, so that one report has every fault."""
    w, faults = walk(name), []
    for function, check in CHECKS.items():
        if name in REFUSED.get(function, ()):
            room = dynamics if hasattr(dynamics, function) else constraints
            with pytest.raises(mbs.ModelError, match=f"{function}: "):
                getattr(room, function)(w.system, w.state)
            continue
        for k, (found, right) in enumerate(check(w)):
            size = max(1.0, np.max(np.abs(right), initial=0.0))
            gap = np.max(np.abs(found - right), initial=0.0) / size
            if not gap < (1e-6 if function == "forward_dynamics" else 1e-8):
                faults.append((function, k, float(gap)))
    assert not faults, faults


@of_models
def test_states_along(name):
    """The coupler by hand, and everything closed."""
    w, values = walk(name), np.linspace(0.3, 1.2, 4)
    states = mbs.assembly.states_along(w.system, "wheel", values, w.state)
    np.testing.assert_allclose(w.system.coordinates(states)["pinion"], m.pinion(values), rtol=1e-12)
    np.testing.assert_allclose(mbs.constraints.constraint_residual(w.system, states), 0.0, atol=1e-9)
    still = w.v["A"] @ w.u  # drives alone have rows that move
    A = mbs.constraints.constraint_jacobian(w.system, states)
    np.testing.assert_allclose(np.einsum("krv,kv->kr", A, states.velocities), np.tile(still, (4, 1)), atol=1e-9)


@pytest.mark.long
def test_rows_that_read_the_time_are_refused_where_their_terms_lack():
    """By what they read: rows of the user that do not read it have none."""
    for rows, moves in ((lambda psi, t: psi[0] - jnp.sin(t), True), (lambda psi, t: psi[0] - 0.3, False)):
        b = mbs.SystemBuilder()
        b.body("cart", 1.0, com=(0.1, 0.0, 0.2), inertia=0.1)
        b.joint("plane", mbs.Planar("y"), "ground", "cart")
        b.constraint("path", mbs.joints.PositionRows(rows))
        system = b.build()
        state = mbs.State.at(system, t=0.3)
        if moves:
            with pytest.raises(mbs.ModelError, match="gyristor_field_direct: the motion has drives .path., or rows"):
                dynamics.gyristor_field_direct(system, state)
        else:
            rates = dynamics.independent_rates(system, state)
            efforts = [f(system, state) @ rates for f in (dynamics.gyristor_field, dynamics.gyristor_field_direct)]
            np.testing.assert_allclose(*efforts, atol=1e-12)
