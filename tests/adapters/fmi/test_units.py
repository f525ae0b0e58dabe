"""Units of FMI from texts."""

import pytest

from jaxmbs.adapters.fmi._units import base_units, unit_definitions


@pytest.mark.parametrize(
    "unit, exponents, factor",
    [
        ("rad/s", {"rad": 1, "s": -1}, 1.0),
        ("rad/s2", {"rad": 1, "s": -2}, 1.0),
        ("N m", {"kg": 1, "m": 2, "s": -2}, 1.0),
        ("N m/rad", {"kg": 1, "m": 2, "s": -2, "rad": -1}, 1.0),
        ("kg m^2", {"kg": 1, "m": 2}, 1.0),
        ("kN/mm", {"kg": 1, "s": -2}, 1e6),
        ("N s/m", {"kg": 1, "s": -1}, 1.0),
        ("1/s", {"s": -1}, 1.0),
        ("m**2", {"m": 2}, 1.0),
        ("kg*m**2/s**2", {"kg": 1, "m": 2, "s": -2}, 1.0),
        ("mm\u00b2", {"m": 2}, 1e-6),
        ("(m/s^2)^2/Hz", {"m": 2, "s": -3}, 1.0),
        ("kg/(m s)", {"kg": 1, "m": -1, "s": -1}, 1.0),
        ("MPa", {"kg": 1, "m": -1, "s": -2}, 1e6),
    ],
)
def test_exponents_of_base_units(unit, exponents, factor):
    found = base_units(unit)
    assert found is not None and found[0] == exponents
    assert found[1] == pytest.approx(factor, rel=1e-15)


def test_unknown_units_have_a_name_alone():
    assert base_units("furlong") is None and base_units("(m") is None
    root = unit_definitions(["m", "furlong", "m"])
    assert [unit.get("name") for unit in root] == ["furlong", "m"]
    assert [len(unit) for unit in root] == [0, 1]
