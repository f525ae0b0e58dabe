"""Contacts in scenes: their solids are where the surfaces are, and arrows are the forces at their points."""

import base64

import jax.numpy as jnp
import numpy as np
import pytest

import jaxmbs as mbs
from jaxmbs import contact as C
from jaxmbs import viz
from jaxmbs.viz._things import things
from jaxmbs.viz.scenes._shape_solids import open_tube, plate_of_outline, shape_solids
from jaxmbs.viz.scenes._trajectory import frame_trajectory
from tests.viz.test_shape_lines import CAM, PAIRS


def numbers(text, *shape):
    return np.frombuffer(base64.b64decode(text), "<f4").reshape(shape)


def a_part_on(pair, place, rotation=(1.0, 0.0, 0.0, 0.0)):
    """A part in contact with the ground, which slides over it, and its state."""
    b = mbs.SystemBuilder()
    b.body("part", 1.0, inertia=1e-3)
    b.joint("part", mbs.Free(), "ground", "part")
    b.contact("touch", pair, "part", "ground", C.HuntCrossley(1e5, 1.0), 0.3)
    system = b.build()
    return system, mbs.State.at(system, {"part": (*place, *rotation)}, {"part": (0.1, 0, 0, 0, 0, 0)})


def area(solid):
    a, b, c = np.moveaxis(solid.vertices[solid.faces], 1, 0)
    return 0.5 * np.sum(np.linalg.norm(np.cross(b - a, c - a), axis=1))


def volume(solid):
    """Volume of the cones from the origin to all faces, their normals outwards."""
    corners, normals = solid.vertices[solid.faces], solid.normals[solid.faces].sum(axis=1)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outwards = np.sign(np.sum(cross * normals, axis=1))
    return np.sum(outwards * np.sum(corners[:, 0] * cross, axis=1)) / 6


def test_area_of_a_tube_and_volume_of_a_plate():
    np.testing.assert_allclose(area(open_tube(0.3, -0.2, 0.5)), 2 * np.pi * 0.3 * 0.7, rtol=2e-3)
    angle = 2 * np.pi * np.arange(200) / 200
    radius = 0.2 + 0.15 * np.cos(3 * angle)  # three lobes with hollows between
    outline = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    sector = np.pi * (0.2**2 + 0.15**2 / 2)
    np.testing.assert_allclose(volume(plate_of_outline(outline, 0.1)), 0.1 * sector, rtol=2e-3)
    hole = plate_of_outline(outline[::-1], 0.1)
    length = np.sum(np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1))
    np.testing.assert_allclose(area(hole), 0.1 * length, rtol=1e-12)


@pytest.mark.long
def test_arrows_of_a_contact_and_its_solids():
    pair, place = PAIRS["plane"]
    system, state = a_part_on(pair, place)
    (stage,) = viz.scene(system, state, loads=True, limits={"touch": 200.0}).data["objects"]
    arrows, load = stage["arrows"], mbs.dynamics.contact_load(system, state, "touch")
    assert arrows["names"] == ["touch"] and arrows["limits"] == [200.0]
    np.testing.assert_allclose(numbers(arrows["place"], 3), load.point[0], rtol=1e-6)
    np.testing.assert_allclose(numbers(arrows["force"], 3), load.normal_force * load.normal[0] + load.friction[0])
    touch = [item for item in stage["items"] if item["name"] == "touch"]
    assert [item["body"] for item in touch] == [1, 0]
    assert [item["color"][3] < 1 for item in touch] == [False, True]
    bare = viz.scene(system, state, shapes={"touch": None}).data["objects"][0]
    assert not [item for item in bare["items"] if item["name"] == "touch"] and bare["arrows"] is None


@pytest.mark.long
@pytest.mark.parametrize("name", [*PAIRS])
def test_solids_of_every_pair_meet_at_the_points(name):
    """Both solids pass the points of contact, to the depth and the fineness of their triangles."""
    lying = (0.1, 0.2, 0.049), (0.5**0.5, 0.5**0.5, 0.0, 0.0)
    system, state = a_part_on(PAIRS[name][0], *(lying if name == "cylinder" else PAIRS[name][1:]))
    film = frame_trajectory(system, state)
    load = mbs.dynamics.contact_load(system, state, "touch")
    points = np.asarray(load.point)[np.asarray(load.depth) > 0]
    found = shape_solids(things(system), film, 0.01)
    assert [solid.is_clear for solid in found] == [True, False]
    for _, frame, solid, *_ in found:
        corners = solid.vertices[solid.faces] @ film.R[0, frame].T + film.x[0, frame]
        for point in points:
            assert np.min(distance_to_triangles(point, corners)) < 2e-3
    data = viz.scene(system, state, loads=True).data
    assert len(data["objects"][0]["arrows"]["names"]) == len(np.asarray(load.depth))


def distance_to_triangles(point, corners):
    """Distances of a point from triangles (n, 3, 3): from their planes within, else from their sides."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    twice = np.linalg.norm(normal, axis=1)
    flat = twice > 1e-12
    normal = normal / np.where(flat, twice, 1.0)[:, None]
    sides, within = [], flat
    for start, end in ((a, b), (b, c), (c, a)):
        along = end - start
        within = within & (np.sum(np.cross(along, point - start) * normal, axis=1) >= 0)
        share = np.sum((point - start) * along, axis=1) / np.maximum(np.sum(along * along, axis=1), 1e-30)
        sides.append(np.linalg.norm(start + np.clip(share, 0, 1)[:, None] * along - point, axis=1))
    return np.where(within, np.abs(np.sum((point - a) * normal, axis=1)), np.min(sides, axis=0))


@pytest.mark.long
def test_a_mode_of_a_mechanism_with_contact_has_no_arrows_of_it():
    system, state = a_part_on(C.RollerOnCurve(CAM, 0.01), PAIRS["cam"][1])
    made = viz.scene(system, viz.animate_mode(system, _one_mode(), 0, state), loads=True)
    assert made.data["objects"][0]["arrows"]["names"] == []


def _one_mode():
    roots, shapes = jnp.array([2j, -2j]), jnp.zeros((12, 2), complex).at[2].set(jnp.array([2j, -2j]))
    return mbs.vibration.Modes(jnp.ones(2), shapes, roots == 0, roots)
