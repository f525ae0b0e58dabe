"""Examples of the questions to matrices: `linear`."""

import numpy as np

import jaxmbs as mbs
from jaxmbs import fatigue

from .attempts import call
from .cases import case

ANY = "any number of frequencies"
TIMES = "any number of times"
SIGNALS = "any number of samples"
CURVE = fatigue.SN(1e6, 3.0)
STRESS = fatigue.psd_table([1.0, 2.0, 4.0], [1.0, 2.0, 0.5], unit=None)
OSCILLATOR = mbs.LinearSystem(
    mass=[[2.0]], stiffness=[[8e4]], damping=[[40.0]], coordinates=["m z"], positions={"m": (0, 0, 0)}
)
CASES = {
    "fatigue.SN": case(lambda z: call(1e6, 3.0, 2.0, 5.0, 1.0), "* nan: shows in the damage", "* inf: a limit"),
    "fatigue.psd_table": case(lambda z: call(np.array([1.0, 2.5, 4.0]), np.array([1.5, 2.0, 0.5]), "N^2/Hz")),
    "fatigue.rainflow": case(lambda z: call(np.array([0.5, 2.0, -1.0, 3.0])), f"signal shape: {SIGNALS}"),
    "fatigue.damage": case(
        lambda z: call(np.array([0.5, 2.0, -1.0, 3.0]), CURVE, "goodman", 20.5), f"history shape: {SIGNALS}"
    ),
    "fatigue.equivalent_load": case(
        lambda z: call(np.array([0.5, 2.0, -1.0, 3.0]), 3.5, 2.5), f"history shape: {SIGNALS}"
    ),
    "fatigue.SpectralMoments": case(lambda z: call(np.array([1.0, 2.0, 4.0, 16.0]))),
    "fatigue.spectral_damage": case(lambda z: call(STRESS, CURVE, "dirlik")),
    "qualification.damage_spectrum": case(
        lambda z: call(np.array([0.5, 2.0, -1.0, 3.0]), np.array([30.5, 100.0]), CURVE, None, 1e-3, 10.5),
        "Q inf: no damping",
        f"source shape: {SIGNALS}",
        "natural shape: any number",
    ),
    "qualification.response_spectrum": case(
        lambda z: call(OSCILLATOR, (np.array([1.5, 99.0]), np.array([2.5, 3.0])), ["m z"], "srss")
    ),
    "qualification.miles": case(
        lambda z: call(np.array([30.5, 100.0]), np.array([0.03, 0.16]), 10.5), "* shape: any that fit"
    ),
    "qualification.random_spectrum": case(
        lambda z: call(np.array([20.5, 50.0, 800.0]), np.array([0.026, 0.16, 0.16]), np.array([30.5, 100.0]), 10.5),
        "natural shape: any number",
    ),
    "qualification.shock_spectrum": case(
        lambda z: call(np.array([0.0, 1.5, -0.5, 0.25]), 1e-3, np.array([30.5, 100.0]), 10.5),
        "Q inf: no damping",
        f"signal shape: {SIGNALS}",
        "frequencies shape: any number",
    ),
    "linear.LinearSystem": case(
        lambda z: call(
            mass=z.M, stiffness=z.K, damping=z.C, interface=["a"], coordinates=["a", "b", "c", "d"], massless=[3]
        ),
        "* complex: matrices may be",
        "damping nan: refused",
    ),
    "vibration.CoordinateLaw": case(
        lambda z: call(mbs.SpringDamper(2.0), {"a": 1.0}),
        "row name: simulate refuses it",
    ),
    "vibration.ModalSuperposition": case(
        lambda z: call(0.25, 2),
        "ratios *: simulate refuses it",
        "num *: simulate refuses it",
        "* swapped: simulate refuses it",
    ),
    "linear.TransferFunctions": case(
        lambda z: call(z.omega, z.values, ["p", "q"], ["p", "q"]),
        "values nan: gaps in what was measured",
        "values inf: shows in whatever is asked",
        "outputs name: names are free",
        "inputs name: names are free",
        "outputs number for a name: names are free",
        "inputs number for a name: names are free",
    ),
    "vibration.accelerance": case(lambda z: call(z.values, z.omega), "receptance shape: any number of channels"),
    "vibration.mobility": case(lambda z: call(z.values, z.omega), "receptance shape: any number of channels"),
    "vibration.acceleration_gain": case(
        lambda z: call(3.0, 2.0), "* shape: numbers or arrays of them", "reference inf: a limit that exists"
    ),
    "vibration.gain_from_mobility": case(lambda z: call(0.5, 2.0, 3.0), "* shape: numbers or arrays of them"),
    "vibration.mobility_from_gain": case(
        lambda z: call(0.5, 2.0, 3.0), "* shape: numbers or arrays of them", "total_mass inf: a limit that exists"
    ),
    "vibration.generalised_stiffness": case(lambda z: call(2.0, 3.0), "* shape: numbers or arrays of them"),
    "vibration.superpose": case(lambda z: call(z.modes.shapes, z.x.T), "coordinates shape: any number of columns"),
    "vibration.base_load": case(lambda z: call(z.M, z.K[:, :1], z.x[:, :1])),
    "linear.block_matrices": case(lambda z: call(z.K, z.M, size=2)),
    "linear.check": case(
        lambda z: call(z.free_beam, np.zeros(3), 1e-6),
        "tolerance *: of a report",
        "system nan inside: LinearSystem refuses it before",
    ),
    "vibration.natural_modes": case(lambda z: call(K=z.K, M=z.M, num=2)),
    "vibration.complex_modes": case(lambda z: call(K=z.K, C=z.C, M=z.M), "* single: shapes have any phase"),
    "vibration.modal_damping": case(lambda z: call(K=z.K, M=z.M, ratios=np.full(4, 0.25))),
    "vibration.rayleigh_damping": case(lambda z: call(K=z.K, M=z.M, by_mass=0.5, by_stiffness=0.25)),
    "vibration.rayleigh_from_ratios": case(lambda z: call((1.0, 0.25), (2.0, 0.5))),
    "vibration.structural_damping": case(lambda z: call(z.K, 0.25), "* swapped: entry by entry"),
    "vibration.is_coupling_modes": case(
        lambda z: call(z.C), "C nan: yes, nothing comes apart", "C inf: likewise", "C complex: matrices may be"
    ),
    "vibration.damped_frequency": case(
        lambda z: call(2.0, 0.25), "* shape: numbers or arrays of them", "ratio inf: zero from critical damping on"
    ),
    "linear.constraint_modes": case(lambda z: call(z.K, (0,))),
    "linear.interface_basis": case(lambda z: call(z.K, (0,))),
    "linear.partition": case(lambda z: call(4, (0, 2)), "size huge: it is the size", "* integer: rows"),
    "vibration.dense_response": case(
        lambda z: call(K=z.K, M=z.M, C=z.C, load=z.M, omega=z.omega, out=z.x),
        f"omega shape: {ANY}",
        "load shape: any number of columns",
    ),
    "vibration.direct_response": case(
        lambda z: call(K=z.blocks[0], M=z.blocks[1], load=np.ones((4, 1)), omega=z.omega), f"omega shape: {ANY}"
    ),
    "vibration.receptance": case(
        lambda z: call(K=z.K, M=z.M, omega=z.omega, out=[0], into=[3], C=z.C), f"omega shape: {ANY}"
    ),
    "vibration.viscous_receptance": case(
        lambda z: call(K=z.K, M=z.M, C=z.C, omega=z.omega, out=[0], into=[3]), f"omega shape: {ANY}"
    ),
    "vibration.transmissibility": case(
        lambda z: call(K=z.K, M=z.M, omega=z.omega, base=(0,), out=(3,)), f"omega shape: {ANY}"
    ),
    "vibration.modal_receptance": case(
        lambda z: call(np.array([1.0, 2.0]), np.ones((1, 2)), np.ones((1, 2)), z.omega, 0.25, 2.0),
        f"omega shape: {ANY}",
        "natural inf: a limit that exists",
        "omega inf: likewise",
        "ratios inf: a limit that exists",
        "modal_masses inf: a limit that exists",
    ),
    "vibration.transfer_matrix": case(
        lambda z: call(K=z.K, M=z.M, s=1j * z.omega, C=z.C, out=z.x, into=z.M),
        f"s shape: {ANY}",
        "into shape: any loads",
    ),
    "vibration.modal_transfer_matrix": case(
        lambda z: call(z.complex_modes, 1j * z.omega, [0], [3]), f"s shape: {ANY}", "s inf: a limit that exists"
    ),
    "vibration.resonance_gains": case(
        lambda z: call(K=z.K, M=z.M, base=(0,), out=(3,), ratios=0.25), positive="ratios"
    ),
    "vibration.modal_motion": case(
        lambda z: call(np.array([1.0, 2.0]), 0.25, z.x[:, :2], 0.5, np.ones(2), np.ones(2)),
        "loads shape: refused",
        positive="step",
    ),
    "vibration.oscillations": case(
        lambda z: call(np.array([1.0, 4.0]), np.array([0.5, 0.25]), z.x[:, :2], 0.5, np.ones(2), np.ones(2)),
        positive="step",
    ),
    "vibration.modal_response": case(lambda z: call(K=z.K, M=z.M, load=z.x, step=0.5, ratios=0.25), positive="step"),
    "vibration.mac": case(
        lambda z: call(z.modes.shapes, z.modes.shapes, z.M),
        "* shape: any number of shapes",
        "first complex: of complex shapes, a real number",
        "second complex: likewise",
    ),
    "vibration.track_modes": case(lambda z: call(z.modes, z.modes, z.M)),
    "vibration.mode_ratios": case(lambda z: call(z.modes, 1)),
    "vibration.effective_masses": case(lambda z: call(z.modes, z.M, np.ones((4, 1))), "rigid shape: any directions"),
    "vibration.participation": case(lambda z: call(z.modes, z.M, np.ones((4, 1))), "rigid shape: any directions"),
    "vibration.lowest_modes": case(lambda z: call(_factor(z.long_blocks[0]), z.long_blocks[1], 2)),
    "linear.rigid_motions": case(lambda z: call(z.x[:, :3], np.array([1.0, 2.0, 3.0]))),
    "linear.static_response": case(lambda z: call(K=z.K, load=z.x)),
    "linear.equilibrium": case(lambda z: call(z.chain, {"b": 1.0}), "forces shape: any number of cases"),
    "vibration.modes": case(lambda z: call(z.chain, 2)),
    "vibration.frequency_response": case(
        lambda z: call(z.chain, z.omega, ["a"], ["d"], "direct", 0.25), f"omega shape: {ANY}"
    ),
    "vibration.harmonic_response": case(lambda z: call(z.chain, z.omega, {"a": 1.0}, 0.25), f"omega shape: {ANY}"),
    "vibration.simulate": case(
        lambda z: call(z.chain, (np.zeros(4), np.ones(4)), ts=z.ts, forces={"a": np.ones(3)}, rtol=1e-6, atol=1e-6),
        positive="rtol atol",
    ),
}


def _factor(matrix):
    return mbs.blocksparse.factor(matrix)
