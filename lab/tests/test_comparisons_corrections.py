"""The table of what correcting and asking again are worth, from rows by hand."""

import pandas as pd

from lab.comparisons.corrections import AGAIN, SAMPLED, corrections_table, ways_of
from schemas.model_names import described
from schemas.settings import Settings
from schemas.vocabulary import Correction


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
