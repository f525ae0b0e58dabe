"""MJCF as text that MuJoCo may be given: includes resolved inside the folder, all that only pictures need taken out.

Nothing that is left names a file but meshes of which the mass of a body is made; their bytes go along.
"""

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import NamedTuple

from ...errors import ModelFileError
from .._file_inside import file_inside
from .._regular_file import read_bytes
from ._imported import count_nouns, quote_names
from ._xml_text import MAX_DEPTH, MOST_BYTES, parse_xml

_MOST_FILES = 100  # included files, and copies that <replicate> makes times this
_MOST_COPIES = 10_000
_UNUSED_SECTIONS = ("visual", "statistic", "sensor", "contact", "custom", "size")
_REFUSED = {
    "composite": "composite bodies",
    "flexcomp": "flexible bodies",
    "flex": "flexible bodies",
    "plugin": "plugins",
    "attach": "attached models",
    "model": "attached models",
}
_OF_TENDONS = ("tendon", "tendon1", "tendon2")


class MjcfText(NamedTuple):
    """Text for the compiler, and a sentence for each part removed from it."""

    xml: str
    assets: dict[str, bytes]
    dropped: list[str]


def mjcf_text(path: Path, tendons: str) -> MjcfText:
    """The text of a model.  Raises: ModelFileError with what it may not have."""
    root = _resolve_includes(path)
    if root.tag != "mujoco":
        raise ModelFileError(path, [f"its outermost element is <{root.tag}>, that of an MJCF is <mujoco>"])
    faults: list[str] = []
    _refuse(root, faults)
    dropped = _describe_omissions(root)
    dropped += _tendons(root, tendons, faults)
    compiler = _compiler(root)
    _strip(root)
    assets = _meshes(path, root, compiler, faults, dropped)
    for element in root.iter():
        if "file" in element.attrib and not (element.tag == "mesh" and element.get("file") in assets):
            faults.append(f"<{element.tag}> reads the file {element.get('file')!r}, which is not supported")
    if faults:
        raise ModelFileError(path, faults)
    return MjcfText(ET.tostring(root, encoding="unicode"), assets, dropped)


def _resolve_includes(path) -> ET.Element:
    """The root with every <include> replaced by what that file holds."""
    folder, left = path.parent, [MOST_BYTES, _MOST_FILES]

    def read(file):
        content = read_bytes(file, MOST_BYTES)
        left[0] -= len(content)
        left[1] -= 1
        if min(left) < 0:
            raise ModelFileError(path, ["it includes too many files, or too much of them"])
        return parse_xml(file, content)

    def resolve(element, file, depth):
        if depth > MAX_DEPTH:
            raise ModelFileError(path, ["its includes are nested too deep, or include themselves"])
        found = []
        for child in element:
            if child.tag != "include":
                resolve(child, file, depth + 1)
                found.append(child)
                continue
            name = child.get("file", "")
            other = file_inside(folder, name, file.parent)
            if other is None:
                raise ModelFileError(path, [f"<include file={name!r}>: no such file inside {str(folder)!r}"])
            part = read(other)
            resolve(part, other, depth + 1)
            found += list(part)
        element[:] = found

    root = read(path)
    resolve(root, path, 0)
    return root


def _refuse(root, faults):
    for tag, what in _REFUSED.items():
        number = sum(1 for _ in root.iter(tag))
        if number:
            faults.append(f"it has {what} (<{tag}>), which are not supported")
    copies = 1.0
    for element in root.iter("replicate"):
        try:
            copies *= max(1.0, float(element.get("count", "1")))
        except ValueError:
            continue  # MuJoCo says it better
    if not copies <= _MOST_COPIES:
        faults.append(f"<replicate> makes more than {_MOST_COPIES} copies")


def _describe_omissions(root) -> list[str]:
    """Describe the parts that no mechanism here has and no picture needs."""
    found = []
    sections = (("sensor", "sensor", "sensors"), ("contact", "rule of contact", "rules of contact"))
    for section, *words in (*sections, ("custom", "custom datum", "custom data")):
        number = sum(len(element) for element in root.findall(section))
        if number:
            found.append(count_nouns(number, *words))
    for tag in ("camera", "light", "skin"):
        number = sum(
            1 for parent in root.iter() if parent.tag not in ("default", "sensor") for _ in parent.findall(tag)
        )
        if number:
            found.append(count_nouns(number, tag))
    return found


def _tendons(root, tendons, faults) -> list[str]:
    """Tendons refused by name, or taken out with what hangs on them."""
    found = [element for section in root.findall("tendon") for element in section]
    if not found:
        return []
    names = quote_names(element.get("name", "unnamed") for element in found)
    if tendons == "refuse":
        faults.append(f'it has tendons, {names}; tendons="read" takes them, tendons="drop" leaves them out')
    if tendons != "drop":
        return []
    for parent in list(root.iter()):
        hanging = [child for child in parent if any(key in child.attrib for key in _OF_TENDONS)]
        for child in hanging:
            parent.remove(child)
    for section in root.findall("tendon"):
        root.remove(section)
    return [f"the tendons {names}, with actuators and equalities of tendons"]


def _compiler(root) -> dict[str, str]:
    """Settings of <compiler>, later ones over earlier; those that say what is kept are put right."""
    settings: dict[str, str] = {}
    for element in root.findall("compiler"):
        settings |= element.attrib
        for key in ("meshdir", "texturedir", "assetdir"):
            element.attrib.pop(key, None)
    last = ET.SubElement(root, "compiler")
    last.attrib.update(fusestatic="false", discardvisual="false", usethread="false")
    return settings


def _strip(root):
    """Take out what is not mechanics: pictures, sensors, contacts, memory sizes."""
    for tag in _UNUSED_SECTIONS:
        for section in root.findall(tag):
            root.remove(section)
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in ("camera", "light", "texture", "skin", "layer", "hfield", "material"):
                parent.remove(child)
            elif child.tag == "geom" and ("hfield" in child.attrib or child.get("type") in ("hfield", "sdf")):
                parent.remove(child)
        parent.attrib.pop("material", None)
    for key in root.iter("key"):
        for state in ("ctrl", "act"):  # of actuators that may have gone with their tendons
            key.attrib.pop(state, None)
    for section in root.findall("deformable"):
        root.remove(section)


def _meshes(path, root, compiler, faults, dropped) -> dict[str, bytes]:
    """Bytes of the meshes that give some body its mass, by a name of ours; all other meshes go."""
    everywhere, never = (compiler.get("inertiafromgeom") == value for value in ("true", "false"))
    needed: dict[str, str] = {}
    shapes = 0

    def visit(element, body, has_inertia):
        nonlocal shapes
        for child in list(element):
            if child.tag == "body":
                visit(child, child.get("name", "unnamed"), never or child.find("inertial") is not None)
            elif child.tag in ("frame", "replicate"):
                visit(child, body, has_inertia)
            elif child.tag == "geom" and "mesh" in child.attrib:
                if has_inertia and not everywhere:
                    element.remove(child)
                    shapes += 1
                else:
                    needed.setdefault(child.get("mesh", ""), body)

    for world in root.findall("worldbody"):
        visit(world, "world", not everywhere)
    if shapes:
        dropped.append(f"the shapes of {count_nouns(shapes, 'mesh', 'meshes')}")
    return _assets(path, root, compiler, needed, faults)


def _assets(path, root, compiler, needed, faults):
    assets: dict[str, bytes] = {}
    folders = [path.parent / compiler[key] for key in ("meshdir", "assetdir") if compiler.get(key)]
    left = MOST_BYTES
    for section in root.findall("asset"):
        for mesh in list(section.findall("mesh")):
            file = mesh.get("file")
            name = mesh.get("name") or Path(file or "").stem
            if name not in needed:
                section.remove(mesh)
                continue
            if "builtin" in mesh.attrib:
                faults.append(f"mesh {name!r} is made by a program ({mesh.get('builtin')!r}), which is not supported")
            if file is None:
                continue
            found = file_inside(path.parent, file, *folders)
            if found is None:
                faults.append(
                    f"body {needed[name]!r} takes its mass from the mesh {file!r}, which is not in the folder: "
                    "give the body an <inertial>"
                )
                section.remove(mesh)  # it is told once
                continue
            content = read_bytes(found, left)
            left -= len(content)
            mesh.set("name", name)
            mesh.set("file", f"mesh{len(assets)}{found.suffix}")
            assets[mesh.get("file", "")] = content
    return assets
