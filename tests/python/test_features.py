"""Every number of a feature leads back to the touches that it names, and these to the messages of their origin.

numpy fits the circles again, from those lines of the file of touches alone.
"""

import csv
import json
from collections import namedtuple

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from touch_groups import groups_of

# the plate of the demo: diameters of its holes and its boss, width of its slot, mm
DRAWN = {"hole": [8.0, 6.0], "boss": [10.0], "slot": [6.0]}
# largest difference to a fit without the program's correction for curvature, mm
AGREE_MM = 0.001
# least number of touches behind a number
LEAST_TOUCHES = 12

Demo = namedtuple("Demo", "features touches stamps")


@pytest.fixture(scope="module")
def demo(demo_folder):
    """Features and touches of the demo, and the stamps of all its wrenches."""
    out = demo_folder
    with (out / "touches.csv").open() as file:
        touches = list(csv.DictReader(file))
    assert [int(touch["touch"]) for touch in touches] == list(range(len(touches)))
    stamps = set()
    with AnyReader([out / "touch.mcap"], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        connections = [c for c in reader.connections if c.topic == "/stylus/wrench"]
        for connection, _, payload in reader.messages(connections):
            stamp = reader.deserialize(payload, connection.msgtype).header.stamp
            stamps.add(stamp.sec * 10**9 + stamp.nanosec)
    return Demo(json.loads((out / "features.json").read_text())["features"], touches, stamps)


def test_all_of_the_plate_is_found_and_nothing_invented(demo_folder):
    """The table of the demo, its step among it: an edge that the ball rolled over and rested in."""
    found = json.loads((demo_folder / "summary.json").read_text())["found"]
    of = {feature["name"]: feature for feature in found["features"]}
    assert sorted(of) == ["blind hole", "boss", "slot", "step", "through-hole"]
    assert all(feature["id"] is not None for feature in of.values())
    assert found["invented"] == 0
    step = of["step"]
    print(f"step: {step['center_off_mm']:.3f} mm, {step['axis_off_deg']:.2f} deg off, {step['touched']:.0%} touched")
    assert step["center_off_mm"] < 0.05 and step["axis_off_deg"] < 0.1 and step["touched"] > 0.8


def of_kind(demo, kind):
    found = [feature for feature in demo.features if feature["kind"] == kind]
    assert len(found) == len(DRAWN[kind])
    return found


def named(demo, feature, number):
    """The lines of the file of touches that a number names."""
    lines = [at for first, last in feature["touches"][number] for at in range(first, last + 1)]
    assert lines == sorted(set(lines))
    return [demo.touches[at] for at in lines]


def columns(touches, *names):
    return np.array([[float(touch[name]) for name in names] for touch in touches])


def across(axis):
    """Two unit vectors square to an axis, as columns."""
    return np.linalg.svd(np.atleast_2d(axis))[2][1:].T


def weights_of(demo, touches):
    """Square roots of the weights: of its group each touch has an equal share."""
    sigma, weight = columns(touches, "sigma_mm", "weight").T
    group = np.array(groups_of(demo.touches))[[int(touch["touch"]) for touch in touches]]
    together = np.bincount(group)[group]
    return np.sqrt(weight / together) / sigma


def circle(points, weights):
    """Centre and radius of the circle with the least weighted squares of distance (Gauss-Newton)."""
    centre, radius = points.mean(axis=0), 1.0
    for _ in range(50):
        off = points - centre
        distance = np.linalg.norm(off, axis=1)
        slopes = np.column_stack([-off / distance[:, None], -np.ones(len(points))])
        step = np.linalg.lstsq(slopes * weights[:, None], -(distance - radius) * weights, rcond=None)[0]
        centre, radius = centre + step[:2], radius + step[2]
    assert np.abs(step).max() < 1e-9
    return centre, radius


@pytest.mark.parametrize("kind, side", [("hole", 1), ("boss", -1)])
def test_a_diameter_is_that_of_the_touches_it_names(demo, kind, side):
    """The ball's centres run on a circle smaller than a hole by its radius, and larger than a boss."""
    for feature in of_kind(demo, kind):
        touches = named(demo, feature, "diameter_mm")
        assert feature["fitted_to"] == "touches" and len(touches) >= LEAST_TOUCHES
        radius = {float(touch["tip_radius_mm"]) for touch in touches}
        assert radius == {1.5}
        plane = across(feature["axis"])
        centres = columns(touches, "center_x_mm", "center_y_mm", "center_z_mm") - feature["center_mm"]
        centre, run = circle(centres @ plane, weights_of(demo, touches))
        diameter = 2 * (run + side * 1.5)
        std = feature["std"]["diameter_mm"]
        print(f"{kind}: {feature['diameter_mm']:.4f} ± {std:.4f}, from {len(touches)} touches {diameter:.4f} mm; centre {np.linalg.norm(centre):.4f}")
        assert diameter == pytest.approx(feature["diameter_mm"], abs=AGREE_MM)
        assert np.linalg.norm(centre) < AGREE_MM
        assert min(abs(diameter - drawn) for drawn in DRAWN[kind]) < 0.05


def test_a_width_is_that_of_the_touches_it_names(demo):
    """The touches on both walls of the slot, each wall a straight line of the ball's centres."""
    (slot,) = of_kind(demo, "slot")
    touches = named(demo, slot, "width_mm")
    along = np.array(slot["direction"])
    side = np.cross(slot["axis"], along)
    normals = columns(touches, "normal_x", "normal_y", "normal_z")
    centres = columns(touches, "center_x_mm", "center_y_mm", "center_z_mm") - slot["center_mm"]
    straight = np.abs(centres @ along) < (slot["length_mm"] - slot["width_mm"]) / 2
    weights, walls = weights_of(demo, touches), []
    for sign in (-1, 1):
        wall = straight & (normals @ side * sign > 0.8)
        assert wall.sum() >= LEAST_TOUCHES
        walls.append(np.average(centres[wall] @ side, weights=weights[wall] ** 2))
    width = walls[0] - walls[1] + 2 * 1.5
    print(f"slot: {slot['width_mm']:.4f}, from its touches {width:.4f} mm")
    # without the ends, which the program fits too
    assert width == pytest.approx(slot["width_mm"], abs=2 * AGREE_MM)


def test_every_touch_is_a_wrench_of_the_recording(demo):
    assert len(demo.stamps) > 10_000
    stamps = [int(touch["stamp_ns"]) for touch in demo.touches]
    assert stamps == sorted(stamps)
    numbers = [(feature, number) for feature in demo.features for number in feature.get("touches", {})]
    assert len(numbers) > 10
    for feature, number in numbers:
        touches = named(demo, feature, number)
        assert all(int(touch["stamp_ns"]) in demo.stamps for touch in touches)
        assert all(touch["rejected"] == "0" for touch in touches), "an outlier measures nothing"


def test_only_what_was_touched_names_touches(demo):
    for feature in demo.features:
        is_touched = feature["fitted_to"] == "touches"
        for number in ("diameter_mm", "width_mm"):
            assert number not in feature.get("touches", {}) or is_touched
        assert not is_touched or (feature["touched"] > 0 and feature["touches"]["center_mm"])
        # an edge between a touched and an untouched plane names touches of the first
        assert is_touched or feature["kind"] in ("edge", "corner") or "touches" not in feature


def test_the_file_of_touches_is_one_surface_under_a_ball(demo):
    """Centre, point and normal of a touch belong together: the centre is the ball's radius off the point."""
    centres = columns(demo.touches, "center_x_mm", "center_y_mm", "center_z_mm")
    points = columns(demo.touches, "point_x_mm", "point_y_mm", "point_z_mm")
    normals = columns(demo.touches, "normal_x", "normal_y", "normal_z")
    off = np.linalg.norm(centres - points - 1.5 * normals, axis=1)
    print(f"off by {off.max():.2e} mm at most, {np.quantile(off, 0.9):.2e} mm in nine of ten")
    assert np.quantile(off, 0.9) < 2e-5
    assert np.abs(np.linalg.norm(normals, axis=1) - 1).max() < 2e-6
