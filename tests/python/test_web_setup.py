"""The setup on the page before there is a node: over HTTP, refusals and the settings at the node's begin; and by clicks, in a real browser,
from nothing to the live page.
"""

import http.client
import json
import os
import re
import shutil
from urllib.parse import urlsplit

import numpy
import pytest
import trimesh
from browser import DESKTOP, PORTRAIT, wait_until
from setup_node import SetupNode, check_looks, page_on
from test_page import AXE
from test_web import let_in
from web_page import Socket

LARGEST = 2 << 30


@pytest.fixture
def empty(touchup_bin, tmp_path):
    with SetupNode(touchup_bin, tmp_path) as node:
        yield node


def test_a_node_without_a_scan_is_set_up_over_http_and_begins_with_what_was_said(touchup_bin, demo_folder, tmp_path):
    with SetupNode(touchup_bin, tmp_path) as node:
        assert node.state()["stage"] == "choosing" and node.state()["files"] == []
        scan = (demo_folder / "scan.ply").read_bytes()
        status, found = node.ask("/api/setup/upload?name=scan.ply", scan)
        assert status == 200, found
        assert (node.scans / "scan.ply").read_bytes() == scan
        found = node.read()
        mesh = trimesh.load(demo_folder / "scan.ply", process=False)
        assert found["scan"]["faces"] == len(mesh.faces)
        (likely,) = [one for one in found["scan"]["units"] if one["is_likely"]]
        assert likely["unit"] == "mm"
        assert numpy.allclose(likely["sides_m"], (mesh.bounds[1] - mesh.bounds[0]) * 1e-3)
        # nothing changes without a request
        assert found["unit"] is None and found["tip"] is None
        assert node.ask("/api/setup/start", {})[0] == 409
        assert node.ask("/api/setup/unit", {"unit": "mm"})[0] == 200
        assert node.ask("/api/setup/start", {})[0] == 409
        assert node.ask("/api/setup/tip", {"radius_mm": 1.25, "uncertainty_mm": 0.006})[0] == 200
        status, found = node.ask("/api/setup/start", {})
        assert (status, found["stage"]) == (200, "starting")
        node.wait_for(lambda: node.ask("/api/setup")[1]["stage"] == "running")
        with Socket(node.url) as page:
            page.take_until(lambda: page.faces)
            assert len(page.faces) == len(mesh.faces)
            assert page.newest["state"]["scan"]["file"] == "scan.ply"
        node.wait_for(lambda: any("listens to" in line for line in node.out))
        assert node.end() == 0, node.text()
    (session,) = node.sessions.iterdir()
    for scene in [(session / "scene.yaml").read_text(), (node.scans / "scene.yaml").read_text()]:
        assert re.search(r"^  radius_mm: 1.25\b", scene, re.M)
        assert re.search(r"^  radius_sigma_mm: 0.003\b", scene, re.M)
        assert re.search(r"^  unit: mm\b", scene, re.M) and re.search(r"^  file: 'scan.ply'", scene, re.M)
        # every key is still explained
        assert scene.count("#") > 100
    assert json.loads((session / "session.json").read_text())["mesh_unit"] == "mm"


def test_the_scene_of_the_folder_is_begun_with_and_keeps_its_comments(touchup_bin, demo_folder, tmp_path):
    scans = tmp_path / "scans"
    scans.mkdir()
    (scans / "scene.yaml").write_text("# bench 3\ntip:\n  radius_mm: 2.5  # the long one\ncontact: { on_n: 0.4 }\n")
    mesh = trimesh.load(demo_folder / "scan.ply", process=False)
    mesh.apply_scale(1 / 25.4)
    mesh.export(scans / "part.stl")
    with SetupNode(touchup_bin, tmp_path) as node:
        assert node.state()["known_radius_mm"] == 2.5
        units = {one["unit"]: one for one in node.choose("part.stl")["scan"]["units"]}
        assert units["inch"]["is_likely"]
        assert node.ask("/api/setup/unit", {"unit": "inch"})[0] == 200
        assert node.ask("/api/setup/tip", {"radius_mm": 2.5})[0] == 200
        assert node.ask("/api/setup/start", {})[0] == 200
        node.wait_for(lambda: any("listens to" in line for line in node.out))
        with Socket(node.url) as page:
            page.take_until(lambda: page.faces)
            places = numpy.array(list(page.vertices.values()))
            # in m, for any unit of the file
            assert numpy.allclose(places.max(0) - places.min(0), units["inch"]["sides_m"], atol=1e-6)
    scene = (scans / "scene.yaml").read_text()
    assert scene.startswith("# bench 3\n") and "# the long one" in scene and "contact: { on_n: 0.4 }" in scene
    assert "unit: inch" in scene


def test_what_is_no_scan_in_the_folder_is_refused(empty, demo_folder, tmp_path):
    (tmp_path / "outside.ply").write_bytes(b"ply\n")
    (empty.scans / "link.ply").symlink_to(tmp_path / "outside.ply")
    (empty.scans / "notes.md").write_text("x")
    scan = (demo_folder / "scan.ply").read_bytes()
    assert [file["name"] for file in empty.state()["files"]] == []
    for name in ["../outside.ply", "link.ply", "notes.md", "none.ply", "/etc/passwd", "", ".."]:
        status, found = empty.ask("/api/setup/scan", {"file": name})
        assert status == 422 and found["error"], name
    for name in ["..%2Fscan.ply", "%2Fscan.ply", "a%5Cb.ply", ".scan.ply", "", "scan.exe", "scene.yaml"]:
        status, found = empty.ask(f"/api/setup/upload?name={name}", scan)
        assert status == 400 and found["error"], name
    assert sorted(path.name for path in empty.scans.iterdir()) == ["link.ply", "notes.md"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["outside.ply", "scans"]
    # not a mesh, one that ends in its middle, one that is larger than any part in any unit
    (empty.scans / "noise.ply").write_bytes(os.urandom(2000))
    (empty.scans / "half.ply").write_bytes(scan[: len(scan) // 2])
    huge = trimesh.creation.box((1e9, 1e9, 1e9))
    huge.export(empty.scans / "huge.stl")
    for name in ["noise.ply", "half.ply", "huge.stl"]:
        refused = empty.choose(name)["scan"]
        assert (refused["state"], refused["file"]) == ("refused", name) and name in refused["why"], refused
    assert empty.ask("/api/setup/unit", {"unit": "mm"})[0] == 409
    assert empty.ask("/api/setup/start", {})[0] == 409


def test_an_upload_is_never_too_large_and_never_writes_over_a_file(empty, demo_folder):
    scan = (demo_folder / "scan.ply").read_bytes()
    (empty.scans / "scan.ply").write_bytes(b"mine")
    assert empty.ask("/api/setup/upload?name=scan.ply", scan)[0] == 200
    assert empty.read()["scan"]["file"] == "scan-2.ply"
    assert (empty.scans / "scan.ply").read_bytes() == b"mine"
    # the node refuses a stated size above the limit before any of the file comes
    place = urlsplit(empty.url)
    connection = http.client.HTTPConnection(place.hostname, place.port, timeout=60)
    connection.putrequest("POST", "/api/setup/upload?name=big.ply")
    for name, value in [("Origin", empty.url), ("Content-Length", str(LARGEST + 1))]:
        connection.putheader(name, value)
    connection.endheaders()
    assert connection.getresponse().status == 413
    connection.close()
    # one that breaks off leaves nothing
    connection = http.client.HTTPConnection(place.hostname, place.port, timeout=60)
    connection.putrequest("POST", "/api/setup/upload?name=half.ply")
    for name, value in [("Origin", empty.url), ("Content-Length", str(len(scan)))]:
        connection.putheader(name, value)
    connection.endheaders(scan[: len(scan) // 2])
    empty.wait_for(lambda: empty.state()["upload"] is not None)
    assert empty.ask("/api/setup/upload?name=other.ply", scan)[0] == 409
    connection.close()
    empty.wait_for(lambda: empty.state()["upload"] is None)
    assert sorted(path.name for path in empty.scans.iterdir()) == ["scan-2.ply", "scan.ply"]


def test_who_looks_sees_the_setup_and_changes_nothing(touchup_bin, demo_folder, tmp_path):
    scans = tmp_path / "scans"
    scans.mkdir()
    shutil.copy(demo_folder / "scan.ply", scans)
    with SetupNode(touchup_bin, tmp_path, "--web-links") as node:
        changes = [("upload?name=x.ply", b"ply"), ("scan", {"file": "scan.ply"}), ("unit", {"unit": "mm"})]
        changes += [("tip", {"radius_mm": 1}), ("start", {}), ("file?name=x.mcap", b"x")]
        changes += [("calibrate", {"what": "tip", "recording": "x.mcap"}), ("use", {"what": "tip"})]
        assert node.ask("/api/setup")[0] == 401
        for path, body in changes:
            assert node.ask(f"/api/setup/{path}", body)[0] == 401, path
        looks, operates = let_in(node, "look"), let_in(node, "operate")
        assert node.state(cookie=looks)["role"] == "look"
        for path, body in changes:
            status, found = node.ask(f"/api/setup/{path}", body, cookie=looks)
            assert status == 403 and "may look" in found["error"], path
            for origin in [False, "http://evil.example", "null"]:
                assert node.ask(f"/api/setup/{path}", body, cookie=operates, origin=origin)[0] == 403, path
        assert node.ask("/api/setup/scan", {"file": "scan.ply"}, cookie=operates)[0] == 200
        assert node.read(cookie=looks)["scan"]["state"] == "read"


def test_numbers_and_requests_that_make_no_sense_are_refused(empty, demo_folder):
    shutil.copy(demo_folder / "scan.ply", empty.scans)
    empty.choose("scan.ply")
    for path, body, status in [
        ("unit", {"unit": "m"}, 422),
        ("unit", {"unit": "furlong"}, 400),
        ("unit", {"unit": "mm", "more": 1}, 400),
        ("tip", {"radius_mm": 0}, 422),
        ("tip", {"radius_mm": -1.5}, 422),
        ("tip", {"radius_mm": 1e9}, 422),
        ("tip", {"radius_mm": 1.5, "uncertainty_mm": -1}, 422),
        ("tip", {"radius_mm": "1.5"}, 400),
        ("tip", b"{", 400),
        ("start", b"x" * 20_000, 413),
    ]:
        found = empty.ask(f"/api/setup/{path}", body)
        assert found[0] == status and found[1]["error"], (path, body, found)
    assert empty.state()["unit"] is None and empty.state()["tip"] is None


def test_an_error_of_the_start_is_told_at_its_step_and_can_be_mended(empty, demo_folder):
    for name in ["scan.ply", "other.ply"]:
        shutil.copy(demo_folder / "scan.ply", empty.scans / name)
    empty.choose("scan.ply")
    empty.ask("/api/setup/unit", {"unit": "mm"})
    empty.ask("/api/setup/tip", {"radius_mm": 1.5})
    # the file goes after its reading
    (empty.scans / "scan.ply").unlink()
    assert empty.ask("/api/setup/start", {})[0] == 200
    empty.wait_for(lambda: empty.state()["stage"] == "choosing")
    failure = empty.state()["failure"]
    assert failure["step"] == "scan" and "scan.ply" in failure["why"]
    assert empty.choose("other.ply")["failure"] is None
    assert empty.ask("/api/setup/unit", {"unit": "mm"})[0] == 200
    assert empty.ask("/api/setup/start", {})[0] == 200
    empty.wait_for(lambda: any("listens to" in line for line in empty.out))


def test_what_is_wrong_around_a_node_is_told_on_the_page_and_a_signal_ends_it(touchup_bin, demo_folder, tmp_path):
    scans = tmp_path / "scans"
    scans.mkdir()
    shutil.copy(demo_folder / "scan.ply", scans)
    with SetupNode(touchup_bin, tmp_path, ros=["-p", "source:=probe", "-p", "robot:=sim"]) as node:
        node.choose("scan.ply")
        node.ask("/api/setup/unit", {"unit": "mm"})
        node.ask("/api/setup/tip", {"radius_mm": 1.5})
        for _ in range(2):
            assert node.ask("/api/setup/start", {})[1]["failure"] is None
            node.wait_for(lambda: node.state()["stage"] == "choosing")
            failure = node.state()["failure"]
            assert failure["step"] == "start" and "`robot:` in the scene" in failure["why"], failure
        # nothing there needs saving
        assert node.end() == 130, node.text()


def test_a_recording_of_the_folder_is_looked_at(empty, demo_folder):
    for name in ["scan.ply", "touch.mcap"]:
        shutil.copy(demo_folder / name, empty.scans)
    # a folder is one recording too
    (empty.scans / "touches").mkdir()
    shutil.copy(demo_folder / "touch.mcap", empty.scans / "touches")
    assert sorted(one["name"] for one in empty.state()["recordings"]) == ["touch.mcap", "touches"]
    assert empty.ask("/api/setup/check", {"recording": "touch.mcap"})[0] == 409
    empty.choose("scan.ply")
    empty.ask("/api/setup/unit", {"unit": "mm"})
    for radius, causes, recording in [(1.5, [], "touch.mcap"), (15, ["radius"], "touches")]:
        assert empty.ask("/api/setup/tip", {"radius_mm": radius})[0] == 200
        assert empty.state()["check"] == {"state": "none"}
        assert empty.ask("/api/setup/check", {"recording": recording})[0] == 200
        empty.wait_for(lambda: empty.state()["check"]["state"] != "running")
        found = empty.state()["check"]
        assert found["file"] == recording and [one["cause"] for one in found["findings"] if one["is_sure"]] == causes, found
    for name in ["scan.ply", "../touch.mcap", "none.mcap"]:
        assert empty.ask("/api/setup/check", {"recording": name})[0] == 422, name
    (empty.scans / "noise.mcap").write_bytes(os.urandom(1000))
    assert empty.ask("/api/setup/check", {"recording": "noise.mcap"})[0] == 200
    empty.wait_for(lambda: empty.state()["check"]["state"] == "refused")
    assert "noise.mcap" in empty.state()["check"]["why"]
    # the check is optional
    assert empty.ask("/api/setup/check", {})[1]["is_check_over"]
    assert empty.ask("/api/setup/start", {})[0] == 200


@pytest.mark.parametrize(
    ("size", "language", "scheme", "sends"),
    [(DESKTOP, "en", "light", False), (PORTRAIT, "de", "dark", True)],
    ids=["desktop", "tablet"],
)
def test_by_clicks_from_nothing_to_the_live_page(browser, touchup_bin, demo_folder, tmp_path, size, language, scheme, sends):
    if not AXE.is_file():
        pytest.skip("axe-core is not there: web/check installs it")
    words = {
        "en": ["Send a scan", "about as large as", "Radius, mm", "This tip is mounted", "Nothing speaks against", "Go on", "Start"],
        "de": ["Scan von diesem", "ungefähr wie", "Radius, mm", "Diese Spitze ist montiert", "Nichts spricht gegen", "Weiter", "Starten"],
    }[language]
    send, like, radius, use, good, go_on, start = words
    scans = tmp_path / "scans"
    scans.mkdir()
    shutil.copy(demo_folder / "touch.mcap", scans)
    if not sends:
        shutil.copy(demo_folder / "scan.ply", scans)
    options = {"has_touch": True} if sends else {}
    with SetupNode(touchup_bin, tmp_path) as node:
        page = page_on(browser, node.url, size, language, color_scheme=scheme, bypass_csp=True, **options)
        other = page_on(browser, node.url, size, language)
        check_looks(page, tmp_path, "scan")
        if sends:
            with page.expect_file_chooser() as chooser:
                page.get_by_role("button", name=send).tap()
            chooser.value.set_files(demo_folder / "scan.ply")
        else:
            page.get_by_role("button", name=re.compile("scan.ply")).click()
        likely = page.get_by_role("button", name=re.compile(f"{like}.*mm"))
        likely.first.wait_for()
        check_looks(page, tmp_path, "unit")
        likely.first.click()
        field = page.get_by_label(radius, exact=True)
        field.fill("0")
        page.get_by_role("button", name=use).click()
        page.get_by_role("alert").first.wait_for()
        field.fill("1,5")
        page.get_by_text("Ø 3").first.wait_for()
        check_looks(page, tmp_path, "tip")
        field.press("Enter")
        page.get_by_role("button", name=re.compile("touch.mcap")).click()
        page.get_by_text(good).first.wait_for()
        check_looks(page, tmp_path, "check")
        page.get_by_role("button", name=go_on, exact=True).click()
        begin = page.get_by_role("button", name=start, exact=True)
        begin.wait_for()
        # the other page shows the same without a click
        other.get_by_role("button", name=start, exact=True).wait_for()
        check_looks(page, tmp_path, "start")
        with page.expect_navigation(), other.expect_navigation():
            begin.click()
        for each in (page, other):
            wait_until(each, "window.touchup !== undefined && touchup.faceCount() > 0")
            assert each.wrong == []
        page.evaluate("touchup.idle()")
        # the dialogue has just given its size
        asked = page.locator(".setup .question").inner_text()
        assert asked == {"en": "Switch the stylus on. Do place and force come in?", "de": "Schalten Sie den Taster ein. Kommen Lage und Kraft an?"}[language]
        page.screenshot(path=tmp_path / "live.png")
        page.context.close()
        other.context.close()
    assert re.search(r"^  radius_mm: 1.5\b", (scans / "scene.yaml").read_text(), re.M)


def test_the_keyboard_alone_leads_through_the_steps(browser, touchup_bin, demo_folder, tmp_path):
    scans = tmp_path / "scans"
    scans.mkdir()
    shutil.copy(demo_folder / "scan.ply", scans)
    with SetupNode(touchup_bin, tmp_path) as node:
        page = page_on(browser, node.url, DESKTOP)

        def is_at(step):
            return f"document.activeElement?.id === 'step-{step}'"

        page.get_by_role("button", name=re.compile("scan.ply")).focus()
        page.keyboard.press("Enter")
        # each reached step has the focus, and its first control is the next stop
        wait_until(page, is_at("unit"))
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")
        wait_until(page, is_at("tip"))
        page.keyboard.press("Tab")
        page.keyboard.type("1.5")
        page.keyboard.press("Enter")
        wait_until(page, is_at("check"))
        page.get_by_role("button", name="Go on without a look").focus()
        page.keyboard.press("Enter")
        wait_until(page, is_at("start"))
        page.keyboard.press("Tab")
        with page.expect_navigation():
            page.keyboard.press("Enter")
        wait_until(page, "window.touchup !== undefined && touchup.faceCount() > 0")
        assert page.wrong == []
        page.context.close()
