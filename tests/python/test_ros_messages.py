"""The package touchup_msgs: read, generated and compiled by tools of others, and documented field by field.

Debian's rosidl translates and generates as a ROS build does; rosbags reads the same files by a parser of its own. Mirrored parts of the
messages (kinds, fields of the file of features) come from the Rust source that defines them.
"""

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy
import pytest
from conftest import ROOT
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

PACKAGE = ROOT / "msg"
FILES = sorted(path.relative_to(PACKAGE) for kind in ("msg", "srv", "action") for path in (PACKAGE / kind).iterdir())
STAND_INS = ROOT / "tests/python/stand_ins"
# includes of other packages in generated code
STANDARD = {
    "builtin_interfaces": ["Time"],
    "std_msgs": ["Header"],
    "geometry_msgs": ["Point", "PointStamped", "Pose", "Quaternion", "Vector3", "Wrench"],
    "unique_identifier_msgs": ["UUID"],
}


def sections(path):
    """The message definitions in a file: one in a .msg, two in a .srv, three in a .action."""
    return re.split(r"^---$", (PACKAGE / path).read_text(), flags=re.MULTILINE)


def fields(definition):
    """Yields type, name and comment of each field; a comment describes all lines below it up to an empty one."""
    comment, is_open = "", False
    for line in definition.splitlines():
        if line.startswith("#"):
            comment = f"{comment} {line[1:].strip()}" if is_open else line[1:].strip()
            is_open = True
            continue
        is_open = False
        if not line.strip():
            comment = ""
        elif "=" not in line:
            kind, name = line.split()
            yield kind, name, comment


@pytest.fixture(scope="module")
def rosidl(tmp_path_factory):
    """Runs Debian's rosidl: rosidl("generate", package, folder with the files, files, *options) -> folder with its output."""
    if not shutil.which("rosidl") or not Path("/usr/share/rosidl_generator_c").is_dir():
        pytest.skip("needs Debian's rosidl: apt-get install rosidl-tools rosidl-generator-c-cpp")

    def run(verb, package, folder, files, *options):
        out = tmp_path_factory.mktemp(f"{verb}_{package}")
        # Debian leaves ament_index_python out, by which the generators find their templates
        environment = {**os.environ, "PYTHONPATH": str(STAND_INS), "AMENT_PREFIX_PATH": "/usr"}
        command = ["rosidl", verb, "-o", str(out), *options, package, *map(str, files)]
        made = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120)
        # it ends with 0 even if it could not load a generator
        assert made.returncode == 0 and "Failed" not in made.stderr, made.stderr
        return out

    return run


def test_cmake_names_every_file():
    listed = re.findall(r'"((?:msg|srv|action)/\w+\.\w+)"', (PACKAGE / "CMakeLists.txt").read_text())
    assert sorted(listed) == [str(path) for path in FILES]


def test_rosidl_translates_every_file(rosidl):
    out = rosidl("translate", "touchup_msgs", PACKAGE, FILES, "--to", "idl")
    assert sorted(path.relative_to(out) for path in out.rglob("*.idl")) == [path.with_suffix(".idl") for path in FILES]


def test_a_wrong_field_name_is_refused(rosidl, tmp_path):
    (tmp_path / "msg").mkdir()
    (tmp_path / "msg/Wrong.msg").write_text("float64 MixedCase\n")
    with pytest.raises(AssertionError, match="MixedCase"):
        rosidl("translate", "touchup_msgs", tmp_path, ["msg/Wrong.msg"], "--to", "idl")


def test_generated_c_and_introspection_compile(rosidl, tmp_path):
    """The input of r2r; a field with a keyword of C as its name would end here."""
    include = tmp_path / "include"
    kinds = ("--type", "c", "--type-support", "introspection_c")

    def generate(package, folder, files):
        out = rosidl("generate", package, folder, files, *kinds)
        for made in ("c", "introspection_c"):
            shutil.copytree(out / made, include / package, dirs_exist_ok=True, ignore=shutil.ignore_patterns("tmp"))
        # made by CMake in a ROS build
        for name in ("generator_c", "typesupport_introspection_c"):
            header = include / package / f"msg/rosidl_{name}__visibility_control.h"
            macros = [f"ROSIDL_{name.upper()}_{kind}_{package}" for kind in ("PUBLIC", "EXPORT", "IMPORT")]
            header.write_text("".join(f"#define {macro}\n" for macro in macros))

    for package, names in STANDARD.items():
        folder = tmp_path / package
        (folder / "msg").mkdir(parents=True)
        for name in names:
            text, _ = get_typestore(Stores.ROS2_HUMBLE).generate_msgdef(f"{package}/msg/{name}", ros_version=2)
            (folder / f"msg/{name}.msg").write_text(text.split("=" * 80)[0])
        generate(package, folder, [f"msg/{name}.msg" for name in names])
    generate("touchup_msgs", PACKAGE, FILES)

    sources = sorted((include / "touchup_msgs").rglob("*.c"))
    # functions and type support of each file
    assert len(sources) == 2 * len(FILES)
    runtime = [f"-I{path}" for path in Path("/usr/include").glob("rosidl_*")] + ["-I/usr/include/rcutils"]
    command = ["cc", "-fsyntax-only", "-Wall", "-Werror", f"-I{include}", *runtime, *map(str, sources)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr[:2000]
    action = (include / "touchup_msgs/action/detail/probe__struct.h").read_text()
    for part in ("Goal", "Result", "Feedback", "SendGoal_Request", "GetResult_Response", "FeedbackMessage"):
        assert f"touchup_msgs__action__Probe_{part};" in action


@pytest.mark.parametrize("path", FILES, ids=str)
def test_every_field_says_what_it_is_and_in_which_unit(path):
    unit = re.compile(r"\b(m|rad|N|s|N m|m/s|m\^2|N\^2|unit vector|0 to 1|probability)\b", re.IGNORECASE)
    for definition in sections(path):
        for kind, name, comment in fields(definition):
            assert comment, f"{name}: no comment"
            if re.match(r"float|geometry_msgs", kind):
                assert unit.search(comment), f"{name}: no unit in “{comment}”"
            assert kind != "std_msgs/Header" or "stamp: " in comment and "frame: " in comment, name


def test_no_part_is_empty():
    """An empty one has a byte on the wire that its definition does not show, and implementations disagree about it."""
    for path in FILES:
        assert all(list(fields(definition)) for definition in sections(path)), path


def test_lengths_angles_and_forces_are_si():
    names = [name for path in FILES for definition in sections(path) for _, name, _ in fields(definition)]
    assert not [name for name in names if re.search(r"_(mm|deg|um|ms|us|percent)$", name)]


FEATURES = ROOT / "crates/touchup-features/src/features"


def quantities(file, part):
    """Names of the quantities in a part of a source, without units."""
    named = dict(re.findall(r"^ *(\w+) = \"(\w+)_(?:mm|deg)\",$", (FEATURES / "quantity.rs").read_text(), re.MULTILINE))
    found = re.search(part, (FEATURES / file).read_text(), re.DOTALL)[0]
    return {named[name] for name in re.findall(r"(?:InspectedQuantity|Self)::(\w+)", found) if name in named}


def test_a_feature_mirrors_the_file_of_features():
    source = (ROOT / "crates/touchup-io/src/features_file.rs").read_text()
    record = re.search(r"pub struct FeatureRecord, .*?\{(.*?)\n    \}", source, re.DOTALL)[1]
    in_file = {re.sub(r"_(mm|deg)$", "", name) for name in re.findall(r"^        pub (\w+)\??:", record, re.MULTILINE)}
    mine = {name for _, name, _ in fields(sections("msg/Feature.msg")[0])}
    # one std and one list of touches by name there, a field for each number and their count here
    known = re.search(r"fn known\(.*?\n\}", source, re.DOTALL)[0]
    stds = set(re.findall(r"\"(\w+?)_(?:mm|deg)\"", known)) | quantities("quantity.rs", r"const SIZES.*?\];")
    assert {name.removesuffix("_std") for name in mine if name.endswith("_std")} == stds
    # only a live session has flags
    only_live = {"status", "search_radius", "touch_count"}
    # only a drawing has facets whose corners lie on the surface
    only_drawn = {"facets"}
    assert {name for name in mine if not name.endswith("_std")} - only_live == in_file - only_drawn - {"std", "touches"}


@pytest.mark.parametrize(
    ("message", "selector", "record", "numbers"),
    [("FormDeviation", "characteristic", "FormRecord", "deviations"), ("Relation", "kind", "RelationRecord", "numbers")],
)
def test_form_and_relations_mirror_the_file_of_features(message, selector, record, numbers):
    """Each length and angle that the file names is a value of the selector, or a field of its own."""
    source = (ROOT / "crates/touchup-io/src/features_file.rs").read_text()
    body = re.search(rf"pub struct {record}, .*?\{{(.*?)\n    \}}", source, re.DOTALL)[1]
    in_file = {re.sub(r"_(mm|deg)$", "", name) for name in re.findall(r"^        pub (\w+)\??:", body, re.MULTILINE)}
    in_file |= quantities("numbers.rs", rf"pub fn {numbers}\(.*?\n    \}}")
    definition = sections(f"msg/{message}.msg")[0]
    names = {name.removesuffix("_feature") for _, name, _ in fields(definition)} - {selector}
    constants = {name.lower() for name in re.findall(r"^uint8 (\w+)=\d+$", definition, re.MULTILINE)}
    # one zone for the kind there, a field named after the kind in the file
    in_message = (names | constants) - {"zone", "zone_std"}
    assert {name for name in in_message if not name.endswith("_std")} == in_file - {"std", "numbers", selector}


def test_kinds_are_those_of_the_program():
    source = (ROOT / "crates/touchup-features/src/features/feature.rs").read_text()
    kinds = re.findall(r"^ *\w+ = \"(\w+)\",$", re.search(r"pub enum FeatureKind \{(.*?)\n *\}", source, re.DOTALL)[1], re.MULTILINE)
    constants = re.findall(r"^uint8 KIND_(\w+)=(\d+)$", sections("msg/Feature.msg")[0], re.MULTILINE)
    assert constants == [("UNKNOWN", "0")] + [(kind.upper(), str(i + 1)) for i, kind in enumerate(kinds)]


@pytest.fixture(scope="module")
def types():
    """The messages as rosbags reads them."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    known = {}
    for path in FILES:
        parts = {".msg": [""], ".srv": ["_Request", "_Response"], ".action": ["_Goal", "_Result", "_Feedback"]}[path.suffix]
        for part, definition in zip(parts, sections(path), strict=True):
            # rosbags refuses services in a folder of their own
            name = f"touchup_msgs/msg/{path.stem}{part}"
            known.update(get_types_from_msg(definition, name))
    store.register(known)
    return store


def test_a_full_mesh_costs_what_its_numbers_cost(types):
    """1000 vertices, 2000 faces: 21 bytes a vertex, 16 a face, no padding but to the next array."""
    message = types.types["touchup_msgs/msg/MeshPatch"]
    header = types.types["std_msgs/msg/Header"](types.types["builtin_interfaces/msg/Time"](1, 2), "object")
    numbers = lambda count, kind: numpy.arange(count, dtype=kind)  # noqa: E731
    patch = message(
        header=header,
        session="2026-01-31T12-00-00",
        version=7,
        base_version=0,
        part=0,
        part_count=1,
        removed_faces=numbers(0, numpy.uint32),
        vertices=numbers(1000, numpy.uint32),
        positions=numbers(3000, numpy.float32),
        variance=numbers(1000, numpy.float32),
        support=numbers(1000, numpy.uint8),
        faces=numbers(2000, numpy.uint32),
        corners=numbers(6000, numpy.uint32),
        removed_vertices=numbers(0, numpy.uint32),
        vertex_count=1000,
        face_count=2000,
    )
    sent = types.serialize_cdr(patch, "touchup_msgs/msg/MeshPatch")
    assert 1000 * 21 + 2000 * 16 <= len(sent) <= 1000 * 21 + 2000 * 16 + 150
    back = types.deserialize_cdr(bytes(sent), "touchup_msgs/msg/MeshPatch")
    assert (back.base_version, back.version) == (0, 7)
    assert numpy.array_equal(back.corners, patch.corners)


def test_codes_of_a_probing_are_distinct(types):
    codes = re.findall(r"^uint8 ([A-Z_]+)=(\d+)$", sections("msg/ProbeResult.msg")[0], re.MULTILINE)
    values = [int(value) for _, value in codes]
    assert 0 not in values and len(set(values)) == len(values) >= 25
