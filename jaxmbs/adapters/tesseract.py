"""Tesseract: a stored question as the folder of a container with values and derivatives both ways.

The container needs JAX and NumPy; the stored program is the whole model.
"""

import json
import keyword
import re
import shutil
from os import PathLike
from pathlib import Path

import jax
import jax.numpy as jnp

from ..runtime import Program, load_program
from ._tesseract_files import API, CONFIG, FIELD, REQUIREMENTS

_KINDS = {"float64": "Float64", "float32": "Float32", "int64": "Int64", "int32": "Int32", "bool": "Bool"}


def write_tesseract(question: str | PathLike, folder: str | PathLike, name: str | None = None) -> Path:
    """Write the folder of a Tesseract that answers a stored question.

    Its endpoints are `apply`, `jacobian_vector_product`, `vector_jacobian_product` and `abstract_eval`; inputs and
    outputs are the leaves of the arguments and results, by their paths with underscores: `rod_length`.
    `tesseract build folder` makes the container.

    Args:
        question: a file that `jaxmbs.runtime.export` stored.  With `forward=True` there, a derivative in a direction
            costs about what two answers do; without, one reverse pass for each number of the results.
        folder: to be made; an empty one may be there.
        name: of the Tesseract; by default that of the stored function.

    Returns: the folder.

    Raises: OSError if the file cannot be read or the folder not be made; FileExistsError where it has contents;
    ValueError for a file that is no stored question, was stored with another version of JAX, or has numbers of a type
    that Tesseract does not know.
    """
    program, folder = load_program(question), Path(folder)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise FileExistsError(f"{folder} is there already and not empty: name another folder")
    texts = _texts(program, name or program.about["function"])
    folder.mkdir(parents=True, exist_ok=True)
    for file, text in texts.items():
        (folder / file).write_text(text, encoding="utf-8")
    shutil.copyfile(question, folder / "question.zip")
    return folder


def _texts(program: Program, name: str) -> dict[str, str]:
    """Contents of the folder's files."""
    inputs, outputs = (_fields(names, shapes) for names, shapes in zip(program.names, program.shapes, strict=True))
    name = re.sub(r"[^a-z0-9_-]+", "-", name.lower()).strip("-_") or "question"
    api = API.format(
        name=name,
        inputs="\n".join(FIELD.format(**field) for field in inputs) or "    pass",
        outputs="\n".join(FIELD.format(**field) for field in outputs) or "    pass",
        input_names=json.dumps([field["name"] for field in inputs]),
        output_names=json.dumps([field["name"] for field in outputs]),
        kinds=", ".join(sorted({"Array", "Differentiable"} | {field["kind"] for field in (*inputs, *outputs)})),
    )
    about = f"{program.about['function']}: a stored question of a multibody model, with exact derivatives"
    return {
        "tesseract_api.py": api,
        "tesseract_config.yaml": CONFIG.format(name=name, about=json.dumps(about)),
        "tesseract_requirements.txt": REQUIREMENTS.format(jax=program.about["jax"]),
    }


def _fields(names: list[str], shapes: list[jax.ShapeDtypeStruct]) -> list[dict]:
    """Fields of a schema.  Raises: ValueError for numbers of a type that Tesseract does not know."""
    unknown = [f"{n} ({s.dtype})" for n, s in zip(names, shapes, strict=True) if s.dtype.name not in _KINDS]
    if unknown:
        raise ValueError(f"Tesseract has no numbers of the type of {', '.join(unknown)}: return real ones")
    fields = []
    for label, shape in zip(names, shapes, strict=True):
        kind = _KINDS[shape.dtype.name]
        array = f"Array[{tuple(shape.shape)!r}, {kind}]"
        is_real = jnp.issubdtype(shape.dtype, jnp.floating)
        fields.append(
            {
                "name": _identifier(label, {field["name"] for field in fields}),
                "label": json.dumps(label),
                "kind": kind,
                "type": f"Differentiable[{array}]" if is_real else array,
            }
        )
    return fields


def _identifier(label: str, taken: set[str]) -> str:
    """A name of Python for a path, other than those taken and than the names that pydantic keeps for itself."""
    name = re.sub(r"\W+", "_", label, flags=re.ASCII).strip("_") or "input"
    if (
        name[0].isdigit()
        or keyword.iskeyword(name)
        or name.startswith("model_")
        or name in ("copy", "json", "schema")
    ):
        name = f"x_{name}"
    while name in taken:
        name += "_"
    return name
