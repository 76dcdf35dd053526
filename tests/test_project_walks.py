"""README.md as its first reader walks through it, then the catalog's and the report's pages: see ``tests.walks``."""

from pathlib import Path

import pytest

from tests.walks import BLOCKS, DATA_PERSON, ELSEWHERE, FIRST, LOADING, NIGHTLY, WALKS, Checkout, block, fresh


@pytest.fixture(scope="module")
def refined(tmp_path_factory: pytest.TempPathFactory, ready: list[str]) -> Checkout:
    """A checkout after the README's first commands, which start a Prefect server of their own."""
    made = fresh(tmp_path_factory.mktemp("walks")).at_hand(ready)
    made.walk(FIRST)
    return made


def test_every_block_is_run_by_a_walk_or_says_what_runs_the_like() -> None:
    assert set(BLOCKS) == {block(*step)[:2] for step in (*WALKS, *ELSEWHERE)}
    for reason in ELSEWHERE.values():
        for word in reason.replace(":", " ").split():
            assert not word.startswith("tests/") or Path(__file__).parents[1].joinpath(word).is_file(), word


@pytest.mark.system
def test_loading_what_was_refined(refined: Checkout) -> None:
    assert "joint_0" in refined.walk(*LOADING)[0]


@pytest.mark.system
def test_a_first_night_starts_a_server_of_its_own(refined: Checkout) -> None:
    (night,) = refined.walk(NIGHTLY)
    assert "unchanged" in night


@pytest.mark.system
def test_the_data_person(refined: Checkout) -> None:
    folder, said = refined.folder, refined.walk(*DATA_PERSON)
    assert "asset_id,mass_kg" in (folder / "masses.csv").read_text(encoding="utf-8")
    assert (folder / "data/refined/report/objects/laptop_silver/before.webp").is_file()
    assert "[kg]" in said[3] or "comment" in said[3]
    assert "laptop_silver" in said[5]
    assert "FINISHED" in said[6]
