"""Side on which an object that is put down on any side lies, where it stands on no more than an edge as authored."""

import math

import numpy as np

from asset2sim.assets.extract import Extraction
from asset2sim.guidance.parts import part_name
from asset2sim.guidance.tables import sizes
from asset2sim.intake.up_axis import AXES
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import apply, link_to_root, rigid_links, tree_of
from asset2sim.physics.mass_matrix import GRAVITY_M_S2, Body, bodies_of
from asset2sim.physics.support_polygon import LEANING_RAD, STANDING_M, SupportPolygon, leaning_on
from asset2sim.validation.support import FIRM_RAD
from schemas.features import Features
from schemas.finding import Finding
from schemas.overlay import PhysicsOverlay
from schemas.support import SupportKind
from schemas.thresholds import Thresholds
from schemas.vocabulary import Severity, Stage, UpAxis

TWO_HANDS_M = 0.5
"""Longest edge, m, of what one puts down as it comes to rest, where no table knows it."""
STANDING_PARTS = {"drawer", "door"}
"""Parts of furniture and appliances, which stand as they are drawn."""
AS_AUTHORED_RAD = 0.35
"""Lean, rad, up to which an object rests nearly as authored: 20 degrees, as on an uneven underside or on its arms."""
LEAST_HEIGHTS = 1.8
"""Least height of the centre of mass over a side, over the height within which points stand on the floor."""
FIRMER = 0.5
"""Weight of the logarithm of a side's energy to tip over beside the cosine of how far moving parts are on top: of a
knife's flanks and its spine, which takes an eighth of the energy, a flank; of a case's two flat sides its base."""


def is_laid_down(features: Features, overlay: PhysicsOverlay) -> bool:
    """Whether such things are put down on whatever side they come to rest: what a hand holds, what the table says, and
    what it does not know and two hands can put down, unless it has parts of furniture."""
    known = sizes().get(features.category)
    if overlay.support.kind is SupportKind.HANDHELD or (known is not None and known.lies):
        return True
    parts = {part_name(features.link(j.child).label, j.child, j.name) for j in features.movable_joints}
    return known is None and overlay.scale * max(features.rest_size) <= TWO_HANDS_M and not parts & STANDING_PARTS


def is_firm(support: SupportPolygon, limits: Thresholds) -> bool:
    """Whether a thing of the hand stands so that it may be used there: by far more than it must, or than a touch."""
    return support.margin_rad >= FIRM_RAD or tip_energy_j(support) >= limits.touch_j


def tip_energy_j(support: SupportPolygon) -> float:
    """Energy that tips the object over its nearest edge, J."""
    return support.mass * GRAVITY_M_S2 * support.rise


def lying_side(extraction: Extraction, overlay: PhysicsOverlay, limits: Thresholds) -> tuple[UpAxis, Finding | None]:
    """The axis that points up as the object is put down in the state asked of it, and a finding where that is not z.

    As authored where it is no thing to lay down, or stands firmly. Else a side that bears it firmly, the firmer the
    better, and best with its moving parts, closed, on top: a suitcase's lid above its base, a remote's keys.
    """
    features = extraction.features
    if overlay.support.fixed or not is_laid_down(features, overlay):
        return UpAxis.Z, None
    tree, scale = tree_of(features.joints, overlay.scale), overlay.scale
    bodies = bodies_of(overlay)
    poses = link_to_root(tree, features.root, overlay.initial_positions)
    clouds = [apply(poses[n], item.points * scale) for n, item in extraction.geometry.items() if len(item.points)]
    if not clouds:
        return UpAxis.Z, None
    moved = {link for joint in features.movable_joints for link in rigid_links(tree, joint.name)}
    closed = link_to_root(tree, features.root, {joint.name: joint.closed for joint in overlay.all_joints})
    still = [name for name in bodies if name not in moved]
    reach = center_of(closed, bodies, list(moved)) - center_of(closed, bodies, still)
    reach /= max(float(np.linalg.norm(reach)), 1e-9)
    mass = sum(body.mass for body in bodies.values())
    center = center_of(poses, bodies, list(bodies))
    points, leans = np.vstack(clouds), {UpAxis.Z: AS_AUTHORED_RAD}
    sides = {
        up: leaning_on(points, center, mass, np.array(axis), leans.get(up, LEANING_RAD)) for up, axis in AXES.items()
    }
    firm = {up: side for up, side in sides.items() if is_firm(side, limits)}
    # Of what is thin as a pen, feet within ``STANDING_M`` are its whole round: it is written as it rolls.
    firm = {up: side for up, side in firm.items() if up is UpAxis.Z or side.height >= LEAST_HEIGHTS * STANDING_M}
    if UpAxis.Z in firm or not firm:
        return UpAxis.Z, None

    def preferred(up: UpAxis) -> float:
        return float(reach @ np.array(AXES[up])) + FIRMER * math.log(tip_energy_j(firm[up]))

    best, before = max(firm, key=preferred), sides[UpAxis.Z]
    after = firm[best]
    message = (
        f"as authored it tips over at {np.degrees(before.margin_rad):.2g}° ({tip_energy_j(before):.2g} J) in the state "
        f"asked of it; it is laid down with its {best} up, where it stands by {np.degrees(after.margin_rad):.0f}° "
        f"({tip_energy_j(after):.2g} J): to keep it as it is, state --up=z, or `up` in the manifest"
    )
    found = Finding(
        stage=Stage.VALIDATE, severity=Severity.INFO, code="laid_down", message=message, value=before.margin_rad,
        limit=FIRM_RAD,
    )  # fmt: skip
    return best, found


def center_of(poses: dict[str, Array], bodies: dict[str, Body], links: list[str]) -> Array:
    """(3,) centre of mass of some links in the root's frame, m; the origin for none."""
    mass = sum(bodies[name].mass for name in links)
    moments = [bodies[name].mass * apply(poses[name], bodies[name].com[None])[0] for name in links]
    return np.sum(moments, axis=0) / mass if moments else np.zeros(3)
