"""Debian's RViz shows the mesh in its colours, and the features with their labels, as published by a node.

The test calculates the expected picture in another way: rays through the camera of the view, onto the mesh that the node has saved, and
onto the touched places of the recording.
"""

import numpy
import open3d
import pytest
import ros_rviz
import trimesh
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from ros_domains import domains
from ros_rviz import Desk, config, projected, rays
from ros_shown import show

SIZE = (1280, 800)
RADIUS_MM = 1.5
# the part yields: less than that is noise of the sensor
CONTACT_N = 0.5
# the plate of the demo, mm: its nominal dimensions
DRAWN = [("boss", [10.0]), ("hole", [6.0]), ("hole", [8.0]), ("slot", [6.0, 20.0])]


@pytest.fixture(scope="module")
def shown(demo_folder, touchup_bin, tmp_path_factory):
    """Topics of the node for the plate of the demo."""
    if missing := ros_rviz.missing_packages():
        pytest.skip(f"RViz needs system packages: apt-get install {' '.join(missing)}")
    return show(touchup_bin, demo_folder, tmp_path_factory.mktemp("shown"), next(domains), len(DRAWN))


@pytest.fixture(scope="module")
def pictures(shown, tmp_path_factory):
    """The view, and RViz's picture of it: the mesh alone, then the features too."""
    desk_folder = tmp_path_factory.mktemp("desk")
    path = desk_folder / "shown.rviz"
    view = config(path, SIZE, ros_rviz.CLOSE, hidden=("Grid", "TF", "Cell"))
    with Desk(desk_folder, SIZE, path, {}, arguments=["--fullscreen"]) as desk:
        desk.play([("/mesh", "visualization_msgs/msg/Marker", tile) for tile in shown.tiles])
        mesh = desk.still()
        desk.play([("/feature_markers", "visualization_msgs/msg/MarkerArray", shown.features)])
        features = desk.still()
    # for inspection after a failure
    for name, picture in [("mesh", mesh), ("features", features)]:
        open3d.io.write_image(str(desk_folder / f"{name}.png"), open3d.geometry.Image(picture))
    return view, mesh, features


@pytest.fixture(scope="module")
def expected(shown, pictures):
    """The saved mesh, and for each pixel the face in it (-1: none) and the place, m."""
    mesh = trimesh.load(shown.session / "refined.ply", process=False)
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(numpy.float32(mesh.vertices * 1e-3), numpy.uint32(mesh.faces))
    through = rays(pictures[0], SIZE)
    hits = scene.cast_rays(open3d.core.Tensor(numpy.float32(through)))
    far = hits["t_hit"].numpy()
    faces = numpy.where(numpy.isfinite(far), hits["primitive_ids"].numpy().astype(numpy.int64), -1)
    return mesh, faces, through[..., :3] + numpy.where(faces < 0, 0, far)[..., None] * through[..., 3:]


def is_green(picture):
    """The colour of the touched part, in any light."""
    red, green, blue = numpy.moveaxis(picture.astype(int), -1, 0)
    return (green > 3 * red // 2) & (green > 3 * blue // 2)


def is_seen(picture):
    """The foreground; the background is in the corners."""
    return (numpy.abs(picture.astype(int) - picture[0, 0]) > 2).any(-1)


def test_labels_say_what_was_milled(shown):
    sizes = sorted(shown.sizes(), key=lambda label: (label[0], label[1][0]))
    assert [(kind, len(given)) for kind, given in sizes] == [(kind, len(drawn)) for kind, drawn in DRAWN]
    for (kind, given), (_, drawn) in zip(sizes, DRAWN, strict=True):
        for (value, within), true in zip(given, drawn, strict=True):
            assert abs(value - true) < 0.05 and 0 < within < 0.1, (kind, given)


def test_the_mesh_fills_the_pixels_that_a_camera_of_45_degrees_sees_it_in(pictures, expected):
    view, picture, _ = pictures
    seen, hit = is_seen(picture), expected[1] >= 0
    assert hit.mean() > 0.15, "the part is in the picture"
    assert not seen[[0, -1]].any() and not seen[:, [0, -1]].any(), "and all of it"
    assert (seen != hit).sum() < 0.01 * hit.sum(), "a tile is missing, twice there, or elsewhere"


def test_what_the_saved_mesh_calls_touched_is_green(pictures, expected):
    mesh, faces, _ = expected
    support = mesh.metadata["_ply_raw"]["vertex"]["data"]["support"].ravel()
    of_face = support[mesh.faces]
    # a face with corners of two kinds has both colours
    is_pure = numpy.append((of_face == of_face[:, :1]).all(1), False)[faces]
    is_touched = numpy.append(of_face[:, 0] == 1, False)[faces]
    green = is_green(pictures[1])
    assert (is_pure & is_touched).sum() > 30_000 and (is_pure & ~is_touched & (faces >= 0)).sum() > 30_000
    assert (green != is_touched)[is_pure].mean() < 0.02


def test_touched_is_green_and_green_was_touched(pictures, expected, demo_folder):
    _, faces, places = expected
    far = numpy.full(faces.shape, numpy.inf)
    contacts = open3d.t.geometry.PointCloud(numpy.float32(contact_points(demo_folder / "touch.mcap")))
    index = open3d.core.nns.NearestNeighborSearch(contacts.point.positions)
    index.knn_index()
    _, squared = index.knn_search(open3d.core.Tensor(numpy.float32(places[faces >= 0])), 1)
    far[faces >= 0] = numpy.sqrt(squared.numpy().ravel()) * 1e3 - RADIUS_MM
    green = is_green(pictures[1]) & (faces >= 0)
    assert (far[green] < 1.0).mean() > 0.99, "untouched, and shown as touched"
    assert green[far < 0.1].mean() > 0.95, "touched, and not shown as touched"


def contact_points(recording):
    """Centres of the ball while the part pushed, m; the plate's recording has the pose in the frame of the scan."""
    poses, pushed = [], []
    with AnyReader([recording], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, _, payload in reader.messages():
            read = reader.deserialize(payload, connection.msgtype)
            stamp_s = read.header.stamp.sec + read.header.stamp.nanosec * 1e-9
            if connection.topic.endswith("pose"):
                poses.append((stamp_s, read.pose.position.x, read.pose.position.y, read.pose.position.z))
            else:
                force = read.wrench.force
                pushed.append((stamp_s, numpy.linalg.norm([force.x, force.y, force.z])))
    poses, pushed = numpy.array(poses), numpy.array(pushed)
    return poses[numpy.interp(poses[:, 0], *pushed.T) > CONTACT_N, 1:]


def test_each_label_is_written_where_its_marker_is(shown, pictures):
    view, before, after = pictures
    ink = (after.min(-1) > 200) & (before.min(-1) < 200)
    places = [[getattr(marker.pose.position, axis) for axis in "xyz"] for marker in shown.labels()]
    distance = numpy.linalg.norm(numpy.array(places) - ros_rviz.camera(view)[0], axis=1)
    pixels = SIZE[1] / (2 * numpy.tan(ros_rviz.FIELD_OF_VIEW / 2) * distance)
    heights = [marker.scale.z for marker in shown.labels()] * pixels
    around = numpy.zeros_like(ink)
    for marker, (column, row), height in zip(shown.labels(), projected(view, SIZE, places), heights, strict=True):
        # the letters of RViz are some half as wide as high
        wide, high = 0.25 * height * len(marker.text), 0.5 * height
        box = (slice(int(row - high), int(row + high)), slice(int(column - 1.5 * wide), int(column + 1.5 * wide)))
        assert 0.02 < ink[box].mean() < 0.5, marker.text
        columns = numpy.flatnonzero(ink[box].any(0)) / (3 * wide)
        assert columns[0] < 0.3 and columns[-1] > 0.7, f"{marker.text} is cut off"
        around[box] = True
    assert ink[~around].sum() < 0.05 * ink.sum(), "something else is written"
