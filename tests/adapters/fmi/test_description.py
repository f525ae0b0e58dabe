"""The description of an FMU against FMI's schema and fmpy's rules."""

import pytest

from jaxmbs.adapters.fmi._description import Variable, build_description, model_description

VARIABLES = [
    Variable("time", "time", 0, "s"),
    Variable("pin", "state", 1, "rad", 0.25),
    Variable("push", "input", 2, "N", 0.0),
    Variable("bob.mass", "parameter", 3, "", 1.5),
    Variable("tip", "output", 5, "m"),
    Variable("der(pin)", "rate", 4, "rad/s", None, 1),
]


@pytest.mark.parametrize("kind", ["ME", "CS"])
def test_the_description_satisfies_the_schema(kind, tmp_path):
    fmpy = pytest.importorskip("fmpy")
    path = tmp_path / "modelDescription.xml"
    path.write_bytes(model_description("one", "{token}", kind, VARIABLES, 0.5, "a tool"))
    found = fmpy.read_model_description(str(tmp_path), validate=True)
    assert (found.modelExchange is None) == (kind == "CS") == (found.coSimulation is not None)
    by_name = {variable.name: variable for variable in found.modelVariables}
    assert by_name["bob.mass"].variability == "tunable" and float(by_name["pin"].start) == 0.25
    assert [u.variable.name for u in found.derivatives] == ["der(pin)"] and by_name["der(pin)"].derivative is by_name[
        "pin"
    ]
    text = path.read_text(encoding="utf-8")
    assert 'providesDirectionalDerivatives="true"' in text and 'providesAdjointDerivatives="true"' in text


def test_the_sources_are_listed():
    text = build_description("one", ["fmu.c"], "x86_64-linux").decode()
    assert 'SourceFile name="fmu.c"' in text and 'modelIdentifier="one"' in text
