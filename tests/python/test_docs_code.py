"""Every block of README.md and docs/*.md runs, or says before it why not (doc_blocks.py).

Blocks of one page run in order in one folder, which has the inputs that the pages name (doc_inputs.py): `sh` in bash, with the built
`touchup`; `python` in one interpreter that has the wheel, TOUCHUP_PYTHON; the wheel checks a scene, `touchup` plans a sweep; `rust` belongs
to cargo test.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from dataclasses import replace

import doc_blocks
import pytest
import yaml
from conftest import ROOT
from doc_inputs import make_calibrations, make_inputs, make_programs, path_with

BLOCKS = {page: doc_blocks.blocks_of(page) for page in doc_blocks.PAGES}
ALL = [block for blocks in BLOCKS.values() for block in blocks]
# pages whose blocks take more than some ten seconds
SLOW = {"docs/compare.md", "docs/probing.md"}
PYTHON = os.environ.get("TOUCHUP_PYTHON", sys.executable)

# flags of tests/all.sh, touchup-report, colcon, touchup.ray, Slurm and Snakemake
OTHERS = {"--full", "--seeds", "--peers", "--base-paths", "--address", "--max-retries", "--requeue", "--retries"}

# reads blocks as lines of JSON, runs them in one namespace, and answers each with a line
INTERPRETER = """
import json, sys
names = {"__name__": "__main__"}
for line in sys.stdin:
    place, code = json.loads(line)
    exec(compile(code, place, "exec"), names)
    print("\\0done", flush=True)
"""


@pytest.fixture(scope="session")
def inputs(touchup, tmp_path_factory):
    """Folders with files: of all pages, and of the one about calibrations, which records the same touches before any calibration."""
    usual, calibration = tmp_path_factory.mktemp("inputs"), tmp_path_factory.mktemp("calibrations")
    make_calibrations(calibration, make_inputs(touchup, usual))
    return {"": usual, "calibration.md": calibration}


@pytest.fixture(scope="session")
def programs(touchup_bin, tmp_path_factory):
    cargo = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))
    folder = tmp_path_factory.mktemp("programs") / "bin"
    make_programs(folder, touchup_bin.resolve(), list(cargo["features"]))
    return folder


@pytest.fixture
def folder(inputs, page, tmp_path):
    """Folder of the blocks of a page: inputs, and the files of the tree that pages name."""
    shutil.copytree(inputs[""], tmp_path, dirs_exist_ok=True)
    if page.name in inputs:
        shutil.rmtree(tmp_path / "my_recording")
        shutil.copytree(inputs[page.name], tmp_path, dirs_exist_ok=True)
    if page.parent.name == "sweep":
        shutil.copytree(page.parent, tmp_path, dirs_exist_ok=True)
    for name in ("config", "examples"):
        shutil.copytree(ROOT / name, tmp_path / name)
    (tmp_path / "docs").mkdir()
    return tmp_path


class Page:
    """Runs blocks one after the other."""

    def __init__(self, folder, programs):
        self.folder, self.interpreter = folder, None
        self.environment = {**os.environ, "PATH": path_with(programs), "MPLBACKEND": "Agg"}

    def run(self, block):
        getattr(self, {"console": "sh", "json": "yaml"}.get(block.kind, block.kind))(block)

    def sh(self, block):
        code = block.code
        if block.kind == "console":
            code = "\n".join(line[2:] for line in code.splitlines() if line.startswith("$ "))
        ended = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", code], cwd=self.folder, env=self.environment, capture_output=True, text=True, timeout=600
        )
        assert ended.returncode == 0, f"{block}: {ended.stdout}{ended.stderr}"

    def python(self, block):
        self.execute(str(block), block.code)

    def yaml(self, block):
        read = yaml.safe_load(block.code)
        assert isinstance(read, dict), f"{block}: {read}"
        # parameters of ROS are not a scene
        if all(isinstance(of, dict) and "ros__parameters" in of for of in read.values()):
            return
        if "keys" in read:
            (self.folder / "block.yaml").write_text(block.code, encoding="utf-8")
            self.sh(replace(block, kind="sh", code="touchup sweep plan block.yaml --out block.jsonl"))
            return
        (self.folder / "block.yaml").write_text(block.code + ("" if "tip" in read else "tip: {radius_mm: 1.5}\n"), encoding="utf-8")
        self.execute(str(block), "import touchup\ntouchup.check_scene('block.yaml')\n")

    def rust(self, block):
        """cargo test --doc runs the blocks of a page that is the documentation of the crate."""
        library = (ROOT / "src/lib.rs").read_text(encoding="utf-8")
        assert f'#[doc = include_str!("../{block.page}")]' in library, f"{block}: no test of cargo has this page"

    def execute(self, place, code):
        if self.interpreter is None:
            # its errors into a file, since no thread reads them meanwhile
            self.errors = open(self.folder / "python.stderr", "w+", encoding="utf-8")
            streams = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": self.errors, "text": True}
            self.interpreter = subprocess.Popen([PYTHON, "-c", INTERPRETER], cwd=self.folder, env=self.environment, **streams)
        self.interpreter.stdin.write(json.dumps([place, code]) + "\n")
        self.interpreter.stdin.flush()
        for line in self.interpreter.stdout:
            if line == "\0done\n":
                return
        self.errors.seek(0)
        pytest.fail(f"{place}: {self.errors.read()}")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.interpreter is not None:
            self.interpreter.stdin.close()
            self.interpreter.stdout.close()
            self.interpreter.wait()
            self.errors.close()


def name_of(page):
    return page.relative_to(ROOT).as_posix()


def flags_of(touchup, cache, words):
    """The flags of a verb, and of a verb below it, by its --help."""
    key = tuple(words)
    if key not in cache:
        ended = touchup(*words, "--help")
        cache[key] = set(re.findall(r"--[a-z][a-z0-9-]*", ended.stdout)) if ended.returncode == 0 else None
    return cache[key]


@pytest.fixture(scope="session")
def every_flag(touchup):
    """Of any verb."""
    verbs = [[verb] for verb in re.findall(r"^  ([a-z]+) ", touchup("--help").stdout, re.MULTILINE)]
    below = [[*verb, under] for verb in verbs for under in re.findall(r"^  ([a-z]+) ", touchup(*verb, "-h").stdout, re.MULTILINE)]
    return set().union(*(flags_of(touchup, {}, words) or set() for words in verbs + below))


def test_each_block_runs_or_says_why_not():
    wrong = [f"{block}: {problem}" for block in ALL if (problem := doc_blocks.problem(block))]
    wrong += [
        f"{page.name}: a mark stands before no block"
        for page, blocks in BLOCKS.items()
        if doc_blocks.marks_of(page) != sum(block.mark is not None for block in blocks)
    ]
    assert wrong == []


def pages_that_run():
    pages = [page for page, blocks in BLOCKS.items() if any(block.is_run for block in blocks)]
    return [pytest.param(page, marks=[pytest.mark.full] if name_of(page) in SLOW else []) for page in pages]


@pytest.mark.parametrize("page", pages_that_run(), ids=name_of)
def test_the_blocks_of_a_page_run(page, folder, programs):
    with Page(folder, programs) as running:
        for block in BLOCKS[page]:
            if block.is_run:
                running.run(block)


@pytest.mark.parametrize("page", list(BLOCKS), ids=name_of)
def test_the_flags_that_a_page_names_exist(page, touchup, every_flag):
    """Of commands in blocks, run or not, and in sentences."""
    text = page.read_text(encoding="utf-8")
    # a command may go on in the next line, in a block by a backslash
    commands = re.findall(r"`touchup ([^`]+)`", re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE).replace("\n", " "))
    for block in BLOCKS[page]:
        if block.kind in ("sh", "console"):
            code = block.code.replace("\\\n", " ")
            commands += re.findall(r"(?:^|&& |\| )(?:touchup|cargo run [^\n#]*--(?= )|cargo run [^\n#]*-- ) ?([^\n#|&]+)", code, flags=re.MULTILINE)
    alone = re.findall(r"`(--[a-z][a-z0-9-]*)[^`]*`", re.sub(r"^ *```.*?^ *```$", "", text, flags=re.DOTALL | re.MULTILINE))
    assert set(alone) <= every_flag | OTHERS
    known, wrong = {}, []
    for command in commands:
        words = command.split()
        verbs = [word for word in words[:2] if re.fullmatch(r"[a-z0-9_]+", word)]
        while verbs and flags_of(touchup, known, verbs) is None:
            verbs.pop()
        if not verbs:
            continue
        named = {word.partition("=")[0].rstrip(".,;:)") for word in words if word.startswith("--")}
        if unknown := named - flags_of(touchup, known, verbs):
            wrong.append(f"touchup {command}: {' '.join(verbs)} has no {' '.join(sorted(unknown))}")
    assert wrong == []
