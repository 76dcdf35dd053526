"""The way of one asset, from the command's worker to its rows, is counted: it may become shorter, not longer."""

from pathlib import Path

import pytest

from tests.walk_profile import walk_of


@pytest.mark.system
def test_one_asset_s_way_is_short_and_computes_each_thing_once(tmp_path: Path) -> None:
    walk = walk_of("laptop_silver", tmp_path)
    assert len(walk.handed) <= 110 and len(walk.files) <= 45
    assert set(walk.verdicts.values()) == {1}
    assert walk.parses.total() <= 6
    assert walk.sentences <= 1
