"""config/touchup.rviz: RViz shows the topics of the node, with a quality of service that matches."""

import re

import yaml
from conftest import ROOT
from ros_tables import code, published, table

SHOWS = {
    "rviz_default_plugins/Marker": "visualization_msgs/msg/Marker",
    "rviz_default_plugins/MarkerArray": "visualization_msgs/msg/MarkerArray",
    "rviz_default_plugins/Path": "nav_msgs/msg/Path",
}


def config():
    """The file."""
    return yaml.safe_load((ROOT / "config/touchup.rviz").read_text())


def topics(node):
    """Every topic in the file: its display, and the topic with its quality of service."""
    if isinstance(node, dict):
        for key, value in node.items():
            if key.endswith("Topic") and isinstance(value, dict):
                yield node, value
            else:
                yield from topics(value)
    elif isinstance(node, list):
        for value in node:
            yield from topics(value)


def test_displays_show_what_is_published():
    mine, shown = published(), set()
    for display, topic in topics(config()["Visualization Manager"]["Displays"]):
        name = topic["Value"]
        if display["Class"] == "rviz_default_plugins/RobotModel":
            assert name == "cell_description" and topic["Durability Policy"] == "Transient Local"
            continue
        shown.add(name)
        row = mine[name]
        assert code(row["type"]) == [SHOWS[display["Class"]]], name
        # an incompatible request gives silence
        assert topic["Durability Policy"].lower() == row["durability"], name
        assert topic["Reliability Policy"].lower() == row["reliability"], name
        assert topic["Depth"] == int(row["depth"]), name
    assert shown == {"mesh", "feature_markers", "tip", "path"}


def test_a_mesh_of_a_million_faces_fits_into_the_queue():
    depth = int(published()["mesh"]["depth"])
    points = int(re.search(r"at most (\d+) points", published()["mesh"]["what"])[1])
    assert depth * points // 3 >= 1_000_000
    # Fast DDS keeps 5000 samples at most by default
    assert depth < 5000


def test_a_point_is_published_where_the_node_listens():
    tools = config()["Visualization Manager"]["Tools"]
    point = next(tool for tool in tools if tool["Class"] == "rviz_default_plugins/PublishPoint")
    incoming = {name for row in table("topic", "type", "what") for name in code(row["topic"])}
    assert point["Topic"]["Value"] == "/clicked_point" and "/clicked_point" in incoming


def test_it_looks_at_a_frame_that_is_always_there():
    manager = config()["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] in {code(row["frame"])[0] for row in table("frame", "in")}
    classes = [display["Class"] for display in manager["Displays"]]
    assert classes[:2] == ["rviz_default_plugins/Grid", "rviz_default_plugins/TF"] and len(classes) == 7
    assert all(re.fullmatch(r"rviz_(default_plugins|common)/\w+", name) for name in classes)


def test_each_panel_has_its_place():
    # without it they lie one above the other, and squeeze the picture out of the window
    state = bytes.fromhex(config()["Window Geometry"]["QMainWindow State"])
    assert all(panel["Name"].encode("utf-16-be") in state for panel in config()["Panels"])
