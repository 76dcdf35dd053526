"""The runner of experiments: rows of every job, deaths of children, further tables, giving up, and going on."""

import os
import signal
from dataclasses import dataclass
from pathlib import Path

import pytest

from asset2sim.catalog.own_files import read_own_files
from asset2sim.experiments.isolation.supervise import Work, in_child
from lab.runner import Done, RunWork, Study, done_row, latest_own, left_to_do, run_study
from schemas.settings import RunSettings
from schemas.table import TYPES, Row, make_table

pytestmark = pytest.mark.system

TEXT, COUNT, TIME = (TYPES[name] for name in ("text", "count", "time"))
JUMPS = make_table(
    "jumps", "one row per frog", ("frog",), "How far frogs jump",
    (("frog!", TEXT, "", ""), ("pond", TEXT, "", ""), ("outcome!", TEXT, "", ""), ("reason!", TEXT, "", ""),
     ("far", COUNT, "1", ""), ("recorded_at!", TIME, "UTC", "")),
)  # fmt: skip
STEPS = make_table(
    "steps", "one row per step of a frog", ("frog", "step"), "Steps of frogs",
    (("frog!", TEXT, "", ""), ("step!", COUNT, "1", ""), ("recorded_at!", TIME, "UTC", "")),
)  # fmt: skip
RUN = RunSettings(workers=2)


@dataclass(frozen=True)
class Frog:
    """A job: a frog that jumps, or dies of it."""

    out: Path
    name: str

    @property
    def known(self) -> Row:
        """Its name and where it is."""
        return {"frog": self.name, "pond": "old"}


def jump(name: str) -> Row:
    if name == "dies":
        os.kill(os.getpid(), signal.SIGKILL)
    if name == "raises":
        raise ValueError("it does not want to")
    return {"outcome": "done", "reason": "", "far": len(name)}


def do_frog(frog: Frog, run: RunWork) -> Done:
    row = done_row(run(Work(jump, (frog.name,), 60.0)))
    return Done(row, {STEPS.name: [{"step": step} for step in range(2)]} if "far" in row else {})


STUDY: Study[Frog] = Study(
    "frogs", (JUMPS, STEPS), do_frog, lambda row: str(row["frog"]), lambda job, row: row["far"] is not None
)


def frogs(out: Path, *names: str) -> list[Frog]:
    return [Frog(out, name) for name in names]


def test_whatever_a_job_does_is_a_row_in_its_output_and_only_what_is_not_settled_is_done_again(tmp_path: Path) -> None:
    jobs = frogs(tmp_path / "a", "leaps", "dies", "raises") + frogs(tmp_path / "b", "hops")
    told: list[tuple[str, int]] = []
    assert left_to_do(STUDY, jobs) == jobs
    assert run_study(STUDY, jobs, RUN, lambda title, _, left: told.append((title, left))) == 0
    assert {title for title, _ in told} == {"leaps", "dies", "raises", "hops"}
    assert [left for _, left in told] == [3, 2, 1, 0]
    rows = latest_own([tmp_path / "a"], JUMPS).set_index("frog")
    assert rows["outcome"].to_dict() == {"leaps": "done", "dies": "failed", "raises": "failed"}
    assert "SIGKILL" in rows["reason"]["dies"] and "does not want to" in rows["reason"]["raises"]
    assert set(rows["pond"]) == {"old"} and rows["far"]["leaps"] == 5
    steps = read_own_files(tmp_path / "a", STEPS)
    assert steps[["frog", "step"]].to_numpy().tolist() == [["leaps", 0], ["leaps", 1]]
    assert latest_own([tmp_path / "b"], JUMPS)["frog"].tolist() == ["hops"]
    assert left_to_do(STUDY, jobs) == jobs[1:3]
    assert run_study(STUDY, jobs[1:2], RUN) == 0
    assert len(read_own_files(tmp_path / "a", JUMPS)) == 4 and len(latest_own([tmp_path / "a"], JUMPS)) == 3


def test_a_study_that_gives_up_says_how_many_are_left(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    jobs = frogs(tmp_path, *(f"raises{number}" for number in range(3)))
    assert run_study(STUDY, jobs, RunSettings(workers=1), enough=lambda row: True) == 2
    assert len(read_own_files(tmp_path, JUMPS)) == 1
    assert "raises0: done; 2 left" in capsys.readouterr().err


def test_what_work_prints_is_dropped_or_kept_in_a_file(tmp_path: Path) -> None:
    assert in_child(Work(print, ("croak",), 60.0)).reason == ""
    in_child(Work(print, ("croak",), 60.0), log_path=tmp_path / "log")
    assert (tmp_path / "log").read_text(encoding="utf-8") == "croak\n"


def test_without_rows_the_latest_are_none(tmp_path: Path) -> None:
    assert latest_own([tmp_path], JUMPS).empty and list(latest_own([], JUMPS).columns) == JUMPS.schema.names
