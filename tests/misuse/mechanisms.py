"""Examples of the questions to mechanisms."""

import functools

import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs

from .attempts import call
from .cases import case

NO_NUMBER = "an answer of names and structure has no number in it"
OF_PLACE = "the answer does not depend on it"


def _study():
    import xarray

    rows = {"x": ("design", [1.0, 2.0, 3.0]), "y": ("design", [3.0, 1.0, 2.0]), "status": ("design", [0, 0, 0])}
    return xarray.Dataset(rows, {"design": [0, 1, 2]})


def _scattered():
    import xarray

    x = np.linspace(0.0, 1.0, 8)
    return xarray.Dataset({"y": ("design", x**2 + x), "reason": ("design", ["ok"] * 8), "x": ("design", x)})


def of_state(*fine):
    return case(lambda z: call(z.bars, z.state), *fine)


def of_frame(*fine):
    return case(lambda z: call(z.bars, z.state, "coupler"), *fine)


def _quantile(kind):
    """A number of a distribution as a function of its parameters."""

    @functools.wraps(kind, updated=())
    def quantile(*args, **options):
        return kind(*args, **options).from_normal(0.5)

    return quantile


CASES = {
    **{f"kinematics.{n}": of_frame() for n in ("position", "rotation", "velocity", "angular_velocity", "jacobian")},
    "constraints.point_kic": of_frame(),
    **{
        f"constraints.{name}": of_state()
        for name in (
            *("constraint_residual", "constraint_jacobian", "internal_kic", "internal_kic_second"),
            *("internal_kic_second_printed", "kic", "kic_second", "kic_second_vector"),
        )
    },
    "signal_flow.signals": of_state("system nan inside: it has no signals", "state nan inside: likewise"),
    "constraints.plane_mix": case(
        lambda z: call(np.ones((2, 3)), np.ones((3, 4, 5))), "tensor shape: planes of any size"
    ),
    "constraints.quadratic": case(lambda z: call(np.ones(4), np.ones((3, 4, 4)))),
    "constraints.left_product": case(
        lambda z: call(np.ones((2, 4)), np.ones((3, 4, 5))), "tensor shape: planes as wide as any"
    ),
    "constraints.right_product": case(
        lambda z: call(np.ones((3, 5, 4)), np.ones((4, 2))), "matrix shape: any number of columns"
    ),
    "constraints.count_mobility": of_state(),
    "constraints.with_mobility_at": of_state(f"state nan inside: {NO_NUMBER}"),
    "constraints.kic_rate": case(lambda z: call(z.second.rotational["coupler"], np.array([2.0]))),
    "assembly.branch": case(
        lambda z: call(z.bars, z.state, ["A"]),
        "held empty: what is missing is completed",
        "* nan inside: 0, which no branch has",
    ),
    "assembly.states_along": case(
        lambda z: call(z.bars, "A", np.array([0.7, 0.8]), z.state), "values shape: any number of values"
    ),
    "assembly.State": case(
        lambda z: call(0.0, np.array([0.25, 0.5]), np.array([1.0, 2.0])),
        "* nan: written by hand, `ok` of it is asked by whoever uses it",
        "* inf: likewise",
        "coordinates shape: the system that it is for is not known",
        "velocities shape: likewise",
    ),
    **{
        f"dynamics.{name}": of_state()
        for name in (
            *("compliance_effort", "forward_dynamics", "generalised_momentum", "gravity_effort", "gyristor_field"),
            *("inertia_field", "kinetic_energy", "mass_matrix", "potential_energy"),
            *("resistance_effort", "resistance_field", "source_effort", "state_equations", "total_effort"),
        )
    },
    "dynamics.contact_load": case(lambda z: call(z.touching, z.touching_state, "touch")),
    "dynamics.element_reports": case(
        lambda z: call(z.bars, z.state),
        "system nan inside: no part of it has results of its own, and no number is given",
        "state nan inside: as before",
    ),
    "dynamics.independent_rates": of_state("system nan inside: rates are part of the state"),
    "dynamics.gyristor_field_direct": of_state(),
    "dynamics.joint_friction": case(lambda z: call(z.rubbing, z.near_rest)),
    **{
        f"dynamics.{n}": case(lambda z: call(z.bars, z.state, np.ones(1)))
        for n in ("hamiltonian", "hamiltonian_slopes")
    },
    **{
        f"dynamics.{name}": case(lambda z: call(z.bars, z.state, "ground", "coupler"))
        for name in ("spring_vector", "spring_kic", "spring_kic_second")
    },
    "dynamics.spring_displacement": case(
        lambda z: call(z.bars, z.state, "ground", "coupler", 0.25), positive="free_length"
    ),
    "reaction.inverse_dynamics": case(lambda z: call(z.bars, z.state, np.array([1.0, 2.0, 3.0]))),
    "dynamics.acceleration": of_frame(),
    "dynamics.angular_acceleration": of_frame(),
    "dynamics.cable_states": case(
        lambda z: call(z.bars, z.state),
        "system nan inside: it has no cable, and no number is given",
        "state nan inside: as before",
    ),
    "dynamics.validity": case(
        lambda z: call(z.bars, z.state),
        "system nan inside: no part of it has an end, and no number is given",
        "state nan inside: as before",
    ),
    "reaction.reactions": case(lambda z: call(z.bars, z.state, "world", "child", {"A": np.ones(6)}, "dense")),
    "reaction.reaction_bonds": case(lambda z: call(z.bars, z.state, {"A": np.ones(6)}, "dense")),
    "jaxmbs.reactions": case(lambda z: call(z.bars, z.state)),
    "analysis.equilibrium": case(lambda z: call(z.hanging, z.near_rest)),
    "jaxmbs.equilibrium": case(lambda z: call(z.hanging, z.near_rest)),
    "analysis.linearise": case(lambda z: call(z.bars, z.state, ["A"], ["D"])),
    "analysis.stiffness": of_state(),
    "analysis.impending_motion": case(lambda z: call(z.rubbing, z.swinging, ["pin"])),
    "analysis.modes": of_state(),
    "analysis.campbell": case(
        lambda z: call(z.blade, np.array([0.5, 1.0]), "pin"), "speeds shape: any number of speeds"
    ),
    "jaxmbs.modes": case(lambda z: call(z.lin)),
    "analysis.frequency_response": case(lambda z: call(z.lin, z.omega), "omega shape: any number of frequencies"),
    "jaxmbs.frequency_response": case(lambda z: call(z.lin, z.omega), "omega shape: any number of frequencies"),
    "jaxmbs.check": case(lambda z: call(z.bars), f"system nan inside: {NO_NUMBER}"),
    "motion.simulate": case(
        lambda z: call(z.bars, z.state, ts=z.ts, rtol=1e-6, atol=1e-6),
        "ts shape: any number of times",
        positive="rtol atol",
    ),
    "jaxmbs.simulate": case(
        lambda z: call(z.bars, z.state, 0.125, dt=0.0625, solver=mbs.ode.ImplicitMidpoint()),
        "solver none: the default",
        positive="dt",
    ),
    "motion.vector_field": case(lambda z: call(z.bars), "system nan inside: judged where it is integrated"),
    "adapters.as_block": case(
        lambda z: call(z.bars, (), ("D",), z.state),
        "system nan inside: judged where it is integrated",
        "state none: the start by default",
    ),
    "cycles.periodic": case(
        lambda z: call(z.hanging, 1.0, z.near_rest, steps=8),
        "start none: State.at(system)",
        "start nan inside: the search ends without a cycle",
        positive="period",
    ),
    "cycles.cycles_along": case(
        lambda z: call(lambda k: z.hanging, (0.25, 0.5), 1.0, z.near_rest, steps=8, most_points=2),
        "near none: State.at of the first system",
        "near nan inside: the search ends without a cycle",
        "values nan: said",
        positive="period",
    ),
    "motion.load_peaks": case(lambda z: call(z.bars, z.motion)),
    "motion.peak": case(lambda z: call(z.bars, z.motion, lambda state: state.coordinates[0])),
    "bondgraph.bond_graph": case(
        lambda z: call(z.bars, "detailed", z.state),
        f"system nan inside: {NO_NUMBER}",
        f"state nan inside: {NO_NUMBER}",
        "state none: any pose",
    ),
    "bondgraph.bond_powers": case(lambda z: call(z.bars, z.state, "inertia")),
    "bondgraph.element_powers": case(lambda z: call(z.bars, z.state)),
    "bondgraph.graph_state_equations": case(lambda z: call(z.bars, z.state, "inertia")),
    "bondgraph.junction_residual": case(lambda z: call(z.powers)),
    "flexible.deformations": case(lambda z: call(z.elastic, z.elastic_state, "arm")),
    "flexible.displacements": case(lambda z: call(z.elastic, z.elastic_state, "arm", z.frame)),
    "flexible.interface_loads": case(lambda z: call(z.elastic, z.elastic_state, "arm", z.frame)),
    "flexible.stresses": case(lambda z: call(z.arm, z.arm_state, "arm", z.arm_frame, z.arm_beam)),
    "flexible.section_forces": case(lambda z: call(z.whip, z.whip_state, "whip")),
    "flexible.section_stresses": case(
        lambda z: call(z.whip, z.whip_state, "whip", mbs.elements.Beam(1.0, 1.0, 1e-2, 1e-5, 1e-5, 2e-5))
    ),
    "flexible.stiffening": case(
        lambda z: call(z.elastic, z.elastic_state),
        "* swapped: refused, all of the system in the message",
        "motion text: likewise",
        "motion none: likewise",
    ),
    "flexible.floating_frame": case(lambda z: call(z.free_beam, ["a", "b"], 0, 0.125), positive="damping_ratio"),
    "flexible.carried_loads": case(
        lambda z: call(z.bars, z.state, {"coupler": z.free_beam}, {"B": ("coupler", "a")})
    ),
    "flexible.mass_properties": case(lambda z: call(z.free_beam)),
    "design.minimise": case(
        lambda z: call(_square, {"x": 2.0}, {"x": (0.0, 4.0)}, progress=False, steps=3),
        "bounds inf: no bound",
        "steps huge: it has converged before",
        "bounds name: refused as another structure",
    ),
    "design.pareto": case(
        lambda z: call(_square, _away, {"x": 2.0}, {"x": (0.0, 4.0)}, 3, 5, progress=False),
        "bounds inf: no bound",
        "steps huge: it has converged before",
        "points huge: as many",
    ),
    "design.Limit": case(
        lambda z: call("reach", _square, 0.0, 2.0, 8.0, 1.0),
        "name *: names are free",
        "lower inf: no bound",
        "upper inf: no bound",
        through=lambda kind: (
            lambda name, value, lower, upper, sharpness, scale: _limited(
                kind(name, value, lower, upper, sharpness, scale)
            )
        ),
    ),
    "design.Worst": case(
        lambda z: call(_square, "numbers"),
        "name *: names are free",
        through=lambda kind: (
            lambda function, name: mbs.minimise(kind(function, name), {"x": 2.0}, steps=3, progress=False)
        ),
    ),
    "design.propagate_uncertainty": case(
        lambda z: call(_square, {"x": 2.0}, {"x": 0.5}, 90.0, 16, 1),
        "samples huge: as many",
        "seed huge: any",
        "design shape: an answer of any shape",
        positive="percent",
    ),
    "design.reliability": case(
        lambda z: call(_margin, {"x": mbs.probability.Normal(2.0, 0.5)}, "form", "series", 1, 200, 1, 1e-6, 30),
        "seed huge: any",
        "samples huge: as many",
        "starts huge: as many",
        "tolerance *: a search with a rough one ends early",
        "variables *: refused where distributions are made",
        "steps *: a search that ends early says so",
    ),
    **{
        f"probability.{name}": case(
            lambda z, given=given: call(*given),
            through=_quantile,
        )
        for name, given in {
            "Normal": (2.5, 0.5),
            "LogNormal": (2.5, 0.5),
            "Uniform": (1.5, 4.5),
            "Gumbel": (2.5, 0.5),
            "Weibull": (2.5, 1.5, 0.5),
            "Triangular": (1.5, 2.5, 4.5),
            "Beta": (2.5, 0.5, 1.5, 4.5),
        }.items()
    },
    "probability.Empirical": case(
        lambda z: call(np.array([1.5, 2.5, 4.5, 3.5])),
        "samples shape: any number of samples",
        through=lambda kind: lambda samples: kind(samples).from_normal(0.5),
    ),
    "probability.RandomVariables": case(
        lambda z: call({name: mbs.probability.Normal(2.5, 0.5) for name in ("a", "b")}, {("a", "b"): 0.5}),
        "distributions name: names are free",
        through=lambda kind: lambda distributions, correlation: kind(distributions, correlation).normal_correlation(),
    ),
    "design.interior_point": case(
        lambda z: call(_square, {"x": 2.5}, {"x": (1.5, 4.5)}, None, _above, "exact", 1e-6, 30, "reverse"),
        "design0 shape: designs of any shape",
        "tolerance *: a search with a rough one ends early",
        "steps *: a search that ends early says so",
        "bounds inf: no bound",
    ),
    "design.interior_point_batch": case(
        lambda z: call(
            lambda x, gap: _square(x),
            {"x": 2.5},
            np.array([1.0, 2.0]),
            {"x": (1.5, 4.5)},
            None,
            lambda x, gap: _above(x),
            hessian="exact",
            tolerance=1e-6,
            steps=30,
            round_steps=2,
            gradient="reverse",
            progress=False,
        ),
        "design0 shape: designs of any shape",
        "cases *: cases are what the functions take",
        "tolerance *: a search with a rough one ends early",
        "round_steps huge: a round is as long as the search at most",
        "steps *: a search that ends early says so",
        "bounds inf: no bound",
    ),
    "design.percentile": case(
        lambda z: call(_margin, {"x": mbs.probability.Normal(2.0, 0.5)}, 90.0, 1e-6, 30),
        "tolerance *: a search with a rough one ends early",
        "variables *: refused where distributions are made",
        "steps *: nan where a search ends early",
    ),
    "design.moments": case(
        lambda z: call(_margin, {"x": mbs.probability.Normal(2.0, 0.5)}, 3, 1),
        "seed huge: any",
        "variables *: refused where distributions are made",
    ),
    "design.polynomial_chaos": case(
        lambda z: call(_margin, {"x": mbs.probability.Normal(2.0, 0.5)}, 1e-2, 40, 1),
        "seed huge: any",
        "evaluations huge: as many at most",
        "tolerance *: a rough polynomial says so",
        "variables *: refused where distributions are made",
    ),
    "design.Robust": case(
        lambda z: call(_margin_of, {"x": mbs.probability.Normal(2.0, 0.5)}, 1.0, 2.0, None, 3),
        "variables *: refused where distributions are made",
        "mean *: any weight",
        "deviation *: any weight",
        through=lambda kind: (
            lambda function, variables, mean, deviation, percent, degree: kind(
                function, variables, mean, deviation, percent, degree
            )({"x": 2.0})
        ),
    ),
    "design.tolerances": case(lambda z: call(_square, {"x": 2.0}, {"x": 0.5})),
    "design.sensitivities": case(
        lambda z: call(_square, {"x": (0.0, 1.0)}, 16, 1), "samples huge: as many", "seed huge: any"
    ),
    "studies.grid": case(
        lambda z: call(np.array([1.0, 2.0])), "x shape: any number", through=lambda grid: lambda x: grid(x=x)
    ),
    **{
        f"studies.{name}": case(
            lambda z: call({"x": (0.0, 1.0), "y": (1.0, 2.0)}, 4, 1),
            "bounds name: names are free",
            "number huge: as many",
            "seed huge: any",
        )
        for name in ("sobol", "latin_hypercube")
    },
    "studies.normal": case(
        lambda z: call({"x": 2.0, "y": 1.0}, {"x": 0.5, "y": 0.0}, 4, 1),
        "design name: refused as another structure",
        "design shape: all its numbers scatter by one deviation",
        "number huge: as many",
        "seed huge: any",
    ),
    "studies.pareto_front": case(
        lambda z: call(_study(), ["x", "y"], ["y"]),
        through=lambda front: lambda found, objectives, maximise: front(found, objectives, maximise).x.values,
    ),
    "studies.sobol_shares": case(
        lambda z: call(_scattered(), "y", ["x"]),
        through=lambda shares: lambda found, answer, variables: shares(found, answer, variables).first["x"],
    ),
    "batching.batch": case(
        lambda z: call(_squared, {"x": np.array([1.0, 2.0])}),
        "designs shape: any number of designs",
        through=lambda batch: lambda function, designs: batch(function, designs, progress=False).values,
    ),
}


def _above(design):
    return 1.2 - design["x"]


def _margin_of(design, x):
    return _margin(x) * design["x"]


def _margin(numbers):
    return numbers["x"] - 0.5


def _square(design):
    return (design["x"] - 1.0) ** 2


def _away(design):
    return (design["x"] - 3.0) ** 2


def _limited(limit):
    return mbs.minimise(_away, {"x": 2.0}, limits=[limit], steps=3, progress=False)


def _squared(design):
    return {"y": jnp.square(design["x"])}
