"""``OUT/scenes``: every scene that a run has cut, put together again of its refined parts."""

import shutil
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import cast

from lxml import etree

from asset2sim.assets.authored import authored_overlay, read_overlay
from asset2sim.assets.exports.whole import PARTS, PlacedPart, write_urdf, write_whole
from asset2sim.assets.extract import read_asset
from asset2sim.assets.folder import URDF_NAME, staged_folder, write_folder
from asset2sim.assets.urdf.base import taken_from_world
from asset2sim.assets.urdf.edit import serialised
from asset2sim.assets.urdf.read import MOST_LINKS
from asset2sim.assets.urdf.references import allowed_folders
from asset2sim.experiments.isolation import Ending
from asset2sim.experiments.isolation.supervise import Work, in_child
from asset2sim.intake.asset_folders import safe_id
from asset2sim.intake.origin import open_origin, parts_in
from asset2sim.intake.scenes import asset_of
from asset2sim.intake.split import Part, passing
from schemas.asset import AssetRef
from schemas.errors import AssetError
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings, Settings
from schemas.support import Support, SupportKind
from schemas.vocabulary import CollisionMode, UpAxis

SCENES = "scenes"
"""Folder of OUT that holds a folder a scene."""
LIMIT_S = 600.0
"""Time in which a scene must be put together, s: a kitchen of eight parts takes five."""
HELD = Support(kind=SupportKind.FIXED, reason="it was not refined")


def put_together(refs: Sequence[AssetRef], done: Collection[str], out: Path, settings: Settings) -> tuple[str, ...]:
    """Write the scenes of which an asset is ``done`` in this run, or that are missing; lines on what is wrong."""
    scenes = {ref.scene: ref for ref in refs if ref.scene is not None}
    touched = {ref.scene for ref in refs if ref.asset_id in done}
    told: list[str] = []
    for name, ref in scenes.items():
        final = out / SCENES / name
        if name in touched or not final.is_dir():
            scene = AssetRef(asset_id=name, path=ref.path, up=ref.up, root=ref.root, subset=ref.subset)
            done_in_child = in_child(Work(assemble, (scene, final, out, settings), LIMIT_S))
            if done_in_child.ending is Ending.RETURNED:
                told += cast(list[str], done_in_child.value)
            else:
                told.append(f"scene {name} was not put together: {done_in_child.reason}")
    return tuple(told)


def assemble(scene: AssetRef, final: Path, out: Path, settings: Settings) -> list[str]:
    """Write one scene into its folder, in one step; see ``write_parts``. Raises AssetError."""
    with staged_folder(final) as folder:
        return write_parts(scene, folder, out, settings)


def write_parts(scene: AssetRef, folder: Path, out: Path, settings: Settings) -> list[str]:
    """Write one scene into its folder: refined parts, and the authored geometry of those that were not written, held
    where they stand; lines that name those. Raises AssetError."""
    up = scene.up or settings.up or UpAxis.Z
    placed, told = list[PlacedPart](), list[str]()
    parts = parts_in(scene, up, settings.inputs)
    for part in parts:
        ref, place = asset_of(scene, part), folder / PARTS / safe_id(part.name)
        source = out / "assets" / ref.asset_id
        try:
            if (source / "overlay.json").is_file():
                overlay, made = copied_part(source, place, part), "refined"
            else:
                overlay, made = authored_part(ref, place, up, settings), "authored"
                told.append(f"scene {scene.asset_id}: part {part.name} is not refined; its geometry stands there")
        except AssetError as error:
            told.append(f"scene {scene.asset_id}: part {part.name} is left out: {error}")
            continue
        placed.append(PlacedPart(part.name, place, overlay, part.to_scene, made))
    urdf = write_urdf(folder, scene.asset_id, placed)
    apart = {frozenset(pair) for pair in passing(parts)}
    apart |= overlapping(urdf, parts, placed, settings.engine)
    there = {link.name for part in placed for link in part.overlay.links}
    write_whole(folder, scene.asset_id, placed, {pair for pair in apart if pair <= there}, settings.engine.timestep_s)
    return told


def overlapping(
    urdf: Path, parts: Sequence[Part], placed: Sequence[PlacedPart], settings: EngineSettings
) -> set[frozenset[str]]:
    """Pairs of links of different parts, none of them free, that overlap in the scene's initial state, as it is
    furnished: they would hold each other. None is found among more links than PyBullet simulates."""
    from asset2sim.engines.static_object import contacts_at  # late: only the child needs an engine

    owner = {link: part.name for part in parts if not part.free for link in part.links}
    initial = {name: value for part in placed for name, value in part.overlay.initial_positions.items()}
    if sum(len(part.links) for part in parts) >= MOST_LINKS:
        return set()
    return {
        frozenset((point.link_a, point.link_b))
        for point in contacts_at(urdf, initial, settings)
        if point.separation_m < 0.0
        and point.link_a in owner
        and point.link_b in owner
        and owner[point.link_a] != owner[point.link_b]
    }


def copied_part(source: Path, place: Path, part: Part) -> PhysicsOverlay:
    """The overlay of a refined part, its folder copied without pictures, its root its own."""
    shutil.copytree(source, place, ignore=shutil.ignore_patterns("views", "SHA256SUMS"))
    urdf = place / URDF_NAME
    urdf.write_bytes(taken_from_world(urdf.read_bytes(), part.root))
    return read_overlay(place)


def authored_part(ref: AssetRef, place: Path, up: UpAxis, settings: Settings) -> PhysicsOverlay:
    """The overlay of a part whose shapes are written as authored, its joints held. Raises AssetError."""
    reach = allowed_folders(ref, settings.inputs)
    opened = open_origin(Path(ref.path), up, reach, ref.part)
    robot = etree.parse(str(opened.urdf)).getroot()
    for joint in robot.findall("joint"):
        joint.set("type", "fixed")
        for tag in ("axis", "limit", "dynamics", "mimic"):
            for element in joint.findall(tag):
                joint.remove(element)
    opened.urdf.write_bytes(serialised(robot))
    extraction = read_asset(ref, opened, reach, None, settings.inputs)
    overlay = authored_overlay(extraction, settings.physics).model_copy(update={"support": HELD})
    write_folder(extraction, overlay, {}, place, settings.physics, CollisionMode.KEEP)
    (place / "overlay.json").write_text(overlay.model_dump_json(indent=2), encoding="utf-8")
    return overlay
