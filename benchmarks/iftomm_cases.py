"""The five rigid cases of the IFToMM library for `iftomm.py`: models, tracked coordinates, references, settings."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import diffrax
import jax
import numpy as np
from cases import load, models
from closed_loop import ANDREWS_NAMES, ANDREWS_START
from scipy.special import ellipj

import jaxmbs as mbs

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
STEPS = (2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)
ALPHA, INDEX_2 = "generalised alpha", "trapezoidal, index 2"  # of Exudyn; the latter fails on A02 and A04
EXPLICIT = ("Runge-Kutta 4", "Runge-Kutta 6(7)")


@dataclass(frozen=True)
class Method:
    """A solver with its tolerances, or with fixed steps [s], from coarse to fine."""

    name: str
    solver: object
    values: tuple[float, ...]
    fixed: bool = False

    def setting(self, value):
        return f"h={value:.0e}" if self.fixed else f"rtol={value:.0e}"

    def options(self, value):
        """Options of `mbs.simulate`."""
        if self.fixed:
            return {"solver": self.solver, "dt": value}
        return {"solver": self.solver, "rtol": value, "atol": value, "interpolate": True}


@dataclass(frozen=True)
class Case:
    """A mechanism, its start, and what is compared.

    Attributes:
        point: name of the tracked frame, `columns` of its place are the coordinates.
        ts: sampled times (T,), equally spaced.
        reference: function of the case and times (T,) to the coordinates (T, J).
        peer: function of the module `iftomm_exudyn` to its model; `peer_methods` and `peer_steps` [s], coarse to
            fine; `peer_options` of its `path`.
    """

    name: str
    problem: str
    build: Callable
    start: Callable
    point: str
    columns: tuple[str, ...]
    ts: np.ndarray
    reference: Callable
    methods: tuple[Method, ...]
    peer: Callable
    conservative: bool = True
    peer_methods: tuple[str, ...] = (ALPHA, INDEX_2)
    peer_steps: tuple[float, ...] = STEPS
    peer_options: dict = field(default_factory=dict)

    def reader(self, system):
        """Function of the states of a motion to the coordinates (T, J)."""
        keep = np.array(["xyz".index(name) for name in self.columns])
        return jax.vmap(lambda state: mbs.position(system, state, self.point)[keep])


def adaptive(*solvers):
    """Solvers of diffrax with steps that pass over the sampled times."""
    return tuple(Method(name, getattr(diffrax, name)(), TOLERANCES) for name in solvers)


# ------------------------------------------------------------------------------------------------------ references
def pendulum_path(case, ts):
    """Elliptic functions, from the left at rest."""
    _, cn, dn, _ = ellipj(np.sqrt(9.81) * ts, 0.5)
    half = np.arcsin(-np.sqrt(0.5) * cn / dn)
    return np.stack([np.sin(2.0 * half), -np.cos(2.0 * half)], axis=1)


def four_bar_path(n):
    """The exact equation of a row by SciPy's DOP853."""

    def path(case, ts):
        angles = models.n_four_bar_angle(n, 0.0, ts)
        return np.stack([-np.sin(angles), np.cos(angles)], axis=1)

    return path


def bricard_path(case, ts):
    """One equation of one freedom by SciPy's DOP853."""
    reference = load(Path(__file__).parent.parent / "tests" / "cases" / "bricard.py")
    return reference.path_of_p3(ts)


def converged(solver, tolerance):
    """Our own motion with a small tolerance, steps landing on the sampled times."""

    def path(case, ts):
        system = case.build()
        options = {"solver": solver, "rtol": tolerance, "atol": tolerance, "max_steps": 1_000_000}
        motion = mbs.simulate(system, case.start(system), ts=ts, **options)
        return np.asarray(case.reader(system)(motion.states))

    return path


# ----------------------------------------------------------------------------------------------------------- cases


def _andrews_start(system):
    guess = dict(zip(ANDREWS_NAMES[1:], ANDREWS_START[1:], strict=True))
    return mbs.State.at(system, beta=ANDREWS_START[0], guess=guess)


def _governor_start(system):
    still = {"slide": 0.0, "right": 0.0, "left": 0.0}
    pose = {"spin": 0.0, "slide": 0.5, "right": np.pi / 6, "left": np.pi / 6}
    return mbs.State.at(system, pose, velocities={"spin": 2 * np.pi} | still)


def _four_bars(n):
    return Case(
        f"A02 N={n}",
        f"A02 - N-four-bar mechanism, N = {n}",
        lambda: models.n_four_bar(n),
        lambda system: models.n_four_bar_state(system, 0.0),
        "B0",
        ("x", "y"),
        np.linspace(0.0, 10.0, 101),
        four_bar_path(n),
        adaptive("Tsit5", "Dopri8"),
        lambda exudyn: exudyn.n_four_bar(n),
        peer_methods=(ALPHA,),
    )


CASES = (
    Case(
        "A01",
        "A01 - Simple pendulum",
        models.simple_pendulum,
        lambda system: mbs.State.at(system, pivot=-np.pi / 2),
        "tip",
        ("x", "y"),
        np.linspace(0.0, 10.0, 101),
        pendulum_path,
        adaptive("Tsit5", "Dopri8") + (Method("Gauss4", mbs.ode.Gauss4(), (1e-1, 5e-2, 2e-2, 1e-2), fixed=True),),
        lambda exudyn: exudyn.simple_pendulum(),
        peer_methods=(ALPHA, INDEX_2, *EXPLICIT),
        peer_steps=(1e-1, 5e-2, *STEPS),
    ),
    _four_bars(2),
    _four_bars(40),
    Case(
        "A03",
        "A03 - Andrews' mechanism",
        models.andrews,
        _andrews_start,
        "K2",
        ("x", "y"),
        np.linspace(0.0, 0.05, 101),
        converged(diffrax.Dopri8(), 1e-12),
        adaptive("Tsit5", "Dopri8"),
        lambda exudyn: exudyn.andrews(ANDREWS_START),
        conservative=False,
        peer_methods=(ALPHA, INDEX_2, "trapezoidal, tight Newton"),
        peer_steps=(1e-4, 5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6, 5e-7, 2e-7, 1e-7),
    ),
    Case(
        "A04",
        "A04 - Bricard's mechanism",
        models.bricard,
        mbs.State.at,
        "P3",
        ("x", "y", "z"),
        np.linspace(0.0, 10.0, 101),
        bricard_path,
        adaptive("Tsit5", "Dopri8"),
        lambda exudyn: exudyn.bricard(),
        peer_methods=(ALPHA,),
        peer_options={"redundant": True},
    ),
    Case(
        "A05",
        "A05 - Flyball governor",
        models.flyball_governor,
        _governor_start,
        "slider",
        ("z",),
        np.linspace(0.0, 10.0, 101),
        converged(diffrax.Kvaerno5(), 1e-11),
        adaptive("Kvaerno3", "Kvaerno5")
        + (Method("ImplicitMidpoint", mbs.ode.ImplicitMidpoint(newton=True), STEPS[:6], fixed=True),),
        lambda exudyn: exudyn.flyball_governor(),
        conservative=False,
    ),
)
