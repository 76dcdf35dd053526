"""A sentence is read once, into a record that says where each wish was read; what nothing has read is said."""

import csv
import sys
from pathlib import Path
from types import FrameType

import pytest

from asset2sim.baselines.ours import by_rules
from asset2sim.checks.alignment.align import align
from asset2sim.guidance import lexicon, read
from asset2sim.guidance.languages import LANGUAGES, normal_text, phrases
from asset2sim.validation.overrides import prompt_findings
from schemas.asset import AssetRef
from schemas.guidance import NOTHING_ASKED
from schemas.settings import Settings
from tasks.extract import extract_asset
from tasks.progress import AssetJob
from tasks.synthesize import check_users_numbers
from tasks.validate import validate_overlay
from tests.assets import NO_VIEWS, ROOT, SHARED, cabinet, saying, written
from tests.factories import guidance_of, make_features, make_record

WORDS = "A small steel box of 2 kg with its door slightly open and its drawer closed, low hinge damping."


def test_each_wish_has_the_words_and_the_place_where_it_was_read() -> None:
    found = guidance_of(WORDS, make_features("1"))
    door, drawer = found.states
    assert (door.joint, door.state.slightly, door.words) == ("hinge", True, "its door slightly open")
    assert (drawer.joint, drawer.state.share) == ("slider", 0.0) and drawer.at > door.at > 0
    assert [(wish.named, wish.changes) for wish in found.motions] == [(("hinge",), {"damping": "low"})]
    assert found.mass is not None and (found.mass.mass_kg, found.mass.words) == (2.0, "2 kg")
    assert [(item.part, item.material) for item in found.materials] == [("", "steel")]
    assert [word.words for word in found.size.words] == ["small"]


def test_a_number_of_the_users_stands_in_only_where_the_sentence_states_none() -> None:
    scaled = NOTHING_ASKED.scaled_to(0.25)
    assert scaled.size.scale is not None and scaled.size.scale.value == 0.25
    assert scaled.scaled_to(0.5) == scaled


def test_from_extraction_to_the_score_the_sentence_is_read_once(tmp_path: Path) -> None:
    calls: list[str] = []

    def count(frame: FrameType, event: str, arg: object) -> None:
        if event == "call" and frame.f_code in (lexicon.tokenize.__code__, read.read_guidance.__wrapped__.__code__):
            calls.append(frame.f_code.co_name)

    folder = written(tmp_path / "thing", cabinet())
    ref = AssetRef(asset_id="thing", path=str(folder), category="Box", prompt="A small box, its lid slightly open.")
    settings = Settings(views=NO_VIEWS.views)
    ask = saying({"scale": 0.3, "initial_joint_positions": {"lid_hinge": 0.2}, "asked": ["lid_hinge"]})
    job = AssetJob(ref, tmp_path, settings, ask)
    sys.setprofile(count)
    try:
        extracted = extract_asset(job, correct_joints=True)
        job = AssetJob(ref, tmp_path, settings, ask, extracted.guidance)
        check_users_numbers(job, extracted.extraction)
        proposal, _, _ = by_rules(job, extracted.extraction)
        overlay = validate_overlay(job, extracted.extraction, proposal, rules=True).overlay
        features, guidance = extracted.features, extracted.guidance
        record = make_record("thing", ref=ref, overlay=overlay, features=features, guidance=guidance, measurement=None)
        found = align(record)
    finally:
        sys.setprofile(None)
    assert found is not None and calls == ["read_guidance", "tokenize"]


BOX = make_features("1")
OTHER_LANGUAGES = [
    "箱の蓋は半分開いている。",
    "盒子的门不打开",
    "Eine kleine Kiste mit halb offenem Deckel, 40 cm breit, 5 kg.",
    "Uma caixa pequena com a tampa meio aberta, 40 cm de largura",
    "una scatola piccola con coperchio aperto a metà",
    "Een kleine doos met het deksel half open, 40 cm breed",
    "Маленькая коробка с открытой крышкой, 40 см",
    "La puerta no está abierta del todo",
    "Küçük bir kutu, kapağı yarı açık",
]


def codes(words: str) -> list[str]:
    return [item.code for item in prompt_findings(guidance_of(words, BOX))]


@pytest.mark.parametrize(
    ("words", "door", "drawer"),
    [
        ("A small box with its door half open and its drawer closed, 40 cm wide, 5 kg.", "50 % open", "closed"),
        ("一个小盒子，门半开，抽屉关着，宽40厘米，5公斤。", "50 % open", "closed"),
        ("小箱子，門半開、抽屜打开，宽度４０公分，重量5千克", "50 % open", "open"),
        ("Caja pequeña con la puerta medio abierta y el cajón cerrado, 40 cm de ancho, 5 kg.", "50 % open", "closed"),
        ("Una caja pequeña, puerta entreabierta. Pesa 5 kilos, de 40 centímetros de ancho.", "slightly open", None),
        ("把小盒子的门打开一半，抽屉拉开。宽40厘米，5公斤", "50 % open", "open"),
        ("Une petite boîte, la porte à moitié ouverte, le tiroir fermé, 40 cm de large, 5 kg.", "50 % open", "closed"),
        ("एक छोटा डिब्बा, दरवाज़ा आधा खुला और दराज़ बंद, 40 सेमी चौड़ा, 5 किग्रा", "50 % open", "closed"),
        ("صندوق صغير، الباب نصف مفتوح والدرج مغلق، عرضه ٤٠ سم، 5 كغم", "50 % open", "closed"),
        ("صندوق صغير، الباب مفتوح قليلا و الدرج مغلق، عرضه 40 سم، 5 كغم", "slightly open", "closed"),
        ("একটি ছোট বাক্স, দরজা অর্ধেক খোলা, ড্রয়ার বন্ধ, ৪০ সেমি চওড়া, ৫ কেজি", "50 % open", "closed"),
    ],
)  # fmt: skip
def test_sizes_and_states_are_read_in_the_languages_that_are_spoken_most(
    words: str, door: str, drawer: str | None
) -> None:
    found = guidance_of(words, BOX)
    states = {joint: wish.state.describe() for joint, wish in found.of_joints.items()}
    assert (states.get("hinge"), states.get("slider")) == (door, drawer), found
    assert found.mass is not None and found.mass.mass_kg == 5.0
    assert [word.words for word in found.size.words] == ["small"]
    assert [(length.metres, length.following) for length in found.size.lengths] == [(0.4, "wide")]
    assert not found.unread


def test_words_that_have_another_in_them_are_not_that_one() -> None:
    """A kettle ("open water") with a switch ("open close"): of it the door alone is spoken of."""
    found = guidance_of("带开关的开水壶，门打开30度", BOX)
    assert [wish.joint for wish in found.states] == ["hinge"] and found.states[0].state.measure is not None
    assert [item.words for item in found.unread] == ["开关, 开水, 壶"]


@pytest.mark.parametrize(("code", "language"), zip(("es", "fr", "zh_Hans", "hi", "ar", "bn"), LANGUAGES, strict=True))
def test_the_units_of_each_language_are_those_of_the_common_locale_data(code: str, language: str) -> None:
    units = pytest.importorskip("babel.units", reason="Babel, which has the data, is not installed here")
    names = {"length-centimeter": "cm", "length-millimeter": "mm", "mass-kilogram": "kg", "mass-gram": "g"}
    for unit, english in names.items():
        for length in ("long", "short"):
            said = units.format_unit(7, unit, length, locale=code).replace("\u200f", "")
            word = "".join(letter for letter in said if not letter.isdecimal()).strip().lower()
            # Without a form of its own Babel says the unit's name in the data.
            assert word in (english, unit) or phrases(language).get(normal_text(word)) == english, (word, unit)


@pytest.mark.parametrize("words", OTHER_LANGUAGES)
def test_a_sentence_in_another_language_is_said_once_with_its_words(words: str) -> None:
    (told,) = prompt_findings(guidance_of(words, BOX))
    assert told.code == "prompt_unread" and words[-12:-1] in told.message and "English" in told.message


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("A box with its handle 40 cm wide.", "'40 cm' in the prompt is not read"),
        ("A box with a 3 cm knob, its door half open.", "'3 cm' in the prompt"),
        ("A box, 20 x 30 x 40 cm.", "'40 cm' in the prompt"),
        ("A box with its door half open. 带轮子，盖子半开。", "'轮子' in the prompt is not read: of Chinese only"),
    ],
)
def test_an_amount_of_which_nothing_comes_is_said(words: str, said: str) -> None:
    (told,) = prompt_findings(guidance_of(words, BOX))
    assert told.code == "prompt_unread" and told.message.startswith(said), told


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("A box of 2 kg that weighs 900 kg.", "2 kg and 900 kg: the first of them counts"),
        ("A box of 2 kg that weighs 4000 g.", "2 kg and 4 kg: the first"),
        ("A box 30 cm tall and 80 cm high.", "0.3 m and 0.8 m: the first"),
        ("A tiny, oversized box.", ""),
        ("A small large box.", "'small' and 'large': the smaller"),
        ("A box with its door open, its door closed.", "the last of them counts"),
    ],
)
def test_what_contradicts_itself_is_said_with_what_counts(words: str, said: str) -> None:
    told = [item.message for item in prompt_findings(guidance_of(words, BOX)) if item.code == "prompt_contradiction"]
    assert len(told) == bool(said) and all(said in message for message in told), told


@pytest.mark.parametrize(
    "words",
    [
        "A box 30 cm tall and 20 cm wide, 2.0 kg, that is 2 kg.",
        "A small box with a large lid.",
        "An open box with its door slightly open by 10 degrees.",
        "Café table in Louis XV style, walnut finish, door ajar",
        "Red storage crate Nordic style oak finish",
        "IKEA SKÅDIS box, vintage, rustic, Φ mark, door half open",
        "Stapler",
        "",
    ],
)
def test_ordinary_words_are_no_finding(words: str) -> None:
    assert codes(words) == []


@pytest.mark.parametrize("folder", [ROOT / "data" / "raw", SHARED / "partnet_mobility", SHARED / "other_furniture"])
def test_the_prompts_of_datasets_have_none(folder: Path) -> None:
    if not (folder / "manifest.csv").is_file():
        pytest.skip(f"{folder} is not there")
    with (folder / "manifest.csv").open(encoding="utf-8") as stream:
        prompts = {row["prompt"] for row in csv.DictReader(stream)}
    assert {words: codes(words) for words in prompts if codes(words)} == {}
