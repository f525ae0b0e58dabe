"""Parts of a URDF that are not read: elements, attributes and shapes, one sentence each."""

import collections
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator

from ._imported import count_nouns, quote_names

_SHAPES = ("visual", "collision")
_ATTRIBUTES = {
    **dict(
        link={"name"}, joint={"name", "type"}, origin={"xyz", "rpy"}, axis={"xyz"}, parent={"link"}, child={"link"}
    ),
    **dict(mimic={"joint", "multiplier", "offset"}, dynamics={"damping", "friction"}, mass={"value"}, inertial=set()),
    **dict(limit={"lower", "upper", "velocity", "effort"}, inertia={"ixx", "iyy", "izz", "ixy", "ixz", "iyz"}),
}
_PARTS = {
    "link": {"inertial", *_SHAPES},
    "joint": {"origin", "axis", "parent", "child", "mimic", "dynamics", "limit"},
    "inertial": {"origin", "mass", "inertia"},
}
_MOST = 20


def duplicate_faults(robot: ET.Element) -> Iterator[str]:
    """Faults: parts that links and joints have twice."""
    for where, element in _parts(robot):
        count = collections.Counter(child.tag for child in element if child.tag not in _SHAPES)
        for tag in _PARTS.get(element.tag, ()):
            if count[tag] > 1:
                yield f"{where} has {count[tag]} <{tag}>"


def describe_omissions(robot: ET.Element, rubbing: Iterable[str], undamped: Iterable[str]) -> list[str]:
    """Sentences.  Args: names of joints with friction, and of those whose damping is on several coordinates."""
    found = [
        f"{what} of the joints {quote_names(names)}"
        for what, names in (("friction", rubbing), ("damping", undamped))
        if names
    ]
    shapes = sum(len(link.findall("collision")) for link in robot.findall("link"))
    if shapes:
        found.append(f"contacts of {count_nouns(shapes, 'collision shape')}")
    count = collections.Counter(child.tag for child in robot if child.tag not in ("link", "joint", "material"))
    lines = [count_nouns(number, f"<{tag}> element") for tag, number in count.items()]
    unknown: dict[str, str] = {}
    for where, element in _parts(robot):
        for child in element:
            if child.tag not in _PARTS.get(element.tag, {child.tag}):
                unknown.setdefault(f"<{child.tag}> of a {element.tag}", where)
        for key in element.attrib.keys() - _ATTRIBUTES.get(element.tag, element.attrib.keys()):
            unknown.setdefault(f"{key}= of <{element.tag}>", where)
    lines += [f"{what}, which is not known ({where})" for what, where in unknown.items()]
    more = [f"and {len(lines) - _MOST} kinds of elements more"] if len(lines) > _MOST else []
    return found + lines[:_MOST] + more


def _parts(robot):
    """Links and joints with what they hold, shapes aside, and whose they are."""
    for element in robot:
        if element.tag in ("link", "joint"):
            where = f"{element.tag} {element.get('name')!r}"
            yield where, element
            for child in element:
                if child.tag not in _SHAPES:
                    yield where, child
                    if child.tag == "inertial":
                        yield from ((where, part) for part in child)
