"""A scripted model that is right but for planted mistakes, and reconsiders when it is told what they come to.

What is right is not ours: of each object it knows what the dataset's expectations accept (the middle of a range), which
careful readers wrote before any result; the rest of its answer is ``prior/household``'s. It makes the mistakes that
were measured on a real one (``shared/vlm_answers``): sizes by toy rules, a lid that is asked open and does not hold, a
state read as a share of the whole travel or as another word, degrees.

Asked again, it decides by the consequences alone, of which it reads nothing but the thing that each names: a mistake
in a thing that is named it mends with probability ``mends``; what is named and right it spoils with probability
``spoils`` (a size half way to the smaller or larger side that the words suggest, a joint half way to closed). All draws
are hashes of asset, thing and seed.
"""

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from asset2sim.models.prior.answer import answer
from lab.noise.noise_level import uniform
from schemas.alignment import SIZE, Expectation
from tests.model_server import Reply
from tests.scripted_server import Asked, information

TOY = 0.4
"""What the measured sizes were of what was expected: 7 to 10 cm where 12 to 35 cm are."""
CM_PER_M = 100.0
LEVEL = 0.5
"""Upright part of a hinge's axis below which its part goes up and down."""
SPOILT = 1.5
"""Factor by which a right size is moved in the direction that a consequence suggests."""


@dataclass
class MistakenModel:
    """Answers the synthesis prompt; ``share`` of the objects have a planted mistake in each thing that allows one.
    ``planted`` is asset → thing → kind of mistake, ``asked`` asset → questions."""

    expected: Mapping[str, Sequence[Expectation]]
    share: float = 0.2
    mends: float = 0.75
    spoils: float = 0.25
    seed: int = 0
    planted: dict[str, dict[str, str]] = field(default_factory=dict)
    asked: dict[str, int] = field(default_factory=dict)

    def __call__(self, question: Asked) -> Reply:
        """The answer to one request."""
        self.asked[question.asset_id] = self.asked.get(question.asset_id, 0) + 1
        facts, own = information(question.text), self.expected.get(question.asset_id, ())
        right = truth(json.loads(answer(question.text)), facts, own)
        mistakes = self.planted.setdefault(question.asset_id, self._plant(question.asset_id, facts, own))
        told = consequences(question.text)
        things = ("scale", *right["initial_joint_positions"])
        named = {thing: text for text in told for thing in things if re.search(rf"\b{re.escape(thing)}\b", text)}
        said = right
        for thing, kind in mistakes.items():
            if thing not in named or self._draw(question.asset_id, f"mends {thing}") >= self.mends:
                said = with_mistake(said, thing, kind, facts)
        for thing, text in named.items():
            if thing not in mistakes and self._draw(question.asset_id, f"spoils {thing}") < self.spoils:
                said = spoilt(said, thing, text, facts)
        return Reply(json.dumps(said))

    def _plant(self, asset_id: str, facts: Mapping[str, Any], own: Sequence[Expectation]) -> dict[str, str]:
        found = {}
        for item in own:
            thing = "scale" if item.what == SIZE else item.what
            kinds = ["toy"] if item.what == SIZE else [k for k in JOINT_MISTAKES if is_mistake(k, item, facts)]
            if kinds and item.ranges and self._draw(asset_id, f"plant {thing}") < self.share:
                # The mistake that only a simulator shows, half of the time where it can be made.
                falls = "falls" in kinds and self._draw(asset_id, f"falls {thing}") < 0.5
                found[thing] = "falls" if falls else kinds[int(self._draw(asset_id, f"kind {thing}") * len(kinds))]
        return found

    def _draw(self, asset_id: str, name: str) -> float:
        return uniform(f"{self.seed} {asset_id}", name)


JOINT_MISTAKES = ("falls", "whole travel", "another word", "degrees")


def truth(base: dict[str, Any], facts: Mapping[str, Any], own: Sequence[Expectation]) -> dict[str, Any]:
    """The prior's answer with size and positions in the middle of what is expected; what is asked to stay holds."""
    longest, positions, entries = max(facts["size_closed_m"]), {}, {item["name"]: item for item in base["joints"]}
    for item in own:
        if item.what == SIZE:
            low, high = item.ranges[0]
            base["scale"] = math.sqrt(low * high) / CM_PER_M / longest
        elif item.ranges:
            positions[item.what] = sum(item.ranges[0]) / 2.0
            entries.setdefault(item.what, {"name": item.what})["holds"] = not item.swings
    asked = [*(["scale"] if "scale" in base["asked"] else []), *positions]
    return base | {"initial_joint_positions": positions, "joints": list(entries.values()), "asked": asked}


def mistaken_position(kind: str, item: Expectation, joint: Mapping[str, Any]) -> float:
    """Where a mistake of a kind puts a joint."""
    middle, closed, opened = sum(item.ranges[0]) / 2.0, float(joint["closed"]), float(joint["open"])
    return {
        "whole travel": closed + 0.2 * (opened - closed),
        "another word": closed + (opened - closed if abs(middle - closed) < 0.5 * abs(opened - closed) else 0.0),
        "degrees": math.degrees(middle),
    }.get(kind, middle)


def is_mistake(kind: str, item: Expectation, facts: Mapping[str, Any]) -> bool:
    """Whether a mistake of this kind in this joint is one: it is outside what is expected, and not a slip that shows
    nowhere."""
    joint = next((entry for entry in facts["joints"] if entry["name"] == item.what), None)
    if joint is None or not item.ranges or item.swings or joint["closed"] == joint["open"]:
        return False
    at, middle = mistaken_position(kind, item, joint), sum(item.ranges[0]) / 2.0
    ajar = abs(middle - joint["closed"]) > 0.05 * abs(joint["open"] - joint["closed"])
    if kind == "falls":  # of what gravity moves, and no stop carries
        away = abs(middle - joint["open"]) > 0.05 * abs(joint["open"] - joint["closed"])
        return bool(joint["type"] == "revolute" and ajar and away and abs(joint["axis"][2]) < LEVEL)
    if kind == "degrees":
        return bool(joint["type"] == "revolute" and ajar)
    return not any(low <= at <= high for low, high in item.ranges) and (kind != "whole travel" or ajar)


def with_mistake(said: dict[str, Any], thing: str, kind: str, facts: Mapping[str, Any]) -> dict[str, Any]:
    """The answer with one mistake."""
    if kind == "toy":
        return said | {"scale": TOY * said["scale"]}
    if kind == "falls":
        return said | {
            "joints": [item | {"holds": False} if item["name"] == thing else item for item in said["joints"]]
        }
    joint = next(entry for entry in facts["joints"] if entry["name"] == thing)
    at = said["initial_joint_positions"][thing]
    wrong = mistaken_position(kind, Expectation(what=thing, ranges=((at, at),)), joint)
    return said | {"initial_joint_positions": said["initial_joint_positions"] | {thing: wrong}}


def spoilt(said: dict[str, Any], thing: str, text: str, facts: Mapping[str, Any]) -> dict[str, Any]:
    """The answer, swayed by a consequence of what was right."""
    if thing == "scale":
        return said | {"scale": said["scale"] * (SPOILT if "small" in text else 1.0 / SPOILT)}
    joint = next(entry for entry in facts["joints"] if entry["name"] == thing)
    at = (said["initial_joint_positions"][thing] + joint["closed"]) / 2.0
    return said | {"initial_joint_positions": said["initial_joint_positions"] | {thing: at}}


def consequences(text: str) -> list[str]:
    """What a question says that an answer comes to; empty for a first question."""
    if "<consequences>" not in text:
        return []
    told: list[str] = json.loads(text.split("<consequences>")[1].split("</consequences>")[0])
    return told
