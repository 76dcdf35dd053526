"""What a fresh checkout installs and runs: packages, pinned versions, entry points and make targets."""

import os
import re
import shlex
import subprocess
import tomllib
from importlib import import_module
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from asset2sim.catalog.run import RECORDED_PACKAGES
from asset2sim.engines.registry import OWN
from schemas.vocabulary import DECIDING_PACKAGES
from tests.assets import ROOT, SHARED

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
LAB = tomllib.loads((ROOT / "lab/pyproject.toml").read_text(encoding="utf-8"))


def pinned() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pairs = [line.split("==") for line in lines if line and not line.startswith("#")]
    assert all(len(pair) == 2 for pair in pairs)
    return {canonicalize_name(name): version for name, version in pairs}


def test_every_dependency_is_pinned_within_its_range() -> None:
    versions = pinned()
    project = PROJECT["project"]
    extras = project["optional-dependencies"]
    texts = (
        *project["dependencies"],
        *extras["pipeline"],
        *extras["bullet"],
        *extras["dev"],
        *LAB["project"]["dependencies"],
    )
    for requirement in map(Requirement, texts):
        if requirement.name == "asset2sim":
            assert requirement.extras <= set(project["optional-dependencies"])
            continue
        assert requirement.specifier.contains(versions[canonicalize_name(requirement.name)]), requirement


def test_every_package_whose_version_a_run_records_is_declared() -> None:
    project = PROJECT["project"]
    texts = [text for extra in project["optional-dependencies"].values() for text in extra]
    declared = {canonicalize_name(Requirement(text).name) for text in (*project["dependencies"], *texts)}
    assert set(RECORDED_PACKAGES) <= declared  # itself among them: extras name it
    assert {*DECIDING_PACKAGES, *OWN} <= set(RECORDED_PACKAGES)


def test_what_is_pinned_holds_no_addresses() -> None:
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    assert "://" not in text
    assert " @ " not in text


def test_every_package_of_the_project_is_shipped() -> None:
    shipped = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    assert sorted(shipped) == sorted(
        path.parent.name for path in ROOT.glob("*/__init__.py") if path.parent.name not in ("tests", "lab")
    )


def test_the_command_can_be_imported() -> None:
    module, _, function = PROJECT["project"]["scripts"]["asset2sim"].partition(":")
    assert callable(getattr(import_module(module), function))


def test_no_flow_or_task_is_named_like_a_module_that_it_would_shadow() -> None:
    names = {path.stem for folder in ("flows", "tasks") for path in (ROOT / folder).glob("*.py")} - {"__init__"}
    for name in names:
        with pytest.raises(ModuleNotFoundError):
            import_module(name)


def test_make_lists_every_target_that_a_user_may_ask_for() -> None:
    listed = subprocess.run(["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True, timeout=120).stdout
    targets = set(re.findall(r"^  ([a-z-]+)  ", listed, re.MULTILINE))
    expected = (
        "help install flow test test-fast lint typecheck failures settings views doctor nightly ui judge rules compare"
    )
    expected += " bench-defects bench samples questions summary loaders held weights withheld docs picture clean"
    expected += " corrections origins first view rate ratings report screenshots judged probe clone learn"
    expected += " bench-gym recorded figures shapes touched dataset"
    assert " ".join(sorted(targets)) == " ".join(sorted(expected.split()))


def make(*words: str) -> subprocess.CompletedProcess[str]:
    """Nothing is installed. As from a terminal, also where make itself runs these tests."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS", "ARGS"))}
    command = ["make", "--silent", "--old-file=.venv/.installed", *words]
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize("target", ["flow", "nightly"])
def test_make_hands_folders_and_options_over_as_they_stand(target: str, tmp_path: Path) -> None:
    hook = """printf '%s' "$ASSET2SIM_FAILED" '$(OUT)' `date` SUBSET=a > "a b"; echo $HOME"""
    program = tmp_path / "python"
    program.write_text('#!/bin/sh\nfor word in "$@"; do printf "%s\\0" "$word"; done\n', encoding="utf-8")
    program.chmod(0o755)
    options = ["--subset", "paper9", "--settings", "my s.yaml", "--strict", "--hook", hook]
    shown = make(target, f"BIN={tmp_path}", "DATA=my data", "OUT=my out", f"ARGS={shlex.join(options)}").stdout
    command = "refine" if target == "flow" else target
    assert shown.split("\0")[:-1] == ["-m", "flows.command", command, "my data", "--out", "my out", *options]


@pytest.mark.parametrize(
    ("variable", "says"),
    [
        ("SUBSET=paper9", 'SUBSET is no variable of this Makefile; say ARGS="--subset paper9".'),
        ("REFINEMENT_MODEL=a b", """say ARGS="--refinement-model 'a b'"."""),
        ("NO_VIEWS=1", 'say ARGS="--no-views".'),
        ("OUT=", "OUT is empty; name a folder"),
        ("DATA=", "DATA is empty; name a folder"),
    ],
)
def test_make_refuses_a_variable_that_it_does_not_know_and_an_empty_folder(variable: str, says: str) -> None:
    ran = make("--dry-run", "flow", variable)
    assert ran.returncode == 2 and says in ran.stderr and ran.stdout == ""


def test_make_says_so_where_there_is_no_python_3_11(tmp_path: Path) -> None:
    (tmp_path / "lab").mkdir()
    for name in ("Makefile", "pyproject.toml", "lab/pyproject.toml", "constraints.txt"):
        (tmp_path / name).write_bytes((ROOT / name).read_bytes())
    done = subprocess.run(
        ["make", "install", "PYTHON=no-such-python"], cwd=tmp_path, capture_output=True, text=True, timeout=120
    )
    assert done.returncode != 0
    assert "Python 3.11 was not found" in done.stderr
    assert not (tmp_path / ".venv").exists()


def test_continuous_integration_has_the_real_objects() -> None:
    """Elsewhere the tests that read them, the paper's nine among them, skip and say so."""
    objects = SHARED / "partnet_mobility"
    assert objects.is_dir() or not os.environ.get("CI"), f"{objects} is absent: put it there, or unset CI to skip"
