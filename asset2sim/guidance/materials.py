"""Materials that parts are to be made of, and which are to be heavy or light."""

from collections.abc import Sequence

from asset2sim.guidance import tables
from asset2sim.guidance.lexicon import Segment, place_of, singular
from asset2sim.guidance.parts import MovablePart, parts_named
from schemas.guidance import AskedMaterial, AskedWeight

_ABOUT_MOTION = ("damping", "damped", "friction")


def asked_materials(parts: Sequence[MovablePart], statements: Sequence[Segment]) -> tuple[AskedMaterial, ...]:
    """The first material of each part that is named with one ("glass door"), and of the whole object."""
    table, found = tables.material_words(), dict[str, AskedMaterial]()
    for segment in statements:
        for index, token in enumerate(segment.tokens):
            material = table.get(token)
            if material is None or (token == "steel" and "stainless" in segment.tokens[max(index - 1, 0) : index]):
                continue
            following = segment.tokens[index + 1 : index + 3]
            owner = next((p.name for word in following for p in parts_named(parts, singular(word)) if p.name), "")
            if not (owner and any({word, singular(word)} & tables.part_words().keys() for word in following)):
                owner = ""
            if owner or segment.sentence == 0:
                found.setdefault(owner, AskedMaterial(part=owner, material=material, **place_of(segment)))
    return tuple(found.values())


def asked_weights(parts: Sequence[MovablePart], statements: Sequence[Segment]) -> tuple[AskedWeight, ...]:
    """The links of the parts that are called heavy or light."""
    return tuple(
        AskedWeight(link=part.link.name, heavy=item.kind == "heavy", **place_of(segment))
        for segment in statements
        if not segment.of(*_ABOUT_MOTION)
        for item in segment.of("heavy", "lightweight")
        for word in segment.of("part", "parts")
        for part in parts_named(parts, word.value)
        if part.link is not None
    )
