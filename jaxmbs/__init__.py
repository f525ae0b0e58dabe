"""jaxmbs: differentiable multibody and structural dynamics.  A `System` is a pytree; functions question it."""

from typing import TYPE_CHECKING

from .arguments import explain_arguments, surround_calls
from .lazy import import_when_asked
from .runtime import public_call, warn_of_wrong_release

__version__ = "0.5.0"

if TYPE_CHECKING:
    from . import (
        adapters,
        analysis,
        assembly,
        batching,
        blocks,
        blocksparse,
        bondgraph,
        constraints,
        contact,
        coupling,
        cycles,
        design,
        documents,
        dynamics,
        elements,
        engines,
        experiment,
        fatigue,
        fem,
        flexible,
        forces,
        friction,
        hydraulics,
        identification,
        io,
        joints,
        kinematics,
        linear,
        model,
        motion,
        ode,
        probability,
        qualification,
        reaction,
        reductions,
        rotors,
        runtime,
        signal_flow,
        statics,
        studies,
        vehicles,
        vibration,
        viz,
    )
    from .adapters import as_block
    from .adapters.fmi import Fmu, export_fmu
    from .analysis import linearise, stiffness
    from .assembly import State
    from .batching import batch
    from .builder import SystemBuilder
    from .cycles import periodic
    from .design import Limit, minimise
    from .documents import report
    from .dynamics import forward_dynamics, mass_matrix
    from .errors import AssemblyError, BatchError, ModelError, ModelFileError, SimulationError, UnknownNameError
    from .forces import (
        PD,
        Actuator,
        BumpStop,
        Bushing,
        CoulombFriction,
        Force,
        Harmonic,
        Ramp,
        Spline,
        SpringDamper,
        Step,
        Table,
        Torque,
    )
    from .identification import identify
    from .io import load_model, save_model
    from .joints import Coupler, Cylindrical, Free, Planar, Prismatic, Revolute, Screw, Spherical, Universal, Weld
    from .kinematics import position, rotation, velocity
    from .linear import LinearSystem
    from .model import Pose, System, inertia, rotations
    from .motion import Motion, vector_field
    from .qualification import shock_spectrum
    from .reaction import inverse_dynamics
    from .runtime import cache
    from .runtime import user_jit as jit
    from .signal_flow import signals
    from .status import Status
    from .studies import sweep
    from .verbs import check, equilibrium, frequency_response, modes, random_response, reactions, simulate

__all__ = [
    "Actuator",
    "AssemblyError",
    "BatchError",
    "BumpStop",
    "Bushing",
    "CoulombFriction",
    "Coupler",
    "Cylindrical",
    "Fmu",
    "Force",
    "Free",
    "Harmonic",
    "Limit",
    "LinearSystem",
    "ModelError",
    "ModelFileError",
    "Motion",
    "PD",
    "Planar",
    "Pose",
    "Prismatic",
    "Ramp",
    "Revolute",
    "Screw",
    "SimulationError",
    "Spherical",
    "Spline",
    "SpringDamper",
    "State",
    "Status",
    "Step",
    "System",
    "SystemBuilder",
    "Table",
    "Torque",
    "Universal",
    "UnknownNameError",
    "Weld",
    "adapters",
    "analysis",
    "as_block",
    "assembly",
    "batch",
    "batching",
    "blocks",
    "blocksparse",
    "bondgraph",
    "cache",
    "check",
    "constraints",
    "contact",
    "coupling",
    "cycles",
    "design",
    "documents",
    "dynamics",
    "elements",
    "engines",
    "equilibrium",
    "experiment",
    "export_fmu",
    "fatigue",
    "fem",
    "flexible",
    "forces",
    "forward_dynamics",
    "frequency_response",
    "friction",
    "hydraulics",
    "identification",
    "identify",
    "inertia",
    "inverse_dynamics",
    "io",
    "jit",
    "joints",
    "kinematics",
    "linear",
    "linearise",
    "load_model",
    "mass_matrix",
    "minimise",
    "model",
    "modes",
    "motion",
    "ode",
    "periodic",
    "position",
    "probability",
    "qualification",
    "random_response",
    "reaction",
    "reactions",
    "reductions",
    "report",
    "rotation",
    "rotations",
    "rotors",
    "runtime",
    "save_model",
    "shock_spectrum",
    "signal_flow",
    "signals",
    "simulate",
    "statics",
    "stiffness",
    "studies",
    "sweep",
    "vector_field",
    "vehicles",
    "velocity",
    "vibration",
    "viz",
]

warn_of_wrong_release()
surround_calls(public_call)
import_when_asked(__name__, explain_arguments)
