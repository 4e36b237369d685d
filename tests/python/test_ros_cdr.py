"""The bytes that tests/ros_messages.rs compares with are those of the messages as they are now."""

import json
import re

import make_ros_cdr
from conftest import ROOT


def test_the_golden_bytes_are_those_of_the_files_in_msg():
    committed = json.loads((ROOT / "tests/data/ros_cdr.json").read_text())
    assert make_ros_cdr.made() == committed


def test_no_two_fields_of_a_message_are_alike():
    """Otherwise two that changed places would not be seen."""

    def numbers(value):
        if isinstance(value, dict):
            for item in value.values():
                yield from numbers(item)
        elif isinstance(value, float):
            yield value

    for name, message in make_ros_cdr.made().items():
        found = list(numbers(message["fields"]))
        assert len(found) == len(set(found)), name


def test_the_constants_are_those_of_the_files():
    """What src/ros/messages has in its impl blocks; of Marker those that are old or not used are left out."""
    source = "".join(path.read_text() for path in sorted((ROOT / "src/ros/messages").glob("*.rs")))
    ours = {}
    for name, body in re.findall(r"^impl (\w+) \{\n(.*?)^\}", source, re.MULTILINE | re.DOTALL):
        listed = re.findall(r"pub const (\w+): \w+ = ([^;]+);", body)
        ours[name] = {key: 2**32 - 1 if value == "u32::MAX" else int(value) for key, value in listed}
    theirs = make_ros_cdr.constants()
    theirs["ProbeFeedback"] = theirs.pop("Probe_Feedback")
    del theirs["Marker"]["MODIFY"], theirs["Marker"]["ARROW_STRIP"]
    assert ours == theirs
