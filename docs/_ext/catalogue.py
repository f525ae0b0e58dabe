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
#: What is no choice of the user's: results, bases and what declarations make.
LEFT_OUT = {"Arrows", "DIRECTIONS", "ElementBond", "InternalState", "Margin", "Node", "PathKinematics", "PointLoads"}
LEFT_OUT |= {"Reading", "Reduced", "SymmetrySubspace", "Touch", "VirtualMotions"}

INTRODUCTION = """# Catalogue

Every kind of thing that a model is made of, with its module, the order of its coordinates, their units and signs. The
page is made from the docstrings of the classes. In the pictures grey is the parent, frame A or the ground, blue the
child or frame B, red what the coordinates or laws are. The most used names are in `jaxmbs` itself too:
`mbs.Revolute` is `jaxmbs.joints.Revolute`.

SI units and radians throughout. [Sharp bits](start/sharp-bits.md) has the conventions of signs in one place,
[limits](limits.md) what is missing.
"""
NEXT = """## Next

- [Cookbook](cookbook.md): eight machines in a few lines each.
- [Limits](limits.md).
"""
SECTIONS = {
    "Joints": """
`b.joint(name, kind, parent, child)`. A coordinate is the motion of the child's frame seen from the parent's, and
it is zero where the two agree. A joint that closes a loop is cut: it then has no coordinate, but the rows listed
here. Of your own: [a joint](extend/joint.md).""",
    "Constraint rows": """
`b.constraint(name, law, between=(A, B))`, and `b.cable` that does not stretch; `Coupler` and `PositionRows`,
`VelocityRows` take no frames. Rows between frames are like those of a cut joint, and `reactions` gives the load
on frame B under the name of the constraint. Of your own: [a row](extend/row.md), over
`jaxmbs.joints.AbstractRows`.""",
    "Force laws": """
`b.force(name, law, joint=...)`, `between=(A, B)` or `on=frame`. A positive effort drives a coordinate up, and
pushes two points apart: the effort of a spring that is stretched is negative. Of your own: [a
law](extend/law.md).""",
    "Parts of cables and beams": """
`b.cable(name, elements, ...)` takes the elements in the order in which the [cable](guide/cables.md) passes them;
`b.beam` takes a section and makes a chain of `BeamElement`, see [exact beams](guide/elastic.md).""",
    "Friction models": """
`b.friction(name, joint, model)`, and `friction=model` of contacts, cables and worm gears, and of the law
`FrictionForce`. One model serves every place, see [friction](guide/friction.md). Of your own: [a
model](extend/friction.md).""",
    "Contact pairs": """
`b.contact(name, pair, body, surface, force, friction=...)`: the round part is on the body's frame B, and the
plane, tube, curve or road on the surface's frame A. See [contact](guide/contact.md).""",
    "Contact forces and surfaces": """
The force that holds a pair apart, curves and heights that a pair takes, and what `b.contact` makes of all of
them. `jaxmbs.contact.hertz_stiffness` has the stiffness of round bodies.""",
    "Hydraulic elements": """
`b.hydraulic(name, element, ports=..., signal=..., shaft=...)`: nodes with a pressure, and elements whose ports
are joined to nodes by name. The cylinder is a force law. See [hydraulic circuits](guide/hydraulics.md).""",
    "Vehicles": """
`jaxmbs.vehicles`, see [vehicles](guide/vehicles.md): tyres are force laws between a road's frame and a wheel's,
`b.force(name, tyre, between=("ground", "front left wheel"))`, made of a model of forces over slip and of a road.  Of
your own: [a tyre](extend/tyre.md).""",
    "Signals": """
Functions of time, for `drive=`, for targets and for values of loads. Any other function of time serves as well;
drives need two derivatives.""",
    "Blocks": """
`b.block(name, block, reads, drives, every=...)`: controllers, filters and delays between
[signals](guide/control.md), continuous or, with a period, sampled. `b.measure` makes the signals that they read.""",
    "Finite elements": """
Groups of a `fem.Structure`. Coordinates of a node are displacements x y z [m] and small rotations rx ry rz [rad]
in world axes, positive along the axes and right-handed about them. `fem.element_forces` and
`fem.element_stresses` return the columns listed here. Of your own: [an element](extend/element.md).""",
    "Reductions": """
`reductions.reduce(system, method)`. Coordinates of the interface come first and keep their names, so that
components can be joined by them; `expand` leads back to all coordinates. Of your own: [a
reduction](extend/reduction.md).""",
    "Solvers": """
`simulate(system, state, solver=...)`: these, and all of [diffrax](guide/diffrax.md), whose `Dopri8` is the
default where no motion [dies out too fast](guide/solvers.md#the-choice). [Choosing a solver](guide/solvers.md) has
measurements.""",
    "Events": """
`simulate(system, state, event=...)`, one or a list; see [events that act](guide/diffrax.md).""",
    "Drawings": """
Shapes that the `drawing()` of a law, row or pair of your own returns; plots and scenes show them, see [a
row](extend/row.md).""",
}


def chosen(room, keep=lambda t: True):
    """Classes of a room by name, but for bases and `LEFT_OUT`."""
    module = importlib.import_module(f"jaxmbs.{room}")
    public = getattr(module, "__all__", None) or [n for n, t in vars(module).items() if defined(module, n, t)]
    things = {n: getattr(module, n) for n in sorted(public) if n not in LEFT_OUT and not n.startswith("Abstract")}
    return {n: (f"jaxmbs.{room}", t) for n, t in things.items() if inspect.isclass(t) and keep(t)}


def defined(module, name, thing):
    return not name.startswith("_") and getattr(thing, "__module__", "") == module.__name__


def sections():
    """Pairs of room and class by name, by section."""
    from jaxmbs.blocks import AbstractBlock
    from jaxmbs.contact import AbstractPair
    from jaxmbs.forces import AbstractLaw, AbstractSignal, InextensibleCable
    from jaxmbs.joints import AbstractClosure, AbstractJoint
    from jaxmbs.vehicles import AbstractRoad, AbstractTyreModel, RandomRoad, Suspension

    is_joint = lambda t: issubclass(t, AbstractJoint) and not issubclass(t, AbstractClosure)
    is_law = lambda t: issubclass(t, AbstractLaw)
    is_pair = lambda t: issubclass(t, AbstractPair)
    on_wheels = AbstractLaw | AbstractBlock | AbstractTyreModel | AbstractRoad | RandomRoad | Suspension
    return {
        "Joints": chosen("joints", is_joint),
        "Constraint rows": chosen("joints", lambda t: not is_joint(t))
        | chosen("forces", lambda t: t is InextensibleCable),
        "Force laws": chosen("forces", is_law),
        "Parts of cables and beams": chosen(
            "forces", lambda t: not (is_law(t) or issubclass(t, AbstractSignal | InextensibleCable))
        ),
        "Friction models": chosen("friction"),
        "Contact pairs": chosen("contact", is_pair),
        "Contact forces and surfaces": chosen("contact", lambda t: not is_pair(t)),
        "Hydraulic elements": chosen("hydraulics"),
        "Vehicles": chosen("vehicles", lambda t: issubclass(t, on_wheels)),
        "Signals": chosen("forces", lambda t: issubclass(t, AbstractSignal)),
        "Blocks": chosen("blocks"),
        "Finite elements": chosen("elements"),
        "Reductions": chosen("reductions"),
        "Solvers": chosen("ode"),
        "Events": chosen("motion", lambda t: t.__name__ == "Event"),
        "Drawings": chosen("drawings"),
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
    listed = lambda names: ", ".join(names) if names else "none"
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
    if hasattr(kind, "ports") and hasattr(kind, "port_flows"):
        found += [f"Ports: {listed(kind.ports)}. Signal: {kind.signal}."]
    return "\n".join(f"- {line}" for line in found)


def contents():
    """One line for each section, with its names."""
    lines = []
    for title, kinds in sections().items():
        lines.append(f"- [{title}](#{title.lower().replace(' ', '-')}): {', '.join(kinds)}.")
    return "\n".join(lines) + "\n"


def page():
    """The text of the page."""
    parts = [INTRODUCTION, contents()]
    for title, kinds in sections().items():
        parts.append(f"## {title}\n{SECTIONS[title]}\n")
        for name, (room, kind) in kinds.items():
            picture = f"![{name}](images/catalogue/{name}.svg)" if name in DRAWINGS else ""
            entry = [f"### {name}", picture, f"`{room}.{call(name, kind)}`", facts(kind), prose(kind)]
            parts.append("\n\n".join(part for part in entry if part) + "\n")
    parts.append(NEXT)
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
