"""Fuse several answers: numbers by inverse-variance weighting, other fields by weighted vote (paper, VLM-IVW)."""

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean, median
from typing import TypeVar

from schemas.overlay import JointProposal, LinkProposal, Overlay
from schemas.support import SupportProposal

LINK_NUMBERS = ("density_kg_m3", "hollow_factor", "wall_m", "mass_kg")
LINK_VECTORS = ("com", "inertia")
"""Vector fields, fused by component with one weight from the field's one sigma: a positive sum of positive
semi-definite inertias is positive semi-definite."""
JOINT_NUMBERS = (
    "damping", "friction", "stiffness", "coast_s", "spring_hz", "press_start", "press_end", "closes_s", "stops_within",
    "returns_s",
)  # fmt: skip
JOINT_CLAIMS = ("spring_rest",)
"""Numbers whose absence is itself an answer (there is no spring): a vote decides whether there is one."""
JOINT_KINDS = ("holds", "damping_level")

Numbers = tuple[float, ...]
_Kind = TypeVar("_Kind", bound=Hashable)
_Part = TypeVar("_Part", LinkProposal, JointProposal)


@dataclass(frozen=True)
class FusedNumber:
    """One parameter over all answers that state it: answer index → value (components), and → sigma or None."""

    values: Mapping[int, Numbers]
    sigmas: Mapping[int, float | None]

    @property
    def weights(self) -> dict[int, float]:
        """Answer index → normalized weight; the weights sum to 1."""
        indices = list(self.values)
        weights = inverse_variances([self.sigmas[index] for index in indices])
        return dict(zip(indices, weights, strict=True))

    @property
    def mean(self) -> Numbers:
        """θ = Σ θᵢ/σᵢ² / Σ 1/σᵢ² of every component."""
        weights = self.weights
        columns = zip(*(self.values[index] for index in weights), strict=True)
        return tuple(weighted_mean(column, list(weights.values())) for column in columns)


def weighted_mean(values: Sequence[float], weights: Sequence[float]) -> float:
    """Σ wᵢ xᵢ for weights that sum to 1, clamped to the range of the values against rounding."""
    mean = sum(weight * value for weight, value in zip(weights, values, strict=True))
    return min(max(mean, min(values)), max(values))


def inverse_variances(sigmas: Sequence[float | None]) -> list[float]:
    """Normalized weights 1/σ² of the answers. A missing or zero sigma counts as the median of the others; without any
    sigma all weights are equal."""
    stated = [sigma for sigma in sigmas if sigma]
    usual = median(stated) if stated else 1.0
    # Relative to the smallest, so that squares neither overflow nor vanish.
    filled = [sigma or usual for sigma in sigmas]
    least = min(filled)
    weights = [(least / sigma) ** 2 for sigma in filled]
    return [weight / sum(weights) for weight in weights]


def fuse(answers: Sequence[Overlay]) -> Overlay:
    """One overlay from several; raises ValueError for an empty sequence.

    A number is fused over the answers that state it. Where absence is itself an answer (a requested state, the rest
    position of a spring, what came from the user), answers that state it must outweigh those that do not. An answer's
    weight in votes is its mean weight over the numbers that it states: smaller sigmas count more, and without sigmas
    all count the same. Of equal votes the first answer's wins.
    """
    if not answers:
        raise ValueError("there is no answer to fuse")
    given = numbers_of(answers)
    votes = vote_weights(given, len(answers))
    means = {path: item.mean for path, item in given.items()}
    return Overlay(
        scale=means["scale"][0],
        contact_material=vote([answer.contact_material for answer in answers], votes),
        support=voted_support(answers, votes),
        links=tuple(
            fused_link(name, [_part(answer.links, name) for answer in answers], means, votes)
            for name in _names(answer.links for answer in answers)
        ),
        joints=tuple(
            fused_joint(name, [_part(answer.joints, name) for answer in answers], means, votes)
            for name in _names(answer.joints for answer in answers)
        ),
        initial_joint_positions={
            name: means[f"initial_joint_positions.{name}"][0]
            for name in _unique(name for answer in answers for name in answer.initial_joint_positions)
            if carried([name in answer.initial_joint_positions for answer in answers], votes)
        },
        asked=tuple(
            name
            for name in _unique(name for answer in answers for name in answer.asked)
            if carried([name in answer.asked for answer in answers], votes)
        ),
        notes=(f"fused from {len(answers)} answers by inverse variance",),
    )


def voted_support(answers: Sequence[Overlay], votes: Sequence[float]) -> SupportProposal | None:
    """The support by vote: that of the first answer which says the kind with the most weight."""
    kind = vote([None if answer.support is None else answer.support.kind for answer in answers], votes)
    stated = (answer.support for answer in answers if answer.support is not None)
    return next((support for support in stated if support.kind is kind), None)


def fused_numbers(path: str, fields: Iterable[str], means: Mapping[str, Numbers]) -> dict[str, object]:
    """Field → fused number, or vector, of the part at a path; fields that no answer states are left out."""
    found = {field: means[f"{path}.{field}"] for field in fields if f"{path}.{field}" in means}
    return {field: mean if field in LINK_VECTORS else mean[0] for field, mean in found.items()}


def fused_link(
    name: str, parts: Sequence[LinkProposal | None], means: Mapping[str, Numbers], votes: Sequence[float]
) -> LinkProposal:
    """One link: fused numbers and vectors; the material by vote among the answers that name one."""
    numbers = fused_numbers(f"links.{name}", (*LINK_NUMBERS, *LINK_VECTORS), means)
    material = vote_of_stated([None if part is None else part.material for part in parts], votes)
    return LinkProposal.model_validate({"name": name, "material": material} | numbers)


def fused_joint(
    name: str, parts: Sequence[JointProposal | None], means: Mapping[str, Numbers], votes: Sequence[float]
) -> JointProposal:
    """One joint: fused numbers, ``holds`` by vote of all answers, a spring's rest position where most state one."""
    claims = [
        field for field in JOINT_CLAIMS if carried([getattr(part, field, None) is not None for part in parts], votes)
    ]
    numbers = fused_numbers(f"joints.{name}", (*JOINT_NUMBERS, *claims), means)
    kinds = {field: vote([getattr(part, field, None) for part in parts], votes) for field in JOINT_KINDS}
    return JointProposal.model_validate({"name": name} | kinds | numbers)


def numbers_of(answers: Sequence[Overlay]) -> dict[str, FusedNumber]:
    """Path (as in ``Overlay.sigmas``) → its value in every answer that states it."""
    values: dict[str, dict[int, Numbers]] = {}
    sigmas: dict[str, dict[int, float | None]] = {}
    for index, answer in enumerate(answers):
        for path, value in stated_numbers(answer).items():
            values.setdefault(path, {})[index] = value
            sigmas.setdefault(path, {})[index] = answer.sigmas.get(path)
    return {path: FusedNumber(values[path], sigmas[path]) for path in values}


def stated_numbers(answer: Overlay) -> dict[str, Numbers]:
    """Path → value of every number that one answer states."""
    found: dict[str, Numbers] = {"scale": (answer.scale,)}
    for kind, parts, fields in (
        ("links", answer.links, (*LINK_NUMBERS, *LINK_VECTORS)),
        ("joints", answer.joints, (*JOINT_NUMBERS, *JOINT_CLAIMS)),
    ):
        for part in parts:
            for field in fields:
                value = getattr(part, field)
                if value is not None:
                    found[f"{kind}.{part.name}.{field}"] = value if isinstance(value, tuple) else (value,)
    for name, position in answer.initial_joint_positions.items():
        found[f"initial_joint_positions.{name}"] = (position,)
    return found


def vote_weights(given: Mapping[str, FusedNumber], answers: int) -> list[float]:
    """(answers,) weight of each answer in votes, summing to 1: its mean weight over the numbers that it states.

    A weight counts relative to an equal share, so that a number stated by few answers does not favour them.
    """
    shares: list[list[float]] = [[] for _ in range(answers)]
    for item in given.values():
        weights = item.weights
        for index, weight in weights.items():
            shares[index].append(weight * len(weights))
    means = [fmean(share) for share in shares]
    return [mean / sum(means) for mean in means]


def vote(kinds: Sequence[_Kind], votes: Sequence[float]) -> _Kind:
    """The value with the most weight; of equals the first."""
    weight: dict[_Kind, float] = {}
    for kind, share in zip(kinds, votes, strict=True):
        weight[kind] = weight.get(kind, 0.0) + share
    return max(weight, key=lambda kind: round(weight[kind], 12))


def vote_of_stated(kinds: Sequence[_Kind | None], votes: Sequence[float]) -> _Kind | None:
    """``vote`` among the answers that are not None; None where there is none."""
    stated = [(kind, share) for kind, share in zip(kinds, votes, strict=True) if kind is not None]
    return vote([kind for kind, _ in stated], [share for _, share in stated]) if stated else None


def carried(held: Sequence[bool], votes: Sequence[float]) -> bool:
    """Whether the answers with True have more than half of the votes."""
    return round(sum(share for yes, share in zip(held, votes, strict=True) if yes), 12) > 0.5


def _names(parts: Iterable[Sequence[_Part]]) -> list[str]:
    return _unique(part.name for group in parts for part in group)


def _unique(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))


def _part(parts: Sequence[_Part], name: str) -> _Part | None:
    return next((part for part in parts if part.name == name), None)
