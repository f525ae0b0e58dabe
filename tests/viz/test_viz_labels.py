"""No text of a saved picture is cut off by its edge or lies on another."""

import io
from itertools import combinations
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray
from matplotlib import pyplot
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import jaxmbs as mbs
from jaxmbs import qualification, viz
from jaxmbs.assembly._state import State
from jaxmbs.demo import _mechanism as mechanism
from jaxmbs.demo import _pictures as pictures
from tests.marks import cases

from .test_orbits import response as whirling

TIMES = np.linspace(0.0, 2.0, 41)


@pytest.fixture(scope="module")
def fleet():
    """Bodies on joints of every unit, enough of them for a long legend."""
    b = mbs.SystemBuilder()
    kinds = [mbs.Revolute("z"), mbs.Prismatic("x"), mbs.Cylindrical("z"), mbs.Free(), *[mbs.Revolute("y")] * 8]
    for i, kind in enumerate(kinds):
        b.body(f"body {i}", 1.0, com=(0.1 * i, 0.2, 0.3), inertia=0.1)
        b.joint(f"bearing number {i}", kind, "ground", f"body {i}", parent_frame=(0.3 * i, 0.0, 0.0))
        b.frame(f"corner {i}", on=f"body {i}", position=(0.2, 0.3, 0.4))
        b.frame(f"edge {i}", on=f"body {i}", position=(-0.3, 0.1, 0.2))
    b.force("strut", mbs.SpringDamper(3.0, 0.1), between=("body 0", "body 1"))
    return b.build()


@pytest.fixture(scope="module")
def motion(fleet):
    """A made-up motion whose energies are large and whose residual is small."""
    n, top = len(TIMES), fleet.topology
    wave = np.sin(TIMES[:, None] * (1.0 + np.arange(top.num_coordinates)))
    ball = top.joints[top.joint_index["bearing number 3"]].first_coordinate + 3
    wave[:, ball : ball + 4] = np.stack([np.cos(TIMES), np.sin(TIMES), 0.0 * TIMES, 0.0 * TIMES], axis=1)
    zeros = jnp.zeros(n)
    accounts = SimpleNamespace(
        kinetic=1234.5 * np.sin(TIMES) ** 2,
        potential=1234.5 * np.cos(TIMES) ** 2,
        work={"strut": -1e-3 * TIMES},
        energy_residual=3e-11 * np.sin(7 * TIMES),
    )
    states = State(jnp.asarray(TIMES), jnp.asarray(wave), jnp.zeros((n, top.num_velocities)), zeros)
    return SimpleNamespace(ts=TIMES, states=states, diagnostics=accounts, events=None)


@pytest.fixture(scope="module")
def pictured(fleet, motion):
    """What draws each picture into axes, or into new ones."""
    waves = {f"bearing number {i}": 123456.0 * np.sin(TIMES[:, None] + np.arange(3) + i) for i in range(12)}
    loads = {name: SimpleNamespace(force=wave, moment=1e-7 * wave) for name, wave in waves.items()}
    graph = mbs.bondgraph.bond_graph(fleet, "detailed")
    ports = [e.name for e in graph.elements if e.is_port]
    powers = SimpleNamespace(
        graph=graph, ports=lambda: {name: 500.0 * np.sin(TIMES + i) for i, name in enumerate(ports)}
    )
    kinds = ("mechanical", "stored", "dissipated", "supplied", "exchanged")
    waves_of = {kind: {"motor of the lift": 900.0 * np.sin(TIMES + i)} for i, kind in enumerate(kinds)}
    inside = SimpleNamespace(names=("motor of the lift",), **waves_of)
    best = mbs.minimise(lambda d: (d["x"] - 1.0) ** 4, {"x": 3.0}, progress=False)
    limits = {"absolute sum": np.array([2.0, 2.0, 4.0, 6.0]), "root of squares": np.full(4, 3.0)}
    few = jax.tree.map(lambda x: x[::8], motion.states)
    load = np.stack([waves[f"bearing number {i}"] for i in range(3)])[..., 0]
    table = study()
    plate, modes, functions = vibrating()
    ok, names = np.array([1, 1, 0, 1]), ("peak", "mass")
    front = mbs.design.ParetoFront(np.arange(4.0), np.arange(4.0)[::-1] ** 2, {}, np.zeros(4), ok, names)
    limited = SimpleNamespace(limits=[limit("peak of the main bearing", 3.0, 4.0), limit("mass", 2.0, 1.9)])
    numbers = {name: mbs.probability.Normal(1.0, 0.1) for name in ("bore of the bearing", "load")}
    failing = mbs.design.reliability(lambda x: 1.5 - x["load"] * x["bore of the bearing"], numbers)
    hertz = 40.0 + np.outer(np.arange(5.0), [3.0, -2.0, 0.1])
    extra = {
        "plot_views": lambda ax: viz.plot_views(fleet, few, ax=ax),
        "plot_envelope": lambda ax: viz.plot_envelope(TIMES, load, "load [N]", limit=2e5, ax=ax),
        "plot_polar": lambda ax: viz.plot_polar(loads, list(loads)[:2], "xz", ax=ax, kilo=True),
        "plot_bode": lambda ax: viz.plot_bode(functions, ax=ax),
        "plot_nyquist": lambda ax: viz.plot_nyquist(functions, ax=ax),
        "plot_campbell": lambda ax: viz.plot_campbell(np.arange(5.0) * 40, hertz, ax=ax),
        "plot_branches": lambda ax: viz.plot_branches(branch(), "x", ax=ax),
        "plot_orbits": lambda ax: viz.plot_orbits(whirling().orbit(1), ax=ax),
        "plot_mac": lambda ax: viz.plot_mac(np.eye(4), ax=ax),
        "plot_pareto_front": lambda ax: viz.plot_pareto_front(front, "peak [kN]", "mass [kg]", ax=ax),
        "plot_limits": lambda ax: viz.plot_limits(limited, ax=ax),
        "plot_importances": lambda ax: viz.plot_importances(failing, ax=ax),
        "plot_parallel": lambda ax: viz.plot_parallel(table, ax=ax),
        "plot_scatter": lambda ax: viz.plot_scatter(table, ax=ax),
        "plot_structure": lambda ax: viz.plot_structure(plate, modes.shapes[:, 0], ax=ax),
        "plot_modes": lambda ax: viz.plot_modes(plate, modes, range(3), ax=ax),
    }
    return (
        extra
        | qualified()
        | {
            "plot_coordinates": lambda ax: viz.plot_coordinates(fleet, motion, ax=ax),
            "plot_reactions": lambda ax: viz.plot_reactions(loads, TIMES, ax=ax),
            "plot_reactions moment": lambda ax: viz.plot_reactions(loads, TIMES, list(loads)[:3], moment=True, ax=ax),
            "plot_energy": lambda ax: viz.plot_energy(motion, ax=ax),
            "plot_power": lambda ax: viz.plot_power(motion, powers, ax=ax),
            "plot_element_power": lambda ax: viz.plot_element_power(motion, inside, "motor of the lift", ax=ax),
            "plot_power kind": lambda ax: viz.plot_power(motion, powers, by="kind", ax=ax),
            "plot_mechanism": lambda ax: viz.plot_mechanism(fleet, few, plane="xz", ax=ax),
            "plot_history": lambda ax: viz.plot_history(best, ax=ax),
            "plot_limit_values": lambda ax: viz.plot_limit_values(limits, np.array([1.0, 2.0, 4.0, 5.0]), ax=ax),
        }
    )


def branch():
    """A branch of cycles around two folds, with numbers of its own."""
    along = np.linspace(0.0, 1.0, 40)
    values = 1.0 + 0.5 * along + 0.3 * np.sin(2.0 * np.pi * along)
    states = SimpleNamespace(coordinates=(1.0 + along)[:, None, None], structure=(("x", "", 1, 1, ("",)),))
    points = [mbs.cycles.StabilityChange(kind, values[k], k) for kind, k in (("fold", 11), ("period doubling", 28))]
    folded = (along > along[11]) & (along < along[28])
    cycles = SimpleNamespace(states=states, stable=jnp.asarray(~folded))
    made = object.__new__(mbs.cycles.Branch)  # without cycles that anyone could ask
    fields = {"name": "frequency [rad/s]", "values": values, "cycles": cycles, "points": tuple(points)}
    for name, value in fields.items():
        object.__setattr__(made, name, value)
    return made


def limit(name, after, bound):
    """A limit of an optimum; the design used twice as much before."""
    row = {"name": name, "before": np.array([2 * after]), "after": np.array([after]), "worst": (0,), "bound": bound}
    return SimpleNamespace(**row, side="<=", ok=after <= bound, active=True)


def qualified():
    """What draws the pictures of qualification."""
    f = np.geomspace(20.0, 2000.0, 60)
    bumps = 1e3 / (1 + (f / 300.0 - 1) ** 2 * 1e2)
    body = mbs.LinearSystem(
        mass=np.eye(1), stiffness=np.array([[4e6]]), damping=np.array([[200.0]]), coordinates=["m z"],
        positions={"m": (0, 0, 0)},
    )  # fmt: skip
    white = mbs.fatigue.psd_table([20.0, 2000.0], [0.1, 0.1], "g^2/Hz")
    response = mbs.random_response(body, {"base": qualification.BaseAcceleration(white, "z")}, ["m z"])
    both = np.stack([10 * bumps, -8 * bumps])
    shock = qualification.ShockSpectrum(*map(jnp.asarray, (f, both, 0.8 * both)), "absolute acceleration")
    cycles = mbs.fatigue.rainflow(80 * np.random.default_rng(1).normal(size=200))
    limiting = np.where((f > 250) & (f < 350), 0, -1)
    none, names = np.zeros((60, 1), complex), ("bolt fz",)
    numbers = f, 0 * f + 9.8, 9.8 / (1 + (limiting == 0)), none, limiting, 2.0
    sine = qualification.SineResponse(*map(jnp.asarray, numbers), names, names)
    return {
        "plot_psd": lambda ax: viz.plot_psd(response, f, ax=ax, unit="N"),
        "plot_shock_spectrum": lambda ax: viz.plot_shock_spectrum(shock, ax=ax),
        "plot_sn": lambda ax: viz.plot_sn(mbs.fatigue.SN(1e12, 3.0), cycles, ax=ax),
        "plot_rainflow_matrix": lambda ax: viz.plot_rainflow_matrix(cycles, ax=ax),
        "plot_margins": lambda ax: viz.plot_margins(envelope(), [1e3, 1e3, 200.0, 60.0], ax=ax),
        "plot_notches": lambda ax: viz.plot_notches(sine, ax=ax),
    }


def envelope():
    """Loads of two events, one of them above what is allowed."""
    names, times = ["bolt fx", "bolt fy", "bolt fz", "strut"], np.linspace(0.0, 1.0, 5)
    loads = np.outer(np.array([0.0, 1.0, -0.5, 0.2, 0.1]), [900.0, -300.0, 250.0, 40.0])
    events = {"burn-out": loads, "landing": -0.9 * loads[::-1] * np.array([0.5, 1.5, 1.0, 1.2])}
    return qualification.load_envelope(
        [qualification.LoadCase(name, values, names, times) for name, values in events.items()]
    )


def study():
    """Forty designs, one of which failed."""
    random = np.random.default_rng(0)
    columns = {name: ("design", random.random(40), {"units": "mm"}) for name in ("crank", "rod", "offset")}
    peak = 3e3 + 1e3 * columns["crank"][1] - 500 * columns["rod"][1]
    status = np.where(np.arange(40) == 7, 4, 0)
    return xarray.Dataset({**columns, "peak": ("design", peak, {"units": "N"}), "status": ("design", status)})


def vibrating():
    """A beam of masses on springs at places, its modes and responses."""
    n = 6
    K = 1e4 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    places = {f"n{i}": (0.2 * i, 0.0, 0.0) for i in range(n)}
    labels = [(name, "z") for name in places]
    system = mbs.LinearSystem(mass=np.eye(n), stiffness=K, damping=1e-4 * K, coordinates=labels, positions=places)
    modes = mbs.vibration.natural_modes(K=jnp.asarray(K), M=jnp.eye(n))
    omega = np.linspace(20.0, 250.0, 300)
    dynamic = K - omega[:, None, None] ** 2 * np.eye(n) + 1e-4j * omega[:, None, None] * K
    values = np.linalg.inv(dynamic)[:, :2, :1]
    return system, modes, mbs.linear.TransferFunctions(omega, values, ("n0 z", "n1 z"), ("n0 z",))


def texts(figure) -> list:
    """All texts that are drawn, tick labels among them, as (text, box in pixels)."""
    found = []
    for ax in figure.findobj(lambda artist: hasattr(artist, "xaxis")):
        for axis in (ax.xaxis, ax.yaxis):
            ticks = axis._update_ticks()  # those within the axes alone
            found += [label for tick in ticks for label in (tick.label1, tick.label2)]
            found += [axis.label, axis.get_offset_text()]
        legend = ax.get_legend()
        found += [ax.title, *ax.texts, *(legend.get_texts() if legend else ())]
    found = [text for text in found if text.get_visible() and text.get_text().strip()]
    return [(text.get_text(), text.get_window_extent()) for text in found]


def faults(figure) -> list[str]:
    """Texts of a figure, saved as it is, that leave its edge or cover each other."""
    FigureCanvasAgg(figure)
    figure.savefig(io.BytesIO(), format="png")
    (width, height), found = figure.bbox.max, texts(figure)
    assert found
    lost = [t for t, b in found if b.x0 < -0.5 or b.y0 < -0.5 or b.x1 > width + 0.5 or b.y1 > height + 0.5]
    covered = [(s, t) for (s, a), (t, b) in combinations(found, 2) if a.padded(-1.0).overlaps(b.padded(-1.0))]
    return [f"{text!r} is cut off" for text in lost] + [f"{s!r} and {t!r} overlap" for s, t in covered]


NAMES = ["plot_coordinates", "plot_reactions", "plot_reactions moment", "plot_energy", "plot_power"]
NAMES += ["plot_power kind", "plot_element_power", "plot_mechanism", "plot_history", "plot_limit_values"]
OTHERS = ["plot_views", "plot_envelope", "plot_polar", "plot_bode", "plot_nyquist", "plot_campbell", "plot_mac"]
OTHERS += ["plot_branches", "plot_orbits"]
OTHERS += [
    "plot_importances",
    "plot_pareto_front",
    "plot_limits",
    "plot_parallel",
    "plot_scatter",
    "plot_structure",
    "plot_modes",
]
OTHERS += ["plot_psd", "plot_shock_spectrum", "plot_sn", "plot_rainflow_matrix", "plot_notches", "plot_margins"]


@pytest.mark.long
def test_every_picture_is_looked_at(pictured):
    assert {*NAMES, *OTHERS} == set(pictured)
    assert {name.split()[0] for name in (*NAMES, *OTHERS)} == {n for n in viz.__all__ if n.startswith("plot_")}


@pytest.mark.parametrize(
    "name", cases(NAMES + OTHERS, long=["plot_coordinates", "plot_element_power", "plot_psd"], rest=pytest.mark.slow)
)
def test_in_new_axes(pictured, name):
    pyplot.switch_backend("agg")
    figure = pictured[name](None).figure
    try:
        assert faults(figure) == []
    finally:
        pyplot.close(figure)


@pytest.mark.parametrize(
    "layout",
    [pytest.param(None, marks=pytest.mark.long), pytest.param("constrained", marks=pytest.mark.long), "tight"],
)
@pytest.mark.parametrize("name", NAMES)
def test_in_axes_given(pictured, name, layout):
    figure = Figure((7.0, 4.6), layout=layout)
    pictured[name](figure.add_subplot())
    assert faults(figure) == []


@pytest.mark.parametrize("name", cases(OTHERS, long=["plot_psd"]))
def test_others_in_axes_given(pictured, name):
    figure = Figure((7.0, 4.6), layout="constrained")
    pictured[name](figure.add_subplot())
    assert faults(figure) == []


@pytest.mark.parametrize("name", NAMES)
def test_in_axes_placed_by_hand(pictured, name):
    figure = Figure((8.0, 6.0))
    pictured[name](figure.add_axes((0.15, 0.15, 0.7, 0.75)))
    assert faults(figure) == []


def test_coordinates_of_each_unit_have_axes_of_their_own(fleet, motion):
    names = ["bearing number 0", "bearing number 2", "bearing number 3"]
    figure = viz.plot_coordinates(fleet, motion, names, ax=Figure().add_subplot()).figure
    shown = {
        ax.get_ylabel(): [line.get_label().removeprefix("bearing number ") for line in ax.lines] for ax in figure.axes
    }
    assert shown == {
        "angle [rad]": ["0", "2 angle"],
        "distance [m]": ["2 distance", "3 x", "3 y", "3 z"],
        "quaternion": ["3 qw", "3 qx", "3 qy", "3 qz"],
    }
    cylinder = fleet.coordinates(motion.states)["bearing number 2"]  # distance, then angle
    assert np.allclose(figure.axes[0].lines[1].get_ydata(), cylinder[:, 1])
    assert np.allclose(figure.axes[1].lines[0].get_ydata(), cylinder[:, 0])


def test_powers_of_many_elements_keep_their_sum(pictured):
    ax = pictured["plot_power"](Figure().add_subplot())
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert len(labels) == 12 and labels[-1].endswith(" others")


def test_a_cut_label_is_noticed():
    figure = Figure((4.0, 3.0))
    figure.add_axes((0.2, 0.0, 0.7, 0.9)).set_xlabel("time [s]")
    assert "'time [s]' is cut off" in faults(figure)


def slider_crank(design, ts):
    """The demo's mechanism and its motion in closed form."""
    system, angle = mechanism.slider_crank(design), mechanism.START + mechanism.SPEED * ts
    rod = -np.arcsin(mechanism.CRANK * np.sin(angle) / design["rod_length"])
    slide = mechanism.CRANK * np.cos(angle) + design["rod_length"] * np.cos(rod)
    columns = {"main": angle, "crank_pin": rod - angle, "slide": slide}
    psi = np.zeros((len(ts), 3))
    for name, column in columns.items():
        psi[:, system.topology.joints[system.topology.joint_index[name]].first_coordinate] = column
    states = State(*map(jnp.asarray, (ts, psi, 0.0 * psi, 0.0 * ts)))
    return system, SimpleNamespace(ts=ts, states=states, events=None)


@pytest.mark.long
def test_pictures_of_the_demo(motion, tmp_path, monkeypatch):
    ts = np.arange(72) / 72 * mechanism.TURN
    after = mechanism.DESIGN | {"counterweight_mass": 5.4, "rod_length": 0.45, "rod_tail_mass": 1.3}
    systems, motions = zip(*(slider_crank(design, ts) for design in (mechanism.DESIGN, after)), strict=True)
    wave = 2000.0 * np.stack([np.cos(50 * ts), np.sin(50 * ts)], axis=1)
    loads = [SimpleNamespace(t=ts, shaking=f * wave, main=f * wave, torque=f * wave[:, :1] / 10) for f in (1.0, 0.5)]
    designs = SimpleNamespace(initial_design=mechanism.DESIGN, design=after)
    saved, save = [], Figure.savefig

    def keep(figure, *args, **kwargs):
        saved.append(figure)
        save(figure, *args, **kwargs)

    monkeypatch.setattr(Figure, "savefig", keep)
    results = {"optimum": designs, "systems": systems, "motions": motions, "loads": loads, "free": motion}
    pictures.draw(tmp_path, results)
    monkeypatch.undo()
    assert len(saved) == 2
    assert [faults(figure) for figure in saved] == [[], []]
