"""Pictures for a question: links in colours that the facts name, with names, at rest and at the ends of travel."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from asset2sim.assets.extract import Extraction
from asset2sim.assets.surfaces.scene import load_scene
from asset2sim.guidance.link_colors import PALETTE, mark_names
from asset2sim.render.marked import marked_pictures, question_pictures, with_names
from schemas.settings import Settings
from tests.assets import joint, link, read, robot, shape, written

pytestmark = pytest.mark.system

SEES = Settings.model_validate({"model": {"model": "some/model"}})


@pytest.fixture
def cabinet(tmp_path: Path) -> Extraction:
    """A dark cube with a door on its front, which is at -x, and a knob hidden behind it at the back."""
    dark = '<material name="m"><color rgba="0.02 0.02 0.02 1"/></material></visual>'
    parts = (
        link("body", shape("1 1 1").replace("</visual>", dark)),
        link("door", shape("0.04 1 1", xyz="-0.02 -0.5 0")),
        link("knob", shape("0.1 0.2 0.2")),
        joint("hinge", "revolute", "body", "door", xyz="-0.5 0.5 0", axis="0 0 -1", limit="0 1.5"),
        joint("turn", "continuous", "body", "knob", xyz="0.55 0 0", axis="1 0 0"),
    )
    return read(written(tmp_path, robot(*parts), {"semantics.txt": "body free box\n"}))


def pictures(
    extraction: Extraction, settings: Settings = SEES, names: dict[str, str] | None = None
) -> dict[str, Image.Image]:
    return {
        item.label: Image.open(io.BytesIO(item.png)).convert("RGB")
        for item in question_pictures(extraction, settings, names)
    }


def test_the_pictures_show_rest_parts_behind_and_the_open_end(cabinet: Extraction) -> None:
    found = pictures(cabinet)
    # Position 0 is closed, so that closed has no picture of its own.
    assert list(found) == ["perspective", "front", "left", "back", "parts", "parts_behind", "parts_open"]
    assert {image.size for image in found.values()} == {(512, 512)}


def test_a_model_that_takes_no_pictures_gets_none(cabinet: Extraction) -> None:
    assert question_pictures(cabinet, Settings()) == ()


def test_each_link_is_drawn_in_the_colour_that_is_named(cabinet: Extraction) -> None:
    colors = mark_names(cabinet.features)
    assert colors == {"body": "beige", "door": "red", "knob": "blue"}
    picture = marked_pictures(load_scene(cabinet.urdf, {}), cabinet.features, 256)
    pixels = np.asarray(picture.image, dtype=float)
    for index, name in enumerate(picture.links):
        seen = picture.shown == index
        if name == "knob":
            assert not seen.any()
            continue
        # Light makes a colour darker; its direction stays.
        mean, wanted = np.median(pixels[seen], axis=0), np.asarray(PALETTE[colors[name]])
        assert mean @ wanted / np.linalg.norm(mean) / np.linalg.norm(wanted) > 0.97, name
    behind = marked_pictures(load_scene(cabinet.urdf, {}), cabinet.features, 256, behind=True)
    assert behind.seen_px("knob") > 60


def test_edges_show_on_what_is_dark(cabinet: Extraction) -> None:
    """The edge between two dark faces is lighter than both."""
    levels = np.asarray(pictures(cabinet)["back"].convert("L"), dtype=float)
    dark = levels[levels < 60]
    row = levels[256]
    assert dark.size > 1000 and row.min() < 40
    outline = np.nonzero((row > 70) & (row < 170))[0]
    assert outline.size >= 2


def test_names_are_those_that_are_given(cabinet: Extraction) -> None:
    own, other = pictures(cabinet), pictures(cabinet, names={"body": "x", "door": "y", "knob": "z"})
    assert np.asarray(own["front"]).tobytes() == np.asarray(other["front"]).tobytes()
    assert np.asarray(own["parts"]).tobytes() != np.asarray(other["parts"]).tobytes()


def test_tags_lie_apart_and_inside() -> None:
    shown = np.full((200, 200), -1, dtype=np.int64)
    for number in range(6):
        shown[80:110, 20 + 25 * number : 40 + 25 * number] = number
    plain = Image.new("RGB", (200, 200), (200, 200, 200))
    colors = {n: (f"link_{n}", np.array([1.0, 0.0, n / 6])) for n in range(6)}
    tagged = np.asarray(with_names(plain, shown, colors))
    for number in range(6):
        border = (tagged == np.array([255, 0, int(255 * number / 6)])).all(axis=2)
        assert border.sum() > 100, number
    assert with_names(plain, shown, {}).tobytes() == plain.tobytes()
