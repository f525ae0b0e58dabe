"""`modelDescription.xml` of FMI 3.0 and `buildDescription.xml` of its sources."""

from typing import NamedTuple
from xml.etree import ElementTree

from ._units import unit_definitions

_CAPABILITIES = (
    *("canGetAndSetFMUState", "canSerializeFMUState", "providesDirectionalDerivatives", "providesAdjointDerivatives"),
)


class Variable(NamedTuple):
    """One number of the interface: `role` is "time", "state", "input", "parameter", "rate" or "output"; `place` its
    value reference, `start` its value at the start, `state` the place of the state whose rate it is."""

    name: str
    role: str
    place: int
    unit: str = ""
    start: float | None = None
    state: int | None = None


_ROLES = {
    "time": {"causality": "independent", "variability": "continuous"},
    "state": {"causality": "local", "variability": "continuous", "initial": "exact"},
    "input": {"causality": "input", "variability": "continuous"},
    "parameter": {"causality": "parameter", "variability": "tunable"},
    "rate": {"causality": "local", "variability": "continuous", "initial": "calculated"},
    "output": {"causality": "output", "variability": "continuous", "initial": "calculated"},
}


def model_description(
    identifier: str, token: str, kind: str, variables: list[Variable], start_time: float, tool: str
) -> bytes:
    """The text of the file, for `kind` "ME" or "CS"."""
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=identifier,
        instantiationToken=token,
        generationTool=tool,
        variableNamingConvention="flat",
    )
    abilities = dict.fromkeys(_CAPABILITIES, "true") | {"modelIdentifier": identifier}
    if kind == "ME":
        ElementTree.SubElement(root, "ModelExchange", abilities | {"needsCompletedIntegratorStep": "true"})
    else:
        more = {"canHandleVariableCommunicationStepSize": "true"}
        ElementTree.SubElement(root, "CoSimulation", abilities | more)
    root.append(unit_definitions([v.unit for v in variables if v.unit]))
    categories = ElementTree.SubElement(root, "LogCategories")
    for name in ("logStatusDiscard", "logStatusError"):
        ElementTree.SubElement(categories, "Category", name=name)
    ElementTree.SubElement(root, "DefaultExperiment", startTime=repr(float(start_time)))
    listed = ElementTree.SubElement(root, "ModelVariables")
    for variable in variables:
        ElementTree.SubElement(listed, "Float64", _attributes(variable))
    structure = ElementTree.SubElement(root, "ModelStructure")
    tags = (("Output", ("output",)), ("ContinuousStateDerivative", ("rate",)), ("InitialUnknown", ("output", "rate")))
    for tag, roles in tags:
        for variable in variables:
            if variable.role in roles:
                ElementTree.SubElement(structure, tag, valueReference=str(variable.place))
    return _text(root)


def _attributes(variable):
    found = {"name": variable.name, "valueReference": str(variable.place)} | _ROLES[variable.role]
    if variable.unit:
        found["unit"] = variable.unit
    if variable.start is not None:
        found["start"] = repr(float(variable.start))
    if variable.state is not None:
        found["derivative"] = str(variable.state)
    return found


def build_description(identifier: str, sources: list[str], platform: str) -> bytes:
    """The text of the file: how the sources are compiled."""
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    build = ElementTree.SubElement(root, "BuildConfiguration", modelIdentifier=identifier, platform=platform)
    files = ElementTree.SubElement(build, "SourceFileSet", language="C11")
    for name in sources:
        ElementTree.SubElement(files, "SourceFile", name=name)
    return _text(root)


def _text(root):
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
