"""What used to be accepted and gave wrong numbers in silence: now an error, or right."""

import importlib
import inspect
import pkgutil

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.elements import PointMass, Rod
from jaxmbs.elements._base import as_real
from jaxmbs.fem import Structure, assemble, assemble_dense
from jaxmbs.linear import LinearSystem

ROOMS = {m.name: importlib.import_module(f"jaxmbs.{m.name}") for m in pkgutil.iter_modules(mbs.__path__) if m.ispkg}


def public_functions():
    """(name, function) of all faces, methods of classes among them."""
    found = {}
    for room in (mbs, *ROOMS.values()):
        for name in getattr(room, "__all__", ()):
            item = getattr(room, name)
            if inspect.isclass(item):
                methods = {key: f for key, f in vars(item).items() if inspect.isfunction(f) and key[0] != "_"}
                found |= {f"{item.__module__}.{name}.{key}": f for key, f in methods.items()}
            elif callable(item):
                found[f"{item.__module__}.{name}"] = item
    return found


FUNCTIONS = public_functions()


class Strut(Rod):
    """A user's element that damps, by a field of any name."""

    oil: jnp.ndarray = eqx.field(converter=as_real, default=0.0)

    def damping(self, nodes):
        return self.oil * self.stiffness(nodes)


class Drag(mbs.forces.AbstractScalarLaw):
    """A user's law whose fields are named like others' and mean something else."""

    damping: jnp.ndarray = eqx.field(converter=as_real, default=0.0)
    power: jnp.ndarray = eqx.field(converter=as_real, default=3.0)

    def effort(self, x, v, t):
        return -self.power * v * jnp.abs(v)


def strut():
    nodes = {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0)}
    parts = {"strut": (Strut(1.0, 1.0, oil=5.0), [("a", "b")]), "mass": (PointMass(2.0), [("b",)])}
    return Structure(nodes, parts, held={"a": "all", "b": "y z rx ry rz"})


def test_matrices_in_the_wrong_order():
    with pytest.raises(TypeError, match="positional"):
        LinearSystem(*assemble_dense(strut()))


@pytest.mark.parametrize(
    "call",
    [
        lambda K, M: mbs.vibration.natural_modes(K, M),
        lambda K, M: mbs.vibration.receptance(K, M, jnp.ones(1), (0,), (0,)),
        lambda K, M: mbs.vibration.modal_damping(K, M, 0.01),
        lambda K, M: mbs.vibration.modal_response(K, M, jnp.ones((1, 3)), 0.1),
        lambda K, M: LinearSystem(M, K),
    ],
    ids=["natural_modes", "receptance", "modal", "modal_response", "LinearSystem"],
)
def test_matrices_by_position(call):
    with pytest.raises(TypeError, match="positional"):
        call(*assemble_dense(strut()))


def test_no_function_takes_matrices_by_position():
    for name, function in FUNCTIONS.items():
        given = inspect.signature(function).parameters.values()
        assert len([p for p in given if p.name in ("K", "M", "C") and p.kind is not p.KEYWORD_ONLY]) < 2, name


def test_matrices_of_an_elastic_body_by_position():
    with pytest.raises(TypeError, match="positional"):
        mbs.flexible.ElasticBody(jnp.eye(34), jnp.eye(7), jnp.eye(7), jnp.zeros((1, 3)), ("root", "tip"))


def test_frequencies_are_hertz_and_omega_is_radians():
    """Whatever takes one says so."""
    for name, function in FUNCTIONS.items():
        given, text = inspect.signature(function).parameters, inspect.getdoc(function) or ""
        assert not {"frequency", "frequencies"} & set(given) or "Hz" in text, name
        assert "omega" not in given or "rad/s" in text or ".slip" in name, name


def test_no_function_hides_a_room():
    assert all(inspect.ismodule(getattr(mbs, name)) for name in ROOMS if hasattr(mbs, name))
    assert inspect.ismodule(mbs.motion) and callable(mbs.simulate) and "simulate" not in ROOMS


EITHER = {
    "check",
    "equilibrium",
    "frequency_response",
    "modes",
    "random_response",
    "reactions",
    "simulate",
}  # of either noun in `mbs`
ALIKE = {  # the same of two kinds of things: bodies or components, fields or graphs, blocks or elements
    "assemble",
    "jit",  # for the library, for users
}
EARLIER = {"BearingFriction", "BrownMcPhee", "LuGre", "SmoothCoulomb"}  # in `forces`, for one release


def test_one_name_has_one_meaning():
    meanings = {}
    for room in (mbs, *ROOMS.values()):
        for name in getattr(room, "__all__", ()):
            meanings.setdefault(name, set()).add(id(getattr(room, name)))
    assert {name for name, found in meanings.items() if len(found) > 1} == EITHER | ALIKE | EARLIER


def test_methods_of_old():
    """One method for all storages, and no function that takes (K, M) where another takes (M, K)."""
    assert not {"couple", "stacked", "join", "transient", "interface_reactions", "redundancy"} & set(
        mbs.coupling.__all__
    )
    gone = ("craig_bampton", "large_craig_bampton", "craig_bampton_sparse", "guyan", "hurty", "rubin", "physical")
    assert not [name for name in gone if name in mbs.reductions.__all__]


def test_damping_of_a_users_element():
    system = assemble(strut())
    np.testing.assert_allclose(system.stiffness, [[1.0]])
    np.testing.assert_allclose(system.damping, [[5.0]])


def pendulum(law):
    b = mbs.SystemBuilder()
    b.body("bob", mass=1.0, com=(0.0, 0.0, -1.0))
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    b.force("law", law, joint="pin")
    return b.build()


@pytest.mark.parametrize(
    ("law", "ports"),
    [
        (Drag(), {"R:law"}),
        (mbs.SpringDamper(stiffness=2.0), {"C:law"}),
        (mbs.SpringDamper(damping=2.0), {"R:law"}),
        (mbs.SpringDamper(stiffness=2.0, damping=1.0), {"C:law", "R:law"}),
    ],
    ids=["drag", "spring", "damper", "both"],
)
def test_one_ports_of_a_law(law, ports):
    graph = mbs.bondgraph.bond_graph(pendulum(law), "inertia")
    assert {e.name for e in graph.elements if e.name in ("C:law", "R:law", "Se:law")} == ports


@pytest.mark.parametrize(
    "call",
    [
        lambda system: mbs.State.at(system, rates={"pin": 1.0}),
        lambda system: mbs.forces.Harmonic(frequency=2.0),
        lambda system: mbs.vibration.modal_motion(
            frequencies=jnp.ones(1), ratios=0.0, loads=jnp.ones((3, 1)), step=0.1
        ),
    ],
    ids=["rates", "Harmonic", "modal_motion"],
)
def test_words_that_meant_two_things_are_gone(call):
    with pytest.raises((TypeError, mbs.ModelError)):
        call(pendulum(Drag()))


def test_bushings_have_translations_first():
    """As elements, compliances and all public six-vectors; it was the other way round."""
    law = mbs.Bushing((1.0, 10.0))
    force, moment = law.wrench(jnp.eye(3), jnp.array([0.1, 0.0, 0.0]), jnp.zeros(3), jnp.zeros(3), 0.0)
    np.testing.assert_allclose((force, moment), [[-0.1, 0.0, 0.0], [0.0, 0.0, 0.0]])


def test_networks_of_bodies_have_forces_first():
    """A block of 2 kg hangs in a weld two metres beside its own: loads, wrenches and compliances force first."""
    statics, weight = mbs.statics, np.array([0.0, 0.0, -20.0])
    bonds = statics.Bonds.from_arrays(["block"], {"weld": ("ground", "block")}, [[0.0, 0.0, 0.0]], length=2.0)
    needed = -np.r_[weight, np.cross([2.0, 0.0, 0.0], weight)]
    found = statics.bond_reactions(bonds, needed[None])
    np.testing.assert_allclose(found["weld"].force, -weight)
    np.testing.assert_allclose(found["weld"].moment, [0.0, -40.0, 0.0])
    for six in (found.wrench[0], found.components[0], statics.reaction_family(bonds, needed[None]).particular[0]):
        np.testing.assert_allclose(six, needed)
    np.testing.assert_allclose(statics.reaction_matrix(bonds).matrix @ needed, needed)
    np.testing.assert_allclose(jnp.diagonal(bonds.compliance[0]), [1.0] * 3 + [0.25] * 3)


def test_a_joint_is_known_by_what_it_says_not_by_its_name():
    """Joints that may be walked towards the ground were told by the names of their classes."""

    class Hinge(mbs.Revolute):
        """A revolute of the user's."""

    class Revolute(mbs.Universal):
        """A joint that is none."""

    def towards_the_ground(joint):
        b = mbs.SystemBuilder()
        b.body("bob", 1.0, inertia=1.0)
        b.joint("pin", joint, "bob", "ground")
        return b.build()

    assert towards_the_ground(Hinge("y")).topology.joint_names == ("pin",)
    with pytest.raises(mbs.ModelError, match="from its outer to its inner body"):
        towards_the_ground(Revolute())


@pytest.mark.parametrize("law", [mbs.Actuator, mbs.forces.GeneralisedEffort, mbs.forces.Wrench])
def test_time_is_the_last_argument_of_every_function(law):
    with pytest.raises(ValueError, match=r"time is the last argument: function\(x, v, t\)"):
        law(lambda t, x, v: 0.0 * x)


class Thrice(mbs.forces.AbstractScalarLaw):
    """A user's law with three efforts for one rate."""

    def effort(self, x, v, t):
        return jnp.ones(3)


BAD_LAWS = {
    "an effort of three": (Thrice(), "joint", "gives shape (1, 3), not (1,)"),
    "six numbers for a pair": (
        mbs.forces.Wrench(lambda R, x, w, v, t: jnp.zeros(6)),
        "on",
        "too many values to unpack",
    ),
    "two arguments": (mbs.Actuator(lambda x, t: x), "joint", "takes 2 positional arguments but 3 were given"),
}


@pytest.mark.parametrize("name", BAD_LAWS)
def test_laws_are_tried_at_build(name):
    law, port, words = BAD_LAWS[name]
    b = mbs.SystemBuilder()
    b.body("bob", 1.0, inertia=(1.0, 1.0, 1.0))
    b.joint("pin", mbs.Revolute("y"), "ground", "bob")
    b.force("push", law, **{port: "pin" if port == "joint" else "bob"})
    with pytest.raises(mbs.ModelError) as report:
        b.build()
    assert "force 'push'" in str(report.value) and words in str(report.value)


def test_numbers_in_the_interface_of_a_structure_are_nodes():
    """As in its groups and supports; they were rows of the matrices."""
    bar = Structure(np.eye(3), {"bars": (Rod(1.0, 1.0), [(0, 1), (1, 2)])}, held={0: "all"})
    system = assemble(bar, interface=[1])
    assert system.interface == assemble(bar, interface=["1"]).interface == (0, 1, 2)
    with pytest.raises(mbs.ModelError, match="no coordinate or node '7'"):
        assemble(bar, interface=[7])
