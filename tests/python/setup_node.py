"""A node in its setup on the page, over HTTP."""

import http.client
import json
import time
from urllib.parse import urlsplit

from ros_domains import domains
from ros_process import Process
from running import DEADLINE_S
from test_page import AXE
from web_page import page_url


class SetupNode(Process):
    """`touchup node --web` without a named scan, with a folder of scans."""

    def __init__(self, program, folder, *arguments, ros=()):
        self.scans, self.sessions = folder / "scans", folder / "sessions"
        self.scans.mkdir(exist_ok=True)
        web = ["--web", "127.0.0.1:0", "--web-scans", self.scans, *arguments]
        ros = ["--ros-args", "-p", f"session_folder:={self.sessions}", *ros]
        super().__init__(program, "node", "--json", *web, *ros, domain=next(domains))
        self.url = page_url(self)
        self.wait_for(lambda: any("no scan is named" in line for line in self.err))

    def ask(self, path, body=None, *, origin=True, cookie=None, **headers):
        """GET, or POST of bytes or of an object as JSON; the status and the answer."""
        place = urlsplit(self.url)
        headers = {"Cookie": cookie} if cookie else {}
        if origin:
            headers["Origin"] = self.url if origin is True else origin
        if body is not None and not isinstance(body, bytes):
            body = json.dumps(body)
        connection = http.client.HTTPConnection(place.hostname, place.port, timeout=60)
        connection.request("GET" if body is None else "POST", path, body, headers)
        answer = connection.getresponse()
        text = answer.read()
        connection.close()
        return answer.status, json.loads(text)

    def state(self, **options):
        status, found = self.ask("/api/setup", **options)
        assert status == 200, found
        return found

    def read(self, **options):
        """The setup after the reading of the scan."""
        until = time.monotonic() + DEADLINE_S
        while (found := self.state(**options))["scan"]["state"] == "reading":
            assert time.monotonic() < until
            time.sleep(0.05)
        return found

    def choose(self, name):
        status, found = self.ask("/api/setup/scan", {"file": name})
        assert status == 200, found
        return self.read()

    def calibrated(self, **request):
        """Result of a calibration."""
        status, found = self.ask("/api/setup/calibrate", request)
        assert status == 200, found
        self.wait_for(lambda: self.state()["calibration"]["state"] != "running")
        return self.state()["calibration"]


def page_on(browser, url, size, language="en", **options):
    width, height = size
    context = browser.new_context(viewport={"width": width, "height": height}, locale=language, **options)
    page = context.new_page()
    page.set_default_timeout(60_000)
    page.wrong = []
    page.on("pageerror", lambda error: page.wrong.append(str(error)))
    page.goto(url)
    page.get_by_role("heading", level=2).first.wait_for()
    return page


def check_looks(page, tmp_path, name):
    """A picture, and the findings of axe-core in it; nothing is wider than the window, and buttons are large enough for a finger."""
    page.screenshot(path=tmp_path / f"{name}.png")
    page.add_script_tag(path=AXE)
    found = page.evaluate("axe.run(document, { resultTypes: ['violations'] })")["violations"]
    serious = [(one["id"], one["nodes"][0]["html"]) for one in found if one["impact"] in ("serious", "critical")]
    assert serious == [], (name, serious)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), name
    heights = page.evaluate("[...document.querySelectorAll('button')].filter((one) => one.offsetParent).map((one) => one.offsetHeight)")
    assert min(heights) >= 44, name
