"""`.. face:: jaxmbs.joints`: the API page of a room, from its `__all__`; `.. names:: jaxmbs`: a table of links."""

import importlib
import inspect
import re

from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective

ROOMS = """
    runtime ode blocksparse joints forces friction contact blocks hydraulics elements model fatigue probability linear
    vibration kinematics constraints signal_flow assembly builder fem statics dynamics reaction reductions coupling
    flexible analysis motion cycles engines rotors vehicles experiment bondgraph batching design identification
    studies qualification io viz documents adapters adapters.fmi demo
""".split()


def first_line(thing):
    """The first sentence of a docstring; a full stop inside of backquotes ends none; none of numbers."""
    if isinstance(thing, dict):
        return ""
    words, sentence = " ".join((inspect.getdoc(thing) or "").split("\n\n")[0].split()).split(". "), ""
    for part in words:
        sentence += (". " if sentence else "") + part
        if sentence.count("`") % 2 == 0:
            break
    return sentence.rstrip(".")


def home(name, thing):
    """Where a name of `jaxmbs` is documented: the face of a room, or the page of `jaxmbs` itself."""
    for room in ROOMS:
        module = importlib.import_module(f"jaxmbs.{room}")
        if thing is module:
            return module.__name__
        if name in module.__all__ and getattr(module, name) is thing:
            return f"{module.__name__}.{name}"
    return f"jaxmbs.{name}"


def own(module, name, thing):
    """The face that documents a name: that of the room where it is written, if its face has it too."""
    room = (getattr(thing, "__module__", None) or "").split(".")[1:2]
    if inspect.isclass(thing) and room and room[0] in ROOMS:
        written = importlib.import_module(f"jaxmbs.{room[0]}")
        if getattr(written, name, None) is thing and name in written.__all__:
            return f"{written.__name__}.{name}"
    return f"{module.__name__}.{name}"


def arguments(kind):
    """The arguments of a class with their defaults, without types: `eqx.Module` hides them from autodoc."""
    try:
        signature = inspect.signature(kind)
    except ValueError:
        return ""
    bare = [p.replace(annotation=p.empty) for p in signature.parameters.values()]
    return str(signature.replace(parameters=bare, return_annotation=signature.empty))


def entry(path, thing):
    """Lines that document one name."""
    if inspect.isclass(thing):
        return [f".. autoclass:: {path}{arguments(thing)}", "   :members:", "   :show-inheritance:", ""]
    if inspect.ismodule(thing):
        return [f".. automodule:: {path}", "   :members:", ""]
    if callable(thing):
        return [f".. autofunction:: {path}", ""]
    if isinstance(thing, dict):  # `autodata` would give the documentation of `dict`
        return [f".. py:data:: {path}", ""]
    return [f".. autodata:: {path}", ""]


class Face(SphinxDirective):
    """All public names of a module: a table, then each of them."""

    required_arguments = 1

    def run(self):
        module = importlib.import_module(self.arguments[0])
        things = {name: getattr(module, name) for name in sorted(module.__all__)}
        homes = {
            name: own(module, name, thing) if module.__name__ != "jaxmbs" else home(name, thing)
            for name, thing in things.items()
        }
        lines = [".. list-table::", "   :widths: 30 70", ""]
        for name, thing in things.items():
            role = "mod" if inspect.ismodule(thing) and homes[name] != f"jaxmbs.{name}" else "obj"
            lines += [f"   * - :py:{role}:`{name} <{homes[name]}>`", f"     - {first_line(thing)}"]
        lines += [""]
        for name, thing in things.items():
            if homes[name] == f"{module.__name__}.{name}" and homes[name].removeprefix("jaxmbs.") not in ROOMS:
                lines += entry(homes[name], thing)
        return self.parse_text_to_nodes("\n".join(StringList(lines, source=self.arguments[0])))


_COLON = "\ue000"


def _hide_colons(app, what, name, thing, options, lines):
    """Napoleon takes what stands before a colon in a property's docstring for its type; ours are sentences."""
    if what in ("property", "attribute"):
        lines[:] = [line.replace(":", _COLON) for line in lines]


def _show_colons(app, what, name, thing, options, lines):
    lines[:] = [line.replace(_COLON, ":") for line in lines]


def _expand_arguments(app, what, name, thing, options, lines):
    """`Args: x: text` on one line becomes the section that Napoleon knows; `Raises` and `Source` stand apart."""
    found, inside = [], False
    for line in lines:
        if line.startswith("Args: "):
            inside = True
            text, *rest = re.split(r"  (?=Raises:|Returns:|Source:)", line.removeprefix("Args: "))
            found += ["Args:", f"    {text}"]
            if rest:
                found += ["", " ".join(rest)]
                inside = False
        elif inside and line.startswith(" "):
            text, *rest = re.split(r"  (?=Raises:|Returns:|Source:)", line.strip())
            found += [f"        {text}", *(["", " ".join(rest)] if rest else [])]
            inside = not rest
        else:
            found += [""] * (inside and line != "") + [line]
            inside = False
    lines[:] = found


def _skip_fields(app, what, name, thing, skip, options):
    """Fields of named tuples, which have no words of their own."""
    return True if str(getattr(thing, "__doc__", "")).startswith("Alias for field number") else None


def setup(app):
    app.connect("autodoc-skip-member", _skip_fields)
    app.connect("autodoc-process-docstring", _expand_arguments, priority=50)
    app.connect("autodoc-process-docstring", _hide_colons, priority=100)
    app.connect("autodoc-process-docstring", _show_colons, priority=900)
    app.add_directive("face", Face)
    return {"parallel_read_safe": True}
