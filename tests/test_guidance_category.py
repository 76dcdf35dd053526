"""What an object is, and how large: from the rows that the tables have."""

import pytest

from asset2sim.guidance import tables
from asset2sim.guidance.category import identify
from asset2sim.guidance.object_info import ObjectInfo
from tests import prior_objects as known


@pytest.mark.parametrize("category", ["Keyboard", "Door", "Eyeglasses"])
def test_a_category_whose_rows_are_left_out_is_unknown_and_no_error(
    category: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Labels name these, as the study that withholds a category's rows asks; the whole tables find them."""
    labels = {"Keyboard": "key", "Door": "door_frame", "Eyeglasses": "glasses_body"}
    thing = known.thing("", known.hinged("part", labels[category]), asset_id="thing")
    info = ObjectInfo.from_json(thing)
    assert identify(info, ())[0] == category, "or the test withholds nothing"
    rest = {name: size for name, size in tables.sizes().items() if name != category}
    nouns = {phrase: name for phrase, name in tables.nouns().items() if name != category}
    monkeypatch.setattr(tables, "sizes", lambda: rest)
    monkeypatch.setattr(tables, "nouns", lambda: nouns)
    assert identify(info, ())[0] != category
