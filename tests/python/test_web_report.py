"""The inspection report that an operator page makes of a session: its numbers, and the permission for it."""

import csv
import http.client
import json
import shutil
import xml.etree.ElementTree as ElementTree
import zlib
from urllib.parse import quote, urlencode, urlsplit

import numpy
import pytest
from browser import DESKTOP, LANDSCAPE, PORTRAIT
from conftest import ROOT
from part_of_recording import first_seconds
from ros_player import play_in_step
from test_page import page_of
from test_ros_node import CYCLONE
from test_web import ask, let_in
from web_page import PageNode

DRAWING = ROOT / "examples/plate_nominal.csv"


@pytest.fixture(scope="module")
def touched(touchup_bin, demo_folder, tmp_path_factory):
    """A node with a nominal part after the beginning of the demo, whose page lets in by link; its cookies by role; and, beside the running
    session, `over`: an ended one, with refine's result of the demo.
    """
    folder = tmp_path_factory.mktemp("reported")
    part, begun = demo_folder / "truth.ply", first_seconds(demo_folder / "touch.mcap", 4, folder / "begun.mcap")
    with PageNode(touchup_bin, folder, demo_folder / "scan.ply", "--web-links", "--web-nominal", part, ros=CYCLONE) as node:
        play_in_step(node, begun, node.domain)
        node.part, node.over = part, node.session.parent / "over"
        shutil.copytree(demo_folder, node.over, ignore=shutil.ignore_patterns("*.mcap"))
        node.cookies = {role: let_in(node, role) for role in ("look", "operate")}
        yield node


def post(node, session, query, body=b"", role="operate", **headers):
    """Asks for a report as a page does; status and answer."""
    place = urlsplit(node.url)
    connection = http.client.HTTPConnection(place.hostname, place.port, timeout=120)
    headers = {"Origin": node.url, "Cookie": node.cookies[role], **headers}
    connection.request("POST", f"/api/reports/{quote(session, safe='')}?{urlencode(query)}", body=body, headers=headers)
    answer = connection.getresponse()
    text = answer.read()
    connection.close()
    return answer.status, json.loads(text)


def made(node, query, body=b""):
    """A report of the session that runs: its results."""
    status, said = post(node, node.session.name, query, body)
    assert status == 200, said
    assert said == {"files": ["report.html", "results.csv", "results.json", "results.qif"], "was_saved": True}
    return results(node.session)


def results(folder):
    return json.loads((folder / "results.json").read_text())


def test_a_report_of_nominal_values_in_the_session_is_of_what_is_saved_then(touched):
    shutil.copy(DRAWING, touched.session / "nominal.csv")
    head = {"part": "Plate 4711", "serial": "SN 1", "operator": "R. Ö"}
    found = made(touched, {"nominal": "session", "file": "nominal.csv", **head})
    assert {name: found[name] for name in head} == head
    with DRAWING.open() as file:
        drawn = [line["name"] for line in csv.DictReader(line for line in file if not line.startswith("#"))]
    assert [one["name"] for one in found["characteristics"]] == drawn and len(drawn) == 13
    with (touched.session / "results.csv").open(newline="") as file:
        rows = [(row["name"], row["decision"]) for row in csv.DictReader(file)]
    assert rows == [(one["name"], one["decision"]) for one in found["characteristics"]]
    assert ElementTree.parse(touched.session / "results.qif").getroot().tag.endswith("QIFDocument")


def test_a_report_of_the_nodes_nominal_part_has_the_tolerances_that_are_asked_for(touched):
    found = made(touched, {"nominal": "part", "general": "iso2768-f", "position_mm": "0.2", "confidence": "0.9"})
    assert found["files"][0]["path"] == str(touched.part) and found["confidence"] == 0.9
    limits = {(one["quantity"], one.get("nominal_mm")): one["upper_limit_mm"] for one in found["characteristics"]}
    # by ISO 2768-1 a fine size from 6 to 30 mm may be off by 0.1 mm
    (bore,) = [upper for (quantity, nominal), upper in limits.items() if quantity == "diameter_mm" and abs(nominal - 8) < 0.02]
    assert abs(bore - 8.1) < 0.02
    assert {upper for (quantity, _), upper in limits.items() if quantity == "position_mm"} == {0.2}


def test_a_drawing_that_lies_elsewhere_is_fit_to_the_part(touched):
    # the drawing turned by half a turn about z: x and y, and axes along them, change their signs
    with DRAWING.open() as file:
        lines = csv.DictReader(line for line in file if not line.startswith("#"))
        turned = [{name: turned_about_z(name, value) for name, value in line.items()} for line in lines]
    elsewhere = touched.session.parent / "elsewhere.csv"
    with elsewhere.open("w") as file:
        writer = csv.DictWriter(file, turned[0])
        writer.writeheader()
        writer.writerows(turned)
    # of the session with all of its recording: one played on a busy machine may lack touches that fix all freedoms
    query = {"nominal": "upload", "file": "elsewhere.csv", "align": "best-fit"}
    status, said = post(touched, "over", query, elsewhere.read_bytes())
    assert status == 200, said
    found = results(touched.over)
    assert numpy.abs(numpy.array(found["alignment"]["rotation"]) - numpy.diag([-1, -1, 1])).max() < 0.02


def turned_about_z(name, value):
    """A field of a drawing turned by half a turn about z."""
    is_turned = name in ("center_x_mm", "center_y_mm", "axis_x", "axis_y", "datum_x_mm", "datum_y_mm")
    return f"{-float(value)}" if is_turned and value else value


@pytest.mark.parametrize("name", ["drawing.csv", "part.ply"])
def test_nominal_values_that_are_handed_in_are_named_as_they_were_called_and_do_not_stay(touched, name):
    source = DRAWING if name.endswith("csv") else touched.part
    query = {"nominal": "upload", "file": name, "general": "iso2768-m"}
    found = made(touched, query, source.read_bytes())
    drawing = found["files"][0]
    assert (drawing["path"], drawing["bytes"]) == (name, source.stat().st_size)
    assert int(drawing["crc32"], 16) == zlib.crc32(source.read_bytes())
    assert found["characteristics"]
    assert not [left for left in touched.session.iterdir() if left.name.startswith(".upload")]


def test_a_session_that_is_over_has_a_report_of_its_own_files(touched):
    status, said = post(touched, "over", {"nominal": "upload", "file": "d.csv"}, DRAWING.read_bytes())
    assert (status, said["was_saved"]) == (200, False)
    found = results(touched.over)
    # as docs/inspect.md has it of the demo
    assert found["counts"] == {"pass": 11, "fail": 1, "undecided": 1}
    features = {one["id"]: one for one in json.loads((touched.over / "features.json").read_text())["features"]}
    measured = [one for one in found["characteristics"] if one["quantity"] in features.get(one.get("feature"), {})]
    assert len(measured) > 3 and all(one["actual_mm"] == features[one["feature"]][one["quantity"]] for one in measured)


def test_who_only_looks_opens_reports_and_makes_none(touched):
    made(touched, {"nominal": "part", "general": "iso2768-m"})
    status, said = post(touched, touched.session.name, {"nominal": "part", "general": "iso2768-m"}, role="look")
    assert status == 403 and "may look and not operate" in said["error"]
    address = f"/api/reports/{touched.session.name}"
    status, headers, text = ask(touched.url, address, Cookie=touched.cookies["look"])
    assert (status, text) == (200, (touched.session / "report.html").read_bytes())
    assert headers["content-type"].startswith("text/html")
    policy = headers["content-security-policy"]
    assert policy.startswith("sandbox; default-src 'none'") and "script-src" not in policy and "frame-ancestors 'none'" in policy
    assert "allow-" not in policy
    assert ask(touched.url, address)[0] == 401
    assert ask(touched.url, "/api/reports/missing", Cookie=touched.cookies["look"])[0] == 404


def test_a_report_is_made_for_our_own_page_alone(touched):
    query = {"nominal": "part", "general": "iso2768-m"}
    for origin in ["http://evil.example", "null", touched.url + "0"]:
        status, said = post(touched, touched.session.name, query, Origin=origin)
        assert status == 403 and "another page" in said["error"]
    path = f"/api/reports/{touched.session.name}?{urlencode(query)}"
    status, _, text = ask(touched.url, path, method="POST", Cookie=touched.cookies["operate"])
    assert status == 403 and b"without Origin" in text
    assert post(touched, touched.session.name, query, Cookie="x=1")[0] == 401


def test_names_that_lead_out_of_the_session_are_refused(touched, tmp_path):
    upload = {"nominal": "upload", "file": "d.csv"}
    for session in ["..", "../..", "/etc", ".hidden", "linked2", "", "missing", "a\0b"]:
        (touched.session.parent / "linked2").exists() or (touched.session.parent / "linked2").symlink_to(tmp_path)
        status, said = post(touched, session, upload, b"x") if session else (404, {})
        assert status in (400, 404), (session, said)
    for file in ["../d.csv", "/etc/d.csv", "a/b.csv", ".d.csv", "a\0.csv", 'a".csv']:
        status, said = post(touched, touched.session.name, {"nominal": "upload", "file": file}, b"x")
        assert status == 400, (file, said)
    for file in ["../nominal.csv", "/etc/passwd", "features.json", ""]:
        status, said = post(touched, touched.session.name, {"nominal": "session", "file": file})
        assert status == 400 and "nominal.csv or nominal.json" in said["error"], said
    assert list(tmp_path.iterdir()) == []
    # a link in the folder of the session is not written through
    over = touched.session.parent / "linking"
    over.mkdir()
    (over / "report.html").symlink_to(tmp_path / "out.html")
    status, said = post(touched, "linking", upload, DRAWING.read_bytes())
    assert status == 400 and "no plain file" in said["error"]
    assert list(tmp_path.iterdir()) == []


def test_what_is_too_large_is_refused_before_it_comes_and_while_it_comes(touched):
    for file, most in [("a.csv", 1 << 20), ("a.stl", 64 << 20)]:
        path = f"/api/reports/{touched.session.name}?{urlencode({'nominal': 'upload', 'file': file})}"
        status, _, text = ask(
            touched.url, path, method="POST", Origin=touched.url, Cookie=touched.cookies["operate"], Content_Length=str(most + 1)
        )
        assert status == 413 and b"may have up to" in text
    # without a length: cut off when it is over
    body = (b"x" * 65536 for _ in range(17))
    try:
        status, said = post(touched, touched.session.name, {"nominal": "upload", "file": "a.csv"}, body)
        assert status == 413, said
    except (BrokenPipeError, ConnectionResetError):
        # it closed before the end of the answer
        pass
    assert not [left for left in touched.session.iterdir() if left.name.startswith(".upload")]


def test_what_is_wrong_is_said_in_words(touched, tmp_path):
    wrong = tmp_path / "wrong.csv"
    wrong.write_text(DRAWING.read_text().replace("diameter_mm", "girth_mm", 1))
    status, said = post(touched, touched.session.name, {"nominal": "upload", "file": "wrong.csv"}, wrong.read_bytes())
    assert status == 400 and said["error"].startswith("wrong.csv") and "girth_mm" in said["error"], said
    for query, words in [
        ({"nominal": "part"}, "a CAD mesh has no tolerances"),
        ({"nominal": "part", "confidence": "0.3"}, "--confidence 0.3 must be above 0.5"),
        ({"nominal": "part", "general": "iso2768-x"}, "take one of iso2768-f"),
        ({"nominal": "part", "shell": "1"}, "shell"),
        ({"nominal": "hope"}, "hope"),
        ({}, "nominal"),
        ({"nominal": "upload", "file": "a.exe"}, ".csv or .json"),
    ]:
        status, said = post(touched, touched.session.name, query)
        assert status == 400 and words in said["error"], said


def test_sessions_say_when_they_began(touched):
    _, _, text = ask(touched.url, "/api/sessions", Cookie=touched.cookies["look"])
    (listed,) = [session for session in json.loads(text) if session["is_current"]]
    # the name of a session is the time of its beginning, with dashes for colons
    day, clock = listed["name"].rstrip("Z").split("T")
    assert listed["begun"] == f"{day}T{clock.replace('-', ':')}Z"


def test_an_operator_makes_a_report_by_clicks_and_sees_the_decisions(browser, touched, tmp_path):
    page = page_of(browser, touched, size=DESKTOP)
    page.get_by_role("button", name="Sessions").click()
    entry = page.locator(".session").filter(has=page.locator("summary strong", has_text="over"))
    entry.locator("summary").click()
    entry.get_by_role("button", name="Report").click()
    dialog = page.get_by_role("dialog", name="Inspection report")
    dialog.get_by_label("Nominal values from").select_option("upload")
    dialog.get_by_label("Table (CSV, JSON)").set_input_files(DRAWING)
    dialog.get_by_label("Part", exact=True).fill("Plate <4711>")
    dialog.get_by_label("Operator").fill("R. Ö")
    dialog.get_by_role("button", name="Make the report").click()
    dialog.get_by_role("status").filter(has_text="in the session's folder").wait_for()
    result = dialog.get_by_role("region", name="Result of the inspection")
    result.locator("strong", has_text="11 pass, 1 fail, 1 undecided").wait_for()
    found = results(touched.over)
    assert (found["part"], found["operator"]) == ("Plate <4711>", "R. Ö")
    rows = result.locator(".decisions li").all_inner_texts()
    assert [row.split()[0] for row in rows] == ["fail", "undecided"] + 11 * ["pass"]
    assert "blind hole diameter" in rows[0] and "slot width" in rows[1]
    page.screenshot(path=tmp_path / "report.png")
    with page.context.expect_page() as opening:
        result.get_by_role("link", name="Open the report").click()
    report = opening.value
    report.wait_for_load_state()
    assert report.url.endswith("/api/reports/over")
    assert "Plate <4711>" in report.locator("h1 + dl").inner_text()
    report.close()
    with page.expect_download() as saving:
        result.get_by_role("link", name="CSV").click()
    assert saving.value.suggested_filename == "results.csv"
    # the page shows the node's words of a refusal
    dialog.get_by_label("Probability").fill("20")
    dialog.get_by_role("button", name="Make the report").click()
    dialog.get_by_role("alert").wait_for()
    assert "must be above 0.5" in dialog.get_by_role("alert").inner_text()
    assert page.wrong == []
    page.context.close()


def test_the_session_that_runs_is_saved_for_its_report_from_the_bar(browser, touched, tmp_path):
    page = page_of(browser, touched, size=LANDSCAPE)
    page.get_by_role("navigation").get_by_role("button", name="Report").click()
    dialog = page.get_by_role("dialog", name="Inspection report")
    dialog.get_by_label("Nominal values from").select_option("part")
    assert dialog.get_by_label("General tolerance").input_value() == "iso2768-m"
    before = (touched.session / "results.json").stat().st_mtime_ns if (touched.session / "results.json").exists() else 0
    dialog.get_by_role("button", name="Make the report").click()
    dialog.get_by_role("status").filter(has_text="Saved; the report").wait_for()
    assert (touched.session / "results.json").stat().st_mtime_ns > before
    assert results(touched.session)["files"][0]["path"] == str(touched.part)
    page.screenshot(path=tmp_path / "bar.png")
    assert page.wrong == []
    page.context.close()


def test_who_only_looks_sees_the_result_and_no_form(browser, touched, tmp_path):
    made(touched, {"nominal": "part", "general": "iso2768-m"})
    page = page_of(browser, touched, role="look", size=PORTRAIT, language="de")
    page.get_by_role("button", name="Sitzungen").click()
    entry = page.locator(".session", has_text=touched.session.name)
    entry.locator("summary").click()
    entry.get_by_role("button", name="Prüfbericht").click()
    dialog = page.get_by_role("dialog", name="Prüfbericht")
    dialog.get_by_role("link", name="Bericht öffnen").wait_for()
    assert not dialog.get_by_role("button", name="Bericht erstellen").is_visible()
    page.screenshot(path=tmp_path / "look.png")
    assert page.wrong == []
    page.context.close()
