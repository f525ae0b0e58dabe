"""The page `docs/catalogue.md` and its pictures, from the docstrings: `python docs/_ext/catalogue.py` writes them."""

import importlib
import inspect
import re
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

from drawings import JOINTS  # noqa: E402
from drawings_of_laws import LAWS  # noqa: E402
from drawings_of_structures import STRUCTURES  # noqa: E402
from pen import Pen  # noqa: E402

PAGE = HERE.parent / "catalogue.md"
PICTURES = HERE.parent / "images" / "catalogue"
DRAWINGS = {**JOINTS, **LAWS, **STRUCTURES}
#: A base class, or what is no choice of the user's.
LEFT_OUT = ("Abstract", "DIRECTIONS", "InternalState", "Node", "Reduced", "SymmetrySubspace", "VirtualMotions")
LEFT_OUT += ("Attachment", "BeamSection", "ElementBond", "Eyelet", "Margin", "PathKinematics", "Sheave")
LEFT_OUT += ("Winch", "WrapCylinder", "WrapSphere")

INTRODUCTION = """# Catalogue

Every joint, constraint, force law, signal, finite element and reduction, with the order of its coordinates, their
units and signs. The page is made from the docstrings of the classes. In the pictures grey is the parent, frame A or
the ground, blue the child or frame B, red what the coordinates or laws are.

SI units and radians throughout. [Sharp bits](start/sharp-bits.md) has the conventions of signs in one place,
[limits](limits.md) what is missing.
"""
SECTIONS = {
    "Joints": """`b.joint(name, kind, parent, child)`. A coordinate is the motion of the child's frame seen from the
parent's, and it is zero where the two agree. A joint that closes a loop is cut: it then has no coordinate, but the
rows listed here.""",
    "Constraints": """`b.constraint(name, law, between=(A, B))`, and `b.cable` that does not stretch; `Coupler` and
`PositionRows`, `VelocityRows` take no frames. Rows between frames are like those of a cut joint, and `reactions`
gives the load on frame B under the name of the constraint.""",
    "Force laws": """`b.force(name, law, joint=...)`, `between=(A, B)` or `on=frame`. A positive effort drives a
coordinate up, and pushes two points apart: the effort of a spring that is stretched is negative.""",
    "Signals": """Functions of time, for `drive=`, for targets and for values of loads. Any other function of time
serves as well; drives need two derivatives.""",
    "Finite elements": """Groups of a `fem.Structure`. Coordinates of a node are displacements x y z [m] and small
rotations rx ry rz [rad] in world axes, positive along the axes and right-handed about them. `fem.element_forces` and
`fem.element_stresses` return the columns listed here.""",
    "Reductions": """`reductions.reduce(system, method)`. Coordinates of the interface come first and keep their
names, so that components can be joined by them; `expand` leads back to all coordinates.""",
}


def chosen(room, keep):
    module = importlib.import_module(f"jaxmbs.{room}")
    things = {n: getattr(module, n) for n in sorted(module.__all__) if not n.startswith(LEFT_OUT)}
    return {n: t for n, t in things.items() if inspect.isclass(t) and keep(t)}


def sections():
    """Classes by name, by section."""
    from jaxmbs.forces import AbstractSignal, InextensibleCable
    from jaxmbs.joints import AbstractClosure, AbstractJoint

    is_joint = lambda t: issubclass(t, AbstractJoint) and not issubclass(t, AbstractClosure)  # noqa: E731
    return {
        "Joints": chosen("joints", is_joint),
        "Constraints": chosen("joints", lambda t: not is_joint(t))
        | chosen("forces", lambda t: t is InextensibleCable),
        "Force laws": chosen("forces", lambda t: not issubclass(t, AbstractSignal | InextensibleCable)),
        "Signals": chosen("forces", lambda t: issubclass(t, AbstractSignal)),
        "Finite elements": chosen("elements", lambda t: True),
        "Reductions": chosen("reductions", lambda t: True),
    }


def call(name, kind):
    """How it is made, with defaults and without types."""
    parameters = inspect.signature(kind).parameters.values()
    return f"{name}({', '.join(str(p.replace(annotation=p.empty)) for p in parameters)})"


def prose(kind):
    """The docstring as Markdown: attributes and arguments as a list, without the source of its equations."""
    text = re.sub(r"\s*Source: .*?(?=\n\n|\Z)", "", _whole(kind), flags=re.DOTALL)
    lines, inside = [], False
    for line in text.split("\n"):
        if re.match(r"(Args|Attributes):\s*$", line):
            inside = True
        elif inside and line.startswith("        "):
            lines[-1] += " " + line.strip()
        elif inside and line.startswith("    "):
            lines.append("- " + re.sub(r"^([\w, ]+): ", _named, line.strip()))
        else:
            inside = inside and not line
            lines.append(re.sub(r"^([+-]\S)", r"\\\1", line))  # no list where a sign begins a line
    return re.sub(r"(?<=\S)  +", " ", "\n".join(lines)).strip()


def _whole(kind):
    """The docstring, with the attributes of what it is derived from where it adds to them."""
    text = inspect.getdoc(kind)
    for base in kind.__mro__[1:]:
        above = inspect.getdoc(base) or ""
        if base.__name__ == "AbstractShell" and "Attributes:" in above:
            text = f"{text}\n\n{above[above.index('Attributes:') :]}"
    return text


def _named(found):
    return ", ".join(f"`{name}`" for name in found.group(1).split(", ")) + ": "


def facts(kind):
    """Lines that the class itself says: coordinates, rows, forces, stresses."""
    listed = lambda names: ", ".join(names) if names else "none"  # noqa: E731
    found = []
    if hasattr(kind, "nodes") and hasattr(kind, "labels"):
        freedoms = sum(3 if node.kind == "ball" else 1 for node in kind.nodes)
        if kind.labels or kind.__name__ == "Weld":
            found += [f"Freedoms: {freedoms}. Coordinates in order: {listed(kind.labels)}."]
            found += [f"Rows where it closes a loop, by unit: {listed(kind.row_units)}."] if kind.row_units else []
    if hasattr(kind, "num_nodes"):
        each = ("x", "y", "z", "rx", "ry", "rz")[: kind.coordinates if isinstance(kind.coordinates, int) else 6]
        found += [f"Nodes: {kind.num_nodes}. Coordinates of each in order: {listed(each)}."]
        found += [f"Forces in order: {listed(kind.force_labels)}."] if kind.force_labels else []
        found += [f"Stresses in order: {listed(kind.stress_labels)}."] if kind.stress_labels else []
    return "\n".join(f"- {line}" for line in found)


def page():
    """The text of the page."""
    parts = [INTRODUCTION]
    for title, kinds in sections().items():
        parts.append(f"## {title}\n\n{SECTIONS[title]}\n")
        for name, kind in kinds.items():
            picture = f"![{name}](images/catalogue/{name}.svg)"
            entry = [f"### {name}", picture, f"`{call(name, kind)}`", facts(kind), prose(kind)]
            parts.append("\n\n".join(part for part in entry if part) + "\n")
    parts.append("## Next\n\n- [A joint of your own](extend/joint.md), [a law](extend/law.md), [an element]"
                 "(extend/element.md), [a reduction](extend/reduction.md).\n- [Limits](limits.md).\n")  # fmt: skip
    return "\n".join(parts)


def drawn(name):
    """The picture of a class as SVG."""
    pen = Pen()
    DRAWINGS[name](pen)
    return pen.svg()


def main():
    PICTURES.mkdir(parents=True, exist_ok=True)
    for name in DRAWINGS:
        (PICTURES / f"{name}.svg").write_text(drawn(name), encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
