"""Examples of components: reductions, coupling, measured transfer functions."""

import inspect

import jax
import jax.numpy as jnp
import numpy as np

from jaxmbs import coupling, linear, reductions

from .attempts import call
from .cases import case
from .zoo import Zoo

ANY = "any number of them"
INTERFACE = (0,)
POSITIONS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])


def reduction(arguments, *fine):
    return case(arguments, *fine, through=_reduced)


def _reduced(kind):
    def made(*args, **options):
        return reductions.reduce(_component(), kind(*args, **options))

    made.__signature__ = inspect.signature(kind)
    return made


def _component():
    K = np.array([[2.0, -1.0, 0.0, 0.0], [-1.0, 2.0, -1.0, 0.0], [0.0, -1.0, 2.0, -1.0], [0.0, 0.0, -1.0, 1.0]])
    return linear.LinearSystem(mass=np.eye(4), stiffness=K, interface=[0, 3])


CASES = {
    "reductions.Unreduced": reduction(lambda z: call()),
    "reductions.Guyan": reduction(lambda z: call()),
    "reductions.CraigBampton": reduction(lambda z: call(1)),
    "reductions.Hurty": reduction(lambda z: call(1, (0,))),
    "reductions.CraigChang": reduction(lambda z: call(1, (0,))),
    "reductions.Rubin": reduction(lambda z: call(2, np.eye(2))),
    "reductions.MacNeal": reduction(lambda z: call(2)),
    "reductions.Mixed": reduction(lambda z: call(2, (0,))),
    "reductions.Characteristic": case(
        lambda z: call(1), through=lambda kind: lambda num_modes: reductions.reduce(_craig_bampton(), kind(num_modes))
    ),
    "reductions.Mirror": case(lambda z: call("x", ("a",)), through=lambda kind: _of_half(kind)),
    "reductions.Cyclic": case(
        lambda z: call(6, 1, {"left": "right"}, "z"),
        "num_sectors huge: as many",
        through=lambda kind: (
            lambda num_sectors, harmonic, faces, axis: reductions.reduce(
                _sector(), kind(num_sectors, harmonic, faces, axis)
            )
        ),
    ),
    "reductions.rotate": case(lambda z: call(z.free_beam, np.eye(3)[[1, 2, 0]])),
    "reductions.virtual_work": case(
        lambda z: call(z.chain, z.x, np.ones(1), {"b": 1.0}), "system nan inside: the work of forces that are given"
    ),
    "reductions.reduce": case(lambda z: call(z.chain, reductions.CraigBampton(2))),
    "reductions.fixed_interface_modes": case(lambda z: call(z.chain, 2)),
    "reductions.characteristic_modes": case(lambda z: call(z.small, 1)),
    "reductions.determinate_coordinates": case(
        lambda z: call(_component()), "system nan inside: LinearSystem refuses it before"
    ),
    "reductions.support_motions": case(lambda z: call(_component(), ("0",))),
    "reductions.transform_interface": case(
        lambda z: call(_component(), np.eye(4), 2), "W shape: any number of coordinates"
    ),
    "reductions.rigid_node": case(
        lambda z: call(z.free_beam, "hub", ["b"], np.zeros(3)), "name name: names are free"
    ),
    "reductions.rigid_body_motions": case(lambda z: call(POSITIONS, np.zeros(3))),
    "reductions.averaged_motion": case(lambda z: call(POSITIONS, np.zeros(3), np.ones(3), False)),
    "reductions.rigid_transformation": case(
        lambda z: call(6, (0, 1, 2), np.ones((3, 1))), "motions shape: any number of motions", "size huge: as large"
    ),
    "reductions.averaged_transformation": case(
        lambda z: call(6, (0, 1, 2), np.array([[1.0, 1.0, 1.0]]), (0,)), "size huge: as large"
    ),
    "reductions.element_loads": case(lambda z: call(z.K, z.C, z.x), "element_stiffness shape: refused"),
    "reductions.harmonic_amplitudes": case(
        lambda z: call(z.values[0], z.omega), "amplitudes shape: any number of coordinates"
    ),
    "reductions.mode_acceleration": case(
        lambda z: call(z.chain, z.x, z.x, z.x, z.x), "x nan: of x only the interface counts", "x inf: likewise"
    ),
    "reductions.mode_acceleration_free": case(lambda z: call(_component(), ("0",), z.x, z.x, z.x)),
    "reductions.interface_forces": case(
        lambda z: call(z.chain, z.x, z.x, z.x, z.x),
        "load nan: of the load only the interface counts",
        "load inf: likewise",
    ),
    "reductions.force_errors": case(lambda z: call(z.chain, z.x, z.x, z.x), "* complex: amplitudes may be"),
    "reductions.frequency_errors": case(lambda z: call(z.chain, z.small, 2)),
    "reductions.num_modes_below": case(lambda z: call(z.chain, 0.25, 2.0), positive="frequency factor"),
    "coupling.rigid_bond": case(lambda z: call("one.a", "two.a"), "* name: connect refuses it"),
    "coupling.hinge": case(
        lambda z: call("one.a", "two.a", free="x", axes=np.eye(3)),
        "* name: connect refuses it",
        "axes *: connect refuses it",
    ),
    "coupling.bushing": case(
        lambda z: call("one.a", "two.a", stiffness=np.ones(6), damping=np.ones(6), axes=np.eye(3)),
        "* name: connect refuses it",
        "axes *: connect refuses it",
    ),
    "coupling.RigidBody": case(
        lambda z: call(mass=2.0, points={"foot": np.zeros(3)}, com=np.zeros(3), inertia=np.ones(3)),
        "points name: names of points are free",
        positive="mass inertia",
    ),
    "coupling.Bond": case(lambda z: call((("one", "a"), ("two", "a"))), "ends *: made by rigid, joint and bushing"),
    "coupling.connect": case(
        lambda z: call({"one": z.chain, "two": z.chain}, {"bolt": coupling.rigid_bond("one.a", "two.a")}),
        "components name: the bond names what is missing",
        "bonds name: names of bonds are free",
    ),
    "coupling.reactions": case(lambda z: call(z.network, z.rest)),
    "coupling.base_motion": case(
        lambda z: call(z.chain, np.array([[1.0], [0.0], [0.0]]), 0.5, 0.25, np.zeros(1), np.zeros(1)), positive="step"
    ),
    "coupling.Components": case(lambda z: call(((0,),), z.K[None], np.ones((1, 4))), through=lambda kind: _coupled),
    "coupling.coupled_response": case(
        lambda z: call([_group(z)], np.ones((2, 1))), "load shape: as many coordinates of each node"
    ),
    "coupling.interface_pattern": case(
        lambda z: call([_group(z)], 2, 1),
        "num_nodes huge: as many",
        "size *: as large",
        "groups nan inside: an answer of names and structure has no number in it",
    ),
    "coupling.modal_pairs": case(
        lambda z: call(np.array([1.0, 2.0]), np.array([[0.5, 0.25]]), _payload()), "carrier_omega shape: refused"
    ),
    "coupling.peak_response": case(
        lambda z: call(2.0, np.array([1.0, 2.0, 0.0]), 0.5, 0.25), "force shape: any number of times", positive="step"
    ),
    "coupling.equivalent_impulse": case(lambda z: call(2.0, 3.0), "* shape: numbers or arrays of them"),
    "coupling.cqc_correlation": case(
        lambda z: call(np.array([1.0, 2.0]), np.array([0.25, 0.5])), "omega shape: refused with other ratios"
    ),
    "coupling.combine_modal_maxima": case(
        lambda z: call(z.x, "cqc", np.ones(3), 0, np.eye(3)), "values shape: any number of cases"
    ),
    "coupling.limit_loads": case(
        lambda z: call(np.ones((2, 2)), np.array([[1.0, 2.0]]), "cqc", np.ones(2), (np.eye(1), np.eye(2)))
    ),
    "coupling.truncation_shortfall": case(
        lambda z: call(np.array([1.0, 2.0]), np.array([1.0, 4.0])), "truth inf: all of it is missing"
    ),
    "experiment.check_suspension": case(
        lambda z: call(z.free_beam, {"a": np.full(6, 1e-3)}, 6, 0.125), positive="limit"
    ),
    "experiment.coherence_variance": case(
        lambda z: call(z.values, np.full(z.values.shape, 0.5), 8.0),
        "averages inf: a limit that exists",
        positive="coherence averages",
    ),
    "experiment.noise_variance": case(lambda z: call(z.values, 0.25, 0.5), "values shape: any number of channels"),
    "experiment.add_noise": case(
        lambda z: call(jax.random.key(0), z.values, np.ones(z.values.shape)), positive="variance"
    ),
    "experiment.mean_of_repeats": case(lambda z: call(z.values), "samples shape: any number of them"),
    "experiment.nonlinearity": case(lambda z: call(z.values), "levels shape: any number of channels"),
    "experiment.propagate": case(lambda z: call(jnp.abs, z.values, np.ones(z.values.shape)), positive="variance"),
    "experiment.propagate_scalar": case(
        lambda z: call(lambda B: jnp.sum(jnp.abs(B)), z.values, np.ones(z.values.shape)), positive="variance"
    ),
    "coupling.regularised_inverse": case(
        lambda z: call(z.values, 2, 0.0, 0.0, np.ones(2)), "A shape: any number of rows and columns", positive="rcond"
    ),
    "coupling.uncoupled_transfer": case(
        lambda z: call({"one": z.measured, "two": z.measured}), "parts name: names are free"
    ),
    "coupling.couple_transfer": case(lambda z: call({"one": z.measured, "two": z.measured}, [("one p", "two p")])),
    "coupling.coupling_forces": case(
        lambda z: call({"one": z.measured, "two": z.measured}, [("one p", "two p")], np.eye(1))
    ),
    "experiment.decouple": case(lambda z: call(z.measured, z.measured.at(["p"], ["p"]), ["p"])),
    "experiment.remove_stiffness": case(lambda z: call(z.measured, ["p"], np.array([[0.25]]))),
    "experiment.measured_stiffness": case(lambda z: call(z.measured, ["p", "q"])),
    "experiment.free_response": case(
        lambda z: call(z.values, z.values, z.values, np.ones(2)), "motions shape: refused with other runs"
    ),
    "experiment.sweep_phase": case(
        lambda z: call(z.ts, 1.0, 2.0, 4.0),
        "time shape: any number of times",
        "* swapped: numbers or arrays of them",
        "duration inf: a limit that exists",
    ),
    "experiment.sweep_amplitudes": case(
        lambda z: call(np.cos(np.linspace(0.0, 20.0, 41))[None], np.linspace(0.0, 20.0, 41), [20], 8),
        "signals inf: outside of the window",
        "* shape: refused with other lengths",
    ),
    "experiment.sweep_variance": case(
        lambda z: call(0.5, 8), "noise shape: any number of channels", "width huge: ok", "* swapped: as many samples"
    ),
    "experiment.rigid_channels": case(lambda z: call(list(z.table.values()), np.zeros(3))),
    "experiment.flexible_channels": case(lambda z: call(list(z.table.values()), np.zeros(3), lambda r: r)),
    "experiment.virtual_point": case(
        lambda z: call(z.campaign, np.zeros(3), z.table, z.table, "hub", np.ones(8)),
        "name name: names are free",
        "name number for a name: likewise",
    ),
}


def _craig_bampton():
    return reductions.reduce(_component(), reductions.CraigBampton(1))


def _of_half(kind):
    return lambda normal, nodes: reductions.reduce(Zoo().free_beam, kind(normal, nodes))


def _sector():
    K = np.array([[3.5, -3.0], [-3.0, 3.0]])
    return linear.LinearSystem(mass=np.diag([2.0, 0.0]), stiffness=K, coordinates=["left", "right"])


def _payload():
    K = np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    free = linear.LinearSystem(mass=np.eye(3), stiffness=K, interface=[0])
    return reductions.reduce(free, reductions.CraigBampton(2))


def _group(zoo):
    parts = [linear.LinearSystem(mass=zoo.M, stiffness=zoo.K, interface=[0, 3])]
    return coupling.Components.of(parts, [[0, 1]], [None])


def _coupled(nodes, matrix, load):
    return coupling.coupled_response([coupling.Components(nodes, matrix, load)], np.ones((1, 1)))
