"""The foreign world of the machined parts against closed forms: contact, friction, filters, noise, scan; and its flights keep clear."""

from dataclasses import replace

import igl
import numpy as np
import pytest
import trimesh
from foreign.contact import Friction, Stylus, Surface, hertz, series_force
from foreign.hand import SPRING, STEP_S, felt_force, joined, stepped, stroked
from foreign.instruments import ForceSensor, Tracker, turns_of
from foreign.noise import band, low_pass, min_jerk, ornstein_uhlenbeck
from foreign.scanner import scanned
from foreign.strokes import strokes_over, way_between
from machined.part import Part, frame, rod
from manifold3d import Manifold
from scipy.spatial.transform import Rotation

STYLUS = Stylus(1.5, 20.0, 0.004, hertz(1.5, 6.2e4), 0.24, 0.2, 4.0, 300.0)
SIDES = ["z", "x", "-x"]


def box():
    """The half space below z = 0, near the origin."""
    mesh = trimesh.creation.box([80.0, 80.0, 20.0])
    mesh.apply_translation([0, 0, -10.0])
    return mesh


def fixed(place, surface, stylus=STYLUS):
    """Force, centre and contact of a ball without friction so far, held at a place."""
    place = np.array([place], float)
    force, centre, contact = felt_force(surface, stylus, place, np.zeros((1, 3)), Friction.at_rest(1))
    return force[0], centre[0], contact[0]


def test_hertz_agrees_with_the_tabulated_case():
    # Johnson 1985, eq. 4.22: δ = (9 F² / (16 R E*²))^⅓
    radius, modulus, force = 2.0, 6.0e4, 3.0
    depth = (9 * force**2 / (16 * radius * modulus**2)) ** (1 / 3)
    assert series_force(np.array([depth]), hertz(radius, modulus), 1e12)[0] == pytest.approx(force, rel=1e-6)


def test_contact_and_shaft_share_the_depth():
    forces = np.geomspace(1e-6, 50, 40)
    depth = (forces / STYLUS.hertz_k) ** (2 / 3) + forces / STYLUS.stiffness
    np.testing.assert_allclose(series_force(depth, STYLUS.hertz_k, STYLUS.stiffness), forces, rtol=1e-9)
    assert (series_force(np.array([0.0, -1.0]), STYLUS.hertz_k, STYLUS.stiffness) == 0).all()


def test_a_ball_pressed_on_a_plane_rests_at_its_radius():
    force, centre, contact = fixed([3.0, -2.0, 1.4], Surface(box()))
    # nearly all of 0.1 mm is in the shaft
    assert force == pytest.approx([0, 0, 2.0], abs=0.02)
    indentation = (force[2] / STYLUS.hertz_k) ** (2 / 3)
    assert centre == pytest.approx([3.0, -2.0, 1.5 - indentation], abs=1e-9)
    assert contact == pytest.approx([3.0, -2.0, 0.0], abs=1e-9)


def test_a_ball_in_a_right_corner_feels_both_walls_and_at_a_convex_edge_one():
    corner = Manifold.cube([40, 40, 20], center=True) - Manifold.cube([40, 40, 20]).translate([0, -20, 0])
    mesh = corner.to_mesh()
    surface = Surface(trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts))
    # no indentation
    rigid = replace(STYLUS, hertz_k=1e12)
    force = fixed([1.4, 0.0, 1.45], surface, rigid)[0]
    assert force == pytest.approx([2.0, 0.0, 1.0], abs=1e-3)
    # 45° over the upper edge at x = 0, z = 10
    out = np.array([1.0, 0.0, 1.0]) / np.sqrt(2)
    force, _, contact = fixed([0, 0, 10] + 1.4 * out, surface, rigid)
    assert force == pytest.approx(2.0 * out, abs=1e-3)
    assert contact == pytest.approx([0, 0, 10], abs=1e-6)


def test_a_ball_fits_loosely_in_a_bore_and_feels_its_wall_once():
    solid = Manifold.cube([20, 20, 10], center=True) - Manifold.cylinder(20, 4.0, 4.0, 400, center=True)
    mesh = solid.to_mesh()
    surface = Surface(trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts))
    for angle in np.linspace(0, 6, 13):
        out = np.array([np.cos(angle), np.sin(angle), 0])
        force, _, _ = fixed(2.6 * out, surface)
        # chords of 400 corners are within 0.12 µm of the circle
        assert -force @ out == pytest.approx(2.0, abs=0.03)
    assert np.linalg.norm(fixed([0, 0, 0], surface)[0]) == 0


def slid(speed, seconds):
    """Friction of a ball pressed by 2 N and pulled along x, over time."""
    friction, normal, velocity = Friction.at_rest(1), np.array([[0.0, 0.0, 1.0]]), np.array([[speed, 0.0, 0.0]])
    return np.array([STYLUS.friction_step(friction, velocity, normal, np.array([2.0]), STEP_S)[0] for _ in range(int(seconds / STEP_S))])


def test_friction_starts_as_a_spring_and_ends_at_coulombs():
    # shaft and bristle in series, before slip
    start = slid(1.0, 0.01)
    spring = 1 / (1 / STYLUS.stiffness + 1 / STYLUS.bristle)
    assert start[-1, 0] == pytest.approx(-spring * 0.01, rel=0.1)
    fast = slid(30.0, 0.5)[:, 0]
    assert fast[-1] == pytest.approx(-STYLUS.kinetic * 2.0, rel=0.01)
    assert np.abs(fast).max() <= STYLUS.static * 2.0 * 1.05
    assert np.abs(slid(30.0, 0.5)[:, 1:]).max() == 0


def test_friction_at_low_speed_reaches_the_static_limit():
    slow = slid(0.2, 2.0)[:, 0]
    assert np.abs(slow).max() == pytest.approx(STYLUS.static * 2.0, rel=0.03)


def test_a_resting_hand_presses_by_its_spring():
    surface = Surface(box())
    steps = 1500
    course = np.tile([0.0, 0.0, 0.5], (steps, 1, 1))
    course[:200, 0, 2] = np.linspace(1.6, 0.5, 200)
    held, _, _, force = stepped(surface, STYLUS, course, np.zeros_like(course), np.array([steps]))
    # springs in series hold 1 mm
    expected = 1.0 / (1 / SPRING + 1 / STYLUS.stiffness)
    assert force[-1, 0, 2] == pytest.approx(expected, rel=0.02)
    assert held[-1, 0, 2] == pytest.approx(1.5 - force[-1, 0, 2] / STYLUS.stiffness, abs=2e-3)


def test_a_wander_has_the_variance_and_memory_it_is_told():
    rng = np.random.default_rng(1)
    std, time_s, step_s = 0.08, 2.0, 0.01
    made = ornstein_uhlenbeck(rng, std, time_s, step_s, (1000, 2000))
    assert made.std(axis=1) == pytest.approx(np.full(1000, std), rel=0.12)
    # 100 steps are half of the time constant
    correlation = (made[:-100] * made[100:]).mean() / made.var()
    assert correlation == pytest.approx(np.exp(-0.5), abs=0.01)


def test_a_tremor_has_its_strength_and_its_band():
    made = band(np.random.default_rng(2), 7.0, 12.0, 0.12, 0.001, (20_000, 8))
    assert made.std() == pytest.approx(0.12, rel=0.05)
    power = np.abs(np.fft.rfft(made, axis=0)) ** 2
    frequency = np.fft.rfftfreq(len(made), 0.001)
    is_in = (frequency > 5) & (frequency < 17)
    assert power[is_in].sum() > 0.95 * power.sum()


def test_the_low_pass_steps_as_butterworths_second_order():
    step_s, cutoff = 1e-4, 80.0
    signal = np.zeros((2000, 1))
    signal[100:] = 1
    made = low_pass(signal, cutoff, step_s)[:, 0]
    t = (np.arange(1900) + 0.5) * step_s
    w = 2 * np.pi * cutoff / np.sqrt(2)
    expected = 1 - np.exp(-w * t) * (np.cos(w * t) + np.sin(w * t))
    np.testing.assert_allclose(made[100:], expected, atol=2e-3)
    assert (low_pass(np.full((50, 2), 3.0), cutoff, step_s) == pytest.approx(3.0)) and made[:100].max() == 0


def test_a_tracker_without_errors_tells_the_tip_late():
    times = np.arange(3000) * STEP_S
    held = np.column_stack([10 * times, 5 - times, 2 * times])
    axis = np.column_stack([0.2 * np.sin(times), 0 * times, np.cos(times)])
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    turns = turns_of(axis, 0.3 * times)
    tip = np.array([3.0, -2.0, -120.0])
    exact = Tracker(250.0, 0.15, 0.007, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.1, tip)
    stamps, places, quaternions = exact.frames(held, turns, np.random.default_rng(3))
    body = Rotation.from_quat(quaternions)
    at = stamps - 0.007
    expected = np.column_stack([10 * at, 5 - at, 2 * at])
    np.testing.assert_allclose(places + body.apply(tip), expected, atol=1e-9)
    np.testing.assert_allclose(body.apply([0, 0, 1]), axis[(at / STEP_S).astype(int)], atol=1e-9)
    # a tenth of 250 frames a second is lost
    assert len(stamps) == pytest.approx(0.9 * 250 * 3, rel=0.05)


def test_a_force_sensor_mixes_its_axes_and_rounds_to_its_steps():
    talk = np.array([[1.01, 0.02, 0.0], [0.0, 0.99, -0.01], [0.01, 0.0, 1.0]])
    bias = np.array([0.3, -0.2, 0.1])
    sensor = ForceSensor(100.0, talk, bias, 0.0, 0.0, 1.0, np.array([0.0, 0.0, 0.5]), 0.5, 0.01)
    turns = Rotation.from_rotvec(np.tile([0, 0, np.pi / 2], (4000, 1)))
    stamps, read = sensor.readings(np.tile([1.0, 2.0, 3.0], (4000, 1)), turns, np.random.default_rng(4))
    # x and y of the stylus are y and −x of the part; 4 s are eight time constants of the warming
    expected = bias + talk @ [2.0, -1.0, 3.0] + [0.0, 0.0, 0.5]
    assert read[-1] == pytest.approx(expected, abs=0.0055)
    assert read[0] == pytest.approx(bias + talk @ [2.0, -1.0, 3.0], abs=0.0055)
    assert read / 0.01 == pytest.approx(np.round(read / 0.01), abs=1e-6)
    assert np.diff(stamps) == pytest.approx(0.002)


def test_min_jerk_is_symmetric_and_rests_at_both_ends():
    share = min_jerk(1001)
    assert share[[0, 500, 1000]] == pytest.approx([0, 0.5, 1])
    assert share[1] < 1e-8 and 1 - share[-2] < 1e-8


def test_ways_between_sides_keep_off_the_part():
    mesh = box()
    ends = {"z": [5, 5, 7.5], "x": [47.5, 1, -8], "-x": [-47.5, 3, -2], "y": [2, 47.5, -5]}
    for before, start in ends.items():
        for after, end in ends.items():
            corners = way_between(mesh, before, np.array(start, float), after, np.array(end, float), 1.5)
            places = np.concatenate([np.linspace(a, b, 50) for a, b in zip(corners, corners[1:])])
            assert Surface(mesh).nearest(places)[0].min() > 1.5
            assert corners[0] == pytest.approx(start) and corners[-1] == pytest.approx(end)


@pytest.fixture(scope="module")
def drilled_plate():
    """A plate with a blind hole, as a mesh."""
    part = Part(Manifold.cube([40, 30, 10], center=True))
    part.cut(rod(4.0, -6.0, 1.0), frame([4, 2, 5], [0, 0, 1]))
    return part.finished()[0]


def test_a_stroked_part_is_touched_on_its_skin_and_never_entered(drilled_plate):
    rng = np.random.default_rng(5)
    surface = Surface(drilled_plate)
    strokes = strokes_over(surface, SIDES, STYLUS.radius, rng)
    motion = joined(drilled_plate, STYLUS.radius, strokes, stroked(surface, STYLUS, strokes, rng), rng)
    is_on = np.isfinite(motion.contact[:, 0])
    mesh = np.asarray(drilled_plate.vertices, float), np.asarray(drilled_plate.faces, np.int64)
    signed = igl.signed_distance(np.ascontiguousarray(motion.centre), *mesh)[0]
    # 30 N indent by 5 µm; friction bends the shaft within a step
    assert signed.min() > STYLUS.radius - 0.03
    assert np.abs(signed[is_on] - STYLUS.radius).max() < 0.03
    assert 0.3 < is_on.mean() < 0.95
    assert 0.5 < np.median(np.linalg.norm(motion.force[is_on], axis=1)) < 6.0
    # in the hole too, around its wall
    wall = motion.contact[is_on]
    from_axis = np.linalg.norm(wall[:, :2] - [4, 2], axis=1)
    is_wall = (np.abs(from_axis - 4.0) < 0.01) & (wall[:, 2] < 4.5) & (wall[:, 2] > -0.9)
    angles = np.arctan2(*(wall[is_wall, :2] - [4, 2]).T)
    assert len(np.unique((angles * 4).astype(int))) > 20
    # no jump, also between strokes
    assert np.linalg.norm(np.diff(motion.held, axis=0), axis=1).max() / STEP_S < 1500


def test_a_scan_lies_on_the_part_and_looks_outwards(drilled_plate):
    scan = scanned(Surface(drilled_plate), SIDES, 0.1, 1.4, np.random.default_rng(7))
    mesh = np.asarray(drilled_plate.vertices, float), np.asarray(drilled_plate.faces, np.int64)
    distance = np.sqrt(igl.point_mesh_squared_distance(np.asarray(scan.vertices, float), *mesh)[0])
    assert np.median(distance) < 0.3
    off = np.ascontiguousarray(scan.triangles_center + 0.7 * scan.face_normals)
    assert (igl.signed_distance(off, *mesh)[0] > 0).mean() > 0.95
    # the lower face is seen by no view
    assert not scan.is_watertight
    assert ((scan.vertices[:, 2] < -5.5).mean()) < 0.05
