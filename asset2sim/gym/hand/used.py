"""The check ``used``: a hand opens and closes every part that a hand operates, honestly, or says whose fault it is."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

import numpy as np

from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.urdf.document import parsed_root
from asset2sim.checks.mechanism import alike_in_chains, written_tree
from asset2sim.gym.hand.gripper import HandWorld, open_world
from asset2sim.gym.hand.holds import way_of
from asset2sim.gym.hand.operate import Led, hand_limit, lead_joint
from schemas.hand_settings import HandSettings
from schemas.learning_settings import GuardSettings
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.support import SupportKind

FREE = "part that swings or rolls freely", "wheel"
BY_BODY = "gas spring", "foot pedal"
"""Kinds of effort (``efforts.csv``): limitless wheels and fans, bails, and what takes a person's weight."""
YIELDS = 1.0 / 3.0
"""Share of the guards' bounds from which an object that gives way is why a part was not moved."""
LEFT = 0.1
"""Share of its way that a part may go once it is let go of: the play of a catch, a gasket."""
RETURNED = 0.25
"""Share of its way that a sprung part may be left from where it came."""


@dataclass(frozen=True)
class UsedJoint:
    """One joint's use: whether it was opened and closed, by what, and else whose ``fault`` it is and why; what other
    joints did meanwhile; the first way's and the second's record."""

    joint: str
    done: bool
    by: str
    fault: str = ""
    reason: str = ""
    ways: tuple[Led, ...] = ()


@dataclass(eq=False)
class HandWorlds:
    """The worlds in which a hand uses one object, opened as needed, by the hand's scale and whether the other hand
    holds the object; and whether that ``moved`` along, tipped, lifted or shoved, in any try."""

    folder: Path
    settings: HandSettings
    moved: bool = False
    opened: dict[tuple[float, bool], HandWorld] = field(default_factory=dict)

    def get(self, scale: float, held: bool) -> HandWorld:
        """The world, as the object was written."""
        world = self.opened.get((scale, held))
        if world is None:
            world = self.opened[scale, held] = open_world(self.folder, self.settings, scale, held=held)
        return world


def no_task(joint: JointPhysics) -> str:
    """Why a joint is nothing that a hand operates: it rolls freely, a foot or a person's weight works it, or its ends
    are the same; empty where a hand does."""
    kind = "" if joint.effort_range is None else joint.effort_range.kind
    endless = joint.lower is None or joint.upper is None
    if kind in BY_BODY:
        return f"no hand works a {kind}"
    if kind in FREE and endless:
        return "it rolls or swings freely"
    return "" if endless or joint.closed != joint.open else "it is open where it is closed"


def joints_to_try(joints: Sequence[JointPhysics], most: int) -> list[JointPhysics]:
    """At most so many joints, spread over all."""
    if len(joints) <= most:
        return list(joints)
    return [joints[round(index)] for index in np.linspace(0, len(joints) - 1, most)]


def use_records(folder: Path, overlay: PhysicsOverlay, settings: HandSettings) -> list[UsedJoint]:
    """Every joint that a hand operates, used from the object's initial state, and each other with the task's fault."""
    worlds, reasons = HandWorlds(folder, settings), {joint.name: no_task(joint) for joint in overlay.joints}
    chains = alike_in_chains(written_tree(parsed_root(folder / URDF_NAME)), overlay.joints)
    before = {chain[-1]: chain[:-1] for chain in chains}
    for last, names in before.items():
        reasons |= {name: reasons[name] or f"it bends along with its chain, up to '{last}'" for name in names}
    operated = [joint for joint in overlay.joints if not reasons[joint.name]]
    tried = joints_to_try(operated, settings.most_joints)
    found = {joint.name: use_joint(worlds, joint, overlay) for joint in tried}
    for joint in tried:
        if not found[joint.name].done:
            sprung = [one for one in tried if one.stiffness > 0.0 and found[one.name].done]
            kept = use_kept_open(worlds, joint, overlay, sprung)
            found[joint.name] = kept or use_end(worlds, joint, overlay, before.get(joint.name, ())) or found[joint.name]
    not_asked = [UsedJoint(name, False, "", "task", reason) for name, reason in reasons.items() if reason]
    return [*found.values(), *not_asked]


def use_joint(worlds: HandWorlds, joint: JointPhysics, overlay: PhysicsOverlay) -> UsedJoint:
    """One joint used: by the hand or, for small parts or where that fails, the finger tips; and where the object moves
    along and is light, with the other hand on it."""
    settings = worlds.settings
    braced, steadied = other_hand(joint, overlay, settings)
    ways = product((True,) if braced else (False, True) if steadied else (False,), (1.0, settings.tip_scale))
    opened = {one.name: one.open for one in overlay.joints if one.holds and one is not joint}
    tries: list[tuple[bool, float, dict[str, float]]] = [(held, scale, {}) for held, scale in ways]
    tries += [(braced or steadied, scale, opened) for scale in (1.0, settings.tip_scale) if opened]
    best: UsedJoint | None = None
    for number, (held, scale, others) in enumerate(tries):
        shoved = steadied and best is not None and moves_along(best)  # held, it may go with what lies over it open
        if others and best is not None and best.fault == "object" and not (shoved or is_out_of_reach(best)):
            break
        last = best.ways[-1] if number > 1 and best is not None and best.ways else None
        if last is not None and (last.deeper_m > 0.0 or (joint.stiffness > 0.0 and last.in_the_way)):
            break  # a key that goes deeper than what is around it, for both tools
        if steadied and worlds.moved and not held:
            continue  # what moved along once is held from then on
        world = worlds.get(scale, held)
        world.reset(world.about.followed(others) if others else None)
        tools = ("gripper" if scale == 1.0 else "fingertips", "the other hand" if held else "")
        found = both_ways(world, joint, " and ".join(filter(None, tools)) + (", other parts open" if others else ""))
        worlds.moved = worlds.moved or moves_along(found)
        if found.done:
            return found
        if best is None or (share_done(found), found_holds(found)) > (share_done(best), found_holds(best)):
            best = found
    assert best is not None, "a hand has at least one way to try"
    return best


def moves_along(found: UsedJoint) -> bool:
    """Whether the object itself was tipped, lifted or shoved."""
    return any(led.guards is not None and led.guards.displaced for led in found.ways)


def is_out_of_reach(found: UsedJoint) -> bool:
    """Whether a part was not used since it lies inside others or is flush with them: once they are open it may be."""
    return bool(not found.done and found.ways and (found.ways[-1].covered or found.ways[-1].flush))


def other_hand(joint: JointPhysics, overlay: PhysicsOverlay, settings: HandSettings) -> tuple[bool, bool]:
    """Whether the other hand holds the object while this joint is used: always, or where the object moves along."""
    fixed = overlay.support.fixed
    braced = not fixed and (
        overlay.support.kind is SupportKind.HANDHELD or (joint.effort_range is not None and joint.effort_range.braced)
    )
    return braced, not fixed and not braced and overlay.mass_kg <= settings.steadied_kg


def use_kept_open(
    worlds: HandWorlds, joint: JointPhysics, overlay: PhysicsOverlay, sprung: Sequence[JointPhysics]
) -> UsedJoint | None:
    """One joint used while the other hand keeps the last of these ``sprung`` parts on which its part hangs open, with a
    hand's force at that part's edge, as a stapler's cover to draw the magazine out; None where that does not do it."""
    held = any(other_hand(joint, overlay, worlds.settings))
    for scale in (1.0, worlds.settings.tip_scale):
        world = worlds.get(scale, held)
        own, parts = (
            way_of(world, joint.name, joint.open),
            {one.name: way_of(world, one.name, one.open) for one in sprung},
        )
        bears = [one for one in sprung if one is not joint and own.bodies < parts[one.name].bodies]
        if not bears:
            return None
        kept = min(bears, key=lambda one: len(parts[one.name].bodies))
        world.reset(world.about.followed({kept.name: kept.open}))
        world.most_n = hand_force(kept, worlds.settings)
        world.keep(kept.name, hand_limit(world, way_of(world, kept.name, kept.open), "hook"))
        tool = "gripper" if scale == 1.0 else "fingertips"
        found = both_ways(world, joint, f"{tool} and the other hand, '{kept.name}' kept open")
        if found.done:
            return found
    return None


def use_end(
    worlds: HandWorlds, joint: JointPhysics, overlay: PhysicsOverlay, before: Sequence[str]
) -> UsedJoint | None:
    """The end of a chain, as of a hose, bent about its last joint while the other hand holds what is ``before`` it, no
    more firmly than a hand can; None where that does not do it, or nothing is before it."""
    for scale in (1.0, worlds.settings.tip_scale) if before else ():
        world = worlds.get(scale, any(other_hand(joint, overlay, worlds.settings)))
        world.reset()
        for name in before:
            world.keep(name, worlds.settings.torque_n_m)
        tool = "gripper" if scale == 1.0 else "fingertips"
        found = both_ways(world, joint, f"{tool} and the other hand, which holds the rest")
        if found.done:
            return found
    return None


def share_done(found: UsedJoint) -> float:
    """How much of both ways was done."""
    return round(sum(min(max(led.reached, 0.0), 1.0) for led in found.ways), 2)


def found_holds(found: UsedJoint) -> bool:
    """Whether a hold was found for the last way that was tried."""
    return bool(found.ways and found.ways[-1].holds)


def both_ways(world: HandWorld, joint: JointPhysics, by: str) -> UsedJoint:
    """The joint led to one end and back to the other: from nearer closed it is opened first."""
    low, high = shut_and_open(joint, world.settings)
    world.most_n = hand_force(joint, world.settings)
    here, before = world.position(joint.name), {one.name: world.position(one.name) for one in world.about.joints}
    first, second = (high, low) if abs(here - low) <= abs(here - high) else (low, high)
    about = next(item for item in world.about.joints if item.name == joint.name)
    near = None if about.pull is None else np.array(about.pull)
    ways: list[Led] = []
    aimed = high if joint.stiffness > 0.0 else low + world.settings.opened_share * (high - low)
    first, second = (aimed if end == high else end for end in (first, second))
    near_rest = abs(here - joint.spring_reference) <= world.settings.closed_share * abs(high - low)
    if joint.stiffness > 0.0 and near_rest and min(low, high) < joint.spring_reference < max(low, high):
        second = here  # a button between its ends: pressed, it comes back
    for target in (first, second):
        left = abs(world.position(joint.name) - target)
        if left <= world.settings.closed_share * abs(high - low):
            continue  # it is there: it went back by itself, or began there
        led = lead_joint(world, joint, target, near)
        ways.append(led)
        fault, reason = fault_of(led, joint, target == low, world.settings)
        if fault:
            verb = "shut" if target == low else "opened"
            said = "; ".join(filter(None, (f"not {verb}: {reason}", moved_meanwhile(world, joint.name, before))))
            return UsedJoint(joint.name, False, by, fault, said, tuple(ways))
    return UsedJoint(joint.name, True, by, reason=moved_meanwhile(world, joint.name, before), ways=tuple(ways))


def moved_meanwhile(world: HandWorld, joint: str, before: Mapping[str, float]) -> str:
    """The other joints than the one used, and those that follow it, in words: those that rest more than ``LEFT`` of
    their range away from where they were ``before``, rad or m; empty where none does."""
    follow, said = world.about.followed({joint: 0.0}), list[str]()
    for one in world.about.joints:
        if one.name in follow or one.lower is None or one.upper is None or one.upper <= one.lower:
            continue
        share = abs(world.position(one.name) - before[one.name]) / (one.upper - one.lower)
        if share > LEFT and (one.mimic is None or one.mimic[0] not in follow):
            said.append(f"meanwhile '{one.name}' goes {share:.0%} of its range")
    return "; ".join(said)


def shut_and_open(joint: JointPhysics, settings: HandSettings) -> tuple[float, float]:
    """Where it is shut and open, rad or m: of what has no limits, or goes on for more than a turn, as screws and reels,
    where it is and a quarter of a turn on."""
    first, turned = joint.initial_position, settings.turned_rad
    if joint.lower is None or joint.upper is None:
        return first, first + turned
    if joint.type != "prismatic" and joint.upper - joint.lower > 2.0 * math.pi + 0.01:
        return first, first + (turned if first + turned <= joint.upper else -turned)
    return joint.closed, joint.open


def fault_of(led: Led, joint: JointPhysics, shut: bool, settings: HandSettings) -> tuple[str, str]:
    """Whose fault it is that a way was not done, and why; empty where it was."""
    guards = led.guards
    if guards is None:
        return "object", "it flew away"
    enough = 1.0 - settings.closed_share if shut else settings.open_share
    level = joint.type == "prismatic" and abs(joint.gravity_load) <= joint.friction  # it may roll, but nothing moves it
    stays = (joint.holds or level) and joint.stiffness == 0.0 and not led.up
    by_hand = joint.stiffness == 0.0 and not led.up  # what no spring moves is moved by the hand, or falls
    falls = (shut or not joint.holds) and not guards.moved_untouched  # a bail led over its top, a lid that drops
    done = led.reached >= enough or (falls and led.rested >= enough)
    limits, most = GuardSettings(), 1.0 if done else YIELDS
    most_n = hand_force(joint, settings)
    went, rests = f"it went {led.reached:.0%} of its way", f"{led.rested:.0%} of its way"
    deeper = f"it goes {led.deeper_m * 1e3:.1f} mm deeper than it stands out of what is around it"
    drifts, untouched = stays and guards.drifted, f"{guards.drift_share:.0%} of its way"
    sprung_away = joint.stiffness > 0.0 and RETURNED < led.rested < enough - LEFT
    faults = (
        (led.deeper_m > 0.0 and not done, "object", f"{deeper}; {went}"),
        (guards.tilted_rad > most * limits.tilt_rad, "object", f"it tips by {math.degrees(guards.tilted_rad):.0f}°"),
        (guards.lifted_m > most * limits.lift_m, "object", f"it is lifted by {guards.lifted_m * 100.0:.0f} cm"),
        (guards.travelled_m > most * limits.travel_m, "object", f"it is shoved by {guards.travelled_m * 100.0:.0f} cm"),
        (drifts and (done or not led.in_the_way), "object", f"it goes {untouched} before it is touched"),
        (led.contact_n > settings.pressed_n, "hand", f"a finger presses with {led.contact_n:.0f} N"),
        (led.covered and not done, "object", "it lies inside its other parts, where no hand gets to it"),
        (led.flush and not done, "object", "it is flush with what is around it: nothing on it can be held"),
        (not led.holds and not done, "hand", "no hold was found at which a hand has room"),
        (not done and led.takes > 1.0, "object", f"it takes {led.takes:.1f} times a hand's {most_n:g} N; {went}"),
        (not done and led.in_the_way, "hand", f"other parts stop it; {went}"),
        (not done, "hand", f"it slipped off or stuck; {went}"),
        (by_hand and guards.moved_untouched, "hand", f"it runs ahead for {guards.untouched_share:.0%} of its way"),
        (guards.struck, "hand", f"it is struck: {guards.struck_share:.0%} of its way is faster than a hand"),
        (stays and led.rested < enough - LEFT, "object", f"left alone, it rests at {rests}"),
        (sprung_away, "object", f"its spring leaves it at {rests}"),
    )
    return next(((fault, reason) for true, fault, reason in faults if true), ("", ""))


def hand_force(joint: JointPhysics, settings: HandSettings) -> float:
    """The most force that a hand uses on a joint, N: what parts of its kind may take, within a hand's."""
    known = settings.force_n if joint.effort_range is None else joint.effort_range.most_n
    return min(max(known, settings.force_n), settings.most_n)
