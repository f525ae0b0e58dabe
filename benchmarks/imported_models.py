"""Public robots read from URDF and MJCF beside Pinocchio and MuJoCo: errors of masses, bias, poses; what was left.

The URDF files are those of example-robot-data, the MJCF files those of dm_control's suite; those with loops are of
MuJoCo's Playground and MJX (`pip install --no-deps playground mujoco-mjx`), beside their constraints held exactly.
Where MuJoCo refuses the inertias of a URDF only Pinocchio is asked.

`--gallery FOLDER ...` reads every MJCF below folders, such as clones of mujoco_menagerie or of MuJoCo itself: a row
for each with its largest error beside MuJoCo, what was left out, and counts.  Controls, activations and states
the initial pose are random; contacts, limits and equalities are off in both.
"""

import collections
import sys
import tempfile
from pathlib import Path

import common
import mujoco
import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))
import jaxmbs as mbs  # noqa: E402
from jaxmbs.io.robots._mjcf_text import mjcf_text  # noqa: E402
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
    parser = common.parser(__doc__, *URDF, *MJCF, *LOOPS)
    parser.add_argument("--gallery", nargs="+", default=(), metavar="FOLDER", help="read every MJCF below folders")
    options = parser.parse_args()
    if options.gallery:
        common.report(gallery_rows(options.gallery), options)
        return
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
    read = mbs.io.read_mjcf(path)
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
        read = mbs.io.read_mjcf(file.name)
    errors = against_hard_constraint(read, mujoco_without_meshes(text), q, v, {})
    return [*_sizes(name, read), *_errors(name, errors, "mujoco", "1e-8")]


def gallery_rows(folders):
    """Rows of all MJCF below folders that have a body, and how many were read, equal and refused."""
    rows, counts = [], collections.Counter()
    for folder in map(Path, folders):
        for path in sorted(folder.rglob("*.xml")):
            if (found := _gallery_row(f"{folder.name}/{path.relative_to(folder)}", path)) is not None:
                counts[found[0]] += 1
                print(found[1].case, found[0], found[1].value, file=sys.stderr, flush=True)
                rows.append(found[1])
    return rows + [common.row("all", what, number) for what, number in counts.items()]


def _gallery_row(name, path):
    """(outcome, row) of one file; None of a file without a model of its own."""
    try:
        model = _compiled(path)
    except (mbs.ModelFileError, ValueError) as error:
        text = path.read_text(errors="replace")
        if "<mujoco" not in text or "<worldbody" not in text or "<body" not in text:
            return None
        return "refused", common.row(name, "refused", 1, " ".join(str(error).split())[:200])
    if model.nv == 0:
        return None
    random = np.random.default_rng(0)
    controls = {model.actuator(a).name: random.normal() for a in range(len(model.actuator_trntype))}
    controls = {key: value for key, value in controls.items() if key}
    try:
        read = mbs.io.read_mjcf(path)
        read = mbs.io.read_mjcf(path, controls={key: controls[key] for key in controls if key in _forces(read)})
        errors = against_mujoco(read, model, seeds=(0, 1), controls=controls, spread=0.05)
    except (mbs.ModelError, mbs.ModelFileError) as error:
        return "refused", common.row(name, "refused", 1, "; ".join(error.faults)[:300])
    worst = max(errors.values())
    left = "; ".join(read.dropped)
    return "equal to 1e-9" if worst < 1e-9 else "differs", common.row(name, "error", worst, left, goal="1e-9")


def _forces(read):
    return read.builder.declared.forces


def _compiled(path):
    """MuJoCo's own model of a file; of one whose meshes are elsewhere that of the text which is read."""
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError:
        text = mjcf_text(path, "read")
        return mujoco.MjModel.from_xml_string(text.xml, text.assets)


def _sizes(name, read):
    declared = read.builder.declared
    for what in ("bodies", "joints", "constraints", "forces", "frames"):
        yield common.row(name, what, len(getattr(declared, what)))
    yield common.row(name, "left out", len(read.dropped), "; ".join(read.dropped))


def _errors(name, errors, peer, goal="1e-9"):
    return [common.row(name, f"{what} error beside {peer}", value, goal=goal) for what, value in errors.items()]


if __name__ == "__main__":
    main()
