"""Empty lists of loads, times, names, states: zeros, nothing, or an error in words; never a raw one from below."""

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from tests.misuse.test_every_question import model


def beam():
    """Two masses on springs, of which the lower one may be joined."""
    matrices = {"mass": np.eye(2), "stiffness": np.array([[2.0, -1.0], [-1.0, 1.0]]), "damping": 0.1 * np.eye(2)}
    return mbs.linear.LinearSystem(**matrices, coordinates=["foot z", "top z"], interface=["foot z"])


class Nothing:
    """What the empty lists are asked of."""

    def __init__(self):
        self.system, self.state = model("pendulum")
        self.motion = mbs.simulate(self.system, self.state, ts=[0.15, 0.2, 0.3])
        self.linear, self.ts = beam(), np.array([0.0, 0.1, 0.2])
        self.lin = mbs.linearise(self.system, self.state, inputs=[], outputs=[])
        self.net = mbs.coupling.connect(
            {"a": beam(), "b": beam()}, {"bolt": mbs.coupling.rigid_bond("a.foot", "b.foot")}
        )
        self.beside = mbs.coupling.connect(
            {"a": beam(), "b": beam(), "c": beam().with_interface()},
            {"bolt": mbs.coupling.rigid_bond("a.foot", "b.foot")},
        )
        self.alone = mbs.coupling.connect({"a": beam()}, {})
        self.bonds = mbs.statics.Bonds.from_arrays(["a"], {"weld": ("ground", "a")}, np.zeros((1, 3)))


def _no_bodies():
    return mbs.statics.Bonds.from_arrays([], {}, np.zeros((0, 3)))


def _carried(z, answer):
    loads = mbs.reactions(z.net, answer)
    assert bool(loads.ok), "loads of nothing balance"
    return loads["bolt"].on_first


#: An empty list or mapping: zeros, or nothing, of a shape, or an error whose words say what is missing.
EMPTY = {
    "equilibrium": (lambda z: mbs.equilibrium(z.linear, {}).displacement, (2,)),
    "equilibrium, no cases": (lambda z: mbs.equilibrium(z.linear, np.zeros((0, 2))).displacement, (0, 2)),
    "equilibrium of a network": (lambda z: mbs.equilibrium(z.net, {}).displacement, (3,)),
    "bonds at rest": (lambda z: _carried(z, mbs.equilibrium(z.net, {})), (1,)),
    "bonds of vibration": (lambda z: _carried(z, mbs.vibration.harmonic_response(z.net, [1.0], {})), (1, 1)),
    "bonds of a motion": (lambda z: _carried(z, mbs.simulate(z.net, ts=z.ts, forces={})), (3, 1)),
    "no bonds": (lambda z: np.zeros(len(list(mbs.reactions(z.alone, mbs.equilibrium(z.alone, {}))))), (0,)),
    "bonds beside what has no interface": (
        lambda z: mbs.reactions(z.beside, mbs.equilibrium(z.beside, {}))["bolt"].on_first,
        (1,),
    ),
    "no components": (lambda z: mbs.coupling.connect({}, {}), "no component"),
    "vibration": (lambda z: mbs.vibration.harmonic_response(z.linear, [1.0, 2.0], {}).displacement, (2, 2)),
    "vibration, no frequencies": (lambda z: mbs.vibration.harmonic_response(z.linear, [], {}).displacement, (0, 2)),
    "linear motion": (lambda z: mbs.simulate(z.linear, ts=z.ts, forces={}).displacement, (3, 2)),
    "linear motion in modes": (
        lambda z: mbs.simulate(z.linear, ts=z.ts, forces={}, solver=mbs.vibration.ModalSuperposition()),
        "under sampled forces",
    ),
    "linear motion, no times": (lambda z: mbs.simulate(z.linear, ts=[]), "ts must be a list of times"),
    "receptance": (lambda z: mbs.frequency_response(z.linear, [1.0], [], []).values, (1, 0, 0)),
    "receptance in modes": (lambda z: mbs.frequency_response(z.linear, [1.0], [], [], "modal").values, (1, 0, 0)),
    "receptance, no inputs": (lambda z: mbs.frequency_response(z.linear, [1.0], [], ["top z"]).values, (1, 1, 0)),
    "receptance, no frequencies": (
        lambda z: mbs.frequency_response(z.linear, [], ["top z"], ["top z"]).values,
        (0, 1, 1),
    ),
    "receptance in modes, no frequencies": (
        lambda z: mbs.frequency_response(z.linear, [], ["top z"], ["top z"], "modal").values,
        (0, 1, 1),
    ),
    "receptance of a network": (lambda z: mbs.frequency_response(z.net, [1.0], [], []).values, (1, 0, 0)),
    "no modes": (lambda z: mbs.modes(z.linear, 0).shapes, (2, 0)),
    "linearise": (lambda z: z.lin.state_space.B, (2, 0)),
    "response": (lambda z: mbs.frequency_response(z.lin, [1.0]), (1, 0, 0)),
    "response by names": (lambda z: mbs.frequency_response(z.lin, [1.0], into=[], out=[]).values, (1, 0, 0)),
    "response, no frequencies": (lambda z: mbs.frequency_response(z.lin, []), (0, 0, 0)),
    "actuators": (lambda z: mbs.inverse_dynamics(z.system, z.state, actuators=[]), "the list of actuators is empty"),
    "accelerations by joint": (
        lambda z: mbs.dynamics.acceleration(z.system, z.state, "a", {}),
        "none given for 'pin'",
    ),
    "compliance": (lambda z: mbs.reactions(z.system, z.state, compliance={})["pin"].moment, (3,)),
    "motion, no times": (lambda z: mbs.simulate(z.system, z.state, ts=[]), "ts must be a list of times"),
    "no states": (lambda z: mbs.position(z.system, z.motion[:0], "a"), (0, 3)),
    "loads of no states": (lambda z: mbs.reactions(z.system, z.motion[:0])["pin"].force, (0, 3)),
    "efforts of no states": (
        lambda z: mbs.inverse_dynamics(z.system, z.motion[:0], actuators=["pin"])["pin"],
        (0, 1),
    ),
    "between, no times": (lambda z: z.motion.at(z.system, []).velocities, (0, 1)),
    "states along nothing": (lambda z: mbs.assembly.states_along(z.system, "pin", [], z.state).velocities, (0, 1)),
    "a state of nothing": (lambda z: mbs.State.at(z.system, {}, {}, {}).velocities, (1,)),
    "statics": (lambda z: mbs.statics.bond_reactions(z.bonds, np.zeros((1, 6))).wrench, (1, 6)),
    "statics, no loads": (lambda z: mbs.statics.bond_reactions(z.bonds, []), "1 bodies need one wrench of 6"),
    "statics, no bodies": (lambda z: mbs.statics.bond_reactions(_no_bodies(), np.zeros((0, 6))).wrench, (0, 6)),
    "redundancy, no loops": (lambda z: mbs.statics.redundancy(z.bonds).redundant, ()),
    "redundancy, no bodies": (lambda z: np.zeros(len(mbs.statics.redundancy(_no_bodies()).undetermined)), (0,)),
    "family, no bodies": (
        lambda z: mbs.statics.reaction_family(_no_bodies(), np.zeros((0, 6))).particular,
        (0, 6),
    ),
    "matrix, no bodies": (lambda z: mbs.statics.reaction_matrix(_no_bodies()).matrix, (0, 0)),
    "batch of no columns": (lambda z: mbs.batch(lambda d: 1.0, {}, progress=False), "design"),
    "batch of no designs": (lambda z: mbs.batch(lambda d: d["a"], {"a": np.zeros(0)}, progress=False), "design"),
    "nothing to choose": (lambda z: mbs.minimise(lambda d: jnp.zeros(()), {}, {}, progress=False), "variable"),
    "no limits": (
        lambda z: mbs.minimise(lambda d: d["a"] ** 2, {"a": 0.0}, {"a": (-1, 1)}, limits=[], progress=False).value,
        (),
    ),
    "no model": (lambda z: mbs.SystemBuilder().build(), "bod"),
}


@pytest.mark.long
def test_empty_lists():
    """Zeros where nothing acts and where nothing is asked of the right shape; or words."""
    faults, z = [], Nothing()
    for name, (ask, expected) in EMPTY.items():
        try:
            found = np.asarray(ask(z))
            if found.shape != expected or np.any(found != 0) or not np.isfinite(found).all():
                faults.append((name, f"answers {found} of shape {found.shape}, not {expected}"))
        except Exception as error:  # noqa: BLE001
            if isinstance(expected, tuple) or not isinstance(error, ValueError) or expected not in str(error):
                faults.append((name, f"{type(error).__name__}: {str(error)[:200]}"))
    words = sum(isinstance(expected, str) for _, expected in EMPTY.values())
    print(f"\n{len(EMPTY)} empty lists, {words} of them refused in words, {len(faults)} faults")
    assert not faults, faults
