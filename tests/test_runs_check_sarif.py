"""SARIF of checked assets: what its schema requires, the line of what failed, and levels as GitHub knows them."""

import json
from pathlib import Path

import pytest

from asset2sim.runs.check_folders import check_as_sarif, line_of
from schemas.asset import AssetRecord
from schemas.finding import Finding
from schemas.vocabulary import FailureMode, Severity, Stage
from tests.builders import UrdfJoint, UrdfLink, write_urdf
from tests.factories import make_failure, make_record

LEVELS = {"none", "note", "warning", "error"}


def finding(severity: Severity, code: str, joint: str | None = None) -> Finding:
    return Finding(stage=Stage.MEASURE, severity=severity, code=code, message=f"{code} of {joint}", joint=joint)


@pytest.fixture
def failed(tmp_path: Path) -> AssetRecord:
    """A record of a folder below ``tmp_path`` whose joint 'lid' failed a check."""
    (tmp_path / "a box").mkdir()
    urdf = write_urdf(
        tmp_path / "a box", [UrdfLink("body"), UrdfLink("lid")], [UrdfJoint("hinge", "revolute", "body", "lid")]
    )
    mode = FailureMode.MISSING_MESH
    record = make_failure("box", mode)
    found = (
        finding(Severity.ERROR, mode.value, "hinge"),
        finding(Severity.WARNING, "mass_implausible"),
        finding(Severity.INFO, "said"),
    )
    return record.model_copy(update={"ref": record.ref.model_copy(update={"path": str(urdf)}), "findings": found})


def test_the_log_has_what_the_schema_of_sarif_requires(failed: AssetRecord, tmp_path: Path) -> None:
    log = json.loads(json.dumps(check_as_sarif([failed, make_record("good")], tmp_path)))
    assert log["version"] == "2.1.0" and "sarif" in log["$schema"]
    (run,) = log["runs"]
    driver = run["tool"]["driver"]
    assert driver["name"] == "asset2sim" and driver["version"]
    rules = [rule["id"] for rule in driver["rules"]]
    assert len(set(rules)) == len(rules) and all(rule["shortDescription"]["text"] for rule in driver["rules"])
    assert run["results"] and {result["ruleId"] for result in run["results"]} == set(rules)
    for result in run["results"]:
        assert result["level"] in LEVELS and result["message"]["text"]
        (location,) = result["locations"]
        place = location["physicalLocation"]
        assert place["artifactLocation"]["uri"] and place["region"]["startLine"] >= 1
        assert all(isinstance(value, str) for value in result["partialFingerprints"].values())
    prints = [result["partialFingerprints"]["asset2sim/v1"] for result in run["results"]]
    assert len(set(prints)) == len(prints)


def test_a_failure_is_an_error_at_the_line_of_its_joint_with_its_remedy(failed: AssetRecord, tmp_path: Path) -> None:
    first, second = check_as_sarif([failed], tmp_path)["runs"][0]["results"]
    place = first["locations"][0]["physicalLocation"]
    file = tmp_path / Path(failed.ref.path).relative_to(tmp_path)
    line = file.read_text(encoding="utf-8").splitlines()[place["region"]["startLine"] - 1]
    assert 'name="hinge"' in line and "<joint" in line
    assert place["artifactLocation"]["uri"] == f"a%20box/{file.name}"
    assert (first["level"], second["level"]) == ("error", "warning")
    assert "Remedy: " in first["message"]["text"]
    assert second["ruleId"] == "mass_implausible"


def test_what_lies_elsewhere_or_is_not_there_is_named_whole(failed: AssetRecord, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    gone = failed.model_copy(update={"ref": failed.ref.model_copy(update={"path": str(tmp_path / "gone")})})
    for record in (failed, gone):
        results = check_as_sarif([record], tmp_path / "elsewhere")["runs"][0]["results"]
        assert {r["locations"][0]["physicalLocation"]["artifactLocation"]["uri"][:8] for r in results} == {"file:///"}


@pytest.mark.parametrize(
    ("text", "name", "line"),
    [
        ('<a>\n<joint\n name = "lid_1"/>', "lid_1", 3),
        ("<a>\n<b name='x'/>", "x", 2),
        ('<a name="lid.1"/>\n<b name="lid11"/>', "lid.1", 1),
        ("<a/>", "x", 1),
        ("<a/>\n", None, 1),
    ],
)
def test_the_line_of_a_name_is_that_of_its_element(text: str, name: str | None, line: int) -> None:
    assert line_of(name, text) == line
