"""Files for other people's continuous integration, for containers, and examples: they parse, and name what there is."""

import re
import shlex
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from asset2sim.intake.formats import FORMATS
from asset2sim.runs.options import parse
from tests.assets import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
FILES = (".pre-commit-hooks.yaml", "action.yml", ".github/workflows/ci.yml", "compose.yaml")


def read(name: str) -> Any:
    return yaml.safe_load((ROOT / name).read_text(encoding="utf-8"))


def runs() -> list[str]:
    """Every shell line of the workflow and of the action."""
    steps = [step for job in read(FILES[2])["jobs"].values() for step in job["steps"]] + read(FILES[1])["runs"]["steps"]
    return [line for step in steps for line in step.get("run", "").splitlines()]


def commands() -> list[list[str]]:
    """The words of every command line of asset2sim in these files."""
    found = [shlex.split(line) for line in runs() if line.startswith("asset2sim ")]
    found += [[*shlex.split(hook["entry"]), "a.urdf"] for hook in read(FILES[0])]
    services = read(FILES[3])["services"].values()
    return found + [["asset2sim", *item["command"]] for item in services if "build" in item and "command" in item]


@pytest.mark.parametrize("words", commands(), ids=" ".join)
def test_every_command_in_them_is_one(words: list[str]) -> None:
    assert words[0] == "asset2sim"
    parse(["x" if word.startswith("$") else word for word in words[1:] if word != "$OPTIONS"])


def test_the_tests_that_the_workflow_names_exist() -> None:
    jobs = read(FILES[2])["jobs"]
    named = " ".join([*runs(), *(item["tests"] for item in jobs["consumers"]["strategy"]["matrix"]["include"])])
    globs = [f"{head}{one}.py" for head, names in re.findall(r"(tests/test_\w+_)\{([\w,]+)\}\.py", named)
             for one in names.split(",")]  # fmt: skip
    globs += re.findall(r"tests/[\w*]+\.py", named)
    assert len(globs) > 30 and all(any(ROOT.glob(name)) for name in globs)


def test_extras_and_make_targets_in_them_exist() -> None:
    texts = [(ROOT / name).read_text(encoding="utf-8") for name in (*FILES, "Dockerfile")]
    found = [names for text in texts for names in re.findall(r"(?:\.|PATH\})\[([a-z0-9,-]+)\]", text)]
    extras = {extra for names in found for extra in names.split(",")}
    assert extras and extras <= set(PROJECT["optional-dependencies"])
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    assert {line.split()[1] for line in runs() if line.startswith("make ")} <= targets


def test_the_action_passes_what_users_say_as_variables_and_never_as_code() -> None:
    for step in read("action.yml")["runs"]["steps"]:
        assert "${{" not in step.get("run", "")


def test_the_pythons_that_are_tested_are_those_that_are_allowed() -> None:
    tested = read(FILES[2])["jobs"]["core"]["strategy"]["matrix"]["python"]
    assert PROJECT["requires-python"] == ">=3.11,<3.14" and tested == ["3.11", "3.12", "3.13"]


def test_the_image_copies_what_is_there_and_is_not_run_by_root() -> None:
    lines = (ROOT / "Dockerfile").read_text(encoding="utf-8").splitlines()
    copied = [word for line in lines if line.startswith("COPY ") for word in line.split()[1:-1]]
    assert copied and all((ROOT / word).exists() for word in copied)
    kept = {line[1:] for line in (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines() if line[0] == "!"}
    assert kept == set(copied)
    assert [line for line in lines if line.startswith("USER ")] == ["USER asset2sim"]
    assert any(line.startswith("HEALTHCHECK") for line in lines)


def test_the_hook_takes_files_of_every_format_but_xml_which_may_be_anything() -> None:
    suffixes = {*FORMATS} - {".xml"}
    (hook,) = read(FILES[0])
    assert all(re.search(hook["files"], f"a{suffix}") for suffix in suffixes) and not re.search(hook["files"], "a.xml")
    page = (ROOT / "docs/install.md").read_text(encoding="utf-8")
    assert r"files: \.xml$" in page


def test_every_example_is_python_and_named_in_the_list_of_them() -> None:
    listed = (ROOT / "examples/README.md").read_text(encoding="utf-8")
    scripts = sorted((ROOT / "examples").glob("*.py"))
    for script in scripts:
        compile(script.read_text(encoding="utf-8"), script.name, "exec")
    assert scripts and all(script.name in listed for script in scripts)


def test_the_version_is_that_of_the_changelog() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["hatch"]["version"]
    found = re.search(version["pattern"], (ROOT / Path(version["path"])).read_text(encoding="utf-8"))
    assert found is not None and found["version"] == "0.2.0" and "version" not in PROJECT
