"""The tables of objects from other hands: what is read and passes, what is kept of their files, why others fail."""

from pathlib import Path

import pandas as pd
import pytest

from asset2sim.catalog.read import latest_rows
from lab.comparisons.origins import Origin, origins_tables
from lab.flows.compare import compare
from schemas.errors import UsageError
from tests.cabinets import written_cabinet

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
