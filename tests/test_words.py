"""Names, first lines of docstrings and messages are in the words of the field; CONTRIBUTING.md has them."""

import ast
import importlib
import re

import pytest

from . import sources
from .sources import PACKAGE

QUESTIONS = re.compile(r"\W*(What|Whether|Which|How|Where|Why|When|Who)\b")
#: Words that a name may not contain, bare or as one of its parts: pictures, not terms.
METAPHORS = frozenset(
    "hunt hunted march marched marching walk walked walker stage act cast lane lanes wall promise front book again "
    "ghost twin guest meeting".split()
)
#: Names that are a bare participle or adverb: they say no thing and no deed.
BARE = frozenset(
    "held told walked built moved spun turned asked found given kept known shown spoken drawn seen taken led beside "
    "apart less put due elsewhere resting undriven broken present short together alone needed wanted".split()
)
#: Of public names every single participle is refused, apart from those that are the field's nouns or states.
TERMS = frozenset({"bed", "embed", "feed", "seed", "shed", "speed"})
#: Where a word of the list is a term of the field: room -> words.
FIELD = {
    "blocksparse": {"front"},
    "ode": {"stage"},
    "contact": {"hunt"},
    "runtime": {"stage"},
    "vehicles": {"lane", "lanes"},
}
# the multifrontal method, Runge-Kutta methods, Hunt and Crossley, a method that tracers of JAX have, lanes of a road
#: Phrases of messages that say "is", "our" or "reports" in another way.
PHRASES = re.compile(
    r"\b(of ours|of one's own|is told|are told|stands (?:at|in|on|beside|for|here)\b|tells (?:what|which|how)|"
    r"asks for|is asked for|keeps (?:its|the|all|to) limits|, please\b|says so\b)",
    re.IGNORECASE,
)


def _room(path):
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return parts[0]


def _modules():
    return [(_room(p), p, sources.tree(p)) for p in sources.files()]


def _words(name):
    """The parts of a name in snake or camel case, in lower case."""
    return {part.lower() for part in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}


def first_lines(tree):
    """Docstrings that begin with a question, as (line, first line)."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text and QUESTIONS.match(text):
                yield getattr(node, "lineno", 1), text.splitlines()[0]


def names(tree):
    """Names of the functions and classes at the top of a module, and of public methods that are no properties."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.lineno, node.name
        if isinstance(node, ast.ClassDef):
            for method in node.body:
                is_field = isinstance(method, ast.FunctionDef) and any(
                    "property" in ast.unparse(decorator) for decorator in method.decorator_list
                )
                if isinstance(method, ast.FunctionDef) and method.name[0] != "_" and not is_field:
                    yield method.lineno, method.name


def is_banned(name, room):
    """True for a name of a banned kind in that room."""
    bare = name.strip("_")
    terms = FIELD.get(room, set()) | ({"front"} if "pareto" in bare.lower() else set())
    return bool((_words(bare) & METAPHORS) - terms) or bare.lower() in BARE


def messages(tree):
    """Texts of more than one word that are no docstrings, as (line, text): of errors, warnings and reports."""
    documented = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    docstrings = {id(node.body[0].value) for node in ast.walk(tree) if _has_docstring(node, documented)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            if " " in node.value.strip():
                yield node.lineno, node.value


def _has_docstring(node, documented):
    return isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)


def faults():
    """All banned words as (room, what)."""
    found = []
    for room, path, tree in _modules():
        place = path.relative_to(PACKAGE.parent)
        found += [(room, f"{place}:{line} {text!r}: say what it is") for line, text in first_lines(tree)]
        found += [(room, f"{place}:{line} name {name!r}") for line, name in names(tree) if is_banned(name, room)]
        if is_banned(path.stem, room):
            found.append((room, f"{place}: name of the module"))
        found += [(room, f"{place}:{line} message {text!r}") for line, text in messages(tree) if PHRASES.search(text)]
    return found + list(public_participles())


def public_participles():
    """Names of functions in an `__all__` that are a single participle."""
    for path in sorted(PACKAGE.rglob("__init__.py")):
        dotted = ".".join(path.parent.relative_to(PACKAGE.parent).parts)
        room = importlib.import_module(dotted)
        for name in getattr(room, "__all__", ()):
            if re.fullmatch(r"[a-z]+ed", name) and name not in TERMS:
                yield dotted.split(".")[1] if "." in dotted else "__init__", f"{dotted}.{name}: a bare participle"


@pytest.fixture(scope="module")
def found():
    return faults()


@pytest.mark.slow
def test_the_package_speaks_the_words_of_its_field(found):
    left = sorted({what for _, what in found})
    assert not left, f"{len(left)} to be said otherwise (CONTRIBUTING.md, Words):\n" + "\n".join(left)


@pytest.mark.parametrize("name", ["held", "_told", "Walk", "walked_reverse", "MarchState", "run_lanes", "spun"])
def test_a_banned_name_is_noticed(name):
    assert is_banned(name, "motion")


@pytest.mark.parametrize("name", ["actuator", "broadcast", "notebook", "interaction", "OdeProblem", "save_factor"])
def test_a_name_of_the_field_is_none(name):
    assert not is_banned(name, "motion") and not is_banned("Front", "blocksparse")


def test_a_question_and_a_message_are_noticed():
    tree = ast.parse('def f():\n    """Whether x."""\n    raise ValueError(f"{1} stands here")\n')
    assert list(first_lines(tree)) == [(1, "Whether x.")]
    assert [text for _, text in messages(tree) if PHRASES.search(text)] == [" stands here"]
