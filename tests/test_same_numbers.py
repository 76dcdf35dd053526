"""Two outputs of ``refine`` are compared in every number; what differs from run to run is left out."""

import json
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.same_numbers import differences, main, one_sided

URDF = '<robot name="r"><link name="body"><inertial><mass value="1.50"/></inertial></link></robot>'


def output(out: Path, **changed: object) -> Path:
    """An output of one asset with a folder and two tables, with these values changed."""
    folder = out / "assets" / "box"
    (folder / "collision").mkdir(parents=True)
    (folder / "views").mkdir()
    (folder / "mobility.urdf").write_text(str(changed.get("urdf", URDF)))
    (folder / "overlay.json").write_text(json.dumps({"scale": changed.get("scale", 0.5), "links": [{"mass_kg": 1.0}]}))
    (folder / "collision" / "piece.obj").write_text(str(changed.get("mesh", "v 0 0 0")))
    (folder / "views" / "front.png").write_text(str(out))
    (folder / "SHA256SUMS").write_text(str(out))
    key = {"run_id": str(out), "asset_id": "box", "method": "asset2sim", "model": "m"}
    asset = key | {"mass_kg": changed.get("mass", 1.5), "seconds_refine": hash(str(out)) % 7, "source_path": str(out)}
    if "column" in changed:
        asset |= {"new": 1}
    finding = key | {"finding_index": 0, "message": changed.get("message", "it falls"), "value": float("nan")}
    (out / "catalog").mkdir()
    pq.write_table(pa.Table.from_pylist([asset]), out / "catalog" / "assets.parquet")
    pq.write_table(pa.Table.from_pylist([finding]), out / "catalog" / "findings.parquet")
    return out


@pytest.mark.parametrize(
    ("changed", "file", "where"),
    [
        ({"urdf": URDF.replace("1.50", "1.5000001")}, "mobility.urdf", "mass@value"),
        ({"urdf": URDF.replace("<inertial>", '<inertial a="b">')}, "mobility.urdf", "inertial@a"),
        ({"scale": 0.5000000001}, "overlay.json", ".scale"),
        ({"mesh": "v 0 0 1"}, "collision/piece.obj", "content"),
        ({"mass": 1.6}, "assets", "mass_kg"),
        ({"message": "it tips"}, "findings", "message"),
    ],
)
def test_planted_difference_is_found(tmp_path: Path, changed: dict[str, object], file: str, where: str) -> None:
    (found,) = differences(output(tmp_path / "old"), output(tmp_path / "new", **changed))
    assert (found.asset, found.file) == ("box", file) and where in found.where


def test_equal_outputs_differ_only_from_run_to_run(tmp_path: Path) -> None:
    same = URDF.replace("1.50", "1.5")
    old, new = output(tmp_path / "old"), output(tmp_path / "new", urdf=same, column=True)
    assert list(differences(old, new)) == [] and main(old, new) == 0
    assert list(one_sided(old, new)) == [f"assets.new only in {new}"]


def test_missing_file_row_and_output_are_differences(tmp_path: Path) -> None:
    old, new = output(tmp_path / "old"), output(tmp_path / "new")
    (new / "assets" / "box" / "overlay.json").unlink()
    empty = pq.read_table(new / "catalog" / "findings.parquet").slice(0, 0)
    pq.write_table(empty, new / "catalog" / "findings.parquet")
    assert [(item.file, item.new) for item in differences(old, new)] == [
        ("overlay.json", "absent"),
        ("findings", "no row"),
    ]
    assert main(old, new) == 1 and main(tmp_path / "none", new) == 1
