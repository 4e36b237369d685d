"""Both packages as ROS tools see them: found by colcon, dependencies stated, files named as in docs/ros.md."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml
from catkin_pkg.package import parse_package
from conftest import ROOT
from ros_tables import code, published, table

# element names of format 3 in the order in which REP 149 lists them; a tool may rely on name, version, description first
BEGIN = ["name", "version", "description", "maintainer", "license"]


@pytest.fixture(scope="module", params=[".", "msg"])
def package(request):
    """Each of the two packages, read and validated by catkin_pkg."""
    warnings = []
    package = parse_package(str(ROOT / request.param / "package.xml"), warnings=warnings)
    package.validate(warnings=warnings)
    assert warnings == []
    return package


def test_format_and_licence(package):
    folder = Path(package.filename).parent
    assert package.package_format == 3
    assert [person.email for person in package.maintainers]
    assert [str(licence) for licence in package.licenses] == ["Apache-2.0"]
    assert (folder / package.licenses[0].file).read_text() == (ROOT / "LICENSE").read_text()
    begin = re.findall(r"^  <(\w+)", Path(package.filename).read_text(), re.MULTILINE)
    assert begin[: len(BEGIN)] == BEGIN


def test_both_agree_with_cargo():
    manifest = tomllib.loads((ROOT / "Cargo.toml").read_text())
    cargo = manifest["workspace"]["package"] | {"name": manifest["package"]["name"]}
    node, messages = (parse_package(str(ROOT / folder / "package.xml")) for folder in (".", "msg"))
    assert (node.name, node.version, str(node.licenses[0])) == (cargo["name"], cargo["version"], cargo["license"])
    assert node.get_build_type() == "ament_cargo"
    assert messages.version == node.version


def test_messages_depend_on_what_they_use():
    package = parse_package(str(ROOT / "msg/package.xml"))
    text = "\n".join(path.read_text() for path in (ROOT / "msg").glob("*/*") if path.suffix in (".msg", ".srv", ".action"))
    used = set(re.findall(r"^(\w+)/\w+", text, re.MULTILINE))
    cmake = (ROOT / "msg/CMakeLists.txt").read_text()
    assert set(re.search(r"DEPENDENCIES ([\w ]+)", cmake)[1].split()) == used
    assert {name for name in re.findall(r"find_package\((\w+)", cmake)} == used | {"ament_cmake", "rosidl_default_generators"}
    # an action needs action_msgs
    assert {depend.name for depend in package.build_depends} == used | {"action_msgs"}
    assert {depend.name for depend in package.buildtool_depends} == {"ament_cmake", "rosidl_default_generators"}
    assert "rosidl_default_runtime" in {depend.name for depend in package.exec_depends}
    assert [group.name for group in package.member_of_groups] == ["rosidl_interface_packages"]
    assert package.get_build_type() == "ament_cmake"


def test_the_node_depends_on_what_it_speaks_and_starts():
    package = parse_package(str(ROOT / "package.xml"))
    spoken = {match for match in re.findall(r"`(\w+)/(?:msg|srv|action)/\w+`", (ROOT / "docs/ros.md").read_text())}
    started = set(re.findall(r'package="(\w+)"', (ROOT / "launch/cell.launch.py").read_text())) - {"touchup"}
    # a viewer starts on a machine that has one, and no robot needs it
    started.remove("rviz2")
    wanted = spoken | started | {"builtin_interfaces", "rcl_interfaces", "std_msgs", "launch", "launch_ros", "xacro"}
    assert {depend.name for depend in package.exec_depends} == wanted


def test_types_of_our_own_exist():
    ours = set(re.findall(r"`touchup_msgs/(\w+/\w+)`", (ROOT / "docs/ros.md").read_text()))
    files = {str(path.relative_to(ROOT / "msg").with_suffix("")) for path in (ROOT / "msg").glob("*/*")}
    assert ours <= files
    # those that nothing speaks are parts of others
    assert files - ours == {"msg/Feature", "msg/FormDeviation", "msg/ProbeSettings", "msg/Relation"}


@pytest.fixture(scope="module")
def colcon(tmp_path_factory):
    """Runs colcon as in docs/ros.md: in a workspace, with this repository below `src`, and cargo-ament-build installed."""
    programs = Path(sys.executable).parent
    environment = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}"}
    workspace = tmp_path_factory.mktemp("workspace")
    (workspace / "src").mkdir()
    (workspace / "src/touchup").symlink_to(ROOT)

    def run(*arguments):
        command = [str(programs / "colcon"), *arguments]
        return subprocess.run(command, cwd=workspace, env=environment, capture_output=True, text=True, timeout=120)

    return run


def test_colcon_finds_both_packages_and_their_order(colcon):
    found = colcon("list", "--topological-order")
    assert found.returncode == 0, found.stderr
    lines = [line.split() for line in found.stdout.splitlines()]
    assert lines == [["touchup_msgs", "src/touchup/msg", "(ros.ament_cmake)"], ["touchup", "src/touchup", "(ament_cargo)"]]
    graph = colcon("graph")
    assert graph.stdout.splitlines()[0].split() == ["touchup_msgs", "+*"]


def test_what_the_launch_files_need_is_installed(tmp_path):
    """`cargo ament-build`, which colcon calls, with a cargo that makes an empty executable without compilation."""
    source, stand_in = tmp_path / "source", tmp_path / "bin"
    (source / "src").mkdir(parents=True)
    stand_in.mkdir()
    (source / "src/main.rs").write_text("fn main() {}\n")
    for name in ("Cargo.toml", "package.xml"):
        shutil.copy(ROOT / name, source)
    for name in ("launch", "config", "urdf"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    # benches are not installed
    manifest = re.sub(r"\n\[\[bench\]\][^\[]*", "\n", (source / "Cargo.toml").read_text())
    (source / "Cargo.toml").write_text(manifest)
    cargo = stand_in / "cargo"
    cargo.write_text('#!/bin/sh\nmkdir -p "$TARGET/debug"\n: > "$TARGET/debug/touchup"\n')
    cargo.chmod(0o755)
    environment = {**os.environ, "PATH": f"{stand_in}:{os.environ['PATH']}", "TARGET": str(tmp_path / "target")}
    plugin = str(Path(sys.executable).parent / "cargo-ament-build")
    command = [plugin, "ament-build", "--install-base", str(tmp_path / "install"), "--"]
    command += ["--manifest-path", str(source / "Cargo.toml"), "--target-dir", str(tmp_path / "target")]
    done = subprocess.run(command, cwd=source, env=environment, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    share = tmp_path / "install/share/touchup"
    assert (tmp_path / "install/lib/touchup/touchup").is_file()
    for path in ("launch/cell.launch.py", "launch/replay.launch.py", "config/touchup.rviz", "config/default.yaml"):
        assert (share / path).is_file(), path
    assert sorted(path.name for path in (share / "urdf").iterdir()) == sorted(path.name for path in (ROOT / "urdf").iterdir())


def test_parameters_are_those_of_the_table():
    (node, section), *others = yaml.safe_load((ROOT / "config/node.yaml").read_text()).items()
    assert (node, others, set(section)) == ("/**", [], {"ros__parameters"})
    kinds = {"string": str, "double": float, "bool": bool, "int": int}
    rows = {code(row["name"])[0]: row for row in table("name", "type", "default")}
    given = section["ros__parameters"]
    assert list(given) == list(rows)
    for name, value in given.items():
        assert type(value) is kinds[rows[name]["type"]], name
        assert yaml.safe_dump(value).split("\n")[0] == (rows[name]["default"] or "''"), name


def test_clicked_points_flag_what_a_feature_can_be():
    kinds = re.findall(r"^uint8 KIND_(\w+)=", (ROOT / "msg/msg/Feature.msg").read_text(), re.MULTILINE)
    row = next(row for row in table("name", "type", "default") if "flag_kind" in row["name"])
    assert row["range"].split(", ") == [kind.lower() for kind in kinds]


def test_names_are_relative_and_services_private():
    shared = {"/diagnostics"}
    for name in published():
        assert re.fullmatch(r"[a-z][a-z0-9_]*", name) or name in shared, name
    for row in table("name", "type", "what"):
        assert re.fullmatch(r"~/[a-z][a-z0-9_]*", code(row["name"])[0]), row
