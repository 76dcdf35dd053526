"""``asset2sim record-motion``: the flow over an output, its table, its page, and what it refuses."""

from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
from asset2sim.catalog.own_files import read_own_files
from asset2sim.catalog.write import write_run
from flows.command import refine, run_command, serve
from lab.runner import latest_own, run_study
from lab.schemas.tables import TRIALS
from lab.trials.study import STUDY, jobs_of
from lab.trials.trial import TRACK
from schemas.errors import UnknownChoiceError, UsageError
from schemas.settings import RunSettings
from schemas.table import Row
from tests.factories import make_record
from tests.prefect_server import in_use, with_tables
from tests.refined_things import block, drawer
from tests.test_catalog_history import night

pytestmark = pytest.mark.system


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """An output with a drawer, a block that no hand holds, and an asset that failed."""
    place = tmp_path / "out"
    place.mkdir()
    write_run(place, night(1), [make_record(name) for name in ("drawer", "block", "gone")])
    drawer(place / "assets" / "drawer")
    block(place / "assets" / "block", 0.2, 1.0)
    return place


def test_the_command_records_every_refined_object_and_writes_the_page(
    out: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, prefect_tables: Path
) -> None:
    monkeypatch.setenv("PREFECT_HOME", str(with_tables(out.parent / "prefect", prefect_tables)))
    page = out.parent / "page.md"
    page.write_text("<!-- judged: begin (make judged) -->\n<!-- judged: end -->\n", encoding="utf-8")
    words = ["record-motion", str(out), "--no-film", "--workers", "2", "--page", str(page)]
    assert run_command(words, refine=refine, nightly=serve) == 0
    assert "1 of 2" in capsys.readouterr().out
    assert "| close drawer | done |" in page.read_text(encoding="utf-8")
    trials = read_own_files(out, TRIALS).set_index("asset_id")
    assert trials["outcome"].to_dict() == {"drawer": "done", "block": "unreachable"}
    assert (out / "motions" / "drawer" / "close" / TRACK).is_file()


def test_a_study_of_which_every_trial_failed_is_no_success(
    out: Path, capsys: pytest.CaptureFixture[str], prefect_server: str
) -> None:
    (out / "assets" / "drawer" / "mobility.urdf").write_text("<robot name='drawer'/>", encoding="utf-8")
    words = ["record-motion", str(out), "--no-film", "--assets", "drawer"]
    with in_use(prefect_server):
        assert run_command(words, refine=refine, nightly=serve) == 1
    assert "none of 1 trials could be done" in capsys.readouterr().err
    assert read_own_files(out, TRIALS)["outcome"].tolist() == ["failed"]


def test_trials_are_done_anew_and_the_latest_counts(out: Path) -> None:
    told: list[tuple[Row, int]] = []
    for _ in range(2):
        jobs = jobs_of(out, ("block",), False)
        run_study(STUDY, jobs, RunSettings(workers=1), lambda _, row, left: told.append((row, left)))
    assert [(row["outcome"], left) for row, left in told] == [("unreachable", 0)] * 2
    assert len(read_own_files(out, TRIALS)) == 2 and len(latest_own([out], TRIALS)) == 1


def test_what_cannot_be_recorded_is_said_in_one_line(out: Path) -> None:
    with pytest.raises(UnknownChoiceError, match="drawer"):
        jobs_of(out, ("drawr",), False)
    with pytest.raises(UsageError, match="no refined object"):
        jobs_of(out, ("gone",), False)
