"""Text of the page on joints, assets and live numbers, in the units and words of people."""

import getpass
import math
from collections.abc import Mapping, Sequence

from asset2sim.viewer.live_object import Readings
from asset2sim.viewer.viewed_object import Movable
from asset2sim.viewer.walk import Stop

FASTEST = 3
"""Joints whose speed is shown, the fastest."""


def range_ends(joint: Movable) -> tuple[float, float]:
    """Its range, rad or m."""
    return joint.lower, joint.upper


def shown_position(joint: Movable, position: float | None = None) -> float:
    """A position (or its start), rad or m, as people read it: degrees or cm."""
    value = joint.start if position is None else position
    return 100.0 * value if joint.slides else math.degrees(value)


def labels(joints: Sequence[Movable]) -> dict[str, str]:
    """Joint → its label with its unit; with the joint's name where two have the same label."""
    said = [joint.label for joint in joints]
    return {
        joint.name: (joint.label if said.count(joint.label) == 1 else f"{joint.label} {joint.name}")
        + (", cm" if joint.slides else ", °")
        for joint in joints
    }


def asset_choice(stop: Stop) -> str:
    """An asset in the list."""
    return f"{stop.asset_id} {stop.category}" + (f", {stop.failure_mode}" if stop.failed else "")


def table(readings: Mapping[str, Readings], names: Mapping[str, str], pace: float) -> str:
    """The live numbers in Markdown, a column an object; ``names`` of joints with the unit of their speeds."""
    rows = [
        ("Φ, mm", [f"{1000.0 * item.phi_m:.2f}" for item in readings.values()]),
        ("kinetic energy, mJ", [f"{1000.0 * item.kinetic_j:.2f}" for item in readings.values()]),
        ("hand, N", [f"{item.hand_n:.1f}" for item in readings.values()]),
    ]
    first = next(iter(readings.values()))
    fastest = sorted(first.speeds, key=lambda name: -abs(first.speeds[name]))[:FASTEST]
    for name in sorted(fastest):
        speeds = [
            f"{round(item.speeds[name], 3) + 0.0:.3f}" if name in item.speeds else "–" for item in readings.values()
        ]
        rows.append((escaped(names.get(name, name)), speeds))
    head = f"| | {' | '.join(readings)} |\n|---|{'---:|' * len(readings)}\n"
    slow = "" if pace > 0.9 else f"\n\n*{pace:.2f} of real time*"
    return head + "\n".join(f"| {name} | {' | '.join(values)} |" for name, values in rows) + slow


def escaped(text: str) -> str:
    """Text from a dataset, so that it means nothing in Markdown."""
    return "".join(f"\\{char}" if char in "\\`*_{}[]<>#|~$" else char for char in text)


def user_name() -> str:
    """Who reviews: the user of this machine."""
    try:
        return getpass.getuser()
    except (OSError, KeyError):  # a container may have users without names
        return "unknown"
