"""The operator's page during the demo, as docs/page.png shows it.

    target/python/bin/python tests/python/page_picture.py docs/page.png
"""

import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

from browser import ARGUMENTS, opened
from conftest import ROOT
from playwright.sync_api import sync_playwright
from web_page import PageDemo

# after the touches of most of the plate, s
AFTER_S = 56


def main(out):
    program = Path(os.environ.get("TOUCHUP_BIN", ROOT / "target/release/touchup"))
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        with PageDemo(program, folder) as demo:
            page = opened(browser, demo.url, size=(1280, 820))
            page.get_by_role("button", name="Skip").click()
            time.sleep(AFTER_S)
            page.screenshot(path=out)
            page.context.close()
            demo.end()
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1])
