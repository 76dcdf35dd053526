"""State search: group penetrations by link pair, choose focus joints, propose poses along one joint, at
random and on a grid over two, accept only where Φ falls."""

import hashlib
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from asset2sim.engines.contacts import by_pair, penetration
from asset2sim.models.prompts import TriedProposal
from asset2sim.refinement.context import Log, trace_step
from asset2sim.refinement.position_bands import Band, Evaluator, Pose, moved_joints, objective
from schemas.features import JointFeatures
from schemas.finding import TraceStep
from schemas.interaction import ContactPair
from schemas.settings import SearchSettings

LINE = 24
"""Positions tried to each side along one joint's band: 10 % of a range in steps of 0.4 %."""
PERTURBATIONS = 48
"""Random poses tried around the best on stagnation."""
GRID = 13
"""Positions per joint of the systematic search over pairs of focus joints."""


def poses_along(best: Pose, joint: str, band: Band) -> Iterator[Pose]:
    """Poses that move one joint through its band, nearest to the requested position first."""
    offsets = np.linspace(0.0, 1.0, LINE + 1)[1:]
    yield {**best, joint: band.requested}
    for share in offsets:
        for end in (band.low, band.high):
            if end != band.requested:
                yield {**best, joint: band.requested + float(share) * (end - band.requested)}


def poses_around(best: Pose, focus: Sequence[str], bands: Mapping[str, Band], seed: int) -> Iterator[Pose]:
    """Seeded perturbations of the best pose over the focus joints: small ones first, up to the whole band."""
    random = np.random.default_rng(seed)
    for index in range(PERTURBATIONS):
        size = (index + 1) / PERTURBATIONS
        moved = dict(best)
        for name, step in zip(focus, random.uniform(-1.0, 1.0, len(focus)) * size, strict=True):
            moved[name] = bands[name].clamp(best[name] + float(step) * (bands[name].high - bands[name].low))
        yield moved


def pose_grid(best: Pose, focus: Sequence[str], bands: Mapping[str, Band]) -> Iterator[Pose]:
    """Every combination over each pair of focus joints' bands."""
    for first, second in itertools.combinations(focus, 2):
        for a in np.linspace(bands[first].low, bands[first].high, GRID):
            for b in np.linspace(bands[second].low, bands[second].high, GRID):
                yield {**best, first: float(a), second: float(b)}


def in_groups(
    best: Pose, focus: Sequence[str], bands: Mapping[str, Band], joints: Sequence[JointFeatures]
) -> Iterator[Pose]:
    """Every combination of two groups of joints, each at one share of its bands: those that hang from one link by axes
    parallel to a focus joint's. The flaps of a carton cannot all stand at one angle: one pair has to be lower."""
    groups = [alike_joints(joints, name, bands) for name in focus[:2]]
    if len(groups) < 2 or groups[0] == groups[1] or len(groups[0]) + len(groups[1]) < 3:
        return
    for shares in itertools.product(np.linspace(0.0, 1.0, GRID), repeat=2):
        moved = dict(best)
        for group, share in zip(groups, shares, strict=True):
            for name in group:
                band = bands[name]
                moved[name] = band.low + float(share) * (band.high - band.low)
        yield moved


def alike_joints(joints: Sequence[JointFeatures], name: str, bands: Mapping[str, Band]) -> frozenset[str]:
    """The joints with a band that hang from the same link as this one, by an axis parallel to its own; itself too."""
    own = next(joint for joint in joints if joint.name == name)
    return frozenset(
        joint.name
        for joint in joints
        if joint.name in bands
        and joint.parent == own.parent
        and abs(float(np.dot(joint.axis_in_root, own.axis_in_root))) > PARALLEL
    )


PARALLEL = 0.99
"""Cosine of the angle between two unit axes from which they are parallel."""
MOST = 4
"""Most joints searched at once: the joints nearest to a pair of links are the ones that separate it."""


def path_to_root(joints: Sequence[JointFeatures], link: str) -> list[str]:
    """The joints between a link and the root, nearest first."""
    above = {joint.child: joint for joint in joints}
    path: list[str] = []
    while link in above:
        path.append(above[link].name)
        link = above[link].parent
    return path


def focus_joints(
    joints: Sequence[JointFeatures], pairs: Sequence[ContactPair], movable: Sequence[str]
) -> tuple[str, ...]:
    """The movable joints on the tree path between the links of the worst pair that has any, nearest to the links first.

    Joints common to both links' paths to the root move both alike and cannot separate them.
    """
    for pair in pairs:
        first, second = path_to_root(joints, pair.link_a), path_to_root(joints, pair.link_b)
        between = [name for name in first if name not in second] + [name for name in second if name not in first]
        focus = [name for name in between if name in movable]
        if focus:
            return tuple(focus[:MOST])
    return ()


ROUNDS = 6
"""Rounds of line searches, each on the worst pair left; real objects rarely have more than three pairs."""
BISECTIONS = 6
"""Bisections of the way back to the requested position: 10 % of a range becomes 0.2 %."""
Ask = Callable[[Pose, tuple[str, ...], tuple[TriedProposal, ...]], Pose | None]
"""Asks a model for a pose: (best pose, focus joints, poses refused so far) → proposed pose within reach, or None."""


@dataclass
class Search:
    """State of one search: best pose so far, its Φ (m), and the log."""

    joints: Sequence[JointFeatures]
    bands: Mapping[str, Band]
    evaluator: Evaluator
    settings: SearchSettings
    seed: int
    best: Pose
    phi: float
    log: Log = field(default_factory=Log)

    @property
    def done(self) -> bool:
        """Whether Φ reached its target or the evaluation budget is spent."""
        return self.phi <= self.settings.target_phi_m or self.evaluator.spent

    def pairs(self) -> tuple[ContactPair, ...]:
        """Colliding pairs at the best pose, worst first."""
        return by_pair(self.evaluator.points(self.best))

    def record(self, proposer: str, pose: Pose, phi: float, evaluations: int, accepted: bool, reason: str) -> None:
        """Add a step to the trace; an accepted pose becomes the best one."""
        moved = moved_joints(pose, self.best)
        self.log.step(trace_step(proposer, self.phi, phi, accepted, reason, moved, evaluations))
        if accepted:
            self.best, self.phi = pose, phi

    def consider(self, proposer: str, poses: Iterator[Pose]) -> bool:
        """Try poses in order: accept the first that reaches the target, else the best objective. True if accepted."""
        before, chosen, chosen_phi = self.evaluator.evaluations, None, self.phi
        lowest = objective(self.phi, self.best, self.bands)
        for pose in poses:
            if self.evaluator.spent:
                break
            phi = self.evaluator.phi(pose)
            if phi <= self.settings.target_phi_m:
                chosen, chosen_phi = pose, phi
                break
            value = objective(phi, pose, self.bands)
            if phi < (1.0 - self.settings.least_gain) * self.phi and value < lowest:
                chosen, chosen_phi, lowest = pose, phi, value
        used = self.evaluator.evaluations - before
        if chosen is None:
            self.record(proposer, self.best, self.phi, used, False, "no proposal lowers Φ")
            return False
        self.record(proposer, chosen, chosen_phi, used, True, "Φ falls")
        return True


def refine_state(
    asset_id: str,
    joints: Sequence[JointFeatures],
    requested: Pose,
    bands: Mapping[str, Band],
    alternatives: Pose,
    evaluator: Evaluator,
    settings: SearchSettings,
    acceptable_m: float,
    ask: Ask | None = None,
) -> tuple[Pose, float, tuple[TraceStep, ...]]:
    """Pose with the lowest Φ found within the bands, its Φ (m), and the trace.

    Line searches first (one joint at a time through its band), then seeded perturbations, a grid, and joints in groups.
    ``alternatives`` maps joints without a requested state to another start position. A model is asked only while Φ is
    still above ``acceptable_m`` (m) after that, and its poses are accepted by the same rule.
    """
    start = penetration(evaluator.points(requested))
    search = Search(joints, bands, evaluator, settings, seed_of(asset_id), dict(requested), start)
    search.record("request", search.best, start, 1, True, "the requested state")
    search_focus(search)
    try_alternative_starts(search, alternatives)
    if ask is not None:
        ask_model(search, ask, acceptable_m)
    return search.best, search.phi, tuple(search.log.trace)


def seed_of(asset_id: str) -> int:
    """Seed of an asset's perturbations."""
    return int.from_bytes(hashlib.sha256(asset_id.encode()).digest()[:4], "big")


def ask_model(search: Search, ask: Ask, acceptable_m: float) -> None:
    """Accept a model's poses while they lower Φ; the next question lists refused poses with their Φ."""
    tried: list[TriedProposal] = []
    for _ in range(search.settings.max_model_calls):
        if search.done or search.phi <= acceptable_m:
            break
        focus = focus_joints(search.joints, search.pairs(), list(search.bands))
        proposed = ask(search.best, focus, tuple(tried)) if focus else None
        if proposed is None:
            break
        if search.consider("model", iter([proposed])):
            tried.clear()
            search_focus(search)
        else:
            tried.append(TriedProposal(proposed, search.evaluator.phi(proposed)))


def search_focus(search: Search) -> None:
    """Lower Φ pair by pair until it reaches its target or no proposal lowers it."""
    for _ in range(ROUNDS):
        if search.done:
            break
        focus = focus_joints(search.joints, search.pairs(), list(search.bands))
        if not focus:
            break
        lowered = False
        for name in focus:
            lowered |= not search.done and search.consider("line", poses_along(search.best, name, search.bands[name]))
        if search.done or lowered:
            continue
        if search.consider("perturbation", poses_around(search.best, focus, search.bands, search.seed)):
            continue
        if search.consider("grid", pose_grid(search.best, focus, search.bands)):
            continue
        together = list(in_groups(search.best, focus, search.bands, search.joints))
        if not together or not search.consider("groups", iter(together)):
            break
    if search.phi <= search.settings.target_phi_m:
        return_to_request(search)


def try_alternative_starts(search: Search, alternatives: Pose) -> None:
    """Try the alternative start positions of colliding joints, where that lowers Φ at once: first of those that are
    alike together, since one temple folded and one not is no state of glasses; then of each, then of all."""
    tried: set[str] = set()
    while not search.done:
        focus = focus_joints(search.joints, search.pairs(), list(search.bands))
        untried = [name for name in focus if name in alternatives and name not in tried]
        tried.update(untried)
        alike = [alike_joints(search.joints, name, search.bands) & {*untried} for name in untried]
        groups = [*(sorted(group) for group in dict.fromkeys(alike) if len(group) > 1), *([name] for name in untried)]
        groups += [untried] if len(untried) > 1 else []
        poses = [{**search.best, **{name: alternatives[name] for name in group}} for group in groups]
        if not poses or not search.consider("authored", iter(poses)):
            return


def return_to_request(search: Search) -> None:
    """Move each joint back towards its requested position by bisection while Φ stays within its target."""
    for name, band in search.bands.items():
        near, far = band.requested, search.best[name]
        if near == far or not band.low <= far <= band.high or search.evaluator.spent:
            continue
        before = search.evaluator.evaluations
        for _ in range(BISECTIONS):
            middle = (near + far) / 2.0
            good = search.evaluator.phi({**search.best, name: middle}) <= search.settings.target_phi_m
            near, far = (near, middle) if good else (middle, far)
        if far != search.best[name]:
            pose = {**search.best, name: far}
            phi = search.evaluator.phi(pose)
            used, kept = search.evaluator.evaluations - before, phi <= search.settings.target_phi_m
            search.record("return", pose, phi, used, kept, "nearer to the requested state")
