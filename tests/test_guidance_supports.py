"""What carries an object, from words: the guidance's, its category's, its name's."""

import pytest

from asset2sim.guidance.lexicon import tokenize
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.supports import called_by, said_support, support_rows, usual_support
from schemas.support import Mount, SupportKind


def thing(category: str = "", asset_id: str = "17") -> ObjectInfo:
    """An object of which only the names are known."""
    return ObjectInfo(asset_id, category, (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), (), (), ())


@pytest.mark.parametrize(
    ("guidance", "kind", "mount"),
    [
        ("A wall-mounted fire hose reel at its real size.", SupportKind.FIXED, Mount.WALL),
        ("A wall clock at its real size.", SupportKind.FIXED, Mount.WALL),
        ("A room door in its frame, closed.", SupportKind.FIXED, Mount.BUILT_IN),
        ("A built-in dishwasher with its door halfway open.", SupportKind.FIXED, Mount.BUILT_IN),
        ("A pipe valve with a lever, screwed to its pipe.", SupportKind.FIXED, None),
        ("A fan that hangs from the ceiling.", SupportKind.FIXED, Mount.CEILING),
        ("A free-standing cooker with its oven door open.", SupportKind.FREESTANDING, None),
        ("A handheld mixer.", SupportKind.HANDHELD, None),
        ("A cupboard nailed to a wall.", SupportKind.FIXED, Mount.WALL),
        ("A locker bolted to the concrete floor.", SupportKind.FIXED, Mount.FLOOR),
        ("A kitchen unit hanging over the stove.", SupportKind.FIXED, Mount.WALL),
        ("A monitor on an arm clamped to the desk.", SupportKind.FIXED, Mount.COUNTER),
        ("An upper kitchen cabinet.", SupportKind.FIXED, Mount.WALL),
        ("A countertop dishwasher.", SupportKind.FREESTANDING, None),
    ],
)
def test_the_guidance_says_what_carries_it(guidance: str, kind: SupportKind, mount: Mount | None) -> None:
    found = said_support(tokenize(guidance))
    assert found is not None and (found.kind, found.mount) == (kind, mount)


@pytest.mark.parametrize(
    "guidance",
    [
        "",
        "A cabinet that is not fixed to the wall.",
        "A laptop, its screen fixed at 90 degrees.",
        "A cart whose door is open.",
        "A bin with its lid attached to its body.",
        "A shoe cabinet, not screwed to the wall.",
    ],
)
def test_other_words_and_denials_say_nothing(guidance: str) -> None:
    assert said_support(tokenize(guidance)) is None


@pytest.mark.parametrize(
    ("category", "asset_id", "guidance", "kind"),
    [
        ("Faucet", "17", "", SupportKind.FIXED),
        ("Furniture", "akiba-door-window", "A piece of furniture.", SupportKind.FIXED),
        ("Furniture", "naiki-6door-closet", "A piece of furniture.", SupportKind.FREESTANDING),
        ("", "17", "A bathroom tap, its lever down.", SupportKind.FIXED),
        ("Scissors", "17", "", SupportKind.HANDHELD),
        ("StorageFurniture", "door-cabinet", "", SupportKind.FREESTANDING),
        ("WashingMachine", "17", "", SupportKind.FREESTANDING),
    ],
)
def test_what_such_things_usually_are(category: str, asset_id: str, guidance: str, kind: SupportKind) -> None:
    found = usual_support(thing(category, asset_id), called_by(tokenize(guidance)))
    assert found is not None and found.kind is kind


def test_a_clock_and_an_unknown_thing_are_left_to_their_shape() -> None:
    assert usual_support(thing("Clock"), None) is None
    assert usual_support(thing("", "object-17"), called_by(tokenize("A thing with a lid."))) is None


@pytest.mark.parametrize(
    ("category", "kind", "support"),
    [
        ("Fan", "CeilingFan", SupportKind.FIXED),
        ("Fan", "FloorFan", SupportKind.FREESTANDING),
        ("Clock", "AlarmClock", SupportKind.FREESTANDING),
        ("Oven", "Hob", SupportKind.FIXED),  # no row of its own: as its category
    ],
)
def test_a_kind_of_its_category_is_carried_as_that_kind_is(category: str, kind: str, support: SupportKind) -> None:
    found = usual_support(thing(category), None, kind)
    assert found is not None and found.kind is support


def test_a_name_is_believed_less_than_a_category() -> None:
    named, stated = usual_support(thing("Furniture", "office-door"), None), usual_support(thing("Door"), None)
    assert named is not None and stated is not None and named.confidence < stated.confidence


def test_every_row_of_the_table_is_sound() -> None:
    for row in support_rows():
        assert row["source"] and row["names"] in ("object", "said") and 0.0 <= float(row["confidence"]) <= 1.0
        assert not row["support"] or row["support"] in list(SupportKind)
        assert not row["mount"] or (row["mount"] in list(Mount) and row["support"] == "fixed")
    phrases = [(row["names"], row["phrase"]) for row in support_rows()]
    assert len(set(phrases)) == len(phrases)
