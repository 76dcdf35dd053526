"""Words of a sentence that nothing has read, and those that contradict each other, as findings for its user."""

import re
import unicodedata
from collections.abc import Sequence
from itertools import pairwise

from asset2sim.guidance import tables
from asset2sim.guidance.languages import LANGUAGES, translated
from asset2sim.guidance.lexicon import UNITS, Segment, part_word, singular
from asset2sim.guidance.sizing import EDGES, LONGEST, is_of_object
from schemas.errors import shortened
from schemas.guidance import AskedMass, AskedSize, AskedState, Guidance, Unread, Wish

AMOUNTS = ("length", "angle", "share", "mass", "time", "force", "torque")
"""Kinds of phrases that are a number with its unit."""
ENGLISH = frozenset((
    "the", "it", "its", "with", "and", "that", "this", "which", "whose", "from", "for", "to", "of", "should", "would",
    "want", "need", "make", "are", "when", "has", "have", "but", "please", "than", "as", "very",
))  # fmt: skip
"""Words of which an English sentence of some length has one, whatever it is about, and which no other of the languages
that are spoken most has: not "a", "in", "on" or "no"."""
OTHER = frozenset((
    "el", "la", "los", "las", "un", "una", "con", "del", "de", "y", "que", "su", "le", "les", "des", "une", "avec",
    "et", "du", "est", "der", "die", "das", "und", "mit", "ein", "eine", "einem", "einer", "im", "ist", "von", "um",
    "uma", "com", "da", "do", "os", "il", "lo", "di", "che", "een", "het", "met", "van", "bir", "ve", "ile", "dengan",
    "yang", "dan", "z", "se", "och", "en",
))  # fmt: skip
"""Words of the same kind of other languages in Latin letters; two words with an accent tell them as well."""
FEWEST = 4
"""Words from which a sentence of which hardly a word is known is of another language, if it looks so."""
FOREIGN = 3
"""Letters of another script from which a sentence is not read: one or two are symbols, as in "Φ" or "μm"."""
KNOWN_SHARE = 0.34
"""Share of its words up to which hardly one of a sentence is known: in other languages some are spelt as in English."""
SHOWN = 80
"""Characters of a sentence that a finding shows."""
APART = 1.1
"""Ratio from which two numbers for one thing contradict each other: weights are stated to about a tenth."""
_WORDS = re.compile(r"[^\W\d_]+")
_ENDS = re.compile(r"(?<=[.!?;。！？；।؟])\s*")


def in_english(words: str) -> tuple[str, tuple[Unread, ...]]:
    """The words in English, as far as ``languages.csv`` has them; and what of other languages is not read."""
    sentences, found = list[str](), list[Unread]()
    for sentence in _ENDS.split(words):
        said = _foreign(sentence)
        there = translated(sentence) if said else None
        sentences.append(sentence if there is None else there.english)
        if said and there is None:
            found.append(
                Unread(
                    words=said,
                    why=f"rules read English and, of size and state, {', '.join(map(str.capitalize, LANGUAGES))}",
                )
            )
        elif there is not None and there.left:
            left = shortened(", ".join(there.left), SHOWN)
            found.append(Unread(words=left, why=f"of {there.language.capitalize()} only words of size and state are"))
    return " ".join(sentences) if found or sentences != _ENDS.split(words) else words, tuple(found)


def unread_amounts(
    statements: Sequence[Segment], guidance: Guidance, masses: Sequence[AskedMass], strange: Sequence[Unread]
) -> tuple[Unread, ...]:
    """The amounts of which nothing came, but the ``masses`` of the object and what is in ``strange`` words."""
    found, covered, apart = list[Unread](), _covered(guidance), " ".join(item.words for item in strange)
    weights = {mass.mass_kg for mass in masses}
    for statement in statements:
        for item in statement.of(*AMOUNTS):
            said = statement.tokens[item.start - statement.start : item.end - statement.start]
            read = item.start in covered or (item.kind == "mass" and item.number in weights)
            if not read and said[0] not in apart:
                about = " ".join(statement.tokens)
                found.append(Unread(words=" ".join(said), why=f"no rule reads it in '{shortened(about, SHOWN)}'"))
    return tuple(found)


def contradictions(masses: Sequence[AskedMass], guidance: Guidance) -> tuple[Unread, ...]:
    """Two masses, two lengths of one edge, two sizes in words, two states of one part; with which of them counts."""
    found = list[Unread]()
    if guidance.mass is not None and (other := _apart(guidance.mass.mass_kg, [mass.mass_kg for mass in masses])):
        found.append(_against(f"{guidance.mass.mass_kg:g} kg", f"{other:g} kg", "first"))
    edges: dict[str, list[float]] = {}
    for length in guidance.size.lengths:
        if length.following in EDGES or length.following in LONGEST:
            edges.setdefault(EDGES.get(length.following, "longest"), []).append(length.metres)
    for metres in edges.values():
        if other := _apart(metres[0], metres):
            found.append(_against(f"{metres[0]:g} m", f"{other:g} m", "first"))
    of_object = [word for word in guidance.size.words if word.place == "first" and not word.beside]
    for one, two in pairwise(of_object):
        if (one.factor < 1.0) != (two.factor < 1.0) and 1.0 not in (one.factor, two.factor):
            found.append(_against(f"'{one.words}'", f"'{two.words}'", "smaller"))
    for joint, last in guidance.of_joints.items():
        wishes = [wish for wish in guidance.states if wish.joint == joint and wish.by_name]
        if any(_is_shut(wish) != _is_shut(last) for wish in wishes if wish.state.kind == last.state.kind == "open"):
            found.append(_against(f"'{wishes[0].words}'", f"'{last.words}'", "last"))
    return tuple(found)


def _against(one: str, other: str, counts: str) -> Unread:
    return Unread(words=f"{one} and {other}", why=f"the {counts} of them counts")


def _apart(one: float, others: Sequence[float]) -> float | None:
    return next((other for other in others if max(one, other) > APART * min(one, other)), None)


def _is_shut(wish: AskedState) -> bool:
    return wish.state.share == 0.0 and wish.state.measure is None and not wish.state.slightly


def _foreign(sentence: str) -> str:
    """Parts of a sentence in letters or, where all of it is, in a language that no table has; else nothing."""
    letters = [match.start() for match in re.finditer(r"[^\W\d_]", sentence)]
    strange = [at for at in letters if sentence[at].isalpha() and not _is_latin(sentence[at])]
    if len(strange) >= FOREIGN or 2 * len(strange) > len(letters):
        return shortened(sentence[strange[0] :].strip(), SHOWN)
    words = [word for word in _WORDS.findall(sentence.lower()) if word not in UNITS and len(word) > 1]
    looks = not ENGLISH & {*words} and (OTHER & {*words} or sum(not word.isascii() for word in words) > 1)
    foreign = looks and len(words) >= FEWEST and sum(map(_is_known, words)) <= KNOWN_SHARE * len(words)
    return shortened(sentence.strip(), SHOWN) if foreign else ""


def _is_latin(letter: str) -> bool:
    return unicodedata.name(letter, "").startswith("LATIN")


def _is_known(word: str) -> bool:
    bare = (word,), (singular(word),)
    everything = (tables.words(), tables.nouns(), tables.size_words(), tables.material_words())
    return bool(part_word(word)) or any(form in table for table in everything for form in bare)


def _covered(guidance: Guidance) -> set[int]:
    """The tokens of the statements from which something came."""
    wishes: list[Wish] = [*guidance.states, *guidance.motions, *_used(guidance.size)]
    return {wish.at + step for wish in wishes for step in range(len(wish.words.split()))}


def _used(size: AskedSize) -> list[Wish]:
    """The lengths that may be a size."""
    return [length for length in size.lengths if is_of_object(length)]
