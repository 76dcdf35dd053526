"""Tables of the comparisons, from rows by hand: whole datasets, other hands, corrections, and what is withheld."""

import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from asset2sim.catalog.read import latest_rows
from asset2sim.catalog.run import start_run
from asset2sim.catalog.write import write_run
from asset2sim.checks.alignment.expectations import met_expectation
from asset2sim.guidance.csv_rows import LEFT_OUT_VARIABLE
from lab.comparisons.corrections import AGAIN, SAMPLED, corrections_table, ways_of
from lab.comparisons.dataset_table import BLOCK, dataset_table, main
from lab.comparisons.origins import Origin, origins_tables
from lab.comparisons.withheld import LEFT_OUT, UNLABELLED, WHOLE, withheld_table
from lab.flows.compare import compare
from lab.pages.blocks import block_of, markers
from schemas.alignment import Expectation
from schemas.asset import AssetRef
from schemas.errors import UsageError
from schemas.model_names import described
from schemas.settings import Settings, Thresholds
from schemas.vocabulary import Correction, FailureMode
from tests.assets import ROOT
from tests.cabinets import written_cabinet
from tests.factories import make_failure, make_record

ASKED = (
    Expectation(what="size", ranges=((90.0, 99.0),), unit="cm", why="big", lines=(2,)),
    Expectation(what="hinge", ranges=((0.0, 0.2),), unit="rad", why="ajar", lines=(3,)),
    Expectation(what="slider", ranges=((0.0, 0.2),), unit="swings", swings=True, why="loose", lines=(4,)),
)


def write_two_sets(folder: Path) -> dict[str, Path]:
    """Two runs: of three objects, two of them in the subset of the paper's nine, and of one without expectations."""
    asked = make_record("1")
    asked = asked.model_copy(update={"expected": tuple(met_expectation(asked, item) for item in ASKED)})
    other = AssetRef(asset_id="3", path="dataset/3", prompt="a box")
    first = [asked, make_failure("2", FailureMode.DRIFT), make_record("3", ref=other)]
    outs = {"first": folder / "one", "second": folder / "two"}
    for out, records in zip(outs.values(), (first, [make_record("9", ref=other)]), strict=True):
        write_run(out, start_run(Settings(), "data"), records)
    return outs


def test_each_set_has_its_column_and_the_papers_nine_come_first(tmp_path: Path) -> None:
    table = dataset_table(write_two_sets(tmp_path), Thresholds())
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    rows = {cells[0]: cells[1:] for cells in lines}
    assert rows[""] == ["the paper's nine", "first", "second"]
    assert rows["objects"] == ["2", "3", "1"]
    assert rows["ok: every test in mujoco, pybullet"] == ["**1 of 2**", "**2 of 3**", "**1 of 1**"]
    assert rows["size as readers expect it, who wrote it down before any result"] == ["0 of 1", "0 of 1", "–"]
    still = "asked joints at rest as they expect them, in every engine"
    assert rows[still][1].startswith("1 of 1; with those that may swing") and rows[still][2] == "–"
    assert rows["drift within 1 mm and 0.01 rad"][1:] == ["2, 2 of 3", "1, 1 of 1"]
    assert rows["Φ at the start, mean and most"][2] == "0.50 and 0.50 mm"


def test_the_block_is_written_and_a_folder_without_a_run_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.md"
    page.write_text("\n".join(markers(BLOCK)), encoding="utf-8")
    named = [f"{name}={out}" for name, out in write_two_sets(tmp_path).items()]
    assert main([str(page), *named]) == 0
    assert "**2 of 3**" in (block_of(page.read_text(encoding="utf-8"), BLOCK) or "")
    assert main([str(page), f"none={tmp_path / 'none'}"]) == 2
    assert "no catalog in" in capsys.readouterr().err


KINDS = ("authored", "prior")


def origin(name: str, *assets: tuple[str, str, float | None], mass: str = "authored") -> Origin:
    """An origin of assets of two links and a joint each, where they have a scale; its reasons are long."""
    rows = pd.DataFrame(assets, columns=["asset_id", "status", "scale"]).assign(
        failure_mode="jam", reason="stuck " * 40
    )
    there = [asset_id for asset_id, _, scale in assets if scale is not None]
    links = pd.DataFrame(
        {"asset_id": sorted(2 * there), "mass_source": mass, "com_source": "rule", "inertia_source": "rule"}
    )
    joints = pd.DataFrame({"asset_id": there, "limits_source": "authored"})
    joints = joints.assign(damping_source="prior", friction_source="search", stiffness_source="prior")
    return Origin(name, rows, links, joints)


def cells(table: str) -> list[list[str]]:
    return [
        [cell.strip() for cell in line.strip("|").split(" | ")] for line in table.splitlines() if line.startswith("|")
    ]


def test_an_origin_is_a_row_and_a_failure_has_its_reason() -> None:
    one = origin("one", ("a", "ok", 1.0), ("b", "ok", 0.5), ("c", "failed", None))
    two = origin("two", ("d", "ok", 1.0), mass="prior")
    first, second = origins_tables([one, two]).split("\n\n")
    rows = {row[0]: dict(zip(cells(first)[0], row, strict=True)) for row in cells(first)[2:]}
    assert [rows["one"][name] for name in ("objects", "read", "ok", "share")] == ["3", "2", "2", "66.7 %"]
    assert (rows["one"]["size kept"], rows["one"]["mass kept"], rows["one"]["damping kept"]) == (
        "1 of 2",
        "4 of 4",
        "0 of 2",
    )
    assert rows["two"]["mass kept"] == "0 of 2" and rows["all"]["mass kept"] == "4 of 6"
    assert rows["one"]["supplied"] == "rule 8, prior 4, search 2"
    (failed,) = cells(second)[2:]
    assert failed[:3] == ["one", "c", "jam"] and len(failed[3]) <= 200 and failed[3].endswith("…")
    assert "\n\n" not in origins_tables([two]), "one origin has no row of all, and without a failure there is one table"


@pytest.mark.system
def test_anybodys_dataset_is_a_row_of_its_own(tmp_path: Path) -> None:
    written_cabinet(tmp_path / "theirs" / "one", "sdf")
    out, page = tmp_path / "out", tmp_path / "page.md"
    page.write_text("<!-- origins: begin (make origins) -->\n<!-- origins: end -->\n", encoding="utf-8")
    assert compare(["origins", str(tmp_path / "theirs"), "--out", str(out), "--page", str(page)]) == 0
    (row,) = cells(page.read_text(encoding="utf-8"))[2:]
    assets, joints = latest_rows(out / "theirs", "assets", "joints")
    assert row[:3] == ["theirs", "1", "1"] and row[5] == "1 of 1" and len(joints) and len(assets) == 1
    assert row[-2] == f"{len(joints)} of {len(joints)}", "limits are the file's own"


def test_two_folders_of_one_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="one name"):
        compare(["origins", str(tmp_path / "a" / "x"), str(tmp_path / "b" / "x"), "--out", str(tmp_path / "out")])


def test_sizes_and_joints_are_counted_as_expected() -> None:
    assets = pd.DataFrame({"status": ["ok", "failed"], "queries": [1, 2]})
    expected = pd.DataFrame(
        [
            ("size", True, None),
            ("size", False, None),
            ("lid", True, False),
            ("handle", True, None),  # it swings, and counts as it was at the start
            ("door", None, None),  # no joint of that name
            ("none", None, None),
        ],
        columns=["what", "met_at_start", "met_at_rest"],
    )
    (row,) = corrections_table({("prior/noisy", "units"): (assets, expected)}).splitlines()[2:]
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells == [described("prior/noisy"), "units", "2", "1", "1 of 2", "2 of 2", "1 of 2", "1.50"]


def test_each_way_is_what_its_name_says() -> None:
    ways = ways_of(Settings(), "prior/noisy")
    assert list(ways) == ["off", "units", "semantic", AGAIN, SAMPLED]
    assert [way.asks_again for way in ways.values()] == [False, False, False, True, True]
    assert [way.correction for way in ways.values()] == [*Correction, Correction.UNITS, Correction.UNITS]
    assert [way.doubt.samples for way in ways.values()] == [1, 1, 1, 1, 3]
    assert list(ways_of(Settings(), "recorded/answers")) == ["off", "units", "semantic"]


def assets(*rows: tuple[str, str, str, float, str]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["asset_id", "status", "failure_mode", "scale", "support"])


def joints(*rows: tuple[str, float, float | None]) -> pd.DataFrame:
    """Joints from 0 to 1: (asset, where it starts, where it is asked to be)."""
    found = pd.DataFrame(rows, columns=["asset_id", "initial_position", "asked_position"])
    return found.assign(joint="lid", lower=0.0, upper=1.0)


def test_sizes_states_and_failures_are_held_against_the_whole_run() -> None:
    whole = assets(("a", "ok", "none", 1.0, "fixed"), ("b", "ok", "none", 1.0, "freestanding"))
    changed = assets(("a", "ok", "none", 1.4, "fixed"), ("b", "failed", "stands", 2.0, "fixed"))
    asked = joints(("a", 0.5, 0.5), ("b", 0.0, None))
    found = joints(("a", 0.8, 0.8), ("b", 0.0, None))
    table = withheld_table(
        [(WHOLE, whole, asked), (UNLABELLED, changed, found), (LEFT_OUT, whole, asked)], [("Box", changed)]
    )
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if line.startswith("|")
    ]
    assert rows[2] == [WHOLE, "2", "2", "100 %", "100 %", "100 %", "1", "–"]
    # a's 1.4 is within 1.5 and b's 2 is not; a's lid is asked 0.3 of its range away, and b's is not asked.
    assert rows[3] == [UNLABELLED, "2", "1", "50.0 %", "50.0 %", "0 %", "2", "stands 1"]
    assert rows[-1] == ["Box", "2", "1", "50.0 %", "b stands"]


@pytest.mark.system
def test_a_category_left_out_is_in_no_table() -> None:
    program = (
        "from asset2sim.guidance import tables as t\n"
        "from asset2sim.guidance.supports import support_rows\n"
        "from asset2sim.guidance.object_info import ObjectInfo\n"
        "from asset2sim.models.prior.answer import prior_overlay\n"
        "assert 'Door' not in t.sizes() and 'Door' not in t.nouns().values() and 'Laptop' in t.sizes()\n"
        "assert all(row['phrase'] != 'door' for row in support_rows())\n"
        "info = ObjectInfo('17', 'Door', (1, 1, 1), (1, 1, 1), (), (), ())\n"
        "assert prior_overlay(info, 'A door.').support is None\n"
    )
    environment = {LEFT_OUT_VARIABLE: "Door", "PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True, timeout=60, cwd=ROOT)
