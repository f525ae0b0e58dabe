"""Text that describes a system, for `system.describe()` and notebooks."""

from ..tables import Rows, aligned, as_html
from ._rows import coupled_names, row_elements

_MOST_NAMES = 12  # of a line
COMPONENTS = ("force x", "force y", "force z", "moment x", "moment y", "moment z")


def _joint_rows(topology):
    bodies = ("ground", *topology.body_names)
    for index, joint in enumerate(topology.joints):
        undetermined = topology.analysis.undetermined[index] if topology.analysis else ()
        marks = [name for name, mark in zip(COMPONENTS, undetermined, strict=False) if mark]
        yield (
            joint.name,
            joint.kind,
            f"{bodies[joint.parent + 1]} -> {bodies[joint.child + 1]}",
            "closes a loop" if joint.is_cut else ", ".join(joint.labels) or "-",
            ", ".join(marks) or "-",
        )


def _heading_lines(topology):
    lines = [
        f"{len(topology.body_names)} bodies, {len(topology.joints)} joints, "
        f"{len(topology.cut_joints)} loops, {topology.num_rows} constraint rows"
    ]
    lines.append(f"mobility: {topology.mobility} (tree velocities {topology.num_velocities})")
    if topology.linear_solver != "dense":
        lines.append(f"linear solver: {topology.linear_solver}")
    found = topology.analysis
    if found is not None and topology.slip_rows:
        lines.append(f"freedoms of position: {len(found.independent_positions)} (rolling restricts velocities only)")
    if found is not None and found.redundant:
        lines.append(
            f"redundant constraints: {found.redundant}; statics does not determine all reactions of: "
            + ", ".join(found.redundant_names)
        )
    if topology.internal:
        states = (f"{one.name} [{one.unit}]" if one.unit else one.name for one in topology.internal)
        lines.append(f"internal states: {', '.join(states)}")
    return lines


def _coupler_lines(topology, rows):
    """Lines on couplers, one for each that connects several joints."""
    tied = {row.name: coupled_names(topology, row.columns) for row in row_elements(rows) if row.columns}
    return [
        f"{name} couples coordinates: reactions of {', '.join(joints)} do not include its contact forces"
        for name, joints in tied.items()
        if joints
    ]


def part_lines(system) -> list[str]:
    """Lines with the names of what acts on the bodies of a system: force elements, friction, oil, blocks."""
    top, friction = system.topology, system.friction
    oil = tuple(record.name for record in top.circuits)
    rubs = () if friction is None else zip(friction.names, friction.joints, strict=True)
    parts = {
        "force elements": [name for group in system.forces for name in group.names],
        "friction": list(dict.fromkeys(f"{name} in {top.joints[j].name}" for name, j in rubs)),
        "hydraulics": oil,
        "measures": [name for group in system.measures for name in group.names],
        "blocks": [name for group in system.blocks for name in group.names if name not in oil],
    }
    return [f"{what}: {_listed(names)}" for what, names in parts.items() if names]


def _listed(names):
    more = len(names) - _MOST_NAMES
    return ", ".join([*names[:_MOST_NAMES], *([f"{more} more"] if more > 0 else [])])


_HEAD = ("joint", "kind", "parent -> child", "coordinates", "undetermined reactions")


def summary(topology) -> str:
    """One line with the number of bodies, joints and freedoms."""
    return f"{_heading_lines(topology)[0]}, mobility {topology.mobility}"


def describe(topology, built=None, rows=(), more=()) -> str:
    """Bodies, joints, loops, mobility and redundancy of a topology, as aligned text.

    Args: built: the `Mobility` of its build, where the topology has that of a state; rows: of couplers and drives;
    more: lines after the heading.
    """
    lines = _heading_lines(topology) + _coupler_lines(topology, rows)
    if built is not None and built.mobility != topology.mobility:
        lines[1] += f" at this state, {built.mobility} at the pose of the build"
    return "\n".join([*lines, *more, "", aligned([_HEAD, *_joint_rows(topology)], left=len(_HEAD))])


def describe_parts(topology, rows=(), more=()) -> tuple[list[str], Rows]:
    """Lines, and head and rows of the table of joints."""
    return [*_heading_lines(topology), *_coupler_lines(topology, rows), *more], [_HEAD, *_joint_rows(topology)]


def describe_html(topology, rows=(), more=()) -> str:
    """Description of a topology as an HTML table, for notebooks."""
    return as_html(*describe_parts(topology, rows, more))
