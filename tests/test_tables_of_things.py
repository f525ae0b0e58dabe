"""What users print shows names and numbers, no shapes of arrays: every public class that has an example."""

import inspect

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import TypeCheckError

import jaxmbs as mbs
from jaxmbs import blocksparse, contact, coupling, elements, fem, forces, friction, joints, linear, reductions
from jaxmbs.tables import fields_repr, sentence_repr
from tests.misuse.test_misuse import CASES, PUBLIC
from tests.misuse.zoo import Zoo
from tests.test_reports import MADE

SHAPES = ("f64[", "f32[", "i64[", "i32[", "c128[", "bool[", "Array(", "array(")


def says(made):
    """The print of a thing; fails for shapes of arrays and for a long one."""
    text = repr(made)
    assert not [shape for shape in SHAPES if shape in text], text
    assert len(text.splitlines()) <= 25 and max(map(len, text.splitlines())) <= 120
    return text


def beam(n=3):
    nodes = {k: (0.5 * i, 0.0, 0.0) for i, k in enumerate("abcdef"[:n])}
    pairs = [list(pair) for pair in zip(list(nodes)[:-1], list(nodes)[1:], strict=True)]
    return fem.Structure(
        nodes, {"bars": (elements.Beam(70e9, 27e9, 1e-4, 1e-9, 1e-9, 2e-9, 2700.0), pairs)}, held={"a": "all"}
    )


def measured_network():
    omega = 2 * np.pi * np.array([10.0, 40.0])
    values = (1.0 + 0.1j) * np.ones((2, 2, 2)) + np.eye(2)
    parts = {n: linear.TransferFunctions(omega, values, ["p z", "q z"], ["p z", "q z"]) for n in ("rig", "wing")}
    return coupling.connect(parts, {"bolt": coupling.rigid_bond("rig.p", "wing.q")})


def matrix():
    pattern = blocksparse.Pattern(3, 2, [(0, 1), (1, 2)])
    return blocksparse.BlockMatrix(pattern, 4.0 * jnp.tile(jnp.eye(2), (3, 1, 1)), jnp.tile(jnp.eye(2), (2, 1, 1)))


HAND = {  # a thing, and some of its words
    "SpringDamper": (lambda: mbs.SpringDamper(40.0, damping=0.7), "SpringDamper(stiffness=40, damping=0.7"),
    "Spline": (lambda: mbs.Spline(np.arange(9.0), np.zeros(9)), "values=<9 numbers>"),
    "Contact": (
        lambda: contact.Contact(contact.SphereOnPlane(0.05), contact.HuntCrossley(1e5)),
        "pair=SphereOnPlane(radius=0.05)",
    ),
    "LuGre": (lambda: friction.LuGre(0.3, 1e5), "LuGre(dynamic=0.3, sigma0=1e+05"),
    "RollingDisk": (lambda: joints.RollingDisk(0.3), "RollingDisk(radius=0.3, axle=(0, 1, 0))"),
    "Actuator": (lambda: mbs.Actuator(lambda x, v, t: 0.0 * x), "Actuator("),
    "Pose": (
        lambda: mbs.Pose((1.0, 0.0, 0.0)),
        "Pose(position=(1, 0, 0), rotation=((1, 0, 0), (0, 1, 0), ",
    ),
    "CraigBampton": (lambda: reductions.CraigBampton(4), "CraigBampton(num_modes=4"),
    "Margin": (lambda: forces.Margin(jnp.asarray(0.1), "m", "is left"), "Margin(value=0.1, unit='m'"),
    "Beam": (lambda: beam().groups["bars"].element, "Beam(young=7e+10"),
    "Structure": (beam, "3 nodes; bars of 2 Beam; 6 coordinates held"),
    "Group": (lambda: beam().groups["bars"], "2 elements Beam, all alike"),
    "FloatingFrame": (
        lambda: mbs.flexible.floating_frame(fem.Structure({k: v for k, v in FREE.items()}, BARS), ["a", "c"]),
        "interfaces a, c",
    ),
    "MeasuredNetwork": (
        measured_network,
        "rig (measured), wing (measured), joined by bolt; 2 frequencies from 10",
    ),
    "BlockMatrix": (matrix, "symmetric, Pattern(3 blocks of 2, 2 edges)"),
    "Factor": (lambda: blocksparse.factor(matrix()), "cholesky of Pattern(3 blocks of 2"),
    "Plan": (lambda: blocksparse.analyse(matrix().pattern), "fronts in"),
}
FREE = {"a": (0.0, 0.0, 0.0), "b": (0.5, 0.0, 0.0), "c": (1.0, 0.0, 0.0)}
BARS = {"bars": (elements.Beam(70e9, 27e9, 1e-4, 1e-9, 1e-9, 2e-9, 2700.0), [["a", "b"], ["b", "c"]])}


@pytest.mark.parametrize("name", HAND)
def test_things_say_their_numbers(name):
    make, words = HAND[name]
    made = make()
    text = says(made)
    assert type(made).__name__ == name and text.startswith(name) and words in " ".join(text.split()), text


def test_traced_things_show_shapes():
    seen = []
    jax.make_jaxpr(lambda k: seen.append(repr(mbs.SpringDamper(k))) or k)(1.0)
    assert "f64[]" in seen[0]


def test_long_fields_are_counted():
    class Bag:
        pass

    text = fields_repr(mbs.Spline(np.arange(4.0), np.zeros(4)))
    assert text.startswith("Spline(times=(0, 1, 2, 3), values=(0, 0, 0, 0)")
    Bag.__repr__, Bag._repr_html_ = sentence_repr(lambda bag: "holds <3> things")
    assert repr(Bag()) == "Bag: holds <3> things" and "&lt;3&gt;" in Bag()._repr_html_()


CLASSES = [name for name, thing in PUBLIC.items() if inspect.isclass(thing) and name in CASES]


@pytest.mark.long
def test_no_public_class_prints_shapes():
    """All that misuses have a valid call of, and all results that have a table."""
    zoo, made = Zoo(), {}
    for name in CLASSES:
        args, options = CASES[name].arguments(zoo)
        try:
            made[name] = PUBLIC[name](*args, **options)
        except TypeCheckError:  # typed for arrays of JAX
            made[name] = PUBLIC[name](*jax.tree.map(_as_jax, args), **options)
        except TypeError:  # made by a class method
            continue
    made |= {name: make() for name, make in MADE.items()}
    bad = {name: repr(thing) for name, thing in made.items() if any(shape in repr(thing) for shape in SHAPES)}
    assert not bad and len(made) > 200


def _as_jax(x):
    return jnp.asarray(x) if isinstance(x, np.ndarray) and x.dtype.kind in "fc" else x
