"""Sentences in the languages that are spoken most, in English words, as far as they are about sizes and states."""

import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache

from asset2sim.guidance.csv_rows import csv_rows

LANGUAGES = ("spanish", "french", "chinese", "hindi", "arabic", "bengali")
"""With English the seven of most speakers (Ethnologue 2025)."""
LEAST_SHARE = 0.5
"""Share of a sentence's letters that must be words of the table: of others the known words may mean something else."""
PREFIXES = {"arabic": ("و", "")}
"""Words that are written as one with the next, of the languages that have such."""
_UNSPACED = "chinese"
_ANOTHER = "?"
"""Stands for a word that has one of the table in it and means something else."""
_NOT = "not"
"""Says no of what stands before or after it, by the language: a sentence that has it is not put into English."""
_POINTS = str.maketrans("，。；：！？、،؛؟।（）％٪", ",.;:!?,,;?.()%%")
_AMOUNT = r"\d+(?:[.,]\d+)?\s*(?:cm|mm|m)"
_SIZED = re.compile(rf"({_AMOUNT})[\s]*_(\w+)|_(\w+)[\s:]*({_AMOUNT})\b")
_REST = re.compile(r"_\w+")
_ASCII = re.compile(r"\d+(?:[.,]\d+)?|\b(?:cm|mm|m|kg|g)\b|[,.;:!?()%°]|[^\W\d_][^\s\d,.;:!?()%°]*|\S")


@dataclass(frozen=True)
class Translation:
    """A sentence in English words, the language that it was in, and its words that the table does not have."""

    english: str
    language: str
    left: tuple[str, ...] = ()


@lru_cache
def phrases(language: str) -> dict[str, str]:
    """Phrase of the language, in small letters → English words, "" for words that say nothing here."""
    rows = csv_rows("languages")
    return {normal_text(phrase): row["english"] for row in rows for phrase in row[language].split("|") if phrase}


@lru_cache
def _pattern(language: str) -> "re.Pattern[str]":
    longest = "|".join(map(re.escape, sorted(phrases(language), key=len, reverse=True)))
    if language == _UNSPACED:
        return re.compile(f"(?P<word>{longest})")
    edge = r"[\s\d,.;:!?()%°']"
    return re.compile(
        rf"(?:(?<={edge})|^)({'|'.join(PREFIXES.get(language, ()))})(?P<word>{longest})(?={edge}|$)|\b[dl]'"
    )


def translated(sentence: str) -> Translation | None:
    """The sentence in English, out of its main language; None where that is little, or it says no of something."""
    text = normal_text(sentence)
    found = max((_translated(text, language) for language in LANGUAGES), key=lambda one: one[0])
    return found[1] if found[0] >= LEAST_SHARE else None


def _translated(text: str, language: str) -> tuple[float, Translation]:
    table, english, left, known, end = phrases(language), list[str](), list[str](), 0, 0
    letters = sum(character.isalpha() for character in text)

    def between(part: str) -> None:
        for piece in _ASCII.findall(part):
            if piece[0].isalpha() and not re.fullmatch(r"cm|mm|m|kg|g", piece):
                left.append(piece)
            else:
                english.append(piece)

    for found in _pattern(language).finditer(text):
        between(text[end : found.start()])
        meant = table.get(found["word"] or "", "")
        if meant == _NOT:
            return 0.0, Translation("", language)
        if meant == _ANOTHER:
            left.append(found["word"])
            meant = ""
        english += [table.get(found[1], ""), meant] if language in PREFIXES else [meant]
        known += sum(character.isalpha() for character in found.group())
        end = found.end()
    between(text[end:])
    said = _SIZED.sub(lambda two: f"{two[1] or two[4]} {two[2] or two[3]}", " ".join(filter(None, english)))
    said = re.sub(r"\s+([,.;:!?)%])", r"\1", _REST.sub("", said))
    return known / max(letters, 1), Translation(said, language, tuple(left))


def normal_text(text: str) -> str:
    """Small letters, one form of each, and the points and digits of English."""
    text = unicodedata.normalize("NFC", text).lower().translate(_POINTS).replace("’", "'")
    return "".join(str(unicodedata.decimal(character, character)) for character in text)
