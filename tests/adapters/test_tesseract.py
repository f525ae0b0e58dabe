"""Folders of Tesseracts, run by tesseract-core's own runtime without a container."""

import importlib.util
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.adapters.tesseract import write_tesseract
from jaxmbs.cli import main

RUNTIME = ("tesseract_core", "fastapi", "uvicorn", "lz4", "fsspec")
needs_runtime = pytest.mark.skipif(
    not all(map(importlib.util.find_spec, RUNTIME)), reason="needs tesseract-core and what its runtime imports"
)
DESIGN = {"rod": {"length [m]": 2.0}, "loads [N]": np.array([1.0, 2.0, 3.0]), "count": 3}
INPUTS = {"rod_length_m": 2.0, "loads_N": DESIGN["loads [N]"], "count": 3}


def stress(design):
    length, loads = design["rod"]["length [m]"], design["loads [N]"]
    return {"moment": loads * length**2, "sine": jnp.sin(loads.sum() * length), "count": 2 * design["count"]}


def folder_of(tmp_path, forward):
    question = mbs.runtime.export(stress, (DESIGN,), tmp_path / "stress.mbs", forward=forward)
    return write_tesseract(question, tmp_path / "container")


@needs_runtime
@pytest.mark.parametrize("forward", [True, pytest.param(False, marks=pytest.mark.long)])
def test_values_and_derivatives_are_the_closed_form(tmp_path, forward):
    """With a stored forward derivative, and by pullbacks without one."""
    from tesseract_core import Tesseract
    from tesseract_core.sdk.api_parse import get_config, validate_tesseract_api

    folder, (loads, c) = folder_of(tmp_path, forward), (DESIGN["loads [N]"], np.cos(12.0))
    validate_tesseract_api(folder)  # as `tesseract build` does it first
    assert get_config(folder).name == "stress"
    with Tesseract.from_tesseract_api(folder / "tesseract_api.py") as stored:
        found = stored.apply(INPUTS)
        np.testing.assert_allclose(found["moment"], 4.0 * loads, rtol=1e-15)
        assert found["count"] == 6
        names = ["rod_length_m", "loads_N"]
        direction = {"rod_length_m": 1.0, "loads_N": np.array([0.0, 1.0, 0.0])}
        forwards = stored.jacobian_vector_product(INPUTS, names, ["moment", "sine"], direction)
        np.testing.assert_allclose(forwards["moment"], 4.0 * loads + [0.0, 4.0, 0.0], rtol=1e-14)
        np.testing.assert_allclose(forwards["sine"], (6.0 + 2.0) * c, rtol=1e-13)
        one = stored.jacobian_vector_product(INPUTS, ["rod_length_m"], ["sine"], {"rod_length_m": 2.0})
        assert set(one) == {"sine"}
        np.testing.assert_allclose(one["sine"], 12.0 * c, rtol=1e-13)
        weights = {"moment": np.array([1.0, 0.0, 1.0]), "sine": 1.0}
        back = stored.vector_jacobian_product(INPUTS, names, ["moment", "sine"], weights)
        np.testing.assert_allclose(back["rod_length_m"], 4.0 * (1.0 + 3.0) + 6.0 * c, rtol=1e-13)
        np.testing.assert_allclose(back["loads_N"], 4.0 * weights["moment"] + 2.0 * c, rtol=1e-13)
        shapes = {"rod_length_m": (), "loads_N": (3,), "count": ()}
        kinds = {n: {"shape": s, "dtype": "int64" if n == "count" else "float64"} for n, s in shapes.items()}
        assert stored.abstract_eval(kinds)["moment"] == {"shape": (3,), "dtype": "float64"}


@needs_runtime
@pytest.mark.long
def test_gradient_of_a_motion(tmp_path):
    """The stored adjoint of a swing is that of JAX, by the mass too, and central differences agree."""
    from tesseract_core import Tesseract

    def build(mass, like=None):
        b = mbs.SystemBuilder()
        b.body("bob", mass=mass, com=(1.0, 0.0, 0.0), inertia=(0.1, 0.1, 0.1))
        b.joint("pin", mbs.Revolute("y"), "ground", "bob")
        b.force("spring", mbs.SpringDamper(5.0, 0.1), joint="pin")
        return b.build(like=like)

    like = build(1.0)

    def swing(design):
        system = build(design["mass"], like)
        motion = mbs.simulate(system, mbs.State.at(system, pin=design["pin"]), t1=0.5, throw=False)
        return {"end": motion.end.coordinates[0]}

    design = {"mass": 1.2, "pin": 0.3}
    folder = write_tesseract(mbs.runtime.export(swing, (design,), tmp_path / "swing.mbs"), tmp_path / "container")
    wanted = jax.grad(lambda d: swing(d)["end"])(design)
    with Tesseract.from_tesseract_api(folder / "tesseract_api.py") as stored:
        found = stored.vector_jacobian_product(design, ["mass", "pin"], ["end"], {"end": 1.0})
        for name, value in design.items():
            np.testing.assert_allclose(found[name], wanted[name], rtol=1e-12)
            ends = [stored.apply(design | {name: value + d})["end"] for d in (1e-5, -1e-5)]
            np.testing.assert_allclose(found[name], (ends[0] - ends[1]) / 2e-5, rtol=1e-5)
            one = stored.jacobian_vector_product(design, [name], ["end"], {name: 1.0})
            np.testing.assert_allclose(one["end"], wanted[name], rtol=1e-12)


def test_names_and_files_of_the_folder(tmp_path):
    def awkward(a, b):
        return a["class"] * b["x y"], b["x_y"] + a["class"]

    arguments = ({"class": 1.0}, {"x y": 2.0, "x_y": jnp.ones(2, jnp.float32)})
    question = mbs.runtime.export(awkward, arguments, tmp_path / "awkward.mbs")
    folder = write_tesseract(question, tmp_path / "deep" / "container", name="An awkward one!")
    assert {path.name for path in folder.iterdir()} == {
        *("question.zip", "tesseract_api.py", "tesseract_config.yaml", "tesseract_requirements.txt")
    }
    text = (folder / "tesseract_api.py").read_text()
    compile(text, "tesseract_api.py", "exec")
    fields = re.findall(r"^    (\w+): (.*) = Field", text, re.MULTILINE)
    assert [name for name, _ in fields] == ["x_0_class", "x_1_x_y", "x_1_x_y_", "x_0", "x_1"]
    assert fields[2][1] == "Differentiable[Array[(2,), Float32]]"
    assert "name: an-awkward-one\n" in (folder / "tesseract_config.yaml").read_text()
    assert f"jax=={jax.__version__}\n" in (folder / "tesseract_requirements.txt").read_text()


def test_command(tmp_path, capsys):
    question = mbs.runtime.export(lambda x: 2 * x, (1.0,), tmp_path / "double.mbs")
    assert main(["tesseract", str(question), str(tmp_path / "out"), "--name", "double"]) == 0
    assert "tesseract build" in capsys.readouterr().out and (tmp_path / "out" / "question.zip").is_file()
    assert main(["tesseract", str(question), str(tmp_path / "out")]) == 1
    assert "not empty" in capsys.readouterr().err


def test_what_is_no_stored_question_is_refused_by_name(tmp_path, capsys):
    other = tmp_path / "reactions"
    other.write_text("no question")
    assert main(["tesseract", str(other), str(tmp_path / "out")]) == 1
    assert f"{other} is no program that `export` stored" in capsys.readouterr().err
    assert main(["tesseract", "nothing.mbs", str(tmp_path / "out")]) == 1
    assert "nothing.mbs" in capsys.readouterr().err
    question = mbs.runtime.export(lambda x: 1j * x, (1.0,), tmp_path / "complex.mbs")
    with pytest.raises(ValueError, match=re.escape("result (complex128)")):
        write_tesseract(question, tmp_path / "out")
    assert not (tmp_path / "out").exists()
