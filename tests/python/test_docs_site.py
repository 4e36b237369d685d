"""The site of the documentation: it builds without a warning, and shows the same as the forge.

mkdocs reads Markdown of its own kind; markdown-it counts the elements that CommonMark, as on forges, sees in a page.
"""

import collections
import os
import re
import subprocess
import sys
from html.parser import HTMLParser

import pytest
from conftest import ROOT
from markdown_it import MarkdownIt

COUNTED = {"li", "ol", "ul", "pre", "table", "tr", "h1", "h2", "h3", "h4", "img", "blockquote"}
# its docstrings are on the site alone
MADE_THERE = {"api"}
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


class Elements(HTMLParser):
    """Counts elements, and collects the addresses that a browser fetches to show a page."""

    def __init__(self, text):
        super().__init__()
        self.count, self.fetched = collections.Counter(), []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        if tag in COUNTED:
            self.count[tag] += 1
        attributes = dict(attributes)
        if tag in ("img", "script", "iframe"):
            self.fetched.append(attributes.get("src") or "")
        elif tag == "link" and attributes.get("rel") in ("stylesheet", "icon", "preload"):
            self.fetched.append(attributes["href"])


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """The built site, and the output of mkdocs."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    built = subprocess.run(command, cwd=ROOT, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    return folder


def page_of(site, path):
    name = {"README.md": "index", "CONTRIBUTING.md": "tree/CONTRIBUTING"}.get(path.name, path.stem)
    return (site / f"{name}.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("path", [path for path in PAGES if path.stem not in MADE_THERE], ids=lambda path: path.name)
def test_a_page_has_the_lists_tables_and_blocks_that_the_forge_shows(site, path):
    forge = Elements(MarkdownIt("commonmark").enable("table").render(path.read_text(encoding="utf-8"))).count
    page = page_of(site, path)
    shown = Elements(page[page.index("<article") : page.index("</article>")]).count
    assert shown == forge


def test_every_public_name_of_the_package_is_on_the_page_of_the_api(site):
    package = (ROOT / "crates/touchup-python/python/touchup/__init__.py").read_text(encoding="utf-8")
    public = package.split("__all__ = [")[1].split("]")[0].replace('"', "").replace(",", "").split()
    assert len(public) > 20
    page = (site / "api.html").read_text(encoding="utf-8")
    # a sentence names constants and the scene
    missing = [name for name in public if not re.search(rf'id="touchup\.(\w+\.)?{name}"|<code>{name}</code>', page)]
    assert missing == []


def test_a_page_fetches_nothing_from_other_hosts(site):
    pages = list(site.rglob("*.html"))
    assert len(pages) > len(PAGES)
    for page in pages:
        away = [url for url in Elements(page.read_text(encoding="utf-8")).fetched if "//" in url]
        assert away == [], page
