"""The command line: exit codes, one-line complaints that name the valid choices, and nothing written by mistake."""

import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path

import pytest

from asset2sim.catalog.run import finish_run, start_run
from asset2sim.catalog.summarize import summarize_all
from asset2sim.catalog.write import write_run
from asset2sim.runs.request import RefineRequest
from asset2sim.runs.result import INTERRUPTED, RunResult, exit_code
from flows import schedule
from flows.command import YOUNG_OBJECTS, run_command
from flows.schedule import check_cron, chosen_schedule
from schemas.errors import Asset2SimError, UsageError
from schemas.settings import Settings
from schemas.vocabulary import FailureMode
from tests.assets import ROOT
from tests.factories import make_failure, make_record
from tests.incremental_runs import dataset

MANIFEST = "asset_id,path,subset\na,Box/a,one\nb,Box/b,two\n"


@pytest.fixture
def data(tmp_path: Path) -> Path:
    folder = tmp_path / "data"
    folder.mkdir()
    (folder / "manifest.csv").write_text(MANIFEST, encoding="utf-8")
    return folder


def never(request: RefineRequest) -> RunResult:
    raise AssertionError(f"the flow must not start: {request}")


def never_serve(request: RefineRequest) -> int:
    raise AssertionError(f"the flow must not be served: {request}")


def published(out: Path, request: RefineRequest) -> RunResult:
    """A finished run with one good and one failed asset, really in a catalog."""
    records = (make_record("a"), make_failure("b", FailureMode.MISSING_MESH))
    run = finish_run(start_run(request.settings, str(request.data)))
    out.mkdir(parents=True, exist_ok=True)
    write_run(out, run, records)
    return RunResult(out, run, summarize_all(records), None, ("MLflow was away",))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "COMMAND"),
        (
            ["refin"],
            "choose from refine, failures, query, show, view, check, convert, describe, views, report, ui, doctor, "
            "nightly, overlays, pack, ask, record, settings, rate, judge-videos, ratings, record-motion, probe, learn",
        ),
        (["refine"], "required: DATA, --out"),
        (["refine", "{data}"], "required: --out"),
        (["refine", "{data}", "--out", "{out}", "--subset", "three"], "unknown subset 'three'; choose from: one, two"),
        (["refine", "{data}", "--out", "{out}", "--assets", "a,z"], "unknown asset 'z'; choose from: a, b"),
        (["refine", "{data}", "--out", "{out}", "--assets", ""], "argument --assets: it names nothing"),
        (["refine", "{data}", "--out", "{out}", "--assets", ","], "leave it out for all of them"),
        *(
            ([command, "{out}", "--assets", ","], "argument --assets: it names nothing")
            for command in ("record-motion", "rate")
        ),
        (["learn", "{out}", "--out", "{out}", "--assets", ","], "argument --assets: it names nothing"),
        (["probe", "{out}", "--policy", "scripted", "--methods", " , "], "argument --methods: it names nothing"),
        (["refine", "{data}", "--out", "{out}", "--method", "magic"], "choose from asset2sim"),
        (["refine", "{data}", "--out", "{out}", "--up", "w"], "argument --up: "),
        (["refine", "{data}", "--out", "{out}", "--model", "prior/magic"], "choose from: prior/household"),
        (["refine", "{data}", "--out", "{out}", "--limit", "0"], "'0' is not a whole number from 1 on"),
        (["refine", "{data}", "--out", "{out}", "--workers", "two"], "'two' is not a whole number from 1 on"),
        (["refine", "{data}", "--out", "{out}", "--hook", "https://chat/KEY"], "not a command; call it, as in"),
        (["refine", "{data}", "--out", "{out}", "--scheduler", "localhost"], "tcp://host:port"),
        (["refine", "{data}", "--out", "{out}", "--scheduler", "tcp://me:key@localhost:1"], "tcp://***@localhost:1: "),
        (["refine", "{data}", "--out", "{out}", "--scheduler", "tcp://localhost:1?a=b"], "tcp://localhost:1?***: "),
        (["refine", "{data}", "--out", "{out}", "--frob"], "unrecognized arguments: --frob"),
        (["refine", "{data}/nowhere", "--out", "{out}"], "no dataset at"),
        (["refine", "{data}", "--out", "{data}"], "is the dataset itself"),
        (["refine", "{data}", "--out", "{data}/Box/a/out"], "overlap"),
        (["refine", "{data}", "--out", "{data}/manifest.csv"], "is a file"),
        (["nightly", "{data}", "--out", "{out}", "--subset", "three"], "choose from: one, two"),
        (["failures", "--out", "{out}"], "{out}"),
        (["failures", "--out", "{out}", "--by", "colour"], "choose from failure_mode, category"),
        (["failures", "--out", "{out}", "--since", "yesterday"], "'yesterday' is not a day or a time"),
        (["failures", "--out", "{out}", "--compare", "latest", "previous"], "{out}"),
        (["failures", "--out", "{out}", "--compare", "latest"], "expected 2 arguments"),
        (["query", "SELECT 1", "--out", "{out}"], "{out}"),
        (["refine", "{data}", "--out", "{out}", "--force", "--retry-failed"], "not allowed with"),
        (["show", "a", "--out", "{out}"], "{out}"),
    ],
)
def test_a_mistake_is_one_line_and_exit_code_two(
    arguments: list[str], message: str, data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    before = sorted(tmp_path.rglob("*"))
    filled = [argument.format(data=data, out=out) for argument in arguments]
    assert run_command(filled, refine=never, nightly=never_serve) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("asset2sim: ")
    assert captured.err.count("\n") == 1
    assert message.format(data=data, out=out) in captured.err.replace("(choose from '", "(choose from ").replace(
        "', '", ", "
    )
    assert sorted(tmp_path.rglob("*")) == before


def test_all_mistakes_of_a_command_are_said_at_once(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["refine", str(data), "--out", str(tmp_path / "out"), "--limit", "0", "--assets", ",", "--dynamics", "wild"]
    assert run_command(words, refine=never, nightly=never_serve) == 2
    said = capsys.readouterr().err
    assert all(f"argument --{name}: " in said for name in ("limit", "assets", "dynamics")) and "3 mistakes:" in said
    words = ["refine", str(data), "--out", str(data), "--model", "prior/magic", "--scheduler", "here"]
    assert run_command([*words, "--assets", "zz"], refine=never, nightly=never_serve) == 2
    said = capsys.readouterr().err
    parts = ("4 mistakes:", "unknown asset 'zz'", "prior/household", "tcp://host:port", "is the dataset itself")
    assert all(part in said for part in parts), said


def test_the_options_reach_the_flow(data: Path, tmp_path: Path) -> None:
    asked: list[RefineRequest] = []

    def refine(request: RefineRequest) -> RunResult:
        asked.append(request)
        return published(tmp_path / "out", request)

    options = [
        "--assets", "b, a", "--limit", "2", "--workers", "3", "--no-views", "--strict", "--model", "prior/household",
    ]  # fmt: skip
    assert (
        run_command(["refine", str(data), "--out", str(tmp_path / "out"), *options], refine=refine, nightly=never_serve)
        == 1
    )
    (request,) = asked
    assert (request.asset_ids, request.limit, request.strict) == (("b", "a"), 2, True)
    assert (request.settings.run.workers, request.settings.views.write) == (3, False)


def test_a_run_names_every_asset_its_failure_modes_and_where_the_output_is(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    arguments = ["refine", str(data), "--out", str(out)]
    assert run_command(arguments, refine=lambda request: published(out, request), nightly=never_serve) == 0
    captured = capsys.readouterr()
    for word in ("missing_mesh", "Failure modes", str(out / "assets"), str(out / "catalog"), "1 of 2 ok"):
        assert word in captured.out
    assert "MLflow was away" in captured.err
    assert run_command(["failures", "--out", str(out)], refine=never, nightly=never_serve) == 0
    assert "missing_mesh" in capsys.readouterr().out
    assert run_command(["show", "b", "--out", str(out)], refine=never, nightly=never_serve) == 0
    assert "missing_mesh" in capsys.readouterr().out
    assert run_command(["show", "nobody", "--out", str(out)], refine=never, nightly=never_serve) == 2


def test_exit_codes_follow_the_run(tmp_path: Path) -> None:
    run = finish_run(start_run(Settings(), "data"))
    good, bad = make_record("a"), make_failure("b", FailureMode.DRIFT)

    def code(records: tuple[object, ...], stopped: str | None, strict: bool) -> int:
        return exit_code(RunResult(tmp_path, run, records, stopped, ()), strict)  # type: ignore[arg-type]

    assert code((good, bad), None, strict=False) == 0
    assert code((good, bad), None, strict=True) == 1
    assert code((good,), None, strict=True) == 0
    assert code((good,), INTERRUPTED, strict=False) == 130
    assert code((good,), "the Dask scheduler went away", strict=False) == 1


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (Asset2SimError("the catalog cannot be written"), 1, "asset2sim: the catalog cannot be written\n"),
        (KeyboardInterrupt(), 130, None),
        (ZeroDivisionError(), None, None),
    ],
)
def test_a_known_failure_is_a_line_ctrl_c_a_code_and_a_broken_program_a_traceback(
    error: BaseException, code: int | None, line: str | None, data: Path, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    def refine(request: RefineRequest) -> RunResult:
        raise error

    words = ["refine", str(data), "--out", str(tmp_path / "o")]
    with nullcontext() if code else pytest.raises(type(error)):
        assert run_command(words, refine=refine, nightly=never_serve) == code
    assert line is None or capsys.readouterr().err == line


@pytest.mark.system
def test_help_lists_the_commands_and_imports_nothing_heavy() -> None:
    heavy = {"prefect", "litellm", "mlflow", "distributed", "pandas", "pybullet"}
    script = (
        "import gc, sys\n"
        "from flows.command import main\n"
        "try:\n    main(['--help'])\n"
        f"finally:\n    print(sorted({heavy} & set(sys.modules)), gc.get_threshold()[0])"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0
    assert done.stdout.splitlines()[-1] == f"[] {YOUNG_OBJECTS}", "and looks seldom for garbage while it imports"
    for command in ("refine", "failures", "query", "show", "doctor", "nightly", "settings", "ui"):
        assert command in done.stdout


@pytest.mark.system
def test_a_mistake_that_loads_an_engine_is_one_line_all_the_same(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "flows.command", "refine", str(tmp_path), "--out", "out", "--method", "nonsense"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 2 and done.stdout == "" and done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith("asset2sim: argument --method: invalid choice: 'nonsense'")


@pytest.mark.system
def test_output_that_nobody_reads_to_the_end_is_no_error(tmp_path: Path) -> None:
    published(tmp_path, RefineRequest(data=tmp_path, out=tmp_path))
    command = [sys.executable, "-m", "flows.command", "show", "a", "--out", str(tmp_path)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""


BAD = ("99 2 * * *", "0 2 * *", "0 2 * * 8", "a b c d e", "R 2 * * *", "0 0 31 2 *", "", "@daily", "0 2 * * * *")


@pytest.mark.parametrize("cron", BAD)
def test_a_bad_schedule_is_one_line_and_nothing_starts(
    cron: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"

    def never(request: object) -> object:
        raise AssertionError(f"it must not start: {request}")

    words = ["nightly", str(data), "--out", str(out)]
    assert run_command([*words, "--cron", cron], refine=never, nightly=never) == 2  # type: ignore[arg-type]
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"asset2sim: --cron '{cron}'") and "0 2 * * *" in line
    file = tmp_path / "catalog.yaml"
    file.write_text(f"metadata: {{nightly: {{cron: '{cron}'}}}}", encoding="utf-8")
    monkeypatch.setattr(schedule.chosen_schedule, "__defaults__", (file,))
    assert run_command(words, refine=never, nightly=never) == 2  # type: ignore[arg-type]
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"asset2sim: {file}: cron '{cron}'") and not out.exists()


def test_a_schedule_of_the_command_line_has_the_files_time_zone(tmp_path: Path) -> None:
    file = tmp_path / "catalog.yaml"
    file.write_text("metadata: {nightly: {cron: 'nonsense', timezone: Europe/Berlin}}", encoding="utf-8")
    assert chosen_schedule("30 3 * * 1-5", file) == ("30 3 * * 1-5", "Europe/Berlin")
    assert check_cron("0 2 29 2 *", "--cron") == "0 2 29 2 *", "there are leap years"
    with pytest.raises(UsageError, match="cron 'nonsense' needs five fields"):
        chosen_schedule(None, file)
