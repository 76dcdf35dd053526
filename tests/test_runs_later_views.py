"""Views left for later are those that the run would have written, and what cannot be drawn is said."""

from pathlib import Path

import pytest

from asset2sim.render import VIEW_NAMES
from asset2sim.runs.later_views import write_missing_views
from schemas.errors import UsageError
from schemas.settings import EngineSettings, RunSettings, Settings, ViewSettings
from schemas.vocabulary import Engine
from tasks.pipeline import refine_asset
from tests.assets import prior, sample

SMALL = Settings(
    views=ViewSettings(width=48, height=48),
    engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False),
    run=RunSettings(workers=2),
)
LATER = SMALL.model_copy(update={"views": SMALL.views.model_copy(update={"write": False})})


def pictures(out: Path) -> dict[str, bytes]:
    return {f"{path.parts[-3]}/{path.name}": path.read_bytes() for path in out.glob("assets/*/views/*.png")}


@pytest.mark.system
def test_later_views_are_the_same_pictures(tmp_path: Path) -> None:
    now, later = tmp_path / "now", tmp_path / "later"
    for asset_id in ("scissors_paper", "box_wooden"):
        refine_asset(sample(asset_id), now, SMALL, prior)
        refine_asset(sample(asset_id), later, LATER, prior)
    assert not pictures(later) and len(pictures(now)) == 2 * len(VIEW_NAMES)
    with pytest.raises(UsageError, match="no catalog in"):
        write_missing_views(later, LATER)
    (later / "catalog").mkdir()
    (later / "assets" / "notes").mkdir()
    broken = later / "assets" / "scissors_torn"
    broken.mkdir()
    (broken / "overlay.json").write_text((later / "assets" / "scissors_paper" / "overlay.json").read_text())
    drawn = write_missing_views(later, LATER)
    assert pictures(later) == pictures(now)
    assert drawn.keys() == {"scissors_paper", "box_wooden", "scissors_torn"}
    assert [asset_id for asset_id, problem in drawn.items() if problem] == ["scissors_torn"]
    assert write_missing_views(later, LATER).keys() == {"scissors_torn"}


def test_views_are_not_drawn_into_a_store(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="copy the assets here first"):
        write_missing_views("s3://bucket/out", SMALL)
    with pytest.raises(UsageError, match="no catalog in"):
        write_missing_views(tmp_path, SMALL)
