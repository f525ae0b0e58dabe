"""What is annotated as any array takes NumPy's as it takes JAX's: the same answers from both."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import experiment, linear, reductions, vibration

K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
M, C, OMEGA, X = np.eye(3), 0.01 * K, np.array([0.3, 2.5]), np.arange(12.0).reshape(4, 3)
WHOLE = linear.LinearSystem(mass=M, stiffness=K, damping=C, interface=[0])
POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]])

CALLS = {
    "natural_modes": lambda K, M, C, w, x: vibration.natural_modes(K=K, M=M).values,
    "complex_modes": lambda K, M, C, w, x: vibration.complex_modes(K=K, C=C, M=M).values,
    "modal": lambda K, M, C, w, x: vibration.modal_damping(K=K, M=M, ratios=[0.01, 0.02, 0.03]),
    "structural": lambda K, M, C, w, x: vibration.structural_damping(K, 0.1),
    "damped_frequency": lambda K, M, C, w, x: vibration.damped_frequency(w, 0.1 * w),
    "dense_response": lambda K, M, C, w, x: vibration.dense_response(K=K, M=M, C=C, load=M, omega=w, out=x),
    "receptance": lambda K, M, C, w, x: vibration.receptance(K=K, M=M, C=C, omega=w, out=x, into=[2]),
    "transmissibility": lambda K, M, C, w, x: vibration.transmissibility(K=K, M=M, omega=w, base=(0,), out=(2,)),
    "mac": lambda K, M, C, w, x: vibration.mac(K, C + M, M),
    "modal_motion": lambda K, M, C, w, x: vibration.modal_motion(w, 0.1, x[:, :2], 0.1, w, w).velocity,
    "base_load": lambda K, M, C, w, x: vibration.base_load(M, K[:, :1], x[:, :1]),
    "static_response": lambda K, M, C, w, x: linear.static_response(K=K, load=x).displacement,
    "rigid_motions": lambda K, M, C, w, x: linear.rigid_motions(x, [1.0, 2.0, 3.0]),
    "interface_basis": lambda K, M, C, w, x: linear.interface_basis(K, np.array([0])),
    "mobility": lambda K, M, C, w, x: vibration.mobility(x[:2, :1, None].astype(complex), w),
    "mode_acceleration": lambda K, M, C, w, x: reductions.mode_acceleration(WHOLE, x, 2 * x, 3 * x, x),
    "interface_forces": lambda K, M, C, w, x: reductions.interface_forces(WHOLE, x, 2 * x, 3 * x, x),
    "harmonic": lambda K, M, C, w, x: reductions.harmonic_amplitudes(x[:2].astype(complex), w)[2],
    "element_loads": lambda K, M, C, w, x: reductions.element_loads(K, C, x),
    "averaged_motion": lambda K, M, C, w, x: reductions.averaged_motion(POINTS, (0.0, 0.0, 0.0), K[0] + 2, False),
    "on_interface": lambda K, M, C, w, x: reductions.transform_interface(WHOLE, M[:, ::-1], 1).mass,
    "kic_rate": lambda K, M, C, w, x: mbs.constraints.kic_rate(x[:1, :, None], w[:1]),
    "inertia.box": lambda K, M, C, w, x: mbs.inertia.box(2.0, x[1]),
    "inertia.rotate": lambda K, M, C, w, x: mbs.inertia.rotate(M + 1.0, M),
    "swept_amplitudes": lambda K, M, C, w, x: experiment.sweep_amplitudes(
        x.T.repeat(9, 1), x[:, 0].repeat(9), [15], 9
    ),
}


LONG = ("transmissibility", "modal_motion", "receptance", "swept_amplitudes", "dense_response", "complex_modes")


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.long) if n in LONG else n for n in CALLS])
def test_answers_of_both_kinds_of_arrays(name):
    given = K, M, C, OMEGA, X
    found, expected = CALLS[name](*given), CALLS[name](*map(jnp.asarray, given))
    assert found.dtype == expected.dtype and isinstance(expected, jax.Array)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-14)
