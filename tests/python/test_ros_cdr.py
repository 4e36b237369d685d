"""The bytes that tests/ros/port/messages.rs compares with are those of the messages as they are now."""

import json

import make_ros_cdr
from conftest import ROOT
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


def test_the_golden_bytes_are_those_of_the_files_in_msg():
    committed = json.loads((ROOT / "tests/data/ros_cdr.json").read_text())
    assert make_ros_cdr.made() == committed


def test_no_two_fields_of_a_message_are_alike():
    """Otherwise an exchange of two fields would stay unseen."""

    def numbers(value):
        if isinstance(value, dict):
            for item in value.values():
                yield from numbers(item)
        elif isinstance(value, float):
            yield value

    for name, message in make_ros_cdr.made().items():
        found = list(numbers(message["fields"]))
        assert len(found) == len(set(found)), name


def test_the_standard_definitions_are_those_of_ros():
    """Fields and constants below crates/touchup-node/src/ros/messages/standard, without old and unused constants of Marker."""
    store = get_typestore(Stores.ROS2_JAZZY)
    left_out = {"MODIFY", "ARROW_STRIP"}
    for path in (ROOT / "crates/touchup-node/src/ros/messages/standard").glob("*/*.msg"):
        name = f"{path.parent.name}/msg/{path.stem}"
        ((constants, fields),) = get_types_from_msg(path.read_text(), name).values()
        known, known_fields = store.fielddefs[name]
        assert fields == known_fields, name
        assert sorted(constants) == sorted(one for one in known if one[0] not in left_out), name
