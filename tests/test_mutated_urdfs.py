"""Mutated URDFs: a seeded part of the study, in which every one becomes a clean row."""

from pathlib import Path
from random import Random

import pytest

from schemas.finding import Finding
from schemas.vocabulary import FailureMode, Severity, Stage, Status
from tests.assets import cabinet
from tests.factories import make_record
from tests.hostile import mutated_urdfs
from tests.hostile.mutated_urdfs import VALIDATED, bench_of, report, unclean
from tests.hostile.urdf_mutations import BYTES, TREE, mutant

COUNT = 40
"""Mutants that a test tries: those of the study's beginning, 15 s of one core."""


def test_mutants_come_of_their_seed_and_every_mutation_comes_up() -> None:
    document = cabinet().encode()
    made = [mutant(document, Random(f"1 {index}")) for index in range(300)]
    assert made == [mutant(document, Random(f"1 {index}")) for index in range(300)]
    assert len({changed for changed, _ in made}) > 280
    assert {name for _, names in made for name in names} == {change.__name__ for change in (*TREE, *BYTES)}


@pytest.mark.system
def test_every_mutant_is_a_clean_row(tmp_path: Path) -> None:
    bench = bench_of(tmp_path, 1)
    results = bench.run(range(COUNT), VALIDATED, 1)
    assert bench.run(range(COUNT), VALIDATED, 1) == results, "what is done is not done again"
    assert [result for result in results if result.problem] == []
    assert len(results) == COUNT and len({result.code for result in results}) > 5


def failed(mode: FailureMode, code: str, message: str) -> str:
    finding = Finding(stage=Stage.EXTRACT, severity=Severity.ERROR, code=code, message=message)
    return unclean(make_record("a", status=Status.FAILED, failure_mode=mode, reason=message, findings=(finding,)))


def test_what_is_no_clean_row() -> None:
    assert failed(FailureMode.UNREADABLE_ASSET, "not_xml", "a.urdf: not readable as XML") == ""
    assert "IndexError" in failed(FailureMode.ENGINE_CRASH, "engine_crash", "IndexError: list index out of range")
    assert "60 s" in failed(FailureMode.TIMEOUT, "timeout", "not done after 60 s")
    assert "TypeError" in failed(FailureMode.UNREADABLE_ASSET, "internal_error", "extract failed: TypeError")
    assert "no sentence" in failed(FailureMode.UNREADABLE_ASSET, "not_urdf", "Traceback (most recent call last)")


def test_a_report_names_what_is_not_clean() -> None:
    result = mutated_urdfs.Result(7, "box", ("cut",), "engine_crash", "engine_crash", "IndexError: x", 0.5)
    text = report([result])
    assert "1 mutants, 1 without a clean row" in text and "- 7 (box: cut): IndexError: x" in text
