"""The one reading of a user's sentence."""

from functools import lru_cache

from asset2sim.guidance.amounts import asked_masses, unmet_numbers
from asset2sim.guidance.category import identify
from asset2sim.guidance.lexicon import segments, tokenize
from asset2sim.guidance.motions import asked_motions
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.parts import asked_materials, asked_weights, parts_of
from asset2sim.guidance.sizing import asked_size
from asset2sim.guidance.states import asked_states
from asset2sim.guidance.supports import called_by, said_support
from asset2sim.guidance.unread import contradictions, in_english, unread_amounts
from schemas.guidance import Guidance


# Rules and the prior, which is asked with the same words and numbers, share one reading.
@lru_cache(maxsize=2)
def read_guidance(words: str, info: ObjectInfo) -> Guidance:
    """The requests of the words for an object. Which parts they mean depends on its joints, labels and shape."""
    words, strange = in_english(words)
    tokens, masses = tokenize(words), asked_masses(words)
    category, category_from = identify(info, tokens)
    statements, parts = segments(tokens, category), parts_of(info, category)
    found = Guidance(
        category=category,
        category_from=category_from,
        called=called_by(tokens),
        size=asked_size(words, tokens, statements),
        mass=next(iter(masses), None),
        states=asked_states(info, parts, statements),
        motions=asked_motions(info, parts, statements),
        materials=asked_materials(parts, statements),
        weights=asked_weights(parts, statements),
        support=said_support(tokens),
        free=any(statement.of("free") for statement in statements),
        unmet=unmet_numbers(words),
    )
    left = (*strange, *unread_amounts(statements, found, masses, strange))
    return found.model_copy(update={"unread": left, "contradictions": contradictions(masses, found)})
