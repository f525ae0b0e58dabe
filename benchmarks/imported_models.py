"""Public robots read from URDF and MJCF beside Pinocchio and MuJoCo: errors of masses, bias, poses; what was left.

The URDF files are those of example-robot-data, the MJCF files those of dm_control's suite; those with loops are of
MuJoCo's Playground and MJX (`pip install --no-deps playground mujoco-mjx`), beside their constraints held exactly.
Where MuJoCo refuses the inertias of a URDF only Pinocchio is asked.
"""

import sys
import tempfile
from pathlib import Path

import common
import mujoco

sys.path.insert(0, str(Path(__file__).parent.parent))
import jaxmbs as mbs  # noqa: E402
from tests.io.compared import (
    against_hard_constraint,
    against_mujoco,
    against_pinocchio,
    mujoco_of_urdf,
    mujoco_without_meshes,
)  # noqa: E402
from tests.io.public_models import LOOPS, MJCF, URDF, looped_text, public_models  # noqa: E402

QUICK = ("double_pendulum_simple", "pendulum")


def main() -> None:
    options = common.parser(__doc__, *URDF, *MJCF, *LOOPS).parse_args()
    rows = []
    for name, path in public_models().items():
        if common.wanted(options, name) and (name in QUICK or not options.quick):
            rows += _judged(name, urdf_rows if path.suffix == ".urdf" else mjcf_rows, path)
    for name in LOOPS:
        if common.wanted(options, name) and looped_text(name) is not None and not options.quick:
            rows += looped_rows(name)
    common.report(rows, options)


def _judged(name, rows, path):
    """The rows of a model; of one that is refused what is wrong with it."""
    try:
        return rows(name, path)
    except mbs.ModelError as error:
        return [common.row(name, "refused", len(error.faults), "; ".join(error.faults))]


def urdf_rows(name, path):
    """Errors beside MuJoCo, where it takes the file, and Pinocchio, whose bias has no dampers."""
    read, model = mbs.io.read_urdf(path), mujoco_of_urdf(path)
    rows = [*_sizes(name, read)]
    rows += _errors(name, against_mujoco(read, model), "mujoco") if model is not None else []
    read.builder.declared.forces.clear()
    return rows + _errors(name, against_pinocchio(read, path), "pinocchio")


def mjcf_rows(name, path):
    """Errors beside MuJoCo, with springs, dampers and actuators."""
    read = mbs.io.read_mjcf(path, tendons="drop")
    return [
        *_sizes(name, read),
        *_errors(name, against_mujoco(read, mujoco.MjModel.from_xml_path(str(path))), "mujoco"),
    ]


def looped_rows(name):
    """How well the loops close, and errors of accelerations."""
    text, (*_, q, v, _) = looped_text(name), LOOPS[name]
    with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
        file.write(text)
        file.flush()
        read = mbs.io.read_mjcf(file.name, tendons="drop")
    errors = against_hard_constraint(read, mujoco_without_meshes(text), q, v, {})
    return [*_sizes(name, read), *_errors(name, errors, "mujoco", "1e-8")]


def _sizes(name, read):
    declared = read.builder.declared
    for what in ("bodies", "joints", "constraints", "forces", "frames"):
        yield common.row(name, what, len(getattr(declared, what)))
    yield common.row(name, "left out", len(read.dropped), "; ".join(read.dropped))


def _errors(name, errors, peer, goal="1e-9"):
    return [common.row(name, f"{what} error beside {peer}", value, goal=goal) for what, value in errors.items()]


if __name__ == "__main__":
    main()
