"""What a comparison is asked, what it runs, and a real one: two sample objects by two methods."""

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from lab.comparisons.method_runs import METHODS, level_of, noisy_models, parse_request, planned_runs, slug
from lab.flows.compare_methods import main
from lab.pages.blocks import markers
from schemas.errors import UsageError
from schemas.settings import Settings
from schemas.vocabulary import Engine, Method
from tests.assets import RAW
from tests.prefect_server import in_use

pytestmark = pytest.mark.system


def test_every_method_is_run_with_every_model_and_what_asks_none_once() -> None:
    runs = planned_runs(Path("out"), (Method.RAW, Method.DIRECT), ("prior/noisy", "openai/gpt:4o"))
    assert [(run.method.value, run.label, run.folder.as_posix()) for run in runs] == [
        ("raw", "none", "out/raw/none"),
        ("direct", "prior/noisy", "out/direct/prior_noisy"),
        ("direct", "openai/gpt:4o", "out/direct/openai_gpt_4o"),
    ]
    settings = runs[2].settings(Settings())
    assert settings.method is Method.DIRECT and settings.model.model == "openai/gpt:4o"
    assert set(METHODS) == set(Method)


def test_models_that_would_share_a_folder_are_refused() -> None:
    assert slug("a/b") == slug("a:b")
    with pytest.raises(UsageError, match="two models share the folder"):
        planned_runs(Path("out"), (Method.DIRECT,), ("a/b", "a:b"))
    with pytest.raises(UsageError, match="at least one"):
        planned_runs(Path("out"), (), ("a/b",))


def test_levels_are_models_and_the_default_level_is_the_default_model() -> None:
    models = noisy_models((0.0, 0.5, 1.0))
    assert models == ("prior/noisy@0", "prior/noisy@0.5", "prior/noisy")
    assert [level_of(model) for model in (*models, "prior/household")] == [0.0, 0.5, 1.0, None]


def test_the_command_line_says_what_to_run(tmp_path: Path) -> None:
    words = ["data", str(tmp_path), "--subset", "paper9", "--methods", "asset2sim,direct", "--levels", "4,1,0"]
    request = parse_request([*words, "--no-interaction", "--limit", "3", "--workers", "1"])
    assert request.methods == (Method.DIRECT, Method.ASSET2SIM), "in the tables' order"
    assert request.all_models == ("prior/noisy", "prior/noisy@0", "prior/noisy@4"), "tables are of the default level"
    engine = request.shared_settings().engine
    assert engine.verify == (Engine.PYBULLET,) and not engine.interact
    assert (request.subset, request.limit) == ("paper9", 3)
    plainest = parse_request(["data", str(tmp_path)])
    assert plainest.methods == METHODS and plainest.all_models == ("prior/noisy",)
    assert parse_request(["data", "out", "--models", "a/b", "--levels", "2"]).all_models == ("a/b", "prior/noisy@2")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--levels", "0,high"], "give numbers from 0 to"), (["--levels", "-1"], "give numbers from 0 to"),
        (["--methods", "magic"], "invalid choice: 'magic' (choose from asset2sim, direct"),
        (["--limit", "0"], "not a whole number"), (["--page", "no/README.md"], "no page at"),
        (["--models", "prior/noisy@eleven"], "prior/noisy@eleven"), (["--subset", "none"], "unknown subset"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line_before_anything_runs(
    words: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(RAW), str(tmp_path / "out"), *words]) == 2
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_two_objects_by_two_methods(tmp_path: Path, prefect_server: str) -> None:
    page = tmp_path / "README.md"
    page.write_text("\n".join(markers("compare")), encoding="utf-8")
    out = tmp_path / "my out"
    words = [str(RAW), str(out), "--limit", "2", "--no-interaction", "--methods", "asset2sim,raw"]
    words += ["--models", "prior/household", "--workers", "2", "--page", str(page)]
    with in_use(prefect_server):
        assert main(words) == 0
    objects = pq.read_table(out / "tables" / "objects.parquet").to_pandas()
    assert objects.groupby("method").size().to_dict() == {"asset2sim": 2, "raw": 2}
    ours = objects[objects["method"] == "asset2sim"]
    assert ours["ok"].all() and (ours["alignment"] > 0.9).all() and (ours["calls"] >= 1).all()
    raw = objects[objects["method"] == "raw"]
    assert (raw["calls"] == 0).all() and raw["alignment"].mean() < ours["alignment"].mean()
    assert (out / "charts" / "failures_prior_household.png").stat().st_size > 10_000
    assert "**ours**" in (out / "compare.md").read_text(encoding="utf-8")
    assert "(compare_failures.png)" in page.read_text(encoding="utf-8")
    assert not (out / "asset2sim" / "prior_household" / "assets" / ours["asset_id"].iloc[0] / "views").exists()
