"""The layout for Foxglove and Lichtblick names topics that the node has, and panels that it lays out."""

import json
import re

from conftest import ROOT

layout = json.loads((ROOT / "config/foxglove.json").read_text())


def panels(place):
    """Names of the panels in a place of the layout, a panel or a split one."""
    return [place] if isinstance(place, str) else [*panels(place["first"]), *panels(place["second"])]


def test_every_panel_is_laid_out_once_and_configured():
    assert sorted(panels(layout["layout"])) == sorted(layout["configById"])


def test_every_topic_is_one_of_the_documentation_with_the_fields_of_its_message():
    text = (ROOT / "docs/ros.md").read_text()
    documented = {name if name.startswith("/") else "/" + name for name in re.findall(r"^\| `([/\w]+)`(?:, `[/\w]+`)? \|", text, re.M)}
    part = layout["configById"]["3D!part"]
    used = {*part["topics"], part["publish"]["pointTopic"], layout["configById"]["DiagnosticSummary!input"]["topicToRender"]}
    paths = [path["value"] for path in layout["configById"]["Plot!force"]["paths"]]
    paths.append(layout["configById"]["RawMessages!features"]["topicPath"])
    used |= {path.split(".")[0] for path in paths}
    assert used <= documented, used - documented
    fields = (ROOT / "msg/msg/HapticMismatch.msg").read_text() + (ROOT / "msg/msg/FeatureArray.msg").read_text()
    for path in paths:
        field = path.split(".")[1].removesuffix("[:]")
        assert re.search(rf"^\S+ {field}$", fields, re.M), path
