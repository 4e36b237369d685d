"""Of mkdocs: the pages that are not in docs/, and links that work on the forge and on the site alike.

A page links to files of the tree as the forge resolves it: relative to its own place. Here the README becomes the front page, and each
file outside of docs/ that a page links to, directly or through another, becomes a page of the site: Markdown as it is, other text as
code. So the site needs no address of a forge.
"""

import posixpath
import re
from pathlib import Path

from mkdocs.structure.files import File

FRONT = "README.md"
ELSEWHERE = "tree/"
LANGUAGES = {".cff": "yaml", ".yaml": "yaml", ".json": "json", ".py": "python", ".rs": "rust", ".rst": "rst", ".sh": "sh"}
LINK = re.compile(r"(?<=\]\()(?!#|[a-z]+:)(?P<path>[^()\s#]+)(?P<anchor>#[^()\s]*)?(?=\))")
FENCE = re.compile(r"(^ *```.*?^ *```\s*?$)", re.DOTALL | re.MULTILINE)

# of each page and picture: its path in the tree -> its path in the site
PLACES: dict[str, str] = {}


def on_files(files, config):
    root = Path(config.config_file_path).parent
    docs = Path(config.docs_dir).relative_to(root).as_posix()
    PLACES.clear()
    PLACES.update({posixpath.join(docs, file.src_uri): file.src_uri for file in files if file.inclusion.is_included()})
    waiting = [FRONT, *(path for path in PLACES if path.endswith(".md"))]
    while waiting:
        path = waiting.pop()
        text = (root / path).read_text(encoding="utf-8")
        if path not in PLACES:
            PLACES[path] = "index.md" if path == FRONT else page_of(path)
            files.append(File.generated(config, PLACES[path], content=as_page(path, text)))
        if path.endswith(".md"):
            new = set(links_of(path, text)) - PLACES.keys() - set(waiting)
            waiting += sorted(target for target in new if (root / target).is_file())
    return files


def on_page_markdown(markdown, page, config, files):
    """Links that the forge follows in the tree, as the site has them; mkdocs itself refuses those that lead nowhere."""
    places = {place: path for path, place in PLACES.items()}
    here = places[page.file.src_uri]

    def on_site(match):
        place = PLACES.get(in_tree(here, match["path"]))
        if place is None:
            return match[0]
        return posixpath.relpath(place, posixpath.dirname(page.file.src_uri) or ".") + (match["anchor"] or "")

    return "".join(as_fence(part) if is_fence(part) else LINK.sub(on_site, part) for part in FENCE.split(markdown))


def is_fence(part):
    return part.lstrip().startswith("```")


def as_fence(part):
    """Of `rust,ignore` the language alone, as the forge shows it."""
    return re.sub(r"^( *```\w+),\S+", r"\1", part)


def page_of(path):
    return ELSEWHERE + (path if path.endswith(".md") else path + ".md")


def as_page(path, text):
    if path.endswith(".md"):
        return text
    return f"# {path}\n\n````{LANGUAGES.get(posixpath.splitext(path)[1], 'text')}\n{text.rstrip()}\n````\n"


def links_of(path, text):
    return [in_tree(path, match["path"]) for part in FENCE.split(text) if not is_fence(part) for match in LINK.finditer(part)]


def in_tree(path, link):
    """Where a link of a file leads, by its path in the tree."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(path), link))
