"""The README's before-and-after picture: raw and refined objects after the rest check in PyBullet.
``python -m lab.pages.picture DATA OUT PICTURE ID [ID …]`` draws it from a dataset and its refinement."""

import sys
from collections.abc import Mapping
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from asset2sim.assets.authored import read_overlay
from asset2sim.checks.rest import observe
from asset2sim.engines.pybullet_object import loaded
from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.locate import find_source
from asset2sim.render import render_views
from schemas.asset import AssetRef
from schemas.settings import EngineSettings, ViewSettings
from schemas.vocabulary import Engine

SIDE = 240
"""Edge of one picture, pixels."""
CAPTION = 40
PYBULLET_FRICTION = 0.5
"""PyBullet's default friction coefficient."""
MARGIN = 8


def positions_after_rest(urdf: Path, positions: Mapping[str, float], friction: float) -> dict[str, float]:
    """Joint positions (rad, m) after the rest check in PyBullet; the given ones if any of them diverges."""
    settings = EngineSettings()
    seen = observe(Engine.PYBULLET, urdf, positions, friction, settings.drop_height_m, settings)
    after = dict(zip(seen.joints, (float(value) for value in seen.joint_positions[-1]), strict=True))
    return after if all(abs(value) < 1e3 for value in after.values()) else dict(positions)


def mass_in_engine(urdf: Path) -> float:
    """Mass of the object in PyBullet, its default for links without a mass included, kg."""
    with loaded(urdf, fixed_base=False, timestep_s=1.0 / 240.0) as item:
        links = range(-1, item.client.getNumJoints(item.body))
        return sum(float(item.client.getDynamicsInfo(item.body, link)[0]) for link in links)


def longest_edge(urdf: Path, positions: Mapping[str, float]) -> float:
    """The longest edge of the object's box at these positions, m."""
    with loaded(urdf, fixed_base=True, timestep_s=1.0 / 240.0) as item:
        item.place(positions)
        boxes = [item.client.getAABB(item.body, link) for link in range(-1, item.client.getNumJoints(item.body))]
    return float(max(max(box[1][i] for box in boxes) - min(box[0][i] for box in boxes) for i in range(3)))


def panel(urdf: Path, positions: Mapping[str, float], friction: float, words: str) -> Image.Image:
    """One object after being left alone, with its size, its mass in PyBullet and a few words below."""
    after = positions_after_rest(urdf, positions, friction)
    picture = render_views(urdf, after, ViewSettings(width=SIDE, height=SIDE))["perspective"]
    image = Image.new("RGB", (SIDE, SIDE + CAPTION), (255, 255, 255))
    image.paste(picture, (0, 0))
    pen, font = ImageDraw.Draw(image), ImageFont.load_default(size=12)
    numbers = f"{longest_edge(urdf, positions):.2f} m, {mass_in_engine(urdf):.2f} kg in PyBullet"
    pen.text((SIDE / 2, SIDE + 12), numbers, fill=(50, 54, 60), font=font, anchor="mm")
    pen.text((SIDE / 2, SIDE + 29), words, fill=(110, 114, 120), font=font, anchor="mm")
    return image


def column(ref: AssetRef, out: Path) -> tuple[Image.Image, Image.Image]:
    """Pictures of one object before (raw, every joint at zero) and after (refined, in its initial state)."""
    folder = out / "assets" / ref.asset_id
    overlay = read_overlay(folder)
    before = panel(find_source(Path(ref.path)), {}, PYBULLET_FRICTION, "as it came, left alone")
    after = panel(folder / "mobility.urdf", overlay.initial_positions, overlay.contact_friction, "refined, left alone")
    return before, after


def before_after(data: Path, out: Path, asset_ids: tuple[str, ...]) -> Image.Image:
    """The picture: a column per object, raw above, refined below."""
    columns = [column(ref, out) for ref in load_dataset(data, None, asset_ids, None)]
    height = SIDE + CAPTION
    sheet = Image.new("RGB", (len(columns) * (SIDE + MARGIN) + MARGIN, 2 * height + MARGIN), (255, 255, 255))
    for index, (before, after) in enumerate(columns):
        left = MARGIN + index * (SIDE + MARGIN)
        sheet.paste(before, (left, MARGIN))
        sheet.paste(after, (left, MARGIN + height))
    return sheet


if __name__ == "__main__":
    source, refined, picture, *ids = sys.argv[1:]
    before_after(Path(source), Path(refined), tuple(ids)).save(picture, optimize=True)
