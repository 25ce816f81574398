"""Every command and every snippet of README and docs, run as written.

Commands that take minutes are checked for their options alone. Scenarios are those of the repository with
fewer points and runs.
"""

import importlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest
from commands import pipeline
from root import ROOT

pytestmark = pytest.mark.usefixtures("few_pictures")

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
TEXTS = {page.name: page.read_text(encoding="utf-8") for page in PAGES}
# what the words of the table in README stand for
WORDS = {
    "FILES": "heap.yaml",
    "FILE": "made/table.csv",
    "FOLDER": "made/folder",
    "STORE": "place/heap.zarr",
    "OUT": "place",
    "OTHER": "place",
    "FIRST": "heap",
    "SECOND": "heap",
    "PLACE": "place",
    "N": "1",
    "S": "1",
    "M": "0.1",
    "NAME": "valley",
    "TEXT": "A title",
    "DAY": "2026-03-31",
}
SMALL = {
    "heap": (("points: {spacing: 1}", "output: {threshold: 0.1}\npoints: {spacing: 4}"),),
    "levels": (
        (
            "[{spacing: 8, count: 64}, {spacing: 4, count: 40}]",
            "[{spacing: 32, count: 32}, {spacing: 16, count: 8}]",
        ),
        *(("points: {spacing: 4}", "points: {spacing: 16}"), ("[0.25, 0.5, 1]", "[0.5]")),
    ),
    "valley": (
        *(("points: {spacing: 4}", "points: {spacing: 32}"), ("count: 256", "count: 40")),
        *(("[0.25, 0.5, 1]", "[0.5]"), ("[1, 5, 10]", "[5]"), ("[10, 30]", "[30]")),
    ),
    "torrent": (
        *(
            ("points: {spacing: 4}", "points: {spacing: 16}"),
            ("count: 67", "count: 2"),
            ("count: 8", "count: 2"),
            ("count: 6", "count: 2"),
        ),
        ("end: 1800, output_every: 60", "end: 60, output_every: 60"),
    ),
    "paper": (
        *(("spacing: 0.2", "spacing: 0.5"), ("count: 15700", "count: 900")),
        *(("end: 24, output_every: 1", "end: 2, output_every: 1"), ("end: 24", "end: 2")),
    ),
}
# minutes each, or what makes and checks the project itself
ELSEWHERE = ("pip", "pytest", "ruff", "mypy", ".ci/run")
SLOW_MODULES = (
    *("pipeline.studies.scale", "pipeline.studies.collocation_scan", "pipeline.studies.stability"),
    *("solver.verification.exact_cases", "solver.verification.surface_cases"),
    *("solver.verification.wall_cases", "solver.verification.deflection_cases"),
    *("solver.verification.inflow_cases", "solver.verification.bank_cases"),
    *("pipeline.studies.convergence", "pipeline.studies.torrent_terrain", "pipeline.studies.emulation"),
    *("solver.verification.erosion_cases", "pipeline.studies.peers", "pipeline.studies.large_terrain"),
    *("pipeline.studies.gallery", "pipeline.studies.pages", "pipeline.studies.kernels"),
)


# scenarios of laws that are compiled for themselves, which are validated alone
SLOW_SCENARIOS = {"scenarios/torrent/pressure.yaml"}


def commands() -> Iterator[tuple[str, str]]:
    """Go through all commands of all pages, those that do the same once: a page, and a command.

    Emulation takes longest. It is not run again with some of the options that it was run with.
    """
    seen: set[str] = set()
    emulated: list[set[str]] = []
    for name, command in written():
        same = re.sub(
            r"^pipeline (emulate|hazard|report|sensitivity|tables) OUT$", r"pipeline \1 valley", command
        )
        words = set(re.sub(r"[\[\]]", "", command).split()) if "--emulate" in command else set()
        if same not in seen and not any(words and words <= other for other in emulated):
            seen.add(same)
            # without maps less is done
            if words and "--no-maps" not in words:
                emulated.append(words)
            yield name, command


def written() -> Iterator[tuple[str, str]]:
    for name, text in TEXTS.items():
        found = [
            re.sub(r"\s+#.*", "", line)
            for block in re.findall(r"^```sh\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
            for line in block.splitlines()
            if line.strip() and not line.startswith("#")
        ]
        prose = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
        found += re.findall(r"`((?:pipeline|python -m) [^`]+)`", prose)
        for line in dict.fromkeys(found):
            for command in line.split(" && "):
                # a name alone is no command line
                if len(command.split()) > 2 or command.split()[0] in ("pytest", "mypy") or "sh" in command:
                    yield name, command


def snippets() -> Iterator[tuple[str, int, str]]:
    for name, text in TEXTS.items():
        found = re.findall(r"^```python\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
        yield from ((name, number, code) for number, code in enumerate(found))


def smaller(text: str, name: str) -> str:
    for before, after in SMALL[name]:
        text = text.replace(before, after)
    # one run of each of the paper's scenarios
    return text.partition("\nsweep:")[0] + "\n" if name == "paper" else text


@pytest.fixture(scope="module")
def folder(shipped, tmp_path_factory) -> Path:
    """A folder as a user has it after the first command of README, with less to compute in the rest."""
    here = tmp_path_factory.mktemp("user")
    (here / "scenarios").mkdir()
    for path in (ROOT / "scenarios").iterdir():
        if path.is_file():
            (here / "scenarios" / path.name).symlink_to(path)
    for name in ("valley", "paper", "torrent"):
        (here / "scenarios" / name).mkdir()
        for path in (ROOT / "scenarios" / name).iterdir():
            if path.suffix == ".yaml":
                text = smaller(path.read_text(encoding="utf-8"), path.stem if path.stem in SMALL else name)
                (here / "scenarios" / name / path.name).write_text(text)
            else:
                shutil.copy(path, here / "scenarios" / name)
    shutil.copytree(ROOT / "docs", here / "docs")
    # other tests look at the results of the catalogue too
    shutil.copytree(shipped.out, here / "results", copy_function=os.link)
    block, *_ = re.findall(r"^```yaml\n(.*?)^```$", TEXTS["README.md"], flags=re.MULTILINE | re.DOTALL)
    (here / "heap.yaml").write_text(smaller(block, "heap"))
    (here / "outline.csv").write_text("x,y\n60,-20\n100,-20\n100,20\n60,20\n")
    return here


@pytest.fixture
def user(folder, monkeypatch, shared_workers):
    """Be in that folder; studies that take minutes do nothing."""
    monkeypatch.chdir(folder)
    monkeypatch.setattr("pipeline.assess.sensitivity.RESAMPLES", 4)
    monkeypatch.setattr("pipeline.studies.bench.bench", lambda to, tell, quick: [to / "bench.md"])
    monkeypatch.setattr("pipeline.studies.stress.pieces.stress", lambda *given, **more: ([], []))
    return folder


def as_given(command: str) -> list[str]:
    """Arguments of a command line: the words of the table stand for something, patterns for their files."""
    # there is a bed that erodes in few scenarios
    words = shlex.split(re.sub(r"[\[\]]", "", command.replace(" [--erosion-depth 0.5]", "")))
    if "--observed" in words:
        words[words.index("--observed") + 1] = "outline.csv"
    if words[:2] == ["pipeline", "report"]:
        words = ["made/page.html" if word == "FILE" else word for word in words]
    if words[:2] == ["pipeline", "film"]:
        words = ["made/film.gif" if word == "FILE" else word for word in words]
    if words[:2] == ["pipeline", "plot"]:
        words = ["made/plot.png" if word == "FILE" else word for word in words]
    if words[0] == "pipeline" and words[1] in ("emulate", "hazard", "report", "sensitivity", "tables"):
        words = ["valley" if word == "OUT" else word for word in words]
    if words[:2] == ["pipeline", "stress"]:
        words = ["heap.yaml" if word == "FILE" else word for word in words]
    if words[:2] == ["pipeline", "report"]:
        words = ["valley" if word in ("FIRST", "SECOND") else word for word in words]
    if words[:3] == ["pipeline", "compare", "OUT"] and "OTHER" not in words:
        # there is one scenario, which is not compared with itself in one place
        words.insert(3, "OTHER")
    words = [WORDS.get(word, word) for word in words]
    return [
        name for word in words for name in (sorted(map(str, Path().glob(word))) if "*" in word else [word])
    ]


def make(name: str) -> None:
    """Have the results that a command reads."""
    if name == "place" and not Path("place").exists():
        assert pipeline("run", "heap.yaml", "--out", "place").exit_code == 0
    if name == "valley" and not Path("valley").exists():
        assert pipeline("run", "scenarios/valley/valley.yaml", "--out", "valley").exit_code == 0
    if name == "levels" and not Path("levels").exists():
        assert pipeline("run", "scenarios/valley/levels.yaml", "--out", "levels").exit_code == 0
    if name == "results/paper" and not Path("results/paper").exists():
        files = sorted(Path("scenarios/paper").glob("*.yaml"))
        assert pipeline("run", *files, "--out", "results/paper").exit_code in (0, 1)


@pytest.mark.parametrize(("page", "command"), list(commands()))
def test_commands_do_what_is_written(user, page, command):
    words = as_given(command)
    if words[0] in ELSEWHERE:
        return
    if words[0] == "pipeline":
        for word in words[2:]:
            make("place" if word.startswith("place") else word)
        if SLOW_SCENARIOS & set(words):
            words = ["pipeline", "validate", *words[2:]]
        done = pipeline(*words[1:])
        allowed = (0, 1) if "results/paper" in words else (0,)
        assert done.exit_code in allowed, done.output
        return
    assert words[:2] == ["python", "-m"], f"what to do with '{command}'?"
    if words[2] in SLOW_MODULES:
        file = Path(importlib.import_module(words[2]).__file__)
        # a package is run by a module of its own
        file = file.with_name("__main__.py") if file.name == "__init__.py" else file
        assert "__main__" in file.read_text(encoding="utf-8")
        return
    line, _, to = command.partition(" > ")
    line = re.sub("^python", shlex.quote(sys.executable), line)
    done = subprocess.run(shlex.split(line), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    if to:
        assert done.stdout == (ROOT / to).read_text(encoding="utf-8")


@pytest.mark.parametrize(("page", "number", "code"), list(snippets()))
def test_snippets_run_to_their_end(user, page, number, code):
    with warnings.catch_warnings():
        # shipped scenarios are not all on the same points
        warnings.simplefilter("ignore", UserWarning)
        exec(compile(code, f"{page}, snippet {number}", "exec"), {})


def test_the_notebook_runs_from_its_first_cell_to_its_last(user):
    import matplotlib.pyplot as plt

    book = json.loads((ROOT / "docs" / "tutorial.ipynb").read_text(encoding="utf-8"))
    assert book["nbformat"] == 4
    names: dict[str, object] = {}
    with warnings.catch_warnings():
        # on few points many runs leave the domain
        warnings.simplefilter("ignore", UserWarning)
        for number, cell in enumerate(book["cells"]):
            if cell["cell_type"] == "code":
                exec(compile("".join(cell["source"]), f"tutorial.ipynb, cell {number}", "exec"), names)
    plt.close("all")
    assert set(names["tables"]["receptors"]["receptor"]) == {"road", "house", "school"}
    assert Path("torrent/hazard/hazard.qgs").exists()
    assert "Hazard of the torrent" in names["page"].read_text(encoding="utf-8")


def test_the_commands_are_found():
    found = [command for _, command in commands()]
    assert len(found) > 30
    for command in (
        "pipeline run scenarios/*.yaml",
        "pipeline tables valley",
        "pipeline figures results/paper",
    ):
        assert command in found
    assert len(list(snippets())) == 6
