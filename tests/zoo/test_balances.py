"""Balances that every motion keeps: rates of places, energies and momenta against velocities, powers and loads."""

import numpy as np

from jaxmbs.forces._ports import FramePort, LinePort, PosePort
from tests.zoo import of_all
from tests.zoo.probes import motion


def axial(W):
    """The vector of a skew matrix."""
    return np.array([W[2, 1], W[0, 2], W[1, 0]])


@of_all(quick=(), slow=())
def test_velocities_and_accelerations_are_rates(specimen):
    found = motion(specimen)
    rate = found.rate_of
    for name in specimen.system.topology.body_names:
        spin = rate["rotations"][name] @ found.rotations[name].T
        np.testing.assert_allclose(spin, -spin.T, atol=1e-10)
        np.testing.assert_allclose(axial(spin), found.turning[name], atol=1e-10)
        pairs = [(rate["places"], found.velocities), (rate["velocities"], found.accelerations)]
        for ours, theirs in [*pairs, (rate["turning"], found.angular_accelerations)]:
            np.testing.assert_allclose(ours[name], theirs[name], atol=1e-9 * (1.0 + np.abs(theirs[name]).max()))


@of_all(quick=(), slow=())
def test_constraints_stay_closed(specimen):
    found = motion(specimen)
    np.testing.assert_allclose(found.residual, 0.0, atol=1e-9)
    np.testing.assert_allclose(found.rate_of["residual"], 0.0, atol=1e-8)


@of_all(quick=(), slow=())
def test_energy_changes_by_the_power_of_elements_and_drives(specimen):
    found = motion(specimen)
    rate = found.rate_of["kinetic"] + found.rate_of["potential"]
    drives = found.pull @ specimen.state.velocities
    assert ("drive" in specimen.kinds) == (abs(drives) > 1e-6)  # rows that do not move do no work
    np.testing.assert_allclose(rate, found.powers.sum() + drives, rtol=1e-9)


@of_all(quick=("four_bar",), slow=())
def test_momenta_change_by_their_rate_and_the_pull_of_the_rows(specimen):
    found = motion(specimen)
    _, rate, _, u = found.canonical
    np.testing.assert_allclose(u, specimen.state.velocities, atol=1e-8)
    size = np.abs(found.rate_of["momenta"]).max()
    np.testing.assert_allclose(found.rate_of["momenta"], rate + found.pull, atol=1e-8 * size)


def between(specimen, found, load, first, second):
    """(body, force, moment, world point) on the bodies of two frames, of which the second one takes the load."""
    top, force, moment = specimen.system.topology, np.array(load.force), np.array(load.moment)
    point = found.frames[top.frame_names[second]]
    return [(top.frame_body[second], force, moment, point), (top.frame_body[first], -force, -moment, point)]


def loads_on_bodies(specimen, found):
    """Of laws, of joints and of constraints between frames."""
    system = specimen.system
    for group in system.forces:
        for name, a, b in zip(group.names, group.first, group.second, strict=True):
            if isinstance(group.port, LinePort | PosePort):
                yield from between(specimen, found, found.loads.law(name), a, b)
            elif isinstance(group.port, FramePort):
                yield between(specimen, found, found.loads.law(name), a, a)[0]
    for joint in system.topology.joints:
        yield from between(specimen, found, found.loads[joint.name], *joint.frames)
    for group in system.closures:
        for name, *ends in zip(group.names, group.first, group.second, strict=True):
            if name not in system.topology.joint_names:
                yield from between(specimen, found, found.loads[name], *ends)


@of_all(without=("elastic", "effort"), slow=("driven",))
def test_every_body_is_in_equilibrium(specimen):
    """Newton and Euler, body by body, in NumPy: loads of joints, rows and laws against the rates of its momenta."""
    system, found = specimen.system, motion(specimen)
    loads = list(loads_on_bodies(specimen, found))
    for k, body in enumerate(system.topology.body_names):
        R, w, alpha = found.rotations[body], found.turning[body], found.angular_accelerations[body]
        r, inertia = R @ np.array(system.com[k]), R @ np.array(system.inertia[k]) @ R.T
        a = found.accelerations[body] + np.cross(alpha, r) + np.cross(w, np.cross(w, r))
        force, moment = float(system.mass[k]) * (a - np.array(system.gravity)), inertia @ alpha
        moment = moment + np.cross(w, inertia @ w)
        mine = [load for load in loads if load[0] == k]
        size = sum(np.abs(F).max() + np.abs(M).max() for _, F, M, _ in mine)
        np.testing.assert_allclose(sum(F for _, F, _, _ in mine), force, atol=1e-9 * size)
        arms = [M + np.cross(x - found.places[body] - r, F) for _, F, M, x in mine]
        np.testing.assert_allclose(sum(arms), moment, atol=1e-9 * size)
