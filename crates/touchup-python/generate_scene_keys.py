"""Writes python/touchup/_scene_keys.py from the scene keys that the installed wheel declares.

    python crates/touchup-python/generate_scene_keys.py [-]
"""

import json
import sys
import textwrap
from pathlib import Path

from touchup._touchup import scene_parameters

HEAD = '''"""The keys of a scene as typed dictionaries; written by generate_scene_keys.py from the definition of the parameters."""

from __future__ import annotations

from typing import Literal, TypedDict

'''


def class_name(section: str) -> str:
    return "".join(word.capitalize() for part in section.split(".") for word in part.split("_"))


def type_of(key: dict) -> str:
    if key["is_list"]:
        return f"list[{class_name(key['name'])}]"
    if key["is_section"]:
        return f"{class_name(key['name'])} | Literal[False, \"off\"] | None"
    if key["words"]:
        return f"Literal[{', '.join(json.dumps(word) for word in key['words'])}]"
    value = key["example"] if key["default"] is None else key["default"]
    depth = 0
    while isinstance(value, list):
        value, depth = value[0], depth + 1
    if isinstance(value, bool):
        kind = "bool"
    elif isinstance(value, (int, float)):
        # a count has no unit and no range in halves; the numbers of a scene are real
        kind = "float"
    else:
        kind = "str"
    return "list[" * depth + kind + "]" * depth


def described(key: dict) -> str:
    numbers = f" [{key['unit']}]" if key["unit"] else ""
    if key["range"]:
        low, high = key["range"]
        numbers += f" {low:g} to {high:g}"
    default = "" if key["is_section"] or key["default"] is None else f"; default `{plain(key['default'])}`"
    return f"{key['summary']}{' —' + numbers if numbers else ''}{default}"


def plain(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def class_of(name: str, summary: str, keys: list[dict]) -> str:
    body = [f'class {name}(TypedDict, total=False):', *quoted(summary)]
    for key in keys:
        body += ["", f"    {key['key']}: {type_of(key)}", *quoted(described(key))]
    return "\n".join(body) + "\n"


def quoted(text: str) -> list[str]:
    return textwrap.wrap(f'"""{text}"""', 112, initial_indent="    ", subsequent_indent="    ")


def classes(key: dict) -> list[str]:
    inner = [text for below in key["inner"] if below["is_section"] for text in classes(below)]
    return [*inner, class_of(class_name(key["name"]), key["summary"], key["inner"])]


def text() -> str:
    sections = json.loads(scene_parameters())
    summary = "Differences from the default scene; False or \"off\" leaves out a part."
    all_classes = [text for section in sections for text in classes(section)] + [class_of("Scene", summary, sections)]
    return HEAD + "\n" + "\n\n".join(all_classes)


if __name__ == "__main__":
    place = Path(__file__).parent / "python/touchup/_scene_keys.py"
    sys.stdout.write(text()) if "-" in sys.argv else place.write_text(text(), encoding="utf-8")
