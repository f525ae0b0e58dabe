"""Every public class of results prints a table with names, numbers and units, and gives its numbers to pandas and
xarray as they are.

The table has a small one of each, made by hand; a new class fails here until it has its line, or a reason why not.
"""

import importlib
import inspect
import types
from xml.etree import ElementTree

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs.assembly import State
from jaxmbs.design._chaos_fit import ChaosFit
from jaxmbs.forces import Margin, Reading
from jaxmbs.quantities import Axis, Quantity, along_freedoms, entries, matrix, numbered
from jaxmbs.reports import Report, Reported, failures
from tests.misuse.parts import PLAIN_TYRE
from tests.misuse.test_misuse import CASES, EXEMPT, PUBLIC
from tests.misuse.zoo import Zoo
from tests.test_public_faces import FACES
from tests.test_tables import loads, motion, redundancy

T, F = jnp.array([0.0, 0.5, 2.0]), jnp.array([10.0, 20.0, 40.0])
YES = jnp.ones(3, bool)


def numbers(*shape):
    """Different numbers of a shape, of both signs."""
    return jnp.asarray(np.sin(1.0 + np.arange(np.prod(shape))).reshape(shape))


def complexes(*shape):
    return jax.lax.complex(numbers(*shape), numbers(*shape)[..., ::-1])


def state(*lead):
    structure = (("pin", "Revolute", 1, 1, ("angle",)), ("ball", "Spherical", 4, 3, ("w", "x", "y", "z")))
    t = jnp.broadcast_to(jnp.asarray(T[: lead[-1]] if lead else 0.5), lead)
    return State(t, numbers(*lead, 5), numbers(*lead, 4), jnp.zeros(lead), structure)


def transfer():
    return mbs.linear.TransferFunctions(2 * jnp.pi * F, complexes(3, 2, 2), ["a", "b"], ["a", "b"])


def cable():
    parts = numbers(3), numbers(3), numbers(3), numbers(3, 2), 1 + numbers(3, 3) ** 2, numbers(3, 2, 2, 3)
    one = mbs.dynamics.CableResult(*parts, jnp.ones((3, 2), bool), numbers(3, 3, 3), numbers(3, 3, 3), (1,), (), T)
    return one


def friction():
    by = {"pin": numbers(3)}
    marks = {"pin": jnp.asarray(YES)}, {"pin": ~jnp.asarray(YES)}
    return mbs.dynamics.FrictionLoads(
        by, {"pin": numbers(3, 1)}, by, numbers(3), {"pin": jnp.array([False, True, False])}, marks[1], marks[0], T
    )


def chaos_fit():
    """A polynomial that nobody asks."""
    return ChaosFit(*[None] * len(ChaosFit._fields))


def optimum():
    f = lambda d: (d["x"] - 1.0) ** 2 + 0.1 * d["y"] ** 2
    return mbs.minimise(f, {"x": 2.0, "y": 0.5}, {"x": (-2.0, 4.0), "y": (-1.0, 1.0)}, progress=False)


def linearisation():
    space = mbs.blocks.StateSpace(numbers(4, 4), numbers(4, 1), numbers(1, 4), numbers(1, 1))
    names = ("pin", "slide")
    parts = (numbers(2, 2) for _ in range(4))
    sets = (0, 1), (0, 1), names, names, (), ("drive",), ("probe",)
    return mbs.analysis.Linearisation(*parts, space, *sets)


def reaction(n=1):
    marks = jnp.ones((3, 3), bool)
    return mbs.reaction.JointReaction(numbers(3, 3), numbers(3, 3), numbers(3, n), numbers(3, n), marks, marks)


def peak():
    return mbs.motion.Peak(jnp.asarray(3.5), jnp.asarray(0.25), state())


def branch():
    stacked = jax.tree.map(lambda x: jnp.stack([x, x]), cycle())
    points = (mbs.cycles.StabilityChange("fold", 0.5, 1),)
    return mbs.cycles.Branch(
        "push", jnp.asarray([0.25, 0.5]), stacked, points, "last value reached", lambda k, v: None
    )


def cycle():
    made, fields = motion(), ("ts", "states", "result", "diagnostics", "end")
    none = jnp.asarray(0.0)
    return mbs.cycles.Cycle(
        **{name: getattr(made, name) for name in fields},
        period=jnp.asarray(2.0),
        multipliers=complexes(2),
        residual=none,
        rate_residual=none,
        is_singular=jnp.asarray(False),
        repeats=jnp.asarray(1),
        num_trivial=0,
        segments=1,
    )


def bond_reactions():
    network = mbs.statics.BodyNetwork.from_names(("one",), {"a": ("ground", "one"), "b": ("ground", "one")})
    zero = jnp.zeros(3)
    return mbs.statics.BondReactions(network, None, numbers(3, 2, 6), numbers(3, 2, 6), zero, zero, zero + 1.0)


def family():
    return mbs.statics.ReactionFamily(bond_reactions().network, numbers(2, 6))


def envelope():
    case = mbs.qualification.LoadCase("landing", np.asarray(numbers(3, 2)), ["x", "y"], T)
    return mbs.qualification.load_envelope([case])


def validity():
    return mbs.dynamics.Validity(T, {"strap": {"wrap": Margin(numbers(3, 2) ** 2, "rad", "is left", ("a", "b"))}})


def element_reports():
    readings = {"load": Reading(numbers(3), "N"), "film at": Reading(numbers(3, 2), "m", ("a", "b"))}
    return mbs.dynamics.ElementReports(T, {"bearing": readings})


def limit():
    return mbs.design.LimitResult("stroke", numbers(2), numbers(2), (0,), 1.0, "<=", 0.1, numbers(2), 0.0)


def bond_loads():
    one = mbs.coupling.BondLoad(numbers(3, 2), -numbers(3, 2), ("x", "rz"))
    return mbs.coupling.BondLoads({"bolt": one}, jnp.asarray(1e-12))


def check():
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    return mbs.check(mbs.LinearSystem(mass=np.eye(2), stiffness=K, interface=[0]))


def linear_motion():
    end = mbs.vibration.LinearState(jnp.asarray(2.0), numbers(2), numbers(2))
    parts = numbers(3, 2), numbers(3, 2), numbers(3, 2), numbers(3, 1), ()
    return mbs.vibration.LinearMotion(T, *parts, jnp.asarray(0), end, jnp.asarray(5), jnp.asarray(1))


def equilibrium():
    parts = state(), jnp.asarray(1e-12), jnp.asarray(True), jnp.asarray(True), numbers(1, 1), numbers(1)
    return mbs.analysis.Equilibrium(*parts, jnp.asarray(4))


def spectrum_response():
    parts = (
        numbers(2) ** 2,
        numbers(3, 2),
        numbers(2),
        F,
        numbers(3) ** 2,
        numbers(3),
        numbers(3) ** 2,
        jnp.asarray(1.0),
    )
    return mbs.qualification.ResponseSpectrum(*parts, ("tip", "root"), "srss")


def kic():
    return mbs.constraints.Kic(numbers(1, 1), {"crank": numbers(3, 1)}, {"crank": numbers(3, 1)}, (0,), (1,))


def contact():
    return mbs.dynamics.ContactLoad(
        numbers(3, 1), numbers(3, 1), numbers(3, 1, 3), numbers(3, 1, 3), numbers(3, 1), numbers(3, 1, 3),
        numbers(3, 1, 3), numbers(3, 1), numbers(3, 1), numbers(3, 1), T,
    )  # fmt: skip


MADE = {
    "CableResult": cable,
    "ContactLoad": contact,
    "FrictionLoads": friction,
    "ElementReports": element_reports,
    "Validity": validity,
    "CampbellDiagram": lambda: mbs.analysis.CampbellDiagram(
        jnp.asarray(F), complexes(3, 2), complexes(3, 2, 2), jnp.asarray(YES), ("pin", "slide")
    ),
    "Equilibrium": equilibrium,
    "ImpendingMotion": lambda: mbs.analysis.ImpendingMotion(
        *({"shaft": numbers(1) * k} for k in (1, 2, 3)), jnp.asarray(0.4), jnp.asarray(True), jnp.asarray(True)
    ),
    "Linearisation": linearisation,
    "Stiffness": lambda: mbs.analysis.Stiffness(*(numbers(2, 2) * k for k in (1, 2, 3, 4))),
    "Batch": lambda: mbs.batching.Batch({"peak": numbers(3), "path": numbers(3, 2)}, np.zeros(3, int), np.ones(3)),
    "BaseMotion": lambda: mbs.coupling.BaseMotion(numbers(3, 2), numbers(3, 2), numbers(3, 2), numbers(3, 1)),
    "BondLoad": lambda: bond_loads()["bolt"],
    "BondLoads": bond_loads,
    "CoupledResponse": lambda: mbs.coupling.CoupledResponse(
        numbers(2, 1), (numbers(1, 2),), (numbers(1, 2, 1),), jnp.asarray(0.0)
    ),
    "Determinacy": lambda: mbs.coupling.Determinacy(1, 0, {"bolt": (True, False)}, {"bolt": ("x", "rz")}),
    "ModalPairs": lambda: mbs.coupling.ModalPairs(jnp.eye(2)[None, None], 4.0 * jnp.eye(2)[None, None]),
    "History": lambda: mbs.design.History(np.array([3.0, 1.0]), np.array([2.0, 0.0]), np.array([1, 4])),
    "LimitResult": limit,
    "Optimum": optimum,
    "ParetoFront": lambda: mbs.design.ParetoFront(
        *(np.asarray(numbers(3)) for _ in range(2)), {"x": numbers(3)}, np.asarray(numbers(3)), np.asarray(YES)
    ),
    "Reliability": lambda: mbs.design.Reliability(
        0.01, 2.3, {"a": 1.0}, {"a": 1.0}, {"a": {"mean": 0.1}}, "form", np.ones((1, 1)), np.ones(1)
    ),
    "InteriorPoint": lambda: mbs.design.InteriorPoint(
        {"x": numbers(3)},
        numbers(3),
        numbers(3, 0),
        numbers(3, 1),
        numbers(3, 1),
        numbers(3, 1),
        *[numbers(3)] * 4,
        jnp.zeros(3, int),
        None,
        numbers(3),
    ),  # fmt: skip
    "PolynomialChaos": lambda: mbs.design.PolynomialChaos(
        1.0, 0.1, {"a": 1.0}, {"a": 1.0}, {}, {"mean": {"a": {"mean": 1.0}}}, 1e-3, 20, 0, 3, chaos_fit()
    ),
    "Tolerance": lambda: mbs.design.Tolerance("mass", 0.1, 2.0, 1.0),
    "Uncertainty": lambda: mbs.design.Uncertainty(1.0, 0.1, 1.2, 0, np.asarray(numbers(3))),
    "MeasuredModes": lambda: mbs.experiment.MeasuredModes(F, np.asarray(numbers(2, 3)), ("a", "b"), np.full(3, 0.01)),
    "SuspensionCheck": lambda: mbs.experiment.SuspensionCheck(numbers(2), *map(jnp.asarray, (5.0, 5.1, 0.1)), 0.2),
    "VirtualPoint": lambda: mbs.experiment.VirtualPoint(transfer(), numbers(3, 2), numbers(3, 2)),
    "Cycles": lambda: mbs.fatigue.Cycles(numbers(3), numbers(3), numbers(3)),
    "Buckling": lambda: mbs.fem.Buckling(numbers(2), numbers(4, 2), numbers(4)),
    "StressEnvelope": lambda: mbs.flexible.StressEnvelope(*({"skin": numbers(4, 2) * k} for k in (1, 2, 3, 4))),
    "Branch": branch,
    "Cycle": cycle,
    "Flywheel": lambda: mbs.engines.Flywheel(jnp.asarray(2.0), jnp.asarray(0.01), cycle(), 4),
    "HarmonicCycles": lambda: mbs.cycles.HarmonicCycles(
        *(F, complexes(3, 2, 1), complexes(3, 2, 1), numbers(3), jnp.ones(3, bool), numbers(3)),
        *((1, 3), ("x",), ("stop",)),
    ),
    "Orders": lambda: mbs.engines.Orders(numbers(3), complexes(3)),
    "BearingValidity": lambda: mbs.rotors.BearingValidity(
        F, {"bearing 0": jax.vmap(mbs.rotors.BearingTable(0, [1.0, 9.0], *numbers(2, 2, 2, 2)).validity)(F)}
    ),
    "CriticalSpeeds": lambda: mbs.rotors.CriticalSpeeds(complexes(3), numbers(3)),
    "Orbit": lambda: mbs.rotors.Orbit(F, numbers(3), numbers(3), numbers(3)),
    "Resonance": lambda: mbs.rotors.Resonance(*map(jnp.asarray, (50.0, 1e-3, 49.0, 51.0))),
    "RunUp": lambda: mbs.rotors.RunUp(jnp.asarray(T), jnp.asarray(T), numbers(len(T), 2, 2)),
    "UnbalanceResponse": lambda: mbs.rotors.UnbalanceResponse(F, complexes(3, 2, 2), complexes(3, 1, 2)),
    "WhirlSpeeds": lambda: mbs.rotors.WhirlSpeeds(F, complexes(3, 2), numbers(3, 2)),
    "Direction": lambda: mbs.identification.Direction("a + 0.3 b", {"a": 1.0, "b": 0.3}, 2.0, "a"),
    "Curves": lambda: mbs.io.Curves(T, numbers(3, 2), "time", ["a", "b"], ["m", "N"]),
    "Kic": kic,
    "SecondKic": lambda: mbs.constraints.SecondKic(
        numbers(1, 1, 1), {"a": numbers(1, 3, 1)}, {"a": numbers(1, 3, 1)}
    ),
    "State": state,
    "Check": check,
    "StaticResponse": lambda: mbs.linear.StaticResponse(numbers(3), numbers(0), numbers(3, 0)),
    "TransferFunctions": transfer,
    "Diagnostics": lambda: motion().diagnostics,
    "EventRecord": lambda: mbs.motion.EventRecord(jnp.asarray(T), jnp.array([0, 1, 0]), ("hit", "go")),
    "LoadPeaks": lambda: mbs.motion.LoadPeaks({"pin": peak()}, {"pin": peak()}),
    "Motion": motion,
    "Peak": peak,
    "DamageSpectrum": lambda: mbs.qualification.DamageSpectrum(F, numbers(3), numbers(3)),
    "Envelope": envelope,
    "LoadCase": lambda: mbs.qualification.LoadCase("landing", np.asarray(numbers(3, 2)), ["x", "y"], T),
    "ResponseSpectrum": spectrum_response,
    "ShockSpectrum": lambda: mbs.qualification.ShockSpectrum(
        jnp.asarray(F), numbers(2, 3), numbers(2, 3), "absolute acceleration"
    ),
    "LoadTable": lambda: mbs.vehicles.LoadTable(
        {"tie_rod": numbers(3)}, {"LF": numbers(3, 3)}, {"force": numbers(3, 3)}, ("kerb", "bump", "turn")
    ),
    "RoadMixDamage": lambda: mbs.vehicles.RoadMixDamage(
        numbers(2, 3), numbers(3, 3), jnp.asarray(1e5), ("good", "bad"), ("LF", "LR", "tie rod")
    ),
    "FourPost": lambda: mbs.vehicles.FourPost(F, complexes(3, 2, 2), ("seat", "tyre"), ("heave", "roll")),
    "RigCurves": lambda: mbs.vehicles.RigCurves(
        *(numbers(3) for _ in range(8)), numbers(3, 3), numbers(3, 3), *(numbers(3) for _ in range(7))
    ),
    "RollCurves": lambda: mbs.vehicles.RollCurves(*(numbers(3) for _ in range(3)), *[MADE["RigCurves"]()] * 2),
    "Ride": lambda: mbs.vehicles.Ride(numbers(2, 2) @ numbers(2, 2).T, ("seat", "seat Wk")),
    "SingleTrack": lambda: mbs.vehicles.SingleTrack(1e3, 1.5e3, 1.2, 1.4, PLAIN_TYRE, PLAIN_TYRE),
    "BrakeInTurn": lambda: mbs.vehicles.BrakeInTurn(*map(jnp.asarray, (1.1, 1.2, 0.05))),
    "SteadyTurn": lambda: mbs.vehicles.SteadyTurn(*map(jnp.asarray, (0.02, 0.01, 0.3, 0.002))),
    "SteerGain": lambda: mbs.vehicles.SteerGain(jnp.asarray(4.0), jnp.asarray(-0.2)),
    "StepResponse": lambda: mbs.vehicles.StepResponse(*map(jnp.asarray, (0.3, 4.0, 0.2, 0.33, 0.4, 0.1))),
    "SineResponse": lambda: mbs.qualification.SineResponse(
        F, numbers(3), numbers(3), complexes(3, 2), jnp.array([-1, 0, -1]), jnp.asarray(2.0), ("cap",), ("a", "b")
    ),
    "Actuation": lambda: mbs.reaction.Actuation({"shaft": numbers(3, 1)}, numbers(3), numbers(3), YES, T),
    "DriveLoad": lambda: mbs.reaction.DriveLoad(numbers(3, 1), jnp.ones((3, 1), bool)),
    "JointReaction": reaction,
    "LawForce": lambda: mbs.reaction.LawForce(numbers(3, 1), numbers(3, 3), None),
    "Reactions": loads,
    "RowLoad": lambda: mbs.reaction.RowLoad(numbers(3, 2), {"pin": numbers(3, 1)}, jnp.ones((3, 2), bool)),
    "BondReaction": lambda: bond_reactions()["a"],
    "BondReactions": bond_reactions,
    "ReactionFamily": family,
    "ReactionMatrix": lambda: mbs.statics.ReactionMatrix(*(np.eye(6),) * 4, np.zeros(6, int)),
    "Redundancy": redundancy,
    "Designs": lambda: mbs.studies.Designs({"x": np.asarray(numbers(3))}, (("x", np.asarray(numbers(3))),)),
    "SobolShares": lambda: mbs.studies.SobolShares({"x": 0.7, "y": 0.2}, {"x": 0.8, "y": 0.3}, 0.99, 4, 1.0, 0.5),
    "HarmonicResponse": lambda: mbs.vibration.HarmonicResponse(2 * jnp.pi * F, complexes(3, 2), jnp.asarray(0.1), ()),
    "LinearMotion": linear_motion,
    "LinearState": lambda: linear_motion().end,
    "ModalMotion": lambda: mbs.vibration.ModalMotion(*(numbers(3, 2) * k for k in (1, 2, 3))),
    "Modes": lambda: mbs.vibration.natural_modes(K=np.diag([4.0, 9.0]), M=np.eye(2)),
    "ResonanceGains": lambda: mbs.vibration.ResonanceGains(
        complexes(3, 2, 1), jnp.asarray(F), numbers(3), numbers(2, 1), numbers(1)
    ),
}
WITHOUT = {
    "components and models that are asked further": """
        SystemBlock MeasuredNetwork ComponentNetwork FloatingFrame GeometricStiffening System Topology Reduced
        SymmetrySubspace VirtualMotions VectorField Factor Plan Group CoordinateTable Instant
    """,
    "values inside of a trace": "PhaseState Rates",
    "a model, and loads of one pose as they are": "Rig PartLoads Compliance",
    "their print is a sentence for each finding of the file": "Imported JointLimits Mesh",
    "made by a search or an integral, in the long test": """
        Identification Excitation ModelUpdate RandomResponse CriticalPlane StressSpectrum Stresses
    """,
    "made by reading a file": "Deck",
    "a line in the table of its branch": "StabilityChange",
    "names, and lengths of a drawing": "MountedParts Lane",
    "no result": "Status PsdTable",
}
#: Numbers of the user, whose units are not known, or counts.
UNITLESS = {"Optimum", "Redundancy", "SobolShares", "Check", "Determinacy", "SuspensionCheck"}


def test_every_public_result_has_a_line():
    answers = {name.rpartition(".")[2] for name in EXEMPT["answers, made by the library"].split()}
    known = set(MADE) | {name for names in WITHOUT.values() for name in names.split()}
    assert not answers - known, f"add a line, or a reason, for {sorted(answers - known)}"
    classes = {n: getattr(importlib.import_module(r), n) for r in FACES for n in importlib.import_module(r).__all__}
    reporting = {name for name, one in classes.items() if inspect.isclass(one) and hasattr(one, "to_pandas")}
    assert not reporting - known - {"Plan"}


@pytest.mark.parametrize("name", MADE)
def test_print_is_a_table_with_units(name):
    made = MADE[name]()
    assert type(made).__name__ == name
    for shown in (str(made), repr(made)):
        assert "f64[" not in shown and "Array(" not in shown and "array(" not in shown
        lines = shown.splitlines()
        assert len(lines) <= 25 and max(map(len, lines)) <= 110 or "\n" not in shown
        assert "unit" in shown or "[" in shown or name in UNITLESS
    assert repr(made).startswith(name)


ASKED = """
    experiment.update identification.best_excitation qualification.critical_plane qualification.stress_spectrum
    qualification.random_response flexible.section_stresses bondgraph.bond_powers bondgraph.element_powers
    experiment.free_response coupling.truncation_shortfall dynamics.cable_states
""".split()


@pytest.mark.long
@pytest.mark.parametrize("name", ASKED)
def test_answers_of_questions_print_tables(name):
    args, options = CASES[name].arguments(Zoo())
    made = PUBLIC[name](*args, **options)
    for one in made.values() if isinstance(made, dict) else [made]:
        assert "f64[" not in repr(one) and "Array(" not in repr(one)
        assert len(repr(one).splitlines()) <= 25 and max(map(len, repr(one).splitlines())) <= 110
        assert len(one.to_pandas()) and len(one.to_xarray().data_vars)


@pytest.mark.parametrize("name", MADE)
def test_notebooks_show_the_same_numbers(name):
    made = MADE[name]()
    page = ElementTree.fromstring(f"<div>{made._repr_html_()}</div>")  # fails for what is not well formed
    rows = [[cell.text or "" for cell in row] for row in page.iter("tr")]
    said = " ".join(page.find("p").itertext())
    assert said.startswith(name) and said[:60] in " ".join(repr(made).split())
    for row in rows:
        assert any(all(cell in line for cell in row) for line in repr(made).splitlines()) or "..." in repr(made)


@pytest.mark.parametrize("name", MADE)
def test_data_sets_have_the_numbers_as_they_are(name):
    made = MADE[name]()
    if type(made).to_xarray is not Reported.to_xarray:
        return  # a data set of its own, tested in its room
    report, data, table = made.report(), made.to_xarray(), made.to_pandas()
    assert len(table)
    for quantity in report.quantities:
        np.testing.assert_array_equal(data[quantity.name].values, np.asarray(quantity.values))
        assert data[quantity.name].attrs.get("units", "") == quantity.unit
        assert len(data[quantity.name].dims) == len(report.axes(quantity))


@pytest.mark.parametrize("name", ["CableResult", "Actuation", "FrictionLoads", "LinearMotion", "Validity"])
def test_times_are_in_seconds(name):
    made = MADE[name]()
    np.testing.assert_array_equal(made.to_xarray()["time"].values, T)
    assert made.to_xarray()["time"].attrs["units"] == "s" and made.to_pandas().index.name == "time"
    np.testing.assert_array_equal(made.to_pandas().index, T)


def test_columns_have_the_numbers_of_the_result():
    made = cable()
    table = made.to_pandas()
    np.testing.assert_array_equal(table["tension"], made.tension)
    np.testing.assert_array_equal(table["force on element 1 z"], made.force[:, 1, 2])
    np.testing.assert_array_equal(table["point of span 0 last y"], made.points[:, 0, 1, 1])
    assert table.attrs["units"]["tension"] == "N"
    drive = MADE["Actuation"]()
    np.testing.assert_array_equal(drive.to_pandas()["shaft"], drive.efforts["shaft"][:, 0])
    one = MADE["ImpendingMotion"]()
    assert one.to_pandas().loc["backward shaft", "value"] == 2 * np.sin(1.0)
    assert one.to_pandas().loc["backward shaft", "unit"] == "N or N m"


def test_extremes_have_their_times():
    made = friction()
    (line,) = [line.split() for line in repr(made).splitlines() if line.startswith("load of pin")]
    values = np.sin([1.0, 2.0, 3.0])
    assert line[3:] == [f"{values[2]:.4g}", "2", "s", f"{values[1]:.4g}", "0.5", "s", "N"]


def test_failures_come_first():
    assert repr(friction()).startswith("FrictionLoads: FAILED: pin jams")
    assert repr(MADE["Batch"]().__class__({"x": numbers(2)}, np.array([0, 2]), np.ones(2))).startswith(
        "Batch: FAILED: 1 of 2 designs failed"
    )
    ended = motion()
    object.__setattr__(ended, "result", jnp.asarray(2))
    assert repr(ended).startswith("Motion: FAILED: maximum number of steps")
    assert failures([True, False, False]) == "2 of 3 not ok" and failures(True) == ""


def test_batches_say_design_and_instant():
    batch = jax.tree.map(lambda x: jnp.stack([x, x]), MADE["DriveLoad"]())
    assert "design 0, instant 1" in repr(batch)
    table = batch.to_pandas()
    assert table.index.names == ["design", "instant"] and table.shape == (6, 1)


@pytest.mark.parametrize("name", ["CableResult", "State", "ImpendingMotion", "Buckling", "Actuation", "ModalMotion"])
def test_traced_ones_show_shapes(name):
    seen = []

    def look(made):
        seen.extend([repr(made), made._repr_html_()])
        return 0.0

    jax.make_jaxpr(look)(MADE[name]())
    assert "f64[" in seen[0] and "f64[" in seen[1]


class Odd(Reported, types.SimpleNamespace):
    def report(self):
        listed = Quantity("a<b & c", self.values, "N", (Axis("way", [f"<{k}>" for k in range(len(self.values))]),))
        return Report([listed, along_freedoms("one", np.ones(1)), entries("grid", np.ones((2, 2)))], fault=self.fault)


def test_names_are_escaped_and_long_ones_cut():
    made = Odd(values=np.arange(43.0), fault="<script>")
    page = ElementTree.fromstring(f"<div>{made._repr_html_()}</div>")
    assert "a<b & c <0>" in [cell.text for cell in page.iter("td")] and "<script>" not in made._repr_html_()
    assert len(repr(made).splitlines()) <= 15 and "... " in repr(made).splitlines()[-1]
    long = Reported()
    long.report = lambda: Report([Quantity("name " * 50, 1.0, "kg")])
    assert max(map(len, repr(long).splitlines())) <= 110 and "kg" in repr(long)


def test_parts_of_quantities():
    assert numbered("mode", 2).labels == ("0", "1") and not numbered("mode", 2).is_swept
    assert along_freedoms("e", np.ones((4, 1))).values.shape == (4,)
    assert along_freedoms("e", np.ones((4, 3))).axes[0].labels == ("0", "1", "2")
    assert entries("x", np.ones((1, 1))).values.shape == () and len(entries("x", np.ones((2, 3))).axes) == 2
    assert matrix("K", np.eye(2), "N/m", "ab", "cd").axes == (Axis("row", ("a", "b")), Axis("column", ("c", "d")))


def test_what_cannot_report_shows_its_fields():
    broken = cable()
    object.__setattr__(broken, "tensions", None)
    assert "CableResult" in repr(broken) and "CableResult" in broken._repr_html_()


def test_units_of_a_design_are_those_that_the_user_gives():
    shown = repr(optimum().with_units({"x": "mm", "objective": "kg"}))
    assert [line.split()[-1] for line in shown.splitlines() if line.split()[0] in ("x", "y")] == ["mm", "-"]
    assert "after 0 kg" in shown or " kg" in shown.splitlines()[0]
    with pytest.raises(mbs.UnknownNameError, match="'z'"):
        optimum().with_units({"z": "m"})
    with pytest.raises(TypeError):
        optimum().with_units({"x": 3})


def test_units_of_a_limit():
    bound = mbs.Limit("load", lambda d: d["x"], upper=4.0, unit="kN")
    found = mbs.minimise(
        lambda d: (d["x"] - 5.0) ** 2, {"x": 1.0}, {"x": (0.0, 9.0)}, limits=bound, progress=False, steps=30
    )
    (limit,) = found.limits
    assert limit.unit == "kN" and "<= 4 kN" in found.table() and "load <= 4 kN" in repr(limit)
    quantities = {q.name: q.unit for q in limit.report().quantities}
    assert quantities["bound"] == quantities["after"] == "kN" and quantities["margin"] == ""
    with pytest.raises(TypeError):
        mbs.Limit("load", lambda d: d["x"], upper=4.0, unit=3)
