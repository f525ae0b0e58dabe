"""Parameters by name: the system at other numbers."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import blocks
from jaxmbs.adapters.fmi._parameters import Parameters, named_numbers


def machine():
    b = mbs.SystemBuilder()
    for k in range(2):
        b.body(f"b{k}", mass=1.0 + k)
        b.joint(f"j{k}", mbs.Prismatic("x"), "ground", f"b{k}")
        b.force(f"s{k}", mbs.SpringDamper(2.0 + k, 0.5), joint=f"j{k}")
    b.measure("x", joint="j0")
    b.block("loop", blocks.PI(3.0, 0.0, target=0.0), reads="x")
    return b.build()


def test_numbers_of_a_system_are_set_by_name():
    system = machine()
    names = ["b1.mass", "s1.stiffness", "loop.kp"]
    found = Parameters.of(system, names)
    np.testing.assert_array_equal(found.start, [2.0, 3.0, 3.0])
    changed = found.system_at(jnp.array([7.0, 8.0, 9.0]))
    np.testing.assert_array_equal(changed.mass, [1.0, 7.0])
    numbers = named_numbers(changed)
    assert {name: numbers[name][0] for name in (*names, "s0.stiffness")} == dict(
        zip((*names, "s0.stiffness"), (7.0, 8.0, 9.0, 2.0), strict=True)
    )


def test_wrong_parameters_are_faults():
    system = machine()
    with pytest.raises(mbs.ModelError, match="did you mean 's1.stiffness'") as error:
        Parameters.of(system, ["s1.stifness", "b7.mass"])
    assert len(error.value.faults) == 2
    with pytest.raises(mbs.ModelError, match="names are given in a list"):
        Parameters.of(system, "b1.mass")
    with pytest.raises(mbs.ModelError, match="needs `parameters`"):
        Parameters.of(lambda p: system, None)


def test_a_function_takes_its_dict():
    found = Parameters.of(lambda p: p, {"mass": 2.0, "lengths": np.array([1.0, 3.0])})
    assert found.names == ("lengths[0]", "lengths[1]", "mass")
    assert float(found.system_at(jnp.array([1.0, 2.0, 5.0]))["mass"]) == 5.0
