"""Faults of a declared model, found before anything is traced."""

import jax
import jax.numpy as jnp
import numpy as np

from ..checks import LARGEST, any_concrete, faults_if, in_range, is_concrete, list_faults, no_such, shape_of
from ..forces import (
    AbstractBodyLaw,
    AbstractPathLaw,
    AbstractPoseLaw,
    AbstractScalarLaw,
    AbstractSystemLaw,
)
from ..forces._path_ports import PathPort, WinchPort
from ..forces._ports import JointPort, LinePort, SystemPort, port_of
from ..forces._signals import Driven, as_signal
from ..joints import AbstractClosure, AbstractJoint, AbstractRows
from ..runtime import as_array, explain_error
from ._circuits import circuit_faults, with_circuits
from ._declarations import GROUND, Model, as_pose, has_one_coordinate, resolve_frame
from ._elastic import entry_faults
from ._friction import friction_faults
from ._law_faults import law_call_faults
from ._signals import block_faults, measure_faults


def model_faults(model: Model) -> list[str]:
    """Faults of a model, one sentence each."""
    bodies, frames, joints, faults = model.bodies, model.frames, model.joints, []
    if not bodies:
        faults.append("the model has no bodies")
    if model.gravity.shape != (3,):
        faults.append(f"gravity must be three numbers, got shape {model.gravity.shape}")
    if any_concrete(lambda g: ~np.isfinite(g), model.gravity):
        faults.append(f"gravity is not finite: {np.asarray(model.gravity)}")
    faults += _name_faults(model)
    for body in bodies.values():
        faults += body_faults(body)
    for frame in frames.values():
        if frame.body in frames:
            faults.append(
                f"frame {frame.name!r}: the frames that carry it form a circle; attach one of them to a body"
            )
        elif frame.body != GROUND and frame.body not in bodies:
            faults.append(f"frame {frame.name!r}: {no_such('body or frame', frame.body, [*bodies, *frames])}")
    for joint in joints.values():
        faults += joint_faults(joint, bodies, frames)
    for force in model.forces.values():
        faults += force_faults(force, bodies, frames, joints)
    for item in model.friction.values():
        faults += friction_faults(item, joints, model.friction)
    for item in model.constraints.values():
        faults += constraint_faults(item, bodies, frames, joints)
    for measure in model.measures.values():
        faults += measure_faults(measure, model, lambda where, end: _reference_faults(where, end, bodies, frames))
    return faults + (circuit_faults(model) or block_faults(with_circuits(model)))


def _name_faults(model):
    """Faults of duplicate or reserved names, which model files may have; the builder refuses them."""
    places = {"body": model.bodies, "frame": model.frames}
    faults = [f"{what} 'ground': the name is taken" for what, table in places.items() if GROUND in table]
    faults += [f"frame {name!r}: a body has this name" for name in model.frames if name in model.bodies]
    faults += [f"constraint {name!r}: a joint has this name" for name in model.constraints if name in model.joints]
    faults += [f"friction {name!r}: a force element has this name" for name in model.friction if name in model.forces]
    if "drives" in {**model.forces, **model.friction}:
        faults.append("force 'drives': this name is reserved for the work of driven joints; choose another")
    return faults


def cut_faults(model: Model, cut) -> list[str]:
    """Faults of the joints to cut, and of elastic bodies that the others then reach by a wrong interface."""
    faults = list_faults("cut", cut)
    faults = faults or [f"cut: {no_such('joint', name, model.joints)}" for name in cut if name not in model.joints]
    return faults + entry_faults(model.elastic, [j for name, j in model.joints.items() if name not in cut])


def guess_faults(model: Model, guess) -> list[str]:
    """Faults of guesses: unknown joints, values that are no finite numbers, traced values."""
    faults = [f"guess: {no_such('joint', name, model.joints)}" for name in guess if name not in model.joints]
    guesses = {name: joint.guess for name, joint in model.joints.items() if joint.guess is not None}
    for name, value in {**guesses, **guess}.items():
        if not is_concrete(value):
            faults.append(
                f"joint {name!r}: its guess is traced; it must be concrete: mobility is counted at a fixed pose"
            )
        elif not _is_finite(value):
            faults.append(f"joint {name!r}: its guess must be finite real numbers, got {value!r}")
    return faults


def _is_finite(value):
    try:
        return bool(np.all(np.isfinite(np.asarray(value, float)))) and not np.iscomplexobj(value)
    except (TypeError, ValueError):
        return False


def body_faults(body) -> list[str]:
    """Faults of the mass, centre of mass and inertia of one body."""
    return mass_faults(f"body {body.name!r}", body)


def mass_faults(where: str, body) -> list[str]:
    """Faults of an object with mass, com, inertia and `any_inertia`; where: the beginning of each message."""
    faults = []
    if np.shape(body.mass) != ():
        faults.append(f"{where}: mass must be one number, got shape {np.shape(body.mass)}")
    elif is_concrete(body.mass):
        mass = np.asarray(body.mass, float)
        if not in_range(mass) or mass < 0:
            faults.append(f"{where}: mass is {mass}; it must be finite and not negative")
    if shape_of(body.com) != (3,) or is_concrete(body.com) and not in_range(body.com):
        faults.append(f"{where}: com must be three finite numbers in body axes, got {body.com!r}")
    shape = shape_of(body.inertia)
    if shape not in ((), (3,), (3, 3)):
        return [*faults, f"{where}: inertia must be 0, three principal values or (3, 3), got shape {shape}"]
    return faults + (_inertia_faults(where, body) if is_concrete(body.inertia, body.mass) else [])


def _inertia_faults(where, body):
    matrix = np.asarray(body.inertia, float)  # on the host: many bodies, and constants inside a traced build
    matrix = matrix if matrix.ndim == 2 else np.diag(matrix * np.ones(3))
    if not in_range(matrix):
        return [f"{where}: inertia is not finite, or larger than {LARGEST:g}"]
    scale = max(np.abs(matrix).max(), 1e-300)
    # rounding of a rotation stays below 1e-9; a principal value of a rod may be 0, and a plate's third the sum of two
    if np.abs(matrix - matrix.T).max() > 1e-9 * scale:
        return [f"{where}: inertia is not symmetric"]
    a, b, c = np.linalg.eigvalsh(matrix)
    if a < -1e-9 * scale:
        return [f"{where}: inertia has the negative principal value {a:.6g}"]
    if a + b < c * (1 - 1e-6) and not body.any_inertia:
        return [
            f"{where}: principal inertias {a:.6g}, {b:.6g}, {c:.6g} break A + B >= C; "
            "is the inertia about the centre of mass, in body axes?"
        ]
    if c > 0 and np.asarray(body.mass).shape == () and float(body.mass) == 0.0 and not body.any_inertia:
        return [f"{where}: has inertia but no mass"]
    return []


def joint_faults(joint, bodies, frames) -> list[str]:
    """Faults of the names, frames and kind of one joint."""
    where, faults = f"joint {joint.name!r}", []
    if not isinstance(joint.kind, AbstractJoint) or isinstance(joint.kind, AbstractClosure):
        return [f"{where}: its kind must be a joint such as Revolute(axis='z'), got {joint.kind!r}"]
    ends = {"parent": joint.parent, "child": joint.child}
    wrong = [f for end, body in ends.items() for f in _end_faults(f"{where}, {end}", end, body, bodies, frames)]
    faults += wrong
    if not wrong and joint.parent == joint.child:
        faults.append(f"{where}: parent and child are both {joint.parent!r}")
    if not isinstance(joint.at, str):
        faults += _place_faults(f"{where}, at", joint.at)
    elif joint.at not in frames:
        faults.append(f"{where}, at: {no_such('frame', joint.at, frames)}")
    for end, frame, body in (
        ("parent_frame", joint.parent_frame, joint.parent),
        ("child_frame", joint.child_frame, joint.child),
    ):
        if not isinstance(frame, str):
            faults += _place_faults(f"{where}, {end}", frame)
        else:
            if frame not in frames:
                faults.append(f"{where}: {end} {frame!r} is not a frame; declare it with b.frame(...)")
            elif not wrong and frames[frame].body != body:
                faults.append(f"{where}: {end} {frame!r} lies on {frames[frame].body!r}, not on {body!r}")
    if joint.at is not None and (joint.parent_frame is not None or joint.child_frame is not None):
        faults.append(f"{where}: at= places both of its frames; give at= and two bodies, or a frame for each of them")
    for end in (f"{joint.name}.parent", f"{joint.name}.child"):
        if end in bodies or end in frames:
            faults.append(f"{'frame' if end in frames else 'body'} {end!r}: {where} names its own frame so")
    faults += [f"{where}: {fault}" for fault in joint.kind.faults()]
    if joint.drive is not None and not has_one_coordinate(joint):
        faults.append(f"{where}: only joints with one coordinate can be driven; split it into simple joints")
    return faults + ([] if joint.drive is None else [f"{where}: its drive: {f}" for f in _drive_faults(joint.drive)])


def _end_faults(where, end, body, bodies, frames):
    """Faults of an end of a joint, which is given by the name of a body or of a frame."""
    if isinstance(body, str) and (body == GROUND or body in bodies):
        return []
    if isinstance(body, str) and body in frames:
        return [
            f"{where}: {body!r} is a frame, which places it already: give the frame, or the body and {end}_frame="
        ]
    return _reference_faults(where, body, bodies, frames) or [
        f"{where}: {body!r} places it already: give that, or the body and {end}_frame="
    ]


def _drive_faults(drive):
    """Faults of a function of time: of its numbers, and those that one abstract call shows."""
    try:
        signal = as_signal(drive)
        shape = jax.eval_shape(lambda t: signal(t), jnp.zeros(())).shape
    except Exception as error:  # noqa: BLE001 - the user's own code
        return [f"it cannot be evaluated: {explain_error(error)}"]
    faults = signal.faults() if hasattr(signal, "faults") else []
    return faults + faults_if((shape not in ((), (1,)), f"it gives shape {shape}, not one number"))


def _place_faults(where, place):
    """Faults of a place: None, a point or a pose."""
    if place is None:
        return []
    try:
        return [f"{where}: {fault}" for fault in as_pose(place).faults()]
    except (TypeError, ValueError) as error:
        return [f"{where}: {error}"]


def _reference_faults(where, reference, bodies, frames):
    try:
        faults = resolve_frame(reference, bodies, frames)[1].faults()
    except KeyError as error:
        return [f"{where}: {no_such('body or frame', error.args[0], [GROUND, *bodies, *frames])}"]
    except (TypeError, ValueError):
        return [f"{where}: {reference!r} is not a body name, frame name, (body, point) or (body, Pose)"]
    return [f"{where}: {reference!r}: {fault}" for fault in faults]


def force_faults(force, bodies, frames, joints) -> list[str]:
    """Faults of the law, port and references of one force element."""
    where, law, faults = f"force {force.name!r}", force.law, []
    given = [p for p in ("between", "joint", "on") if getattr(force, p) is not None]
    if isinstance(law, AbstractScalarLaw):
        wanted = ("between", "joint")
    elif isinstance(law, (AbstractPoseLaw, AbstractPathLaw)):
        wanted = ("between",)
    elif isinstance(law, AbstractBodyLaw):
        wanted = ("on",)
    elif isinstance(law, AbstractSystemLaw):
        wanted = ()
    else:
        return [f"{where}: {law!r} is not a force law such as SpringDamper(...) or Force(...)"]
    if getattr(law, "drum_radius", None) is not None:
        if given != ["between", "joint"]:
            return [f"{where}: a cable on a drum takes between=... and joint=..., got {', '.join(given) or 'none'}"]
    elif (wanted and (len(given) != 1 or given[0] not in wanted)) or (not wanted and given):
        need = " or ".join(f"{w}=..." for w in wanted) or "no port"
        return [f"{where}: {type(law).__name__} takes {need}, got {', '.join(given) or 'none'}"]
    if force.joint is not None:
        if force.joint not in joints:
            faults.append(f"{where}: {no_such('joint', force.joint, joints)}")
        elif not has_one_coordinate(joints[force.joint]):
            faults.append(
                f"{where}: joint {force.joint!r} does not have exactly one coordinate; use a Bushing between frames"
            )
    references = force.between if force.between is not None else ([force.on] if force.on is not None else [])
    wanted_frames = law.num_frames if isinstance(law, AbstractPathLaw) else 2
    if force.between is not None and len(force.between) != wanted_frames:
        words = "two" if wanted_frames == 2 else str(wanted_frames)
        return [f"{where}: between= takes {words} frames, got {len(force.between)}"]
    for reference in references:
        faults += _reference_faults(where, reference, bodies, frames)
    if isinstance(law, AbstractPathLaw) and not faults:
        faults += _path_faults(where, [resolve_frame(reference, bodies, frames)[0] for reference in references])
    elif force.between is not None and not faults:
        first, second = (resolve_frame(reference, bodies, frames)[0] for reference in references)
        if first == second:
            faults.append(
                f"{where}: both frames are on {first!r}, so their distance is constant and the force has no "
                "effect; give frames on two "
                "bodies"
            )
        if hasattr(law, "length_faults"):
            faults += [f"{where}: {type(law).__name__} between two points: {fault}" for fault in law.length_faults()]
    return faults + [
        f"{where}: {fault}"
        for fault in law.faults() or _effort_faults(law, force.joint is not None and force.between is None)
    ]


def _path_faults(where, bodies):
    """Faults of the bodies of a law over several frames."""
    if len(set(bodies)) > 1:
        return []
    return [f"{where}: all its frames are on {bodies[0]!r}, so it has no effect; give frames on two bodies"]


def _effort_faults(law, on_joint) -> list[str]:
    """Faults that one abstract call of the law shows; laws of the whole system are called when its size is known."""
    port = JointPort() if on_joint else port_of(law)
    if port.num_flows is None:
        return []
    zero, place = as_array(0.0), (as_array(np.eye(3)), as_array(np.zeros(3)))
    displacement = {LinePort: place[1:], JointPort: (zero,)}.get(type(port), place)
    if isinstance(port, PathPort):
        displacement = tuple(jnp.stack([part] * port.num_frames) for part in place)
        if getattr(law, "drum_radius", None) is not None:
            port, displacement = WinchPort(port.num_frames), (*displacement, zero)
    return law_call_faults(law, port, displacement, port.num_flows)


def system_law_faults(forces, topology) -> list[str]:
    """Faults that one abstract call of every law of the whole system shows."""
    laws = [force for force in forces if isinstance(force.law, AbstractSystemLaw)]
    laws = [force for force in laws if not any(isinstance(getattr(force.law, f), Driven) for f in force.law.inputs)]

    def faults_of(law):
        place = (jnp.zeros(topology.num_coordinates),)
        return law_call_faults(law, SystemPort(), place, topology.num_velocities)

    return [f"force {force.name!r}: {fault}" for force in laws for fault in faults_of(force.law)]


def constraint_faults(item, bodies, frames, joints) -> list[str]:
    """Faults of the law and references of one constraint."""
    where, law = f"constraint {item.name!r}", item.law
    if isinstance(law, AbstractClosure):
        if item.between is None or len(item.between) != 2:
            return [f"{where}: {type(law).__name__} takes between=(frame, frame)"]
        faults = [f for reference in item.between for f in _reference_faults(where, reference, bodies, frames)]
    elif isinstance(law, AbstractRows):
        if law.is_nonholonomic and (law.num_frames or law.joints or not law.reads_all):
            kind = type(law).__name__
            return [f"{where}: {kind} restricts velocities alone, so it has reads_all = True and no frames or joints"]
        if law.num_frames and (item.between is None or len(item.between) != law.num_frames):
            return [f"{where}: {type(law).__name__} takes between= {law.num_frames} frames"]
        faults = [f"{where}: {no_such('joint', name, joints)}" for name in law.joints if name not in joints]
        faults += [
            f"{where}: joint {name!r} does not have exactly one coordinate"
            for name in law.joints
            if name in joints and not has_one_coordinate(joints[name])
        ]
        places = item.between if law.num_frames else ()
        faults += [f for reference in places for f in _reference_faults(where, reference, bodies, frames)]
        if places and not faults:
            faults = _path_faults(where, [resolve_frame(reference, bodies, frames)[0] for reference in places])
    else:
        return [f"{where}: {law!r} is not a constraint such as Distance(...), Coupler(...) or PositionRows(...)"]
    return faults + [f"{where}: {fault}" for fault in law.faults()]
