"""How large the programs of the main questions are: what a user waits for at the first call.

Equations, loops and bytes do not scatter as seconds do.  A change that needs a higher ceiling says why here.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import blocks, hydraulics, probability
from jaxmbs.contact import HuntCrossley, SphereOnPlane
from jaxmbs.design import _minimise, _uncertainty
from jaxmbs.forces import Attachment, BeamSection, Eyelet, FrictionForce, PolynomialSpring, Sheave, WrapSphere
from jaxmbs.friction import LuGre, SmoothCoulomb
from jaxmbs.joints import AbstractRows
from jaxmbs.linear import LinearSystem
from jaxmbs.rotors._validity import bearing_validity
from jaxmbs.runtime import without_tricks
from jaxmbs.runtime._jit import SMALL_PROGRAM
from jaxmbs.runtime.tape import is_available
from tests.compilations import compiled
from tests.elements.test_elements import CASES
from tests.flexible.beams import elastic_beam
from tests.marks import cases
from tests.misuse import vehicles as vehicle_examples
from tests.models import chain_of_bars, four_bar_builder
from tests.vehicles.test_parts import FOUR_LINKS, LINKS, SPRING, chassis
from tests.vehicles.tyres import WHOLE as SAMPLE_TYRE

pytestmark = pytest.mark.skipif("JAXMBS_TRICKS" in os.environ, reason="without its tricks a program is another one")
BENCHMARKS = Path(__file__).parent.parent / "benchmarks"
sys.path.append(str(BENCHMARKS))
from program_size import equations, loops, stablehlo_bytes  # noqa: E402

LENGTHS = np.array([1.0, 0.3, 0.9, 0.7])
QUESTIONS = {
    "equilibrium": lambda system, state, _: mbs.equilibrium(system, state, throw=False),
    "forward dynamics": lambda system, state, _: mbs.forward_dynamics(system, state),
    "simulate": lambda system, state, _: mbs.simulate(system, state, t1=1.0),
    "reactions": lambda system, _, motion: mbs.reactions(system, motion),
    "linearise": lambda system, state, _: mbs.linearise(system, state),
    "stiffness": lambda system, state, _: mbs.stiffness(system, state),
    "kic": lambda system, state, _: mbs.constraints.kic(system, state),
}
# A motion takes 30 more than it did: its end has derivatives, and what is lost makes no NaN of what is kept.
# Reactions of loops: 150 equations and a loop count the marks at each state, those of the build were another's.
# Within a trace `linearise`, `stiffness` and `kic` look whether the build's independent set determines the motion at
# the state: one more walk of the tree, 240 equations and two loops.
# Searches do not follow residuals that are rounding, nor an equilibrium efforts: 20 equations each.
CEILINGS = {  # equations, loops
    "four-bar": {
        "equilibrium": (3220, 17),
        "forward dynamics": (850, 4),
        "simulate": (3140, 20),
        "reactions": (1700, 9),
        "linearise": (3980, 18),
        "stiffness": (1860, 13),
        "kic": (670, 5),
    },
    "chain": {"forward dynamics": (910, 6), "simulate": (2830, 21), "reactions": (1270, 7)},
    # as programs compiled "quick" are traced
    "four-bar, quick": {"forward dynamics": (560, 4), "simulate": (2420, 20), "reactions": (1285, 9)},
}
# What is derived and compiled of a load by the lengths, at a state: in reverse mode, as `tolerances` does by default,
# and in forward mode with a limit on it.  Results that nothing needs are left out before.
DESIGN = {"tolerances": 3860, "minimise": 4210}
# equations, bytes of StableHLO: from build to the derivative of a load along a motion; full and quick
# 100 of the equations are the signs of the start's branch, 300 what tells singular poses and lost answers
# Kinematics, rows, saddle systems and the step are functions that are traced once: their calls are 2 % of the bytes.
GRADIENT = {False: (16_600, 2_120_000), True: (11_990, 1_900_000)}


def four_bar(lengths, like=None):
    """Planar, all revolute: three redundant rows."""
    return four_bar_builder(lengths).build(like=like)


def begin(system):
    return mbs.State.at(system, A=0.7, velocities={"A": 3.0}, guess={"B": -0.2, "D": 1.2})


def chain():
    return chain_of_bars(6)


def asked(system, state, question):
    """The question as a function of the numbers of the system, to numbers."""
    motion = eqx.filter_eval_shape(lambda: mbs.simulate(system, state, t1=1.0))
    motion = jax.tree.map(lambda x: jnp.ones(x.shape, x.dtype) if hasattr(x, "shape") else x, motion)
    numbers, rest = eqx.partition(system, eqx.is_inexact_array)
    return lambda numbers: eqx.filter(question(eqx.combine(numbers, rest), state, motion), eqx.is_array), numbers


@pytest.mark.parametrize("model", cases(CEILINGS, slow=["four-bar"]))
def test_equations_and_loops(model):
    system = chain() if model == "chain" else four_bar(LENGTHS)
    state = mbs.State.at(system, pin0=0.3) if model == "chain" else begin(system)
    for name, (most_equations, most_loops) in CEILINGS[model].items():
        function, numbers = asked(system, state, QUESTIONS[name])
        with SMALL_PROGRAM("quick" in model):
            size = equations(function, numbers), loops(function, numbers)
        assert size[0] <= most_equations and size[1] <= most_loops, (name, size)
        if jax.__version_info__ < (0, 11):  # later ones need fewer
            assert size[0] > 0.9 * most_equations, f"{name}: {size[0]} equations; lower its ceiling"


class _Asked(Exception):
    """A program and its arguments, in place of its result."""


@pytest.mark.parametrize("verb", cases(DESIGN, slow=["tolerances", "minimise"]))
def test_equations_of_design(verb, monkeypatch):
    """Counted where the program would be compiled."""
    system = four_bar(LENGTHS)

    def load(lengths):
        new = four_bar(lengths, like=system)
        return jnp.sum(mbs.reactions(new, begin(new))["A"].force ** 2)

    def ask(function, **_):
        def asked(*args):
            raise _Asked(function, args)

        return asked

    for module in (_uncertainty, _minimise):
        monkeypatch.setattr(module, "jit", ask)
    with pytest.raises(_Asked) as found, SMALL_PROGRAM(True):
        if verb == "tolerances":
            mbs.design.tolerances(load, LENGTHS, 1e-3 * LENGTHS)
        else:
            limit = mbs.Limit("load", load, upper=1e3)
            mbs.minimise(jnp.sum, LENGTHS, limits=limit, gradient="forward", compile="quick", progress=False)
    function, args = found.value.args
    with SMALL_PROGRAM(True):
        size = equations(function, *args)
    assert 0.9 * DESIGN[verb] < size <= DESIGN[verb]


ONE = {"load": probability.Normal(1.0, 0.1)}
FOUR = {
    "load": probability.Gumbel(1.0, 0.1),
    "strength": probability.Weibull(3.0, 15.0),
    "size": probability.LogNormal(2.0, 0.1),
    "share": probability.Beta(0.4, 0.02, 0.3, 0.5),
}
#: Equations of a percentile of a sum of squares, and of its derivative: of one normal number, and of four others.
PERCENTILES = {"one": (ONE, 414, 665), "four": (FOUR, 1860, 11_600)}


@pytest.mark.slow
@pytest.mark.parametrize("name", PERCENTILES)
def test_equations_of_random_numbers(name):
    """The numbers of a distribution stand at few places: in its values, in their slopes, and in what is implicit."""
    numbers, most, most_derived = PERCENTILES[name]
    answer = lambda scale: mbs.design.percentile(lambda x: scale * sum(v**2 for v in x.values()), numbers, 99.0)
    for function, ceiling in ((answer, most), (jax.grad(answer), most_derived)):
        size = equations(function, 1.0)
        assert size <= ceiling, size
        if jax.__version_info__ < (0, 11):  # later ones need fewer
            assert size > 0.9 * ceiling, f"{size} equations; lower the ceiling"


def test_programs_of_design():
    """One program has value and gradient; a search that backtracks has one more, of the values alone."""
    design, options = {"x": 0.7, "y": 0.6}, {"progress": False, "compile": "quick"}
    line = lambda d: d["x"] + 0.3 * d["y"]
    steep = mbs.Limit("steep", lambda d: jnp.exp(5.0 * (d["x"] ** 2 + d["y"] ** 2)), upper=2.0)
    flat = mbs.Limit("flat", lambda d: d["x"] + d["y"], lower=0.1)
    bounds = {"x": (-2.0, 2.0), "y": (-2.0, 2.0)}
    search = lambda limits: mbs.minimise(line, design, bounds, limits=limits, **options)
    tolerances = lambda: mbs.design.tolerances(line, design, design)
    with without_tricks("tape"):
        tolerances(), search(flat)  # programs of single operations, which are compiled once in a process
        assert [len(compiled(ask)) for ask in (tolerances, lambda: search(flat), lambda: search(steep))] == [1, 1, 2]
    if is_available():
        tolerances(), search(flat), search(steep)
        assert [len(compiled(ask)) for ask in (tolerances, lambda: search(flat), lambda: search(steep))] == [0, 0, 0]


@pytest.mark.slow
def test_programs_of_an_equilibrium():
    system = four_bar(LENGTHS)
    state = begin(system)
    with pytest.warns(UserWarning, match="unstable"):
        assert len(compiled(lambda: mbs.equilibrium(system, state, follow=False))) <= 1
    assert len(compiled(lambda: mbs.equilibrium(system, state))) <= 2  # once more with the loads from zero


# ------------------------------------------------------------------------------- one and many things of a kind
def hoists(count, **cable):
    """Two masses on a rope over a wheel, so many times."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    for k in range(count):
        for side, x in (("l", -0.1), ("r", 0.1)):
            b.body(f"{side}{k}", 1.0 + 0.1 * k)
            b.joint(f"{side}{k}", mbs.Prismatic("z"), "ground", f"{side}{k}", parent_frame=(x, float(k), -1.0))
        wheel = Sheave(("ground", (0.0, float(k), 0.0)), 0.1, axis="y")
        b.cable(f"c{k}", [Attachment(f"l{k}"), wheel, Attachment(f"r{k}")], free_length=2.0 + 0.1 * np.pi, **cable)
    return b.build()


def spatial_tendons(count):
    """Eight arms, so many pairs of which a path with a spring of its length joins round a ball."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    for k in range(8):
        b.body(f"b{k}", 1.0, inertia=0.1)
        b.joint(f"j{k}", mbs.Revolute("y"), "ground", f"b{k}", parent_frame=(1.0 * (k % 2), float(k // 2), 0.0))
    for k in range(count):
        ends = [("ground", (-1.0, float(k), 0.0)), ("ground", (2.0, float(k), 0.0))]
        ball = WrapSphere(("ground", (0.5, float(k), -0.1)), 0.2, axis="y")
        path = [Attachment(ends[0]), Eyelet((f"b{2 * k}", (0.0, 0.0, 0.5))), ball, Attachment(f"b{2 * k + 1}")]
        b.cable(f"t{k}", path, law=PolynomialSpring([100.0, 5.0], damping=[1.0]))
    return b.build()


def fixed_tendons(count):
    """Eight wheels and four discs, so many of which have the length of a tendon between two wheels, with a spring."""
    b = mbs.SystemBuilder()
    for k in range(8):
        b.body(f"b{k}", 1.0, inertia=0.1)
        b.joint(f"j{k}", mbs.Revolute("z"), "ground", f"b{k}")
    for k in range(4):
        b.body(f"d{k}", 0.1, inertia=0.01)
        b.joint(f"t{k}", mbs.Revolute("z"), "ground", f"d{k}")
    for k in range(count):
        b.constraint(f"g{k}", mbs.Coupler({f"t{k}": -1.0, f"j{k}": 1.0 + k, f"j{k + 1}": -2.0}))
        b.force(f"s{k}", PolynomialSpring([100.0, 5.0], damping=[1.0]), joint=f"t{k}")
    return b.build()


def geared(count):
    """Sixteen wheels, so many of them coupled to the next one."""
    b = mbs.SystemBuilder()
    for k in range(16):
        b.body(f"b{k}", 1.0, inertia=0.1)
        b.joint(f"j{k}", mbs.Revolute("z"), "ground", f"b{k}")
    for k in range(count):
        b.constraint(f"g{k}", mbs.Coupler({f"j{k}": 1.0 + k, f"j{k + 1}": -2.0}))
    return b.build()


def turned(count):
    """Sixteen wheels, so many of them driven."""
    b = mbs.SystemBuilder()
    for k in range(16):
        b.body(f"b{k}", 1.0, inertia=0.1)
        drive = mbs.Harmonic(0.1 * (k + 1)) if k < count else None
        b.joint(f"j{k}", mbs.Revolute("z"), "ground", f"b{k}", drive=drive)
    return b.build()


class Guide(AbstractRows):
    """A row of a user's: the origin of frame B stays on a parabola of frame A; no slopes given."""

    num_frames = 2

    curvature: jax.Array

    def value(self, rotations, positions, q, t):
        x, y, _ = rotations[0].T @ (positions[1] - positions[0])
        return (y - self.curvature * x**2)[None]


def guided(count):
    """Four beads in the plane, so many of them on a guide."""
    b = mbs.SystemBuilder(gravity=(0, -9.81, 0))
    for k in range(4):
        b.body(f"b{k}", 1.0, inertia=0.1)
        b.joint(f"j{k}", mbs.Planar("z"), "ground", f"b{k}")
    for k in range(count):
        b.constraint(f"g{k}", Guide(jnp.asarray(0.5 + 0.1 * k)), between=("ground", f"b{k}"))
    return b.build()


def controlled(count):
    """Sixteen wheels, so many of them with a speed loop: a measure, a PI and an actuator."""
    b = mbs.SystemBuilder()
    for k in range(16):
        b.body(f"b{k}", 1.0, inertia=0.1)
        b.joint(f"j{k}", mbs.Revolute("z"), "ground", f"b{k}")
    for k in range(count):
        b.force(f"motor{k}", mbs.Actuator(0.0), joint=f"j{k}")
        b.measure(f"speed{k}", joint=f"j{k}", of="velocity")
        b.block(f"loop{k}", blocks.PI(1.0 + k, 2.0, target=1.0), reads=f"speed{k}", drives=f"motor{k}")
    return b.build()


def piped(count):
    """A wheel, and so many volumes of oil that orifices join in a row."""
    b = mbs.SystemBuilder()
    b.body("b", 1.0, inertia=0.1)
    b.joint("j", mbs.Revolute("z"), "ground", "b")
    b.hydraulic("tank", hydraulics.Tank())
    for k in range(count):
        b.hydraulic(f"v{k}", hydraulics.Volume(1e-3, pressure=1e6 * (k + 1)))
        ports = {"a": f"v{k}", "b": f"v{k + 1}" if k + 1 < count else "tank"}
        b.hydraulic(f"o{k}", hydraulics.Orifice(1e-6), ports=ports)
    return b.build()


def sprung(count):
    """Sixteen wheels, so many of them with a spring."""
    b = mbs.SystemBuilder()
    for k in range(16):
        b.body(f"b{k}", 1.0, inertia=0.1)
        b.joint(f"j{k}", mbs.Revolute("z"), "ground", f"b{k}")
    for k in range(count):
        b.force(f"s{k}", mbs.SpringDamper(10.0 + k, 0.1), joint=f"j{k}")
    return b.build()


def rubbing(count, model=SmoothCoulomb(0.2, transition_speed=0.05)):  # noqa: B008
    """A four-bar, so many of whose pins rub."""
    b = four_bar_builder(LENGTHS)
    for name in "ADBC"[:count]:
        b.friction(f"rub {name}", name, model, radius=0.02)
    return b.build(guess={"A": 0.7, "B": -0.2, "D": 1.2})


def touching(count, friction=None):
    """Four balls, so many of which touch the ground."""
    b = mbs.SystemBuilder(gravity=(0, 0, -9.81))
    for k in range(4):
        b.body(f"b{k}", 1.0, inertia=0.1)
        b.joint(f"j{k}", mbs.Free(), "ground", f"b{k}")
    for k in range(count):
        b.contact(f"c{k}", SphereOnPlane(0.1), f"b{k}", "ground", HuntCrossley(1e5), friction)
    return b.build()


def rubbed(count):
    """Four blocks, so many of them under friction of a given load."""
    b = mbs.SystemBuilder()
    for k in range(4):
        b.body(f"b{k}", 1.0)
        b.joint(f"j{k}", mbs.Prismatic("x"), "ground", f"b{k}")
    for k in range(count):
        b.force(f"f{k}", FrictionForce(SmoothCoulomb(0.1 * (k + 1)), 5.0), joint=f"j{k}")
    return b.build()


def bent(count):
    """So many cantilevers of two exact beam elements."""
    b = mbs.SystemBuilder(gravity=(0, 0, 0))
    section = BeamSection([1e6, 1e6, 1e6, 1.0, 1.0, 1.0], 1.0, [2e-3, 1e-3, 1e-3])
    for k in range(count):
        ends = [(0.0, float(k), 0.0), (1.0, float(k), 0.0)]
        b.beam(f"rod{k}", section, ends, 2, (0, 1, 0))
        b.joint(f"clamp{k}", mbs.Weld(), "ground", f"rod{k}.0", at=ends[0])
    return b.build()


def swinging(count):
    """So many elastic arms on hinges."""
    b, frame = mbs.SystemBuilder(), elastic_beam(0.5, 3, num_modes=1)
    for k in range(count):
        b.elastic(f"arm{k}", frame.body)
        place = (0.0, float(k), 0.0)
        b.joint(f"pin{k}", mbs.Revolute("y"), "ground", f"arm{k}.{frame.body.interfaces[0]}", parent_frame=place)
    return b.build()


def meshing(count):
    """Eight wheels, so many pairs of which mesh by their teeth, and a motor's rotor on each of these pairs."""
    b = mbs.SystemBuilder()
    for k in range(8):
        b.body(f"b{k}", 1.0, inertia=0.1)
        b.joint(f"j{k}", mbs.Revolute("z"), "ground", f"b{k}", parent_frame=(0.1 * (k % 2), float(k // 2), 0.0))
    for k in range(count):
        b.rotor(f"j{2 * k}", 1e-3, ratio=5.0)
        teeth = {"teeth": (20, 20), "module": 0.005, "stiffness": 1e8, "damping": 1e3}
        b.gear_pair(f"g{k}", f"b{2 * k}", f"b{2 * k + 1}", **teeth)
    return b.build()


def rolling(count):
    """Four wheels on one carriage, so many of them on tyres."""
    tyre = mbs.vehicles.Tyre(mbs.vehicles.MagicFormula(SAMPLE_TYRE, "5.2"))
    b = mbs.SystemBuilder()
    b.body("carriage", 1000.0, inertia=500.0)
    b.joint("carriage", mbs.Free(), "ground", "carriage")
    for k in range(4):
        b.body(f"wheel{k}", 20.0, inertia=1.0)
        b.joint(f"spin{k}", mbs.Revolute("y"), "carriage", f"wheel{k}", parent_frame=(k - 1.5, (-1.0) ** k, 0.32))
    for k in range(count):
        b.force(f"tyre{k}", tyre, between=("ground", f"wheel{k}"))
    return b.build()


#: model of so many things, how many are many; equations with one and growth with many, of accelerations and motion
KINDS = {
    "inextensible cable": (lambda n: hoists(n, inextensible=True), 4, (1670, 20), (7600, 60)),
    "elastic cable": (lambda n: hoists(n, stiffness=1e5, damping=10.0), 4, (1530, 20), (5080, 60)),
    "friction in joints": (rubbing, 4, (1150, 65), (3390, 110)),
    "friction in joints, bristles": (lambda n: rubbing(n, LuGre(0.2, 1e3, 10.0)), 4, (1160, 65), (3530, 125)),
    "contact": (touching, 4, (1860, 30), (4680, 110)),
    "contact with friction": (lambda n: touching(n, 0.3), 4, (1890, 30), (4710, 110)),
    "contact with bristles": (lambda n: touching(n, LuGre(0.3, 1e3, 5.0)), 4, (2220, 30), (5390, 135)),
    "cable with friction": (lambda n: hoists(n, stiffness=1e5, friction=0.2), 4, (1840, 20), (5385, 65)),
    "friction as a law": (rubbed, 4, (1070, 20), (3280, 50)),
    "spatial tendon": (spatial_tendons, 4, (2570, 10), (6840, 20)),
    "fixed tendon": (fixed_tendons, 4, (770, 10), (2880, 20)),
    "coupler": (geared, 15, (850, 40), (3100, 40)),
    "row of a user": (guided, 4, (1010, 20), (4320, 20)),
    "drive": (turned, 15, (890, 20), (3900, 40)),
    "control loop": (controlled, 16, (1290, 10), (3740, 20)),
    "volume and orifice": (piped, 12, (940, 10), (3020, 20)),
    "spring": (sprung, 16, (1300, 10), (3660, 20)),
    "exact beam": (bent, 4, (2200, 400), (4850, 750)),
    "elastic body": (swinging, 4, (3250, 200), (8010, 260)),
    "tyre": (rolling, 4, (3200, 30), (6800, 90)),
    "gear pair and rotor": (meshing, 4, (1560, 10), (4220, 20)),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_many_things_of_a_kind_cost_what_one_does(kind):
    build, many, *ceilings = KINDS[kind]
    for name, (most, growth) in zip(("forward dynamics", "simulate"), ceilings, strict=True):
        one, more = (
            equations(*asked(system, mbs.State.at(system), QUESTIONS[name])) for system in map(build, (1, many))
        )
        assert one <= most and more - one <= growth, (name, one, more)
        if jax.__version_info__ < (0, 11):  # later ones need fewer
            assert one > 0.9 * most, f"{name}: {one} equations; lower its ceiling"


#: What a builder adds without a row above, and why.
WITHOUT_ROW = {
    "body": "in every row", "joint": "in every row", "frame": "a number of a body", "link": "a body of other numbers",
    "drive": "a word of its joint, as in its row",
}  # fmt: skip


@pytest.mark.slow
def test_every_kind_of_thing_has_a_ceiling(monkeypatch):
    """A method of the builder that adds a thing is called by the model of a row."""
    nouns = {name for name in dir(mbs.SystemBuilder) if not name.startswith("_")} - {"build", "faults", "declared"}
    called = set()

    def noted(name, method):
        return lambda *args, **options: called.add(name) or method(*args, **options)

    for name in nouns:
        monkeypatch.setattr(mbs.SystemBuilder, name, noted(name, getattr(mbs.SystemBuilder, name)))
    for build, *_ in KINDS.values():
        build(1)
    assert nouns - called - set(WITHOUT_ROW) == set()


@pytest.mark.long
@pytest.mark.parametrize("small", GRADIENT)
def test_the_gradient_of_a_load(small):
    system = four_bar(LENGTHS)

    def loss(lengths):
        new = four_bar(lengths, like=system)
        return jnp.sum(mbs.reactions(new, mbs.simulate(new, begin(new), t1=1.0))["A"].force ** 2)

    gradient, lengths = jax.grad(loss), jnp.asarray(LENGTHS)
    with SMALL_PROGRAM(small):
        size = equations(gradient, lengths), stablehlo_bytes(gradient, lengths)
    for found, most in zip(size, GRADIENT[small], strict=True):
        assert 0.9 * most < found <= most


@pytest.mark.long
def test_programs_from_import_to_reactions():
    """One tries the compiler's options, one serves build and `State.at`, two are of diffrax, two answer questions."""
    environment = {name: value for name, value in os.environ.items() if name != "XLA_FLAGS"}
    command = [sys.executable, str(BENCHMARKS / "cold_child.py"), "pendulum", ""]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    assert json.loads(done.stdout.splitlines()[-1])["programs from import to reactions"] <= 6


# ------------------------------------------------------------------------------------- peaks, drives, implicit stages
def driven_chain(n):
    """Every hinge of a chain follows a table of its own."""
    times = np.linspace(0.0, 1.0, 5)
    return chain_of_bars(n, lambda k: mbs.Spline(times, 0.1 * (k + 1) * times**2))


def peak_of_a_load(system, _, motion):
    return mbs.motion.peak(system, motion, lambda s: jnp.linalg.norm(mbs.reactions(system, s)["A"].force))


def implicit_motion(stiffness):
    """Of a linear system."""
    system = LinearSystem(stiffness=stiffness, mass=np.eye(3), damping=0.1 * np.eye(3), interface=[0])
    times = jnp.linspace(0.0, 1.0, 11)
    push = jnp.sin(times)[:, None] * jnp.ones((1, 3))
    return mbs.simulate(system, ts=times, forces=push, solver=diffrax.Kvaerno5()).displacement


def size_of(function, numbers):
    """Equations, loops, and programs that are called where no trace is under way."""
    programs = [e for e in jax.make_jaxpr(function)(numbers).jaxpr.eqns if e.primitive.name == "jit"]
    return equations(function, numbers), loops(function, numbers), len(programs)


def peaks_of_a_four_bar(question):
    system = four_bar(LENGTHS)
    return asked(system, begin(system), question)


def driven(question):
    system = driven_chain(7)
    return asked(system, mbs.State.at(system), question)


def vehicle_parts():
    """Examples of the room, built outside of traces."""
    vehicle_examples.rig(), vehicle_examples.on_posts()
    return vehicle_examples


def road_damage():
    linear, curve = vehicle_parts().quarter(), mbs.fatigue.SN(1e21, 5.0)

    def damage(level):
        mix = {"C": mbs.vehicles.RoadShare(mbs.vehicles.RandomRoad(level), 20.0, 1.0)}
        return mbs.vehicles.road_mix_damage(linear, mix, {"road": (0.0, 0.0)}, curve, 3e8).damage

    return damage, jnp.asarray(256e-6)


def of_hinge(question):
    """What is asked of a trailing arm on the rig, of a point of its hinge."""
    rig = vehicle_parts().rig()
    return lambda point: question(rig, {"P": point}), jnp.asarray(vehicle_examples.ARM["P"])


def solid_axle():
    b = chassis()
    own = mbs.vehicles.mount_solid_axle(b, FOUR_LINKS, LINKS, "rear", "chassis", 90.0, (9.0, 1.0, 9.0), SPRING)
    system = b.build()
    return asked(system, mbs.State.at(system), lambda s, at, _: mbs.vehicles.hardpoint_loads(s, at, own, "chassis"))


# a peak has the load twice in it, drives of one structure are evaluated once for all
FIRST_ANSWERS = {  # equations, loops, programs
    "peak": (lambda: peaks_of_a_four_bar(peak_of_a_load), (7000, 40, 1)),
    "load_peaks": (lambda: peaks_of_a_four_bar(lambda s, _, m: mbs.motion.load_peaks(s, m)), (7300, 40, 1)),
    "seven drives, simulate": (lambda: driven(QUESTIONS["simulate"]), (4220, 30, 1)),
    "seven drives, reactions": (lambda: driven(QUESTIONS["reactions"]), (1300, 5, 1)),
    "implicit motion": (lambda: (implicit_motion, jnp.eye(3)), (1150, 7, 2)),
    "road damage": (road_damage, (830, 3, 3)),
    "four posts": (
        lambda: (lambda f: mbs.vehicles.four_post(vehicle_parts().on_posts(), f).transfer, jnp.arange(1.0, 4.0)),
        (160, 1, 1),
    ),
    "curves of a suspension": (lambda: of_hinge(lambda rig, H: rig.curves(0.01, hardpoints=H)), (4530, 19, 1)),
    "loads of a suspension": (lambda: of_hinge(lambda rig, H: rig.loads(np.ones(3), hardpoints=H)), (5960, 29, 1)),
    "an axle in roll": (
        lambda: of_hinge(lambda rig, H: jax.tree.leaves(mbs.vehicles.roll_curves(rig, 0.01, SPRING, H))),
        (13_600, 50, 2),
    ),
    "solid axle": (solid_axle, (1830, 5, 2)),
}


@pytest.mark.parametrize("name", cases(FIRST_ANSWERS, slow=[*list(FIRST_ANSWERS)[:3], *list(FIRST_ANSWERS)[5:]]))
def test_first_answers(name):
    case, most = FIRST_ANSWERS[name]
    size = size_of(*case())
    assert all(a <= b for a, b in zip(size, most, strict=True)), size
    if jax.__version_info__ < (0, 11):
        assert size[0] > 0.9 * most[0], f"{size[0]} equations; lower the ceiling"


# Stiffness and mass of one element.  Shells of three nodes have a shear angle of each side and its share; so has a
# wedge with shear from its sides.  Enhanced strains are turned as tensors.
ELEMENTS = {
    **dict(mass=10, mass_with_arm=30, spring=40, ground_spring=10, rod=45, lumped_rod=45, beam=540, thick_beam=610),
    **dict(triangle=1010, weak_triangle=910, layered_triangle=1250, shear_panel=560, quadrilateral=885),
    **dict(
        residual_quadrilateral=1175, layered_quadrilateral=925, quadratic_triangle=820, quadratic_quadrilateral=580
    ),
    **dict(hexahedron=395, tetrahedron=240, wedge=395, residual_triangle=880, side_wedge=725),
    **dict.fromkeys(("quadratic_tetrahedron", "quadratic_wedge", "quadratic_hexahedron"), 235),
}


@pytest.mark.slow
def test_equations_of_elements():
    """Every kind of element has a ceiling on the equations of its matrices."""
    assert set(ELEMENTS) == set(CASES)
    found = {
        name: equations(lambda element, nodes: (element.stiffness(nodes), element.mass(nodes)), element, nodes)
        for name, (element, nodes, _) in CASES.items()
    }
    assert not {name: count for name, count in found.items() if count > ELEMENTS[name]}


def test_equations_of_the_ends_of_bearing_tables():
    K = np.ones((9, 2, 2)) * 1e7

    def margins(number):
        tables = [mbs.rotors.BearingTable(k, np.linspace(10.0, 900.0, 9), K, 1e-3 * K) for k in range(number)]
        return lambda speeds: jax.tree.leaves(bearing_validity(tables, speeds).margins)

    speeds = jnp.linspace(50.0, 800.0, 5)
    assert equations(margins(1), speeds) <= 25 and equations(margins(4), speeds) <= 100
