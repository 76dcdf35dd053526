"""What of a prompt nothing has read, and what contradicts itself, is said; ordinary English has nothing of it."""

import csv
from pathlib import Path

import pytest

from asset2sim.validation.overrides import prompt_findings
from tests.assets import ROOT, SHARED
from tests.factories import guidance_of, make_features

BOX = make_features("1")
OTHER_LANGUAGES = [
    "一个小盒子，盖子半开，宽40厘米，5公斤。",
    "盒子 40 cm 5 kg 半开",
    "箱の蓋は半分開いている。",
    "Una caja pequeña de 40 cm con la tapa medio abierta, 5 kg.",
    "Eine kleine Kiste mit halb offenem Deckel, 40 cm breit, 5 kg.",
    "Une petite boîte avec le couvercle à moitié ouvert, 5 kg",
    "Uma caixa pequena com a tampa meio aberta, 40 cm de largura",
    "una scatola piccola con coperchio aperto a metà",
    "Een kleine doos met het deksel half open, 40 cm breed",
    "Маленькая коробка с открытой крышкой, 40 см",
    "एक छोटा डिब्बा जिसका ढक्कन आधा खुला है, 40 सेमी",
    "صندوق صغير بغطاء نصف مفتوح، عرضه 40 سم",
    "একটি ছোট বাক্স, ঢাকনা অর্ধেক খোলা",
    "Küçük bir kutu, kapağı yarı açık",
]


def codes(words: str) -> list[str]:
    return [item.code for item in prompt_findings(guidance_of(words, BOX))]


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
        ("A box with its door half open. 盖子半开", "'盖子半开' in the prompt"),
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
        "A 2 kg box that holds 1 kg of tea.",
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
