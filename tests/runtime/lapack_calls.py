"""Which LAPACK calls a program contains and how many matrices each is given; small questions to the library."""

import re

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

import jaxmbs as mbs
from jaxmbs import blocksparse as bs
from jaxmbs import reductions, vibration
from jaxmbs.coupling._regularised_inverse import regularised_inverse
from jaxmbs.linear._static_response import static_response
from jaxmbs.math import _square as square
from jaxmbs.math._interpolation import spline_slopes
from jaxmbs.vibration._damping import complex_modes
from jaxmbs.vibration._lanczos import lowest_modes
from jaxmbs.vibration._modal_equations import modal_motion
from jaxmbs.vibration._mode_shapes import track_modes
from jaxmbs.vibration._modes import natural_modes
from tests.structural_matrices import beam, component
from tests.zoo.mechanisms import four_bar, four_bar_state

_CALL = re.compile(r"custom_call @(?:lapack|blas)_([a-z0-9]+?)(?:_ffi)?\(.*?\) .*?: \((.*?)\) ->")
_COMPILED = re.compile(r"= \(?([^=]*?) custom-call\(.*?custom_call_target=\"(?:lapack|blas)_([a-z0-9]+?)(?:_ffi)?\"")

SOLVE, DEFINITE = {"getrf", "trsm"}, {"potrf", "trsm"}
VALUES = DEFINITE | {"syevd"}
GENERAL = {"geev", "gesdd"}


def lapack_calls(text):
    """Pairs (routine without its letter of precision, most matrices in one argument) of a lowered program."""
    return [
        (name[1:], max(_matrices(shape) for shape in re.findall(r"tensor<([0-9x]*)x[a-z]", types)))
        for name, types in _CALL.findall(text)
    ]


def compiled_calls(text):
    """The same of a compiled program, from what each call returns."""
    return [
        (name[1:], max(_matrices(shape.replace(",", "x")) for shape in re.findall(r"\[([0-9,]+)\]", types)))
        for types, name in _COMPILED.findall(text)
    ]


def _matrices(shape):
    return int(np.prod([int(n) for n in shape.split("x")][:-2]))


SYSTEM = four_bar()
STATE = four_bar_state(SYSTEM)
K, M = beam(8)
C = 0.01 * K + 0.02 * M
LARGE, LARGE_MASS = beam(20, fixed=2)
OMEGA = jnp.linspace(1.0, 9.0, 5)
PATTERN = bs.Pattern(6, 3, [(i, i + 1) for i in range(5)])


PAIR = {"omega": OMEGA, "out": (0,), "into": (0,)}


def reduced(method, t, interface=(0, 1)):
    return reductions.reduce(component(K * (1.0 + t), M, interface), method)


def at(t):
    """The four-bar a little displaced by t."""
    return mbs.State(STATE.t, STATE.coordinates * (1.0 + 1e-3 * t), STATE.velocities)


def motion(t, **options):
    return mbs.simulate(SYSTEM, at(t), t1=0.1, throw=False, **options)


def block_matrix(t):
    blocks = jnp.broadcast_to((4.0 + t) * jnp.eye(3), (6, 3, 3))
    return bs.BlockMatrix(PATTERN, blocks, jnp.broadcast_to(-jnp.eye(3), (5, 3, 3)))


def block_modes(t):
    return lowest_modes(bs.factor(block_matrix(t)), block_matrix(0.0), 2)


def measured(t):
    Z = jax.vmap(lambda w: K + 1.0 - (w**2) * M)(OMEGA)[:, :4, :4] * (1.0 + t)
    return Z.astype(complex)


#: The run path of mechanisms: no LAPACK at all.
WITHOUT = {
    "State.at": lambda t: mbs.State.at(SYSTEM, main=0.5 + t, guess={"knee": 0.1, "base": 1.4}),
    "forward_dynamics": lambda t: mbs.forward_dynamics(SYSTEM, at(t)),
    "inverse_dynamics": lambda t: mbs.inverse_dynamics(SYSTEM, at(t), jnp.ones_like(STATE.velocities)),
    "mass_matrix": lambda t: mbs.mass_matrix(SYSTEM, at(t)),
    "reactions": lambda t: mbs.reactions(SYSTEM, at(t)),
    "stiffness": lambda t: mbs.stiffness(SYSTEM, at(t)),
    "kic": lambda t: mbs.constraints.kic(SYSTEM, at(t)),
    "simulate": motion,
    "simulate, implicit": lambda t: motion(t, solver=diffrax.Kvaerno5()),
    "simulate, Gauss": lambda t: motion(t, solver=mbs.ode.Gauss4(newton=True), dt=0.05),
    "linearise": lambda t: mbs.linearise(SYSTEM, at(t), inputs=("main",), outputs=("main",)),
    "modal_motion": lambda t: modal_motion(jnp.arange(1.0, 4.0) + t, 0.01, jnp.ones((5, 3)), 0.1),
    "spline": lambda t: spline_slopes(jnp.arange(5.0), jnp.sin(jnp.arange(5.0) * t)),
    "block factors": lambda t: bs.solve_once(block_matrix(t), jnp.ones((6, 3))),
    "block ldl": lambda t: bs.log_determinant(bs.factor(block_matrix(t), "ldl")),
    "block lu": lambda t: bs.solve_once(block_matrix(t), jnp.ones((6, 3)), "lu"),
    "dense_response": lambda t: vibration.dense_response(
        K=K, M=(1.0 + t) * M, load=jnp.ones((18, 1)), omega=OMEGA, C=C
    ),
    "measured_stiffness": lambda t: jax.vmap(square.inverse)(measured(t)),
}

#: What else may call LAPACK, one matrix at a time.
WITH = {
    "equilibrium": (lambda t: mbs.equilibrium(SYSTEM, at(t), throw=False), {"syevd"}),
    "modes": (lambda t: mbs.modes(mbs.linearise(SYSTEM, at(t))), GENERAL),
    "natural_modes": (lambda t: natural_modes(K=K, M=M * (1.0 + t)), VALUES),
    "track": (
        lambda t: track_modes(natural_modes(K=K, M=M), natural_modes(K=K, M=M * (1.0 + t))),
        VALUES | {"gesdd"},
    ),
    "complex_modes": (lambda t: complex_modes(K=K, C=C, M=M * (1.0 + t)), GENERAL),
    "static_response": (lambda t: static_response(K=LARGE * (1.0 + t), load=jnp.ones(len(LARGE))), SOLVE),
    "block modes": (block_modes, {"syevd"}),
    "inertia": (lambda t: bs.matrix_inertia(bs.factor(block_matrix(t), "ldl")), {"syevd"}),
    "guyan": (lambda t: reduced(reductions.Guyan(), t, (0, 1, 16, 17)), DEFINITE),
    "craig_bampton": (
        lambda t: reduced(reductions.CraigBampton(4), t),
        VALUES,
    ),
    "rubin": (
        lambda t: reduced(reductions.Rubin(4, num_rigid=2), t),
        VALUES | SOLVE,
    ),
    "craig_chang": (
        lambda t: reductions.reduce(
            component(K * (1.0 + t), M, (0, 1)), reductions.CraigChang(4, determinate=(0, 1))
        ),
        VALUES | SOLVE,
    ),
    "receptance": (lambda t: vibration.receptance(K=K * (1.0 + t), M=M, **PAIR), VALUES),
    "viscous_receptance": (
        lambda t: vibration.viscous_receptance(K=K * (1.0 + t), M=M, omega=OMEGA, out=(0,), into=(0,), C=C),
        GENERAL,
    ),
    "regular_inverse": (lambda t: regularised_inverse(measured(t), rank=2), {"gesdd"}),
    "gradient of natural_modes": (
        jax.grad(lambda t: jnp.sum(natural_modes(K=LARGE, M=LARGE_MASS * (1.0 + t)).values)),
        VALUES,
    ),
    "gradient of static_response": (
        jax.grad(lambda t: jnp.sum(static_response(K=LARGE * (1.0 + t), load=jnp.ones(len(LARGE))).displacement)),
        SOLVE,
    ),
}

#: Slow to trace: asked in a batch only, where the same calls are.
HEAVY = {"stiffness", "simulate", "simulate, implicit", "simulate, Gauss", "linearise", "equilibrium", "modes"}
