"""Flaps of a carton that cross where they are closed pass through each other, and all close."""

from pathlib import Path

import pytest

from schemas.asset import AssetRef
from schemas.vocabulary import Status
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, box_obj, joint, link, mesh, prior, robot, written


def carton(folder: Path, wide: float, reach: float) -> Path:
    """A carton of 0.4 m, drawn closed, with four flaps ``wide`` m to either side, that reach ``reach`` m inwards."""
    low, high, top = -0.2, 0.2, 0.3
    flaps = {"west": ("0 -1 0", low, 0.0), "east": ("0 1 0", high, 0.0),
             "south": ("1 0 0", 0.0, low), "north": ("-1 0 0", 0.0, high)}  # fmt: skip
    card = 0.004
    # fmt: off
    walls = {"floor": ((low, low, 0.0), (high, high, card)),
             "w": ((low, low, 0.0), (low + card, high, top)), "e": ((high - card, low, 0.0), (high, high, top)),
             "s": ((low, low, 0.0), (high, low + card, top)), "n": ((low, high - card, 0.0), (high, high, top))}
    # fmt: on
    files = {f"{name}.obj": box_obj(*ends) for name, ends in walls.items()}
    parts = [link("body", "".join(mesh(f"{name}.obj") for name in walls))]
    for name, (axis, x, y) in flaps.items():
        ends = [(-wide, wide)] * 2
        for at, way in enumerate((x, y)):
            if way:
                ends[at] = (0.0, reach) if way < 0.0 else (-reach, 0.0)
        (left, right), (near, far) = ends
        files[f"{name}.obj"] = box_obj((left, near, 0.0), (right, far, card))
        place = f"{x} {y} {top + 0.001}"
        parts += [
            link(name, mesh(f"{name}.obj")),
            joint(f"fold_{name}", "revolute", "body", name, xyz=place, axis=axis, limit="0 4.5"),
        ]
    return written(folder, robot(*parts), files)


@pytest.mark.system
@pytest.mark.parametrize(("wide", "reach", "crossing"), [(0.198, 0.19, 4), (0.1, 0.09, 0)])
def test_all_four_flaps_of_a_carton_close(tmp_path: Path, wide: float, reach: float, crossing: int) -> None:
    path = carton(tmp_path / "carton", wide, reach)
    asked = AssetRef(asset_id="carton", path=str(path), category="Box", prompt="A closed carton with four flaps.")
    record = refine_asset(asked, tmp_path / "out", NO_VIEWS, prior)
    assert record.overlay is not None
    assert record.status is Status.OK, record.reason
    assert all(abs(flap.initial_position) < 0.1 for flap in record.overlay.joints)
    assert len(record.overlay.passing) == crossing
    assert len([finding for finding in record.findings if finding.code == "links_pass"]) == crossing
