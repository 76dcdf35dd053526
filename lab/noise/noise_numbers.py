"""Errors of size, mass and feel in an overlay, and of the standard deviations that a model states."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from asset2sim.guidance.object_info import JointInfo
from asset2sim.models.prior.link_proposals import LEAST_WALL_M, MIN_HOLLOW
from lab.noise.noise_level import Draws, NoiseLevel

SCALES = (1e-4, 1e4)
"""Bounds of a scale with its error: no model answers beyond them."""
_DAMPED = ("damping", "friction", "coast_s", "closes_s", "stops_within")
_SPRUNG = {"stiffness": 1.0, "press_start": 1.0, "press_end": 1.0, "spring_hz": 0.5, "returns_s": -0.5}
"""Fields that follow a spring's stiffness → the power of it to which they are proportional."""


def with_wrong_numbers(
    answer: dict[str, Any], links: Sequence[str], joints: Sequence[str], draws: Draws, sizes: NoiseLevel
) -> dict[str, Any]:
    """The answer with every positive number off by its log-normal factor, and without what it says of its own
    uncertainty; ``links`` and ``joints`` in prompt order."""
    growth = draws.factor("scale", sizes.scale_log, sizes.shared)
    scale = min(max(answer["scale"] * growth, SCALES[0]), SCALES[1])
    growth = scale / answer["scale"]
    return {key: value for key, value in answer.items() if key != "uncertainty" or not sizes.scale_log} | {
        "scale": scale,
        "links": [_link(entry, links, growth, draws, sizes) for entry in answer.get("links") or []],
        "joints": [_joint(entry, joints, draws, sizes) for entry in answer.get("joints") or []],
    }


def with_sigmas(
    answer: dict[str, Any], joints: Mapping[str, JointInfo], paths: Sequence[str], draws: Draws, sizes: NoiseLevel
) -> dict[str, Any]:
    """The answer with the standard deviations of its numbers at ``paths``: right on average, each a little off."""
    sigmas = {}
    for path in paths:
        found = _at(answer, path)
        spread = None if found is None else _spread(path, found, joints, sizes)
        if spread is not None:
            sigmas[path] = spread * draws.factor(f"sigma {path}", sizes.sigma_log)
    return answer | {"sigmas": sigmas}


def _link(
    entry: dict[str, Any], names: Sequence[str], growth: float, draws: Draws, sizes: NoiseLevel
) -> dict[str, Any]:
    key = f"link {_place(entry, names)}"
    density = draws.factor(f"{key} density", sizes.density_log, sizes.shared)
    hollow = draws.factor(f"{key} hollow", sizes.hollow_log, sizes.shared)
    mass = draws.factor(f"{key} mass", sizes.mass_log, sizes.shared) * growth**3
    changed = dict(entry)
    if entry.get("density_kg_m3") is not None:
        changed["density_kg_m3"] = entry["density_kg_m3"] * density
    if entry.get("hollow_factor") is not None:
        changed["hollow_factor"] = min(max(entry["hollow_factor"] * hollow, MIN_HOLLOW), 1.0)
    if entry.get("wall_m") is not None:
        changed["wall_m"] = max(entry["wall_m"] * hollow * growth, LEAST_WALL_M)
    if entry.get("contents"):
        # What is inside is guessed in kilograms, for the size that the object is taken to have.
        inside = density * hollow * growth**3
        changed["contents"] = [item | {"mass_kg": item["mass_kg"] * inside} for item in entry["contents"]]
    if entry.get("mass_kg") is not None:
        changed["mass_kg"] = entry["mass_kg"] * mass
    if entry.get("inertia") is not None:
        heavier = mass if entry.get("mass_kg") is not None else density * hollow * growth**3
        changed["inertia"] = [value * heavier * growth**2 for value in entry["inertia"]]
    if entry.get("com") is not None:
        changed["com"] = [value * growth for value in entry["com"]]
    return changed


def _joint(entry: dict[str, Any], names: Sequence[str], draws: Draws, sizes: NoiseLevel) -> dict[str, Any]:
    key = f"joint {_place(entry, names)}"
    stiffer = draws.normal(f"{key} spring", sizes.shared) * sizes.stiffness_log
    changed = dict(entry)
    for field in _DAMPED:
        if entry.get(field) is not None:
            changed[field] = entry[field] * draws.factor(f"{key} {field}", sizes.damping_log, sizes.shared)
    for field, power in _SPRUNG.items():
        if entry.get(field) is not None:
            changed[field] = entry[field] * math.exp(stiffer * power)
    return changed


def _place(entry: Mapping[str, Any], names: Sequence[str]) -> int:
    name = entry.get("name")
    return names.index(name) if name in names else -1


def _at(answer: Mapping[str, Any], path: str) -> float | None:
    """The number at a path of ``Overlay.sigmas``, or None where the answer has none."""
    head, _, rest = path.partition(".")
    if head == "scale":
        return float(answer["scale"])
    if head == "initial_joint_positions":
        found = answer.get(head, {}).get(rest)
    else:
        name, _, field = rest.rpartition(".")
        entries = answer.get(head) or []
        found = next((entry.get(field) for entry in entries if entry.get("name") == name), None)
        if field == "inertia" and found:
            found = max(found)  # one standard deviation stands for all six
    return float(found) if isinstance(found, int | float) and not isinstance(found, bool) else None


def _spread(path: str, value: float, joints: Mapping[str, JointInfo], sizes: NoiseLevel) -> float | None:
    """The standard deviation of the number at a path, in its unit; None where no error of it is simulated."""
    head, _, rest = path.partition(".")
    field = rest.rpartition(".")[2]
    if head == "initial_joint_positions" or field == "spring_rest":
        name = rest if head == "initial_joint_positions" else rest.rpartition(".")[0]
        return sizes.position_share * joints[name].range if name in joints else None
    if head == "scale":
        return sizes.scale_log * abs(value)
    logs = {
        "density_kg_m3": sizes.density_log,
        "hollow_factor": sizes.hollow_log,
        "wall_m": sizes.hollow_log,
        # A final mass goes with the cube of the size that is believed, an inertia with its fifth power.
        "mass_kg": math.hypot(sizes.mass_log, 3.0 * sizes.scale_log),
        "inertia": math.hypot(sizes.mass_log, 5.0 * sizes.scale_log),
    }
    logs |= dict.fromkeys(_DAMPED, sizes.damping_log)
    logs |= {name: sizes.stiffness_log * abs(power) for name, power in _SPRUNG.items()}
    return logs[field] * abs(value) if field in logs else None
