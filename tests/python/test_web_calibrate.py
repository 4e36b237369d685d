"""Calibrations from recordings in the setup on the page: over HTTP and by clicks the contents of the recordings come into scene.yaml."""

import datetime
import os
import re
import shutil

import numpy
import pytest
import yaml
from browser import DESKTOP, PORTRAIT
from calibration_recordings import (
    BIAS_N,
    CENTRE_MM,
    OFFSET_MM,
    SPACE_MM,
    WEIGHT_N,
    dwells,
    still,
    swing,
    write_bag,
    write_file,
    write_points,
)
from setup_node import SetupNode, check_looks, page_on
from test_page import AXE

SCENE = f"# bench 3\ntip:\n  radius_mm: 1.5  # the long one\n  offset_mm: {OFFSET_MM.tolist()}\npatch: off  # no time\n"


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """A scene, and a recording for each calibration: two files and a folder of rosbag2. No test writes there."""
    made = tmp_path_factory.mktemp("calibration")
    (made / "scene.yaml").write_text(SCENE)
    write_bag(made / "swing", swing())
    write_file(made / "still.mcap", still())
    write_file(made / "dwells.mcap", dwells())
    write_points(made / "points.csv")
    return made


@pytest.fixture
def scans(made, tmp_path):
    """The same as a folder of scans."""
    return shutil.copytree(made, tmp_path / "scans")


# the payload last: during the touches of the points the sensor carried nothing
SOURCES = {
    "tip": {"recording": "swing"},
    "scan": {"recording": "dwells.mcap", "points": "points.csv"},
    "payload": {"recording": "still.mcap"},
}


def test_what_is_in_the_recordings_is_found_and_comes_into_the_scene_when_it_is_used(touchup_bin, scans, tmp_path):
    with SetupNode(touchup_bin, tmp_path) as node:
        assert {one["name"] for one in node.state()["recordings"]} == {"swing", "still.mcap", "dwells.mcap"}
        assert [one["name"] for one in node.state()["tables"]] == ["points.csv"]
        # the user has to confirm a tip of the scene, since its ball rests on a point
        assert node.ask("/api/setup/calibrate", {"what": "scan", **SOURCES["scan"]})[0] == 409
        assert node.ask("/api/setup/tip", {"radius_mm": 1.5})[0] == 200
        for what, source in SOURCES.items():
            before = (scans / "scene.yaml").read_text()
            assert node.ask("/api/setup/use", {"what": what})[0] == 409
            found = node.calibrated(what=what, **source)
            assert (found["state"], found["is_used"], found["doubts"]) == ("found", False, [])
            # nothing changes without a request
            assert (scans / "scene.yaml").read_text() == before
            status, state = node.ask("/api/setup/use", {"what": what})
            assert status == 200 and state["calibration"]["is_used"], state
            assert node.ask("/api/setup/use", {"what": what})[0] == 409
            named = state["calibrations"][what]
            age = datetime.datetime.now(datetime.UTC).date() - datetime.date.fromisoformat(named["date"])
            assert named["is_there"] and 0 <= age.days <= 1
            text = (scans / "scene.yaml").read_text()
            assert text.startswith("# bench 3\n") and "# the long one" in text and "# no time" in text
            assert f"# touchup calibrate {what}: " in text and named["date"] in text, text
            check_truth(what, yaml.safe_load(text), found["found"])


def check_truth(what, scene, found):
    """The scene has the values of the recording, within five of its own standard uncertainties."""
    if what == "tip":
        off = numpy.array(scene["tip"]["offset_mm"]) - OFFSET_MM
        assert (abs(off) < 5 * numpy.array(found["offset_mm"]["std"])).all(), off
    elif what == "payload":
        payload, bias = scene["compensation"]["payload"], scene["compensation"]["bias"]
        weight_n = payload["mass_kg"] * 9.81
        assert abs(weight_n - numpy.linalg.norm(WEIGHT_N)) < 5 * found["weight_std_n"]
        for value, truth, std in [(payload["centre_mm"], CENTRE_MM, "centre_mm"), (bias["force_n"], BIAS_N, "bias_force_n")]:
            assert (abs(numpy.array(value) - truth) < 5 * numpy.array(found[std]["std"])).all(), (value, truth)
    else:
        # five points of 0.02 mm noise, 30 mm apart
        assert numpy.allclose(scene["scan_to_space"]["position_mm"], SPACE_MM, atol=0.5)
        assert found["rms_mm"] < 0.1


def test_what_the_command_line_puts_into_the_scene_meanwhile_stays_there(touchup_bin, touchup, scans, tmp_path):
    scene = scans / "scene.yaml"
    with SetupNode(touchup_bin, tmp_path) as node:
        assert node.calibrated(what="tip", recording="swing")["state"] == "found"
        done = touchup("calibrate", "payload", "--bag", scans / "still.mcap", "--scene", scene, "--out", scene)
        assert done.returncode == 0, done.stderr
        status, state = node.ask("/api/setup/use", {"what": "tip"})
        assert status == 200 and state["calibrations"]["payload"]["is_there"], state
        text = scene.read_text()
        assert "# touchup calibrate payload: 12 static segments" in text and "# touchup calibrate tip: 3000 poses" in text
        # the setup neither uses nor overwrites a file that is no scene any more
        scene.write_text("tip: [\n")
        status, found = node.ask("/api/setup/calibrate", {"what": "payload", "recording": "still.mcap"})
        assert status == 422 and "scene.yaml" in found["error"], found
        assert scene.read_text() == "tip: [\n"


def test_what_cannot_be_used_is_refused_in_words_that_name_the_file(touchup_bin, scans, tmp_path):
    (scans / "noise.mcap").write_bytes(os.urandom(1000))
    (scans / "two.csv").write_text("scan_x_mm,scan_y_mm,scan_z_mm\n1,2,3\n4,5,6\n")
    with SetupNode(touchup_bin, tmp_path) as node:
        assert node.ask("/api/setup/tip", {"radius_mm": 1.5})[0] == 200
        for what, source, words in [
            ("tip", {"recording": "still.mcap"}, "still.mcap: "),
            ("payload", {"recording": "swing"}, "swing: "),
            ("tip", {"recording": "noise.mcap"}, "noise.mcap"),
            ("scan", {"recording": "dwells.mcap", "points": "two.csv"}, "dwells.mcap: 5 dwells of half a second in contact, and 2 points"),
            ("scan", {"points": "points.csv"}, "points.csv"),
        ]:
            found = node.calibrated(what=what, **source)
            assert (found["state"], found["what"]) == ("refused", what), found
            # as the folder has it
            assert words in found["why"] and str(scans) not in found["why"], found
            assert node.ask("/api/setup/use", {"what": what})[0] == 409
    assert (scans / "scene.yaml").read_text() == SCENE


def test_requests_that_make_no_sense_or_lead_out_of_the_folder_are_refused(touchup_bin, scans, tmp_path):
    write_file(tmp_path / "outside.mcap", still())
    bag = scans / "bag"
    bag.mkdir()
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  relative_file_paths: [../../outside.mcap]\n")
    (scans / "link").symlink_to(scans / "swing")
    with SetupNode(touchup_bin, tmp_path) as node:
        for request, status in [
            ({"what": "tip"}, 422),
            ({"what": "tip", "recording": "points.csv"}, 422),
            ({"what": "tip", "recording": "swing", "points": "points.csv"}, 422),
            ({"what": "scan", "recording": "dwells.mcap"}, 422),
            ({"what": "scan", "points": "swing"}, 422),
            ({"what": "tip", "recording": "../outside.mcap"}, 422),
            ({"what": "tip", "recording": "bag"}, 422),
            ({"what": "tip", "recording": "link"}, 422),
            ({"what": "tip", "recording": ".."}, 422),
            ({"what": "drill", "recording": "swing"}, 400),
            ({"what": "tip", "recording": "swing", "more": 1}, 400),
        ]:
            found = node.ask("/api/setup/calibrate", request)
            assert found[0] == status and found[1]["error"], (request, found)
        assert node.state()["calibration"] == {"state": "none"}


def test_a_recording_that_is_sent_is_kept_and_can_be_used(touchup_bin, scans, tmp_path):
    sent = (scans / "still.mcap").read_bytes()
    with SetupNode(touchup_bin, tmp_path) as node:
        assert node.ask("/api/setup/file?name=mine.mcap", sent) == (200, {"file": "mine.mcap"})
        assert node.ask("/api/setup/file?name=mine.mcap", sent) == (200, {"file": "mine-2.mcap"})
        assert (scans / "mine-2.mcap").read_bytes() == sent
        assert node.ask("/api/setup/file?name=mine.csv", b"x") == (200, {"file": "mine.csv"})
        for name in ["mine.ply", "scene.yaml", "..%2Fmine.mcap", ""]:
            status, found = node.ask(f"/api/setup/file?name={name}", sent)
            assert status == 400 and found["error"], name
        assert node.state()["scan"] == {"state": "none"}
        assert node.calibrated(what="payload", recording="mine-2.mcap")["state"] == "found"
        # another tip may be on another stylus: unused results are gone
        assert node.ask("/api/setup/tip", {"radius_mm": 2})[1]["calibration"] == {"state": "none"}


@pytest.mark.parametrize(
    ("size", "language", "scheme", "sends"),
    [(DESKTOP, "en", "light", False), (PORTRAIT, "de", "dark", True)],
    ids=["desktop", "tablet"],
)
def test_by_clicks_into_the_scene(browser, touchup_bin, demo_folder, scans, tmp_path, size, language, scheme, sends):
    if not AXE.is_file():
        pytest.skip("axe-core is not there: web/check installs it")
    words = {
        "en": ["about as large as", "This tip is mounted", "Centre of the ball", "Place of the part", "Send a recording"],
        "de": ["ungefähr wie", "Diese Spitze ist montiert", "Mitte der Kugel", "Lage des Teils", "Aufzeichnung senden"],
    }[language]
    like, mounted, centre, place, send = words
    words = {
        "en": ["Smallest swing", "Use it", "It is in scene.yaml now.", "Worst point", "cannot be used"],
        "de": ["Kleinster Schwenk", "Übernehmen", "Es steht jetzt in scene.yaml.", "Schlechtester Punkt", "nicht verwendbar"],
    }[language]
    swung, use, used, worst, refused = words
    (scans / "scan.ply").write_bytes((demo_folder / "scan.ply").read_bytes())
    (tmp_path / "swing.mcap").write_bytes((scans / "swing" / "swing.mcap").read_bytes())
    (scans / "scene.yaml").write_text(SCENE.replace("  offset_mm", "  # offset_mm"))
    with SetupNode(touchup_bin, tmp_path) as node:
        page = page_on(browser, node.url, size, language, color_scheme=scheme, bypass_csp=True)
        page.get_by_role("button", name=re.compile("scan.ply")).click()
        page.get_by_role("button", name=re.compile(f"{like}.*mm")).first.click()
        page.get_by_role("button", name=mounted).click()
        card = page.locator(".calibration", has_text=centre).first
        check_looks(page, tmp_path, "sensors")
        card.locator("summary").click()
        card.get_by_role("button", name=re.compile("still.mcap")).click()
        card.get_by_text(refused).wait_for()
        check_looks(page, tmp_path, "refused")
        if sends:
            with page.expect_file_chooser() as chooser:
                card.get_by_role("button", name=send).click()
            chooser.value.set_files(tmp_path / "swing.mcap")
        else:
            card.get_by_role("button", name=re.compile("swing")).click()
        card.get_by_text(swung).wait_for()
        # the unchanged offset, with the sign and the decimal point of the language
        shown = card.locator("dl").inner_text().replace("−", "-").replace(",", ".")
        (z,) = re.findall(r"(-14\d\.\d+)\s±", shown)
        assert abs(float(z) - OFFSET_MM[2]) < 0.01, shown
        check_looks(page, tmp_path, "found")
        card.get_by_role("button", name=use).click()
        card.get_by_text(used).wait_for()
        check_looks(page, tmp_path, "used")
        # the place of the part: a table, then the recording
        card = page.locator(".calibration", has_text=place).first
        card.locator("summary").click()
        assert card.get_by_role("button", name=re.compile("dwells.mcap")).is_disabled()
        card.get_by_role("button", name=re.compile("points.csv")).click()
        card.get_by_role("button", name=re.compile("dwells.mcap")).click()
        card.get_by_text(worst).wait_for()
        card.get_by_role("button", name=use).click()
        card.get_by_text(used).wait_for()
        check_looks(page, tmp_path, "place")
        assert page.wrong == []
        page.context.close()
    scene = yaml.safe_load((scans / "scene.yaml").read_text())
    assert numpy.allclose(scene["tip"]["offset_mm"], OFFSET_MM, atol=0.05)
    assert numpy.allclose(scene["scan_to_space"]["position_mm"], SPACE_MM, atol=0.5)
