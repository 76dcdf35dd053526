"""Random draws without a generator: every one is a hash of what it is for, so that order and process do not matter."""

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

_NORMAL = NormalDist()
_DIGITS = 53
"""Bits of a hash that become a number in (0, 1): as many as a double holds."""


@dataclass(frozen=True)
class Draws:
    """What one answer draws: ``belief`` is the same for every answer about an object, ``slip`` is this answer's own."""

    belief: str
    slip: str

    def normal(self, name: str, shared: float = 0.0) -> float:
        """A standard normal deviate, of whose variance the share ``shared`` is the object's."""
        own = _NORMAL.inv_cdf(uniform(self.slip, name))
        common = _NORMAL.inv_cdf(uniform(self.belief, name))
        return math.sqrt(shared) * common + math.sqrt(1.0 - shared) * own

    def factor(self, name: str, spread: float, shared: float = 0.0) -> float:
        """A log-normal factor around 1."""
        return math.exp(spread * self.normal(name, shared))

    def happens(self, name: str, chance: float, shared: float = 0.0) -> bool:
        """Whether an error of that probability occurs; answers about one object agree by the share ``shared``."""
        return chance > 0.0 and _NORMAL.cdf(self.normal(name, shared)) < chance

    def index(self, name: str, count: int, shared: bool = False) -> int:
        """One of ``count`` things, the object's or this answer's own choice."""
        return min(int(uniform(self.belief if shared else self.slip, name) * count), count - 1)

    def share(self, name: str) -> float:
        """A number in (0, 1), this answer's own."""
        return uniform(self.slip, name)


def draws_for(information: Mapping[str, object], guidance: str, conversation: str, sample: int, seed: int) -> Draws:
    """The draws of one answer. Beliefs come from the object's shape and what is asked of it, not from its names, so
    that a method which withholds names meets the same beliefs; slips from all that was said, and from ``sample``."""
    return Draws(
        belief=_digest("belief", str(seed), _shape(information), guidance),
        slip=_digest("slip", str(seed), str(sample), conversation),
    )


def uniform(key: str, name: str) -> float:
    """A number in (0, 1) that depends on both texts alone."""
    digest = hashlib.sha256(f"{key}\0{name}".encode("utf-8", "replace")).digest()
    return ((int.from_bytes(digest[:8], "big") >> (64 - _DIGITS)) + 0.5) / 2.0**_DIGITS


def _shape(information: Mapping[str, object]) -> str:
    """The object by its numbers; where a prompt has none (refinement), by its id, else by its joints' ends."""
    links, joints = information.get("links"), information.get("joints")
    if not isinstance(links, list) or not isinstance(joints, list):
        focus = information.get("focus_joints")
        ends = [_only(joint, ("closed", "open")) for joint in focus] if isinstance(focus, list) else []
        return json.dumps(information.get("asset_id") or ends, sort_keys=True, default=str)
    known: Sequence[object] = [
        information.get("size_closed_m"),
        [_only(link, ("box_m", "volume_m3")) for link in links],
        [_only(joint, ("type", "lower", "upper")) for joint in joints],
    ]
    return json.dumps(known, sort_keys=True, default=str)


def _only(item: object, keys: Sequence[str]) -> list[object]:
    return [item.get(key) for key in keys] if isinstance(item, dict) else []


def _digest(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode("utf-8", "replace")).hexdigest()
