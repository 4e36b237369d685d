"""package.xml is what ROS tools expect, and says the same as Cargo.toml."""

import tomllib

from catkin_pkg.package import parse_package
from conftest import ROOT


def test_package_xml_is_valid_and_agrees_with_cargo():
    warnings = []
    package = parse_package(str(ROOT / "package.xml"), warnings=warnings)
    package.validate(warnings=warnings)
    cargo = tomllib.loads((ROOT / "Cargo.toml").read_text())["package"]
    assert (package.name, package.version) == (cargo["name"], cargo["version"])
    assert [str(licence) for licence in package.licenses] == [cargo["license"]]
    assert package.get_build_type() == "ament_cargo"
    assert warnings == []
