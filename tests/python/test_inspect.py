"""`touchup inspect` against SciPy, and its files against one another."""

import csv
import html.parser
import json
import math
import re
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree

import lxml.etree
import numpy as np
import pytest
import trimesh
from conftest import ROOT
from scipy.stats import ncx2, norm, truncnorm

QIF = "{http://qifstandards.org/xsd/qif3}"
DRAWING = ROOT / "examples/plate_nominal.csv"
# of the probabilities, absolute: Simpson's rule for positions, roundings for the others
PROBABILITY = 1e-9


def hole(number, diameter, u, centre_off=0.0, roundness=0.0):
    """A touched hole at (10 number, 0, 0), whose numbers all have the standard uncertainty u."""
    return {
        "id": number,
        "kind": "hole",
        "center_mm": [10.0 * number + centre_off, 0.0, 0.0],
        "axis": [0.0, 0.0, 1.0],
        "diameter_mm": diameter,
        "std": {"diameter_mm": u, "center_mm": u * math.sqrt(2)},
        "form": {"roundness_mm": roundness, "std": {"roundness_mm": u}},
        "fitted_to": "touches",
    }


def inspected(touchup, folder, holes, rows, *more):
    """The characteristics that the program decides on, as --json has them."""
    features, drawing = folder / "features.json", folder / "drawing.json"
    features.write_text(json.dumps({"features": holes}))
    drawing.write_text(json.dumps({"characteristics": rows}))
    ran = touchup("inspect", features, "--nominal", drawing, "--json", *more)
    assert ran.returncode in (0, 4), ran.stderr
    return json.loads(ran.stdout)["characteristics"]


def row(number, quantity, **numbers):
    centre = [10.0 * number, 0.0, 0.0]
    return {"name": f"{quantity} {number}", "kind": "hole", "quantity": quantity, "center_mm": centre, **numbers}


def test_probabilities_and_decisions_on_sizes_are_those_of_scipy(touchup, tmp_path):
    rng = np.random.default_rng(26)
    holes, rows = [], []
    for number in range(60):
        u, half = rng.uniform(0.001, 0.05), rng.uniform(0.01, 0.2)
        holes.append(hole(number, 8 + rng.normal(0, half), u))
        rows.append(row(number, "diameter_mm", nominal_mm=8.0, tolerance_mm=half))
    found = inspected(touchup, tmp_path, holes, rows)
    z = norm.ppf(0.95)
    decisions = []
    for one, measured, drawn in zip(found, holes, rows, strict=True):
        y, u, half = measured["diameter_mm"], measured["std"]["diameter_mm"], drawn["tolerance_mm"]
        p = norm.cdf(8 + half, y, u) - norm.cdf(8 - half, y, u)
        assert one["conformance_probability"] == pytest.approx(p, abs=PROBABILITY)
        fails = abs(y - 8) > half + z * u
        expected = "pass" if p >= 0.95 else "fail" if fails else "undecided"
        assert one["decision"] == expected, one
        decisions.append(expected)
        assert one["rejection_upper_mm"] == pytest.approx(8 + half + z * u, abs=1e-9)
        if "acceptance_upper_mm" in one:
            limit = one["acceptance_upper_mm"]
            assert norm.cdf(8 + half, limit, u) - norm.cdf(8 - half, limit, u) == pytest.approx(0.95, abs=1e-8)
        else:
            assert 2 * norm.cdf(half / u) - 1 < 0.95
    assert {"pass", "fail", "undecided"} == set(decisions)


def test_positions_conform_as_a_noncentral_chi_square_says(touchup, tmp_path):
    rng = np.random.default_rng(7)
    holes, rows = [], []
    for number in range(40):
        u, zone = rng.uniform(0.002, 0.03), rng.uniform(0.02, 0.2)
        holes.append(hole(number, 8.0, u, centre_off=rng.uniform(0, 0.1)))
        rows.append(row(number, "position_mm", tolerance_mm=zone))
    for one, measured, drawn in zip(inspected(touchup, tmp_path, holes, rows), holes, rows, strict=True):
        off = measured["center_mm"][0] - drawn["center_mm"][0]
        u = measured["std"]["center_mm"] / math.sqrt(2)
        assert one["actual_mm"] == pytest.approx(2 * off, abs=1e-9)
        p = ncx2.cdf((drawn["tolerance_mm"] / 2 / u) ** 2, 2, (off / u) ** 2)
        assert one["conformance_probability"] == pytest.approx(p, abs=1e-8)


def test_forms_conform_as_a_normal_distribution_cut_at_zero(touchup, tmp_path):
    holes = [hole(number, 8.0, 0.01, roundness=0.004 * number) for number in range(12)]
    rows = [row(number, "roundness_mm", tolerance_mm=0.03) for number in range(12)]
    for one, measured in zip(inspected(touchup, tmp_path, holes, rows), holes, strict=True):
        y = measured["form"]["roundness_mm"]
        p = truncnorm.cdf(0.03, -y / 0.01, np.inf, loc=y, scale=0.01)
        assert one["conformance_probability"] == pytest.approx(p, abs=PROBABILITY)


class Page(html.parser.HTMLParser):
    """Addresses that a page asks for, and its text."""

    def __init__(self):
        super().__init__()
        self.addresses, self.tags, self.text = [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.addresses += [value for name, value in attrs if name in ("src", "href", "xlink:href", "data", "action")]

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture(scope="module")
def plate(touchup, demo_folder, tmp_path_factory):
    """The plate of the demo, inspected against its drawing, with all files."""
    out = tmp_path_factory.mktemp("inspect")
    files = {name: out / f"r.{name}" for name in ("html", "csv", "qif")}
    flags = ["--out", files["html"], "--csv", files["csv"], "--qif", files["qif"]]
    who = ["--part", "Plate <4711>", "--serial", "SN 1", "--operator", "A & B"]
    ran = touchup("inspect", demo_folder / "features.json", "--nominal", DRAWING, "--json", *flags, *who)
    return ran, json.loads(ran.stdout), files


def test_one_characteristic_of_the_plate_fails_and_one_is_undecided(plate):
    ran, record, _ = plate
    assert ran.returncode == 4

    def named(decision):
        return [one["name"] for one in record["characteristics"] if one["decision"] == decision]

    assert (named("fail"), named("undecided")) == (["blind hole diameter"], ["slot width"])
    assert record["verdict"] == "fail" and record["counts"]["pass"] == len(record["characteristics"]) - 2
    said = "1 of 13 out of tolerance: blind hole diameter; 1 of 13 undecided: slot width"
    assert said in json.loads(ran.stderr)["message"]


def test_table_and_qif_have_the_numbers_of_the_json(plate):
    _, record, files = plate
    with open(files["csv"], newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    root = ElementTree.parse(files["qif"]).getroot()
    by_id = {node.get("id"): node for node in root.iter() if node.get("id")}
    assert int(root.get("idMax")) == max(map(int, by_id))
    measurements = list(root.iter(f"{QIF}CharacteristicMeasurements"))[0]
    assert int(measurements.get("n")) == len(measurements) == len(rows) == len(record["characteristics"])
    status = {"pass": "PASS", "fail": "FAIL", "undecided": "INDETERMINATE"}
    for one, line, node in zip(record["characteristics"], rows, measurements, strict=True):
        for name, value in one.items():
            if isinstance(value, float):
                assert float(line[name]) == value, name
        assert (line["name"], line["decision"], int(line["touches"])) == (one["name"], one["decision"], one["touches"])
        assert node.find(f"{QIF}Status/{QIF}CharacteristicStatusEnum").text == status[one["decision"]]
        value = node.find(f"{QIF}Value")
        assert float(value.text) == one["actual_mm"]
        assert float(value.get("combinedUncertainty")) == one["standard_uncertainty_mm"]
        item = by_id[node.find(f"{QIF}CharacteristicItemId").text]
        assert item.find(f"{QIF}Name").text == one["name"]
        nominal = by_id[item.find(f"{QIF}CharacteristicNominalId").text]
        definition = by_id[nominal.find(f"{QIF}CharacteristicDefinitionId").text]
        upper = definition.find(f"{QIF}Tolerance/{QIF}MaxValue")
        upper = definition.find(f"{QIF}ToleranceValue") if upper is None else upper
        assert float(upper.text) == one["upper_limit_mm"]
    assert root.find(f".//{QIF}ActualComponent/{QIF}SerialNumber").text == "SN 1"


def test_the_actual_values_are_those_of_the_features(plate, demo_folder):
    features = {one["id"]: one for one in json.loads((demo_folder / "features.json").read_text())["features"]}
    checked = 0
    for one in plate[1]["characteristics"]:
        feature = features[one["feature"]]
        if one["quantity"] in feature:
            assert one["actual_mm"] == feature[one["quantity"]]
            assert one["standard_uncertainty_mm"] == feature["std"][one["quantity"]]
            runs = feature["touches"][one["quantity"]]
            assert one["touches"] == sum(last - first + 1 for first, last in runs)
            checked += 1
    assert checked == 7


def test_the_report_is_one_file_and_names_every_characteristic(plate):
    _, record, files = plate
    page = Page()
    page.feed(files["html"].read_text(encoding="utf-8"))
    assert page.addresses and all(address.startswith("data:image/png;base64,") for address in page.addresses)
    assert not {"script", "link", "iframe", "object"} & set(page.tags)
    text = "".join(page.text)
    assert all(one["name"] in text for one in record["characteristics"])
    for said in ("Plate <4711>", "A & B", "SN 1", *(file["crc32"] for file in record["files"])):
        assert said in text, said


@pytest.mark.skipif(shutil.which("chromium") is None, reason="chromium is not installed")
def test_the_report_prints_to_pdf(plate, tmp_path):
    pdf = tmp_path / "report.pdf"
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"]
    flags += ["--disable-component-update", "--disable-sync", "--no-pdf-header-footer"]
    flags += [f"--user-data-dir={tmp_path}/profile"]
    command = ["chromium", *flags, f"--print-to-pdf={pdf}", plate[2]["html"].as_uri()]
    subprocess.run(command, timeout=120, capture_output=True, check=False)
    data = pdf.read_bytes()
    pages = data.count(b"/Type /Page\n") + data.count(b"/Type /Page ") + data.count(b"/Type /Page/")
    assert data.startswith(b"%PDF") and 4 <= pages <= 10, pages


ROUND, LONG = ["hole", "boss", "cylinder", "notch"], ["slot", "pocket"]
# kinds of features by quantity, as in docs/inspect.md, plus the quantities of every kind
KINDS = dict.fromkeys(["diameter_mm", "roundness_mm", "cylindricity_mm", "straightness_mm"], ROUND) | {
    "width_mm": LONG,
    "length_mm": [*LONG, "edge", "cylinder"],
    "depth_mm": [*LONG, "hole", "boss", "cylinder"],
    "cone_angle_deg": ["hole"],
    "flatness_mm": ["plane"],
    "position_mm": [*ROUND, *LONG, "edge"],
}
EVERY = [*ROUND, *LONG, "edge", "corner", "plane"]
OF_EVERY_KIND = ["x_mm", "y_mm", "z_mm"]
TO_DATUM = ["perpendicularity_mm", "parallelism_mm", "coaxiality_mm", "concentricity_mm", "distance_mm", "angle_deg"]
KINDS |= dict.fromkeys([*OF_EVERY_KIND, *TO_DATUM], EVERY)


def every_characteristic(tolerances):
    """A drawing with every quantity of every kind of feature, once for each of the tolerances and once to no feature."""
    for quantity, kinds in KINDS.items():
        unit, is_zone = quantity.rsplit("_", 1)[1], quantity in TO_DATUM[:4] or KINDS[quantity] == ["plane"]
        is_zone = is_zone or quantity in ("roundness_mm", "cylindricity_mm", "straightness_mm", "position_mm")
        for kind in kinds:
            for number, tolerance in enumerate(tolerances[-1:] if is_zone else tolerances):
                # the first one has a measured value, no feature has the numbers of the others
                one = {"name": f"{kind} {quantity} <{number}>", "kind": kind, "quantity": quantity}
                one |= {"feature": EVERY.index(kind) + 10 * number, "center_mm": [0.1 * number, 0, 0]}
                one |= {f"{name}_{unit}": value for name, value in tolerance.items()}
                if not is_zone:
                    one[f"nominal_{unit}"] = 6.1
                if quantity in TO_DATUM:
                    one["datum"] = {"kind": "plane", "feature": 99}
                yield one


@pytest.fixture(scope="session")
def qif_errors(shared):
    """A function of a file: its errors against the schema of QIF 3.0."""
    folder = shared / "data/qif"
    schema = lxml.etree.XMLSchema(lxml.etree.parse(folder / "QIFApplications/QIFDocument.xsd"))
    assert schema.validate(lxml.etree.parse(folder / "nist/nist_ctc_01_asme1_ap242.qif")), schema.error_log

    def errors(path):
        schema.validate(lxml.etree.parse(path))
        return list(schema.error_log)

    return errors


@pytest.mark.parametrize("is_bound", [False, True])
def test_every_characteristic_is_valid_by_the_schema_of_qif(touchup, tmp_path, qif_errors, is_bound):
    sizes = {"diameter_mm": 6.1, "width_mm": 6.1, "length_mm": 6.1, "depth_mm": 6.1, "cone_angle_deg": 6.1}
    forms = {"roundness_mm": 0.01, "cylindricity_mm": 0.02, "straightness_mm": 0.01, "flatness_mm": 0.01}
    std = dict.fromkeys([*sizes, "center_mm"], 0.001)
    features = [
        {"id": id, "kind": kind, "center_mm": [0, 0, 0], "axis": [0, 0, 1], "fitted_to": "touches", "std": std}
        | sizes
        | {"form": {**forms, "coverage": 1.0, "std": dict.fromkeys(forms, 0.001)}}
        | ({"depth_is_at_least": True} if is_bound else {})
        for id, kind in [*enumerate(EVERY), (99, "plane")]
    ]
    relations = [
        {"kind": quantity.rsplit("_", 1)[0], "of": id, "to": 99, quantity: 6.1, "std": {quantity: 0.001}}
        for quantity in TO_DATUM
        for id in range(len(EVERY))
    ]
    tolerances = [
        {"lower_deviation": -0.03},
        {"upper_deviation": 0.07},
        {"lower_deviation": -0.03, "upper_deviation": 0.07},
        {"tolerance": 0.03},
    ]
    drawing = list(every_characteristic(tolerances))
    assert len(drawing) > 250
    (tmp_path / "f.json").write_text(json.dumps({"features": features, "relations": relations}))
    (tmp_path / "d.json").write_text(json.dumps({"characteristics": drawing}))
    out = tmp_path / "r.qif"
    who = ["--part", "Plate <4711>", "--serial", " SN  1 ", "--operator", "A & B"] if is_bound else []
    ran = touchup("inspect", tmp_path / "f.json", "--nominal", tmp_path / "d.json", "--json", "--qif", out, *who)
    found = json.loads(ran.stdout)["characteristics"]
    measured = {(one["kind"], one["quantity"]) for one in found if f"actual_{one['quantity'][-2:]}" in one or "actual_deg" in one}
    assert len(measured) > 60, measured
    assert qif_errors(out) == []
    # the limits of a drawing of 6.1 −0.03 +0.07 have two decimals
    text = out.read_text()
    assert {float(x) for x in re.findall(r"<M..Value>(.*?)<", text)} == {6.07, 6.13, 6.17}
    assert set(re.findall(r"<M..Value>(.*?)<", text)) == {"6.07", "6.13", "6.17"}


def test_nothing_is_decided_on_a_mesh_alone_and_the_missing_touches_are_named(touchup, demo_folder, tmp_path):
    features = tmp_path / "features.json"
    assert touchup("features", demo_folder / "refined.ply", "--out", features).returncode == 0
    ran = touchup("inspect", features, "--nominal", DRAWING, "--json")
    assert ran.returncode == 4
    measured = [one for one in json.loads(ran.stdout)["characteristics"] if "actual_mm" in one]
    assert {one["decision"] for one in measured} == {"undecided"}
    # the table gives the uncertainty of the mesh all the same
    assert sum("standard_uncertainty_mm" in one for one in measured) >= 5
    (bore,) = [one for one in measured if one["name"] == "through-hole diameter"]
    assert "no touches behind it" in bore["reason"] and "12 touches near (" in bore["reason"]


@pytest.mark.parametrize("diameter, decision", [(11.1125, "pass"), (11.018, "undecided"), (10.9, "fail"), (11.2, "fail")])
def test_facets_of_a_cad_mesh_fail_no_part_that_is_as_they_are(touchup, tmp_path, diameter, decision):
    """A bore of 24 sides: its corners lie on the circle, its flats 0.048 mm inside."""
    cad = trimesh.creation.annulus(r_min=11.1125 / 2, r_max=20, height=10, sections=24)
    cad.export(tmp_path / "cad.stl")
    (tmp_path / "features.json").write_text(json.dumps({"features": [hole(0, diameter, 0.002) | {"center_mm": [0, 0, 5]}]}))
    flags = ["--nominal", tmp_path / "cad.stl", "--tolerance-mm", 0.05, "--match-mm", 20, "--json"]
    ran = touchup("inspect", tmp_path / "features.json", *flags)
    record = json.loads(ran.stdout)
    (bore,) = [one for one in record["characteristics"] if one["name"] == "hole 1 diameter"]
    assert bore["nominal_mm"] == pytest.approx(11.1125, abs=0.001)
    assert bore["decision"] == decision, bore
    assert any("facets" in note and "0.095 mm" in note for note in record["notes"]), record["notes"]
