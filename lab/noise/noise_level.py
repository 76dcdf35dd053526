"""How large the errors of the simulated fallible model are, and why: fixed from the paper before any method was
compared with another.

**Scale.** Direct VLM is 35.0 ± 37.6 % off the experts' scale (paper, Table 1). For a log-normal factor with standard
deviation σ the mean of |f − 1| is exp(σ²/2)·(2Φ(σ) − 1), which is 0.350 at σ = 0.415 (its own standard deviation is
then 0.33). ``prior/household`` is itself 11 % off on those nine, which is σ = 0.137, and what is added here is
independent of that: √(0.415² − 0.137²) = 0.39.

**How much of an error is common to all answers about an object.** VLM-IVW, 25 answers, is 38.4 % off in scale and
Direct VLM, one answer, 35.0 %: nothing averages out, so nearly all of the variance is shared. A share of 0.9 would
bring 25 answers to √(0.9 + 0.1/25) = 0.95 of one answer's error, which nine objects cannot tell from what was measured
(the standard error of either mean is 12 %). Of joint positions 0.42 rad are left of 0.50: (0.42/0.50)² = s + (1 − s)/25
gives s = 0.69.

**State.** Direct VLM's alignment is 86.1 % and Asset2Sim's, whose scale is off by as much (32.7 %), 97.2 %: 11 points
less, of which the state is one half of the score, so between 11 % of the states (if the scale lost as many points) and
22 % (if it lost none) are wrong; 15 % here. Their joint positions are 0.50 and 0.40 rad off, 0.10 rad more, which is
what 15 % of states give that are wrong by 0.7 rad, as a slightly open lid counted from the other end is. The 15 % are
split over the errors that the paper's prompt warns of: the wrong end 8 %, the wrong part 4 %, degrees or millimetres
3 %. Not every such error shows: half open is the same from either end, an object with one joint has no other, zero is
zero in any unit. Over the 150 real objects 63, 36, 78 and 19 % of the errors put an asked state a quarter of its range
or more from where it was asked, and the chances are raised by that (13 % of the asked states then are wrong).

**Materials and dynamics.** The paper gives ranges; a model that knows no more is taken to fill one with four standard
deviations: ln(upper/lower)/4.

**Answers that do not fit.** Of the paper's 93 assets 80 were finished by all methods: 14 % were lost on the way for any
reason, and each structural slip is kept below that.

A level L multiplies every standard deviation, and an error of probability p happens with 1 − (1 − p)ᴸ: level 0 is
``prior/household`` itself, level 1 is the paper's model.
"""

import hashlib
import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

from pydantic import Field

from schemas.base import Fraction, Frozen, NonNegative
from schemas.errors import UnknownChoiceError
from schemas.model_names import HOUSEHOLD

NOISY = "prior/noisy"
NOISY_LABEL = "simulation of a fallible model"
"""Label for all numbers of such a model: they say nothing about any real model."""
MAX_LEVEL = 10.0
"""Largest error level: beyond it every answer is wrong in every way."""
NOISY_FORM = f"{NOISY}[@LEVEL[:SEED]] with LEVEL 0 to {MAX_LEVEL:g} (such as {NOISY}@2:7)"
"""Name of a simulated fallible model: its error level (1, the default, is the paper's) and its seed."""

_NOISY = re.compile(r"prior/noisy(?:@(\d{1,4}(?:\.\d{1,6})?)(?::(\d{1,9}))?)?")


class NoiseLevel(Frozen):
    """The size of every error. ``…_log`` is the standard deviation of a log-normal factor (no unit), ``p_…`` a
    probability."""

    scale_log: NonNegative = 0.39
    """Uniform scale; with ``prior/household``'s own error 35.0 % off the experts' (paper, Direct VLM)."""
    density_log: NonNegative = 0.27
    """Density of a link: the paper's metals have 2700 to 8000 kg/m³, ln(8000/2700)/4."""
    hollow_log: NonNegative = 0.40
    """Hollow factor of a link: solid to thin shell is 1 to 0.2, ln(5)/4."""
    mass_log: NonNegative = 0.48
    """A mass stated as such: density and hollow factor together, √(0.27² + 0.40²); a wrong scale enters cubed, as it
    does where a density is stated."""
    damping_log: NonNegative = 0.58
    """Damping, friction, and the times and distances that stand for them: the paper's ranges span a factor of ten,
    ln(10)/4."""
    stiffness_log: NonNegative = 0.58
    """Stiffness: the paper's range for sliders is 50 to 500 N/m, ln(10)/4; a spring's frequency and time go as its
    root."""
    position_share: NonNegative = 0.029
    """Standard deviation of a requested position as a share of the joint's range: "slightly open" is 10 to 20 % of it,
    0.1/√12."""
    step_log: NonNegative = 0.40
    """A refinement's step: the paper's steps are 5 to 25 % of the range, ln(5)/4."""
    sigma_log: NonNegative = 0.35
    """What a stated standard deviation is off by: one that is taken from five answers is 1/√8 off."""
    p_wrong_end: Fraction = 0.13
    """Closed is taken for open: the object's states and spring rests are mirrored in their joints' ranges."""
    p_wrong_part: Fraction = 0.11
    """A state, or else a spring, is given to another movable joint."""
    p_degrees: Fraction = 0.03
    """Hinge positions in degrees."""
    p_millimetres: Fraction = 0.02
    """Slider positions in millimetres: less often, since every other length in the prompt is in metres."""
    p_dropped_link: Fraction = 0.10
    """One link that has a mass to state is left out."""
    p_dropped_joint: Fraction = 0.10
    """One joint's entry is left out; its state stays."""
    p_malformed: Fraction = 0.10
    """The text is not plain JSON: cut short, fenced, with prose, with comments, or with a NaN, each as often. Two of
    the five leave nothing to read."""
    shared: Fraction = 0.9
    """Share of a number's variance that is common to every answer about the object."""
    shared_state: Fraction = 0.69
    """The same of the wrong end and the wrong part."""

    def at(self, level: float) -> "NoiseLevel":
        """The same model ``level`` times as fallible; the shares stay."""
        changes = {name: getattr(self, name) * level for name in _SPREADS}
        changes |= {name: -math.expm1(level * math.log1p(-min(getattr(self, name), _CERTAIN))) for name in _CHANCES}
        return self.model_copy(update=changes)


class Noise(Frozen):
    """Which simulated fallible model: its level, 1 being the paper's, and the seed of its errors."""

    level: float = Field(1.0, ge=0.0, le=MAX_LEVEL)
    seed: int = Field(0, ge=0)

    @property
    def sizes(self) -> NoiseLevel:
        """The sizes of its errors."""
        return NoiseLevel().at(self.level)


def is_noisy(model: str) -> bool:
    """Whether the model is a simulation of a fallible one; for any name, valid or not."""
    return model == NOISY or model.startswith(f"{NOISY}@")


def noise_of(model: str) -> Noise | None:
    """The errors of a model in this process; None for ``prior/household`` itself. Raises ``UnknownChoiceError`` for a
    name that is not of the form ``NOISY_FORM``."""
    if model == HOUSEHOLD:
        return None
    found = _NOISY.fullmatch(model)
    level = float(found.group(1) or 1.0) if found else MAX_LEVEL + 1.0
    if found is None or level > MAX_LEVEL:
        raise UnknownChoiceError("model", model, (HOUSEHOLD, NOISY_FORM))
    return Noise(level=level, seed=int(found.group(2) or 0))


_SPREADS = tuple(name for name in NoiseLevel.model_fields if name.endswith(("_log", "_share")))
_CHANCES = tuple(name for name in NoiseLevel.model_fields if name.startswith("p_"))
_CERTAIN = 1.0 - 1e-12
_NORMAL = NormalDist()
_DIGITS = 53
"""Bits of a hash that become a number in (0, 1): as many as a double holds."""


@dataclass(frozen=True)
class Draws:
    """Keys of one answer's draws: ``belief`` is the same in all answers about an object, ``slip`` is this one's own."""

    belief: str
    slip: str

    def normal(self, name: str, shared: float = 0.0) -> float:
        """A standard normal deviate; the share ``shared`` of its variance is common to all answers about the object."""
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
        """An index below ``count``, the same for all answers about the object where ``shared``."""
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
