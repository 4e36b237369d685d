"""The port on DDS against Fast DDS at its default buffers: what ROS 2 nodes with rmw_fastrtps put on the wire.

tests/fastdds/peer.cpp is built by this test with Debian's Fast DDS, or with the one below FASTDDS_ROOT.
"""

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from conftest import ROOT
from ros_echo import Echo, domains

TIMEOUT_S = 120


@pytest.fixture(scope="module")
def peer(tmp_path_factory):
    """Runs the peer: peer("undo", domain, 10, 1) -> what it printed."""
    root = Path(os.environ.get("FASTDDS_ROOT", "/"))
    if not (root / "usr/include/fastdds").is_dir() or not shutil.which("g++"):
        pytest.skip("needs Fast DDS and a C++ compiler: apt-get install libfastrtps-dev g++")
    binary = tmp_path_factory.mktemp("fastdds") / "peer"
    multiarch = next((root / "usr/lib").glob("*/libfastrtps.so")).parent
    includes = [f"-I{root}/usr/include", f"-I{root}/usr/include/{multiarch.name}"]
    link = [f"-L{multiarch}", "-lfastrtps", "-lfastcdr", f"-Wl,-rpath-link,{multiarch}"]
    command = ["g++", "-std=c++17", "-O1", *includes, ROOT / "tests/fastdds/peer.cpp", "-o", binary, *link]
    subprocess.run(command, check=True, timeout=TIMEOUT_S)
    environment = {**os.environ, "LD_LIBRARY_PATH": str(multiarch)}

    def run(*arguments, wrapper=()):
        command = [*wrapper, binary, *map(str, arguments)]
        ran = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=TIMEOUT_S)
        assert ran.returncode == 0, ran.stdout + ran.stderr
        return ran.stdout

    return run


@pytest.fixture
def domain():
    return next(domains)


def test_who_comes_late_gets_every_tile_at_default_buffers(peer, domain):
    with Echo(domain, "400"):
        assert "ok 400 tiles" in peer("tiles", domain, 400)


def test_a_service_answers_in_the_mapping_of_fast_dds(peer, domain):
    with Echo(domain):
        assert "ok 100 calls" in peer("undo", domain, 100, 1)


def test_an_answer_in_fragments_is_whole(peer, domain):
    """Up to 48 kB: what is kept below that is in src/ros/node/arm/answer.rs."""
    with Echo(domain):
        assert "ok 12 calls" in peer("undo", domain, 12, 1000)


def test_no_wrench_of_a_kilohertz_is_lost(peer, domain):
    with Echo(domain) as echo:
        assert "ok 3000 echoes" in peer("echo", domain, 3000)
    assert echo.has("dropped [0, 0] lost [0, 0] unsent [0, 0]")


def test_the_wrong_mapping_is_told(peer, domain):
    with Echo(domain, "--ros-args", "-p", "service_mapping:=cyclone") as echo:
        with pytest.raises((AssertionError, subprocess.TimeoutExpired)):
            peer("undo", domain, 1, 1)
        echo.wait_for(lambda: echo.has("WARN", "/touchup/undo", "-p service_mapping:=enhanced"))


def test_loopback_is_network_enough(peer, domain):
    """In a network namespace of its own, where there is nothing but lo."""
    inside = ["unshare", "--user", "--map-root-user", "--net"]
    if subprocess.run([*inside, "true"], capture_output=True).returncode:
        pytest.skip("needs network namespaces: sysctl kernel.unprivileged_userns_clone=1, or root")
    with Echo(domain, wrapper=[*inside, "sh", "-c", 'ip link set lo up && exec "$0" "$@"']) as echo:
        joined = ["nsenter", "--target", str(echo.process.pid), "--user", "--preserve-credentials", "--net"]
        assert "ok 10 calls" in peer("undo", domain, 10, 1, wrapper=joined)
