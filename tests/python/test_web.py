"""Permissions of users of the operator page, and the equality of its data with the node's mesh; without a browser."""

import contextlib
import http.client
import json
import re
import socket
import ssl
import subprocess
import time
from urllib.parse import urlsplit

import igl
import numpy
import pytest
import trimesh
import zxingcpp
from conftest import ROOT
from part_of_recording import first_seconds
from ros_domains import domains
from ros_player import in_step
from ros_process import Process
from scipy.spatial import cKDTree
from test_ros_node import CYCLONE
from web_page import DEVIATION, OUTLIER, PROTOCOL, PageNode, Socket, page_url
from websockets.exceptions import ConnectionClosed, InvalidStatus


def ask(url, path, method="GET", context=None, **headers):
    """A request with exactly these headers besides Host; its status, headers and text."""
    place = urlsplit(url)
    if place.scheme == "https":
        connection = http.client.HTTPSConnection(place.hostname, place.port, timeout=30, context=context)
    else:
        connection = http.client.HTTPConnection(place.hostname, place.port, timeout=30)
    headers = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.putrequest(method, path, skip_host="Host" in headers, skip_accept_encoding=True)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    text = answer.read()
    connection.close()
    return answer.status, dict(answer.getheaders()), text


@pytest.fixture(scope="module")
def node(touchup_bin, demo_folder, tmp_path_factory):
    """A node whose page everybody on this machine may use."""
    with PageNode(touchup_bin, tmp_path_factory.mktemp("open"), demo_folder / "scan.ply") as node:
        yield node


@pytest.fixture(scope="module")
def closed(touchup_bin, demo_folder, tmp_path_factory):
    """A node whose page lets in by link."""
    with PageNode(touchup_bin, tmp_path_factory.mktemp("closed"), demo_folder / "scan.ply", "--web-links") as node:
        yield node


def links(node, role):
    """The links that a node has printed for a role, the newest last."""
    return [found[1] for line in node.err if (found := re.search(rf"may {role} by \S+(/pair\?token=\w+)", line))]


def newest_link(node, role):
    """The newest link for a role, once there is one: a node prints them after the address of its page."""
    node.wait_for(lambda: links(node, role))
    return links(node, role)[-1]


def let_in(node, role):
    """The cookie that the newest link for a role gives."""
    link = newest_link(node, role)
    count = len(links(node, role))
    status, headers, _ = ask(node.url, link)
    assert (status, headers["location"]) == (303, "/")
    # the next user has another link
    node.wait_for(lambda: len(links(node, role)) > count)
    cookie = headers["set-cookie"]
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie
    return cookie.split(";")[0]


@pytest.mark.parametrize("path", ["/", "/api/state", "/api/sessions", "/ws", "/pair?token=0"])
def test_a_name_that_is_not_the_pages_own_is_refused_on_every_path(node, path):
    port = urlsplit(node.url).port
    for host in ["evil.example", f"evil.example:{port}", f"127.0.0.1.evil.example:{port}", "127.0.0.1:1", ""]:
        status, _, text = ask(node.url, path, Host=host)
        assert status in (400, 403), (host, text)


def test_the_page_says_that_nothing_comes_from_elsewhere_and_nobody_frames_it(node):
    for path in ["/", "/api/state", "/nothing"]:
        _, headers, _ = ask(node.url, path)
        policy = headers["content-security-policy"]
        assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy and "unsafe" not in policy
        assert headers["x-content-type-options"] == "nosniff" and headers["referrer-policy"] == "no-referrer"
    status, headers, text = ask(node.url, "/")
    assert (status, headers["content-type"]) == (200, "text/html; charset=utf-8")
    # the files that it loads are here too
    for asset in re.findall(rb'(?:src|href)="([^"]+)"', text):
        assert asset.startswith(b"/"), asset
        assert ask(node.url, asset.decode())[0] == 200, asset


def test_a_request_of_another_page_is_refused(node):
    for origin in ["http://evil.example", "null", node.url.replace("http:", "https:"), node.url + "0", ""]:
        assert ask(node.url, "/api/state", Origin=origin)[0] == 403, origin
        with pytest.raises(InvalidStatus) as refused, Socket(node.url, origin=origin or "null"):
            pass
        assert refused.value.response.status_code == 403
    assert ask(node.url, "/api/state", Origin=node.url)[0] == 200
    # a client that opens the socket without an origin, and one that changes something, is no browser's page of ours
    upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec_WebSocket_Version": "13"}
    assert ask(node.url, "/ws", Sec_WebSocket_Key="x" * 22 + "==", **upgrade)[0] == 403
    assert ask(node.url, "/api/state", method="POST")[0] == 403


def test_without_a_link_nothing_is_shown_and_the_page_itself_is_no_secret(closed):
    assert ask(closed.url, "/")[0] == 200
    for path in ["/api/state", "/api/sessions", f"/api/sessions/{closed.session.name}/session.json"]:
        for cookie in [None, "touchup=1", f"touchup_{urlsplit(closed.url).port}={'0' * 32}"]:
            headers = {"Cookie": cookie} if cookie else {}
            status, _, text = ask(closed.url, path, **headers)
            assert status == 401 and "new link" in json.loads(text)["error"]
    with pytest.raises(InvalidStatus) as refused, Socket(closed.url):
        pass
    assert refused.value.response.status_code == 401
    for token in ["", "0" * 32, "../../etc/passwd"]:
        assert ask(closed.url, f"/pair?token={token}")[0] == 403


def test_a_link_is_good_once_and_gives_its_role(closed):
    used = newest_link(closed, "look")
    looks, operates = let_in(closed, "look"), let_in(closed, "operate")
    assert ask(closed.url, used)[0] == 403
    with Socket(closed.url, cookie=looks) as one, Socket(closed.url, cookie=operates) as other:
        for page, role in [(one, "look"), (other, "operate")]:
            page.take_until(lambda page=page: page.newest.get("state", {}).get("clients") == 2 and page.faces)
            assert page.newest["state"]["role"] == role
        assert one.faces == other.faces
        for name in ["~/undo", "~/reset", "~/pause", "~/stop", "~/save_mesh", "~/annotate_feature", "~/invite", "~/probe_all"]:
            assert "may look and not operate" in one.call(name)["error"], name
        assert "response" in one.call("~/arm_state")
        assert other.call("~/pause", data=True)["response"]["success"]
        one.take_until(lambda: one.newest["state"]["is_paused"])
        assert other.call("~/pause", data=False)["response"]["success"]
        link = other.call("~/invite", role="look")["response"]["link"]
        assert ask(closed.url, urlsplit(link).path + "?" + urlsplit(link).query)[0] == 303


def test_files_of_sessions_and_no_others_can_be_downloaded(node):
    status, _, text = ask(node.url, "/api/sessions")
    (listed,) = json.loads(text)
    assert status == 200 and listed["is_current"] and listed["name"] == node.session.name
    assert "session.json" in listed["files"]
    status, headers, text = ask(node.url, f"/api/sessions/{node.session.name}/session.json")
    assert (status, text) == (200, (node.session / "session.json").read_bytes())
    assert headers["content-disposition"] == 'attachment; filename="session.json"'
    (node.session / "link.json").symlink_to("/etc/hostname")
    (node.session.parent / "linked").symlink_to("/etc")
    name = node.session.name
    for place in [
        f"{name}/link.json", "linked/hostname", f"{name}/recording", f"{name}/missing", f"{name}/.", f"{name}/..%2Fx",
        "..%2F..%2Fetc/passwd", "%2Fetc/passwd", f"{name}/%2Fetc%2Fpasswd", ".hidden/x", f"{name}/a%00b", f"{name}/a%0Ab",
    ]:
        status, _, text = ask(node.url, f"/api/sessions/{place}")
        assert status in (400, 404), (place, text)
    assert ask(node.url, f"/api/sessions/../../etc/passwd")[0] == 404


def test_a_page_that_sends_too_much_is_cut_off_and_others_are_not(node):
    with Socket(node.url) as other:
        with Socket(node.url) as large:
            large.socket.send("x" * 100_000)
            with pytest.raises(ConnectionClosed):
                large.take_until(lambda: False)
        with Socket(node.url) as many:
            with pytest.raises(ConnectionClosed):
                for _ in range(1000):
                    many.beat()
                many.take_until(lambda: False)
        for nonsense in ["", "{}", "[]", "null", '{"call": 1}', '{"id": "x", "call": "~/undo", "request": {"strokes": "all"}}', "\0"]:
            other.socket.send(nonsense)
        assert other.call("~/undo", strokes=1)["response"]["message"] == "there is no stroke to be taken back"
        assert "there is no field" in other.call("~/undo", stroke=1)["error"]
        assert "no service" in other.call("~/nothing")["error"]


def test_pages_beyond_sixteen_are_turned_away(node):
    pages = [Socket(node.url) for _ in range(16)]
    with pytest.raises(InvalidStatus) as refused, Socket(node.url):
        pass
    assert refused.value.response.status_code == 503
    for page in pages:
        page.__exit__()
    until = time.monotonic() + 30
    while True:
        try:
            with Socket(node.url) as page:
                page.take_until(lambda: page.faces)
            return
        except InvalidStatus:
            assert time.monotonic() < until, "their places are free again"
            time.sleep(0.1)


def test_a_certificate_of_the_user_encrypts_the_page(touchup_bin, demo_folder, tmp_path):
    chain, key = tmp_path / "chain.pem", tmp_path / "key.pem"
    subject = ["-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1"]
    made = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-keyout", key, "-out", chain, *subject]
    subprocess.run(made, check=True, capture_output=True)
    files = ["--web-links", "--web-certificate", chain, "--web-key", key]
    with PageNode(touchup_bin, tmp_path, demo_folder / "scan.ply", *files) as node:
        assert node.url.startswith("https://")
        trusted = ssl.create_default_context(cafile=chain)
        status, headers, _ = ask(node.url, newest_link(node, "look"), context=trusted)
        assert status == 303 and "; Secure" in headers["set-cookie"]
        cookie = headers["set-cookie"].split(";")[0]
        with Socket(node.url, cookie=cookie, ssl=trusted) as page:
            page.take_until(lambda: page.faces)
        with pytest.raises(ssl.SSLError):
            ask(node.url, "/", context=ssl.create_default_context())
        place = urlsplit(node.url)
        # no ticket for a client that reads and writes in two threads to lose its request to
        with socket.create_connection((place.hostname, place.port)) as plain:
            secure = trusted.wrap_socket(plain, server_hostname=place.hostname)
            secure.sendall(b"GET / HTTP/1.0\r\n\r\n")
            while secure.recv(1 << 12):
                pass
            assert secure.version() == "TLSv1.3" and not secure.session.has_ticket
        # a silent one delays no other
        with socket.create_connection((place.hostname, place.port)):
            assert ask(node.url, "/", context=trusted)[0] == 200


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--web", "nowhere"], 2, "address and a port"),
        (["--web-name", "cell.local"], 2, "--web"),
        (["--web", "127.0.0.1:0", "--web-certificate", "missing.pem", "--web-key", "missing.pem"], 3, "missing.pem"),
        (["--web", "192.0.2.1:8321"], 1, "192.0.2.1:8321"),
    ],
)
def test_what_is_wrong_with_the_flags_is_said(touchup, demo_folder, tmp_path, arguments, code, words):
    ros = ["-p", f"scan:={demo_folder / 'scan.ply'}", "-p", f"session_folder:={tmp_path / 'sessions'}"]
    done = touchup("node", "--tip-radius-mm", 1.5, *arguments, "--ros-args", *ros)
    assert done.returncode == code and words in done.stderr, done.stderr


def test_pages_have_the_nodes_mesh_however_late_they_join_and_one_that_takes_nothing_holds_nobody_up(
    touchup_bin, demo_folder, tmp_path
):
    nominal = ["--web-nominal", demo_folder / "truth.ply"]
    with PageNode(touchup_bin, tmp_path, demo_folder / "scan.ply", *nominal, ros=CYCLONE) as node, Socket(node.url) as early:
        early.take_until(lambda: early.faces)
        # it asks for the socket and reads nothing more
        place = urlsplit(node.url)
        slow = socket.create_connection((place.hostname, place.port))
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        lines = [
            "GET /ws HTTP/1.1", f"Host: {place.netloc}", f"Origin: {node.url}", "Connection: Upgrade", "Upgrade: websocket",
            "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==", f"Sec-WebSocket-Protocol: {PROTOCOL}",
        ]
        slow.sendall("\r\n".join([*lines, "", ""]).encode())
        before = early.version
        # the node leaves behind a page that reads nothing for long
        for _ in in_step(node, first_seconds(demo_folder / "touch.mcap", 12, tmp_path / "begun.mcap"), node.domain):
            with contextlib.suppress(TimeoutError):
                while True:
                    early.take(0)
        # at rest, some time after the last sample, it equals the saved mesh
        early.take_until(lambda: early.call("~/save_mesh", overwrite=True, name="saved.ply")["response"]["mesh_version"])
        saved = early.call("~/save_mesh", overwrite=True, name="saved.ply")["response"]
        early.take_until(lambda: early.version >= saved["mesh_version"])
        assert early.version > before
        with Socket(node.url) as late:
            late.take_until(lambda: late.version >= saved["mesh_version"])
            assert (late.faces, late.vertices) == (early.faces, early.vertices)
        # features are recognised after the mesh rests
        early.take_until(lambda: early.newest["features"]["features"])
        assert early.newest["tip"]["markers"]
        mesh = trimesh.load(node.session / "saved.ply", process=False)
        assert len(early.faces) == len(mesh.faces) == saved["face_count"]
        corners = numpy.array([[early.vertices[vertex] for vertex in face] for face in early.faces.values()])
        # the same triangles in any numbering: each has its own middle, and that is one of the others
        ours, theirs = (numpy.asarray(triangles).mean(axis=1) for triangles in (corners * 1e3, mesh.triangles))
        distances, nearest = cKDTree(theirs).query(ours)
        assert distances.max() < 1e-3 and len(set(nearest)) == len(theirs)
        # the uncertainty of each vertex equals the saved one beside it
        touched = [vertex for vertex in early.vertices if early.support[vertex] == 1]
        early.take_until(lambda: OUTLIER in early.numbers_of and all(early.variance[vertex] >= 0 for vertex in touched))
        columns = mesh.metadata["_ply_raw"]["vertex"]["data"]
        sigma_of = {tuple(place): sigma for place, sigma in zip(columns_of(columns, "xyz"), columns["sigma_mm"].ravel(), strict=True)}
        tree = cKDTree(list(sigma_of))
        far, at = tree.query([numpy.array(early.vertices[vertex]) * 1e3 for vertex in touched])
        sigmas = numpy.sqrt([early.variance[vertex] for vertex in touched]) * 1e3
        ratio = sigmas / numpy.array(list(sigma_of.values()))[at]
        assert far.max() < 1e-3 and len(touched) > 1000 and numpy.abs(ratio - 1).max() < 1e-3
        # deviations equal libigl's from the true part
        truth = trimesh.load(demo_folder / "truth.ply", process=False)
        measured = {vertex: far for vertex, far in early.numbers_of[DEVIATION].items() if vertex in early.vertices}
        assert measured.keys() == early.vertices.keys()
        places = numpy.array([early.vertices[vertex] for vertex in measured]) * 1e3
        squared, _, _ = igl.point_mesh_squared_distance(places, truth.vertices, truth.faces.astype(numpy.int64))
        assert numpy.abs(numpy.abs(list(measured.values())) * 1e3 - numpy.sqrt(squared)).max() < 1e-3
        slow.close()
        assert node.end() in (0, 4), node.text()


def columns_of(columns, names):
    return numpy.stack([columns[name].ravel() for name in names], axis=1).astype(float)


def test_a_recording_on_the_page_ends_with_the_result_of_what_was_touched_until_then(touchup_bin, demo_folder, tmp_path):
    files = ["--scan", demo_folder / "scan.ply", "--bag", demo_folder / "touch.mcap", "--out", tmp_path / "refined.ply"]
    told = ["--tip-radius-mm", 1.5, "--stiffness-n-per-mm", 20, "--json"]
    with Process(touchup_bin, "refine", "--live", "--web", "127.0.0.1:0", *files, *told, domain=next(domains)) as refining:
        with Socket(page_url(refining)) as page:
            # no touch before an onlooker has connected
            page.take_until(lambda: page.newest.get("tip", {}).get("markers") and page.version > 1000)
            assert page.call("~/undo", strokes=1)["response"]["strokes"] == 1
            page.take_until(lambda: page.call("~/pause", data=True)["response"]["success"])
            assert refining.end() == 0, refining.text()
    summary = json.loads(refining.out[-1])
    assert summary["told"]["stiffness_n_per_mm"] == {"value": 20.0, "source": "scene"}
    assert summary["accepted"] > 100 and summary["patch"]["added_faces"] > 0
    # of the session before, without the undone stroke
    (session,) = (tmp_path / "sessions").iterdir()
    assert [json.loads(line)["change"] for line in (session / "strokes.jsonl").read_text().splitlines()] == ["undo"]
    assert (tmp_path / "refined.ply").is_file()
    assert not list(tmp_path.glob("*.yaml")) and not list(ROOT.glob("*.yaml"))


def code_in(lines):
    """The text of the QR code that half blocks show, dark on light as a terminal has them."""
    shades = {" ": (1, 1), "▀": (0, 1), "▄": (1, 0), "█": (0, 0)}
    width = max(map(len, lines))
    rows = [[shades[c][half] for c in line.ljust(width)] for line in lines for half in (0, 1)]
    picture = numpy.kron(numpy.array(rows, dtype=numpy.uint8) * 255, numpy.ones((6, 6), dtype=numpy.uint8))
    (read,) = zxingcpp.read_barcodes(picture, try_invert=False)
    return read.text


@pytest.mark.parametrize(("everywhere", "families"), [("0.0.0.0:0", "."), ("[::]:0", ".:")])
def test_at_all_addresses_each_of_the_machine_has_its_link_and_a_telephone_reads_one(touchup_bin, demo_folder, tmp_path, everywhere, families):
    listed = subprocess.run(["hostname", "-I"], check=True, capture_output=True, text=True).stdout.split()
    own = {f"[{ip}]" if ":" in ip else ip for ip in listed if any(sign in ip for sign in families)}
    with PageNode(touchup_bin, tmp_path, demo_folder / "scan.ply", address=everywhere) as node:
        node.wait_for(lambda: any("not encrypted" in line for line in node.err))
        port = urlsplit(node.url).port
        pages = [found[1] for line in node.err if (found := re.search(r"page: (\S+)", line))]
        assert sorted(pages) == sorted(f"http://{ip}:{port}" for ip in own or {"localhost"})
        (at,) = [i for i, line in enumerate(node.err) if "may operate by" in line]
        linked = re.findall(r"http://\S+", node.err[at])
        assert [link.split("/pair?")[0] for link in linked] == pages
        length = next(i for i, line in enumerate(node.err[at + 1 :]) if line.startswith("touchup:"))
        assert code_in(node.err[at + 1 : at + 1 + length]) == linked[0]
        for page in pages:
            assert ask(page, "/", Origin=page)[0] == 200, page
            assert ask(page, "/api/state", Origin=page)[0] == 401, page
            link = newest_link(node, "operate")
            before = len(links(node, "operate"))
            cookie = let_in_by(page, link)
            node.wait_for(lambda before=before: len(links(node, "operate")) > before)
            assert ask(page, "/api/state", Cookie=cookie)[0] == 200
        for host in ["evil.example", "192.0.2.77", "[2001:db8::77]", "0.0.0.1"]:
            assert ask(node.url, "/", Host=f"{host}:{port}")[0] == 403, host


def let_in_by(page, link):
    """The cookie that a link gives at an address of the page."""
    status, headers, _ = ask(page, link)
    assert status == 303
    return headers["set-cookie"].split(";")[0]
