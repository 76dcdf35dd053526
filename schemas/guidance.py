"""Requests of a user's sentence of one object, each wish with its words: read once, and never parsed again."""

from typing import Literal

from schemas.base import Finite, Frozen, NonNegative, Positive
from schemas.support import SupportProposal

WHOLE_OBJECT = "object"
"""The subject of a state that names no part: "an open box"."""
EVERY_PART = "everything"


class Wish(Frozen):
    """The ``words`` of a statement, in lower case, and the number of its first token in the sentence."""

    words: str
    at: int = 0


class AskedOpening(Frozen):
    """By how much a part is to be open: rad, or m at the final scale."""

    kind: Literal["angle", "length"]
    amount: NonNegative


class State(Frozen):
    """A state: ``kind`` open, rest, pressed, up, down, sideways, normal or off. What is open is so by a ``share`` of
    its useful travel (None: as far as it is opened in use), ``slightly``, or by a ``measure``; ``closing`` says that it
    is counted from the open end."""

    kind: str
    share: Finite | None = None
    slightly: bool = False
    closing: bool = False
    measure: AskedOpening | None = None

    @property
    def in_use(self) -> bool:
        """Whether it is open, and nothing says how far: as far as in use, or further."""
        return self.kind == "open" and self.share is None and not self.slightly and self.measure is None

    def describe(self) -> str:
        """The state in a word or two."""
        if self.measure is not None:
            return f"open by {self.measure.amount:.3g} {'rad' if self.measure.kind == 'angle' else 'm'}"
        if self.slightly:
            return "slightly closed" if self.closing else "slightly open"
        if self.kind != "open":
            return self.kind
        if self.share is None:
            return "open"
        return {0.0: "closed", 1.0: "fully open"}.get(self.share, f"{100 * self.share:.0f} % open")


class AskedState(Wish):
    """A state that is asked of ``joint``, the ``subject`` being the words for its part. Without a joint it is asked of
    a part that the object does not have."""

    state: State
    subject: tuple[str, ...]
    joint: str | None = None

    @property
    def by_name(self) -> bool:
        """Whether the words name the part, not only the whole object."""
        return self.subject[0] != WHOLE_OBJECT

    @property
    def of_all(self) -> bool:
        """Whether the state is that of the whole object, or of all that opens."""
        return self.subject[-1] in (WHOLE_OBJECT, EVERY_PART)

    def describe(self) -> str:
        """The wish and the joint that it came to, in a line."""
        if self.joint is not None:
            return f"state: {' and '.join(self.subject)} {self.state.describe()} → {self.joint}"
        missing = "part that opens" if self.of_all else " or ".join(self.subject)
        return f"state: {self.state.describe()} is asked, and this object has no {missing}"


class AskedScale(Wish):
    """A uniform scale as a number; ``words`` are its digits as they were read."""

    value: Positive


class AskedLength(Wish):
    """A length, m, that is not about a part. ``following`` is the word after it ("tall"), ``beside`` the words of
    measuring in its statement ("measures")."""

    metres: Positive
    following: str = ""
    beside: tuple[str, ...] = ()


class SizeWord(Wish):
    """A word of size: the ``factor`` on the usual size, the kinds of phrases ``beside`` it in its statement, and
    whether that is the ``first`` one, or another of the phrase that says what the object is (``head``)."""

    factor: Positive
    beside: tuple[str, ...] = ()
    place: Literal["first", "head", "later"] = "first"


class AskedSize(Frozen):
    """All that is said of the object's size; ``real`` words ask for the real thing's ("actual", "full"), and ``kinds``
    are named that have proportions of their own ("desk", "coffee table")."""

    scale: AskedScale | None = None
    lengths: tuple[AskedLength, ...] = ()
    words: tuple[SizeWord, ...] = ()
    real: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()


class AskedMass(Wish):
    """The mass of the whole object, kg."""

    mass_kg: Positive


class AskedWeight(Wish):
    """A link that is to be ``heavy``, or else light."""

    link: str
    heavy: bool


class AskedMaterial(Wish):
    """The material of a ``part``, "" being the whole object."""

    part: str
    material: str


class AskedMotion(Wish):
    """How the parts of some joints are to move. ``changes`` maps the kind of a wish ("damping", "soft close", "closes")
    to its level, or to its number in s, m or rad, or to ""; ``named`` are the joints that the words are about,
    ``joints`` those that the changes can apply to."""

    joints: tuple[str, ...]
    named: tuple[str, ...]
    changes: dict[str, str]


class UnmetNumber(Wish):
    """A number that no object can have, and ``why``."""

    why: str


class Unread(Frozen):
    """Words that nothing has read, or of which not all can count, and ``why``."""

    words: str
    why: str


class Guidance(Frozen):
    """Requests of a sentence for one object. ``category`` is a row of the table of sizes, "*" where nothing names one,
    and ``category_from`` says what named it; ``called`` is what the first phrase calls the object, by the name that the
    table of supports has for it. ``free``: something is to move freely, so that gravity may take it from its state."""

    category: str = "*"
    category_from: str = ""
    called: str | None = None
    size: AskedSize = AskedSize()
    mass: AskedMass | None = None
    states: tuple[AskedState, ...] = ()
    motions: tuple[AskedMotion, ...] = ()
    materials: tuple[AskedMaterial, ...] = ()
    weights: tuple[AskedWeight, ...] = ()
    support: SupportProposal | None = None
    free: bool = False
    unmet: tuple[UnmetNumber, ...] = ()
    unread: tuple[Unread, ...] = ()
    contradictions: tuple[Unread, ...] = ()

    @property
    def of_joints(self) -> dict[str, AskedState]:
        """Joint → the state that is asked of it last, in the order in which joints are named first."""
        return {wish.joint: wish for wish in self.states if wish.joint is not None}

    @property
    def lacking(self) -> tuple[AskedState, ...]:
        """The states that are asked of parts that the object does not have."""
        return tuple(wish for wish in self.states if wish.joint is None)

    def scaled_to(self, scale: float) -> "Guidance":
        """The guidance with a scale as a number, unless the sentence has one."""
        if self.size.scale is not None:
            return self
        stated = AskedScale(words=f"{scale:.6f}", value=scale)
        return self.model_copy(update={"size": self.size.model_copy(update={"scale": stated})})


NOTHING_ASKED = Guidance()
"""The guidance of an empty sentence for an object of which nothing is known."""
