"""Views that a run keeps for the next: taken where all that they show is the same, else drawn anew."""

from pathlib import Path

import pytest

from asset2sim.render import write_views
from schemas.settings import ViewSettings
from tasks import publish
from tasks.publish import write_known_views
from tests.refined_things import OPEN_M, drawer

pytestmark = pytest.mark.system

SMALL = ViewSettings(width=64, height=64)


def test_views_are_drawn_anew_only_where_something_that_they_show_is_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, kept, drawn = drawer(tmp_path / "a"), tmp_path / "kept.npz", list[Path]()

    def counted(urdf: Path, positions: dict[str, float], to: Path, settings: ViewSettings) -> tuple[Path, ...]:
        drawn.append(to)
        return write_views(urdf, positions, to, settings)

    monkeypatch.setattr(publish, "write_views", counted)

    def views(settings: ViewSettings = SMALL, **positions: float) -> dict[str, bytes]:
        before = len(drawn)
        write_known_views(folder, positions, settings, kept)
        found = {file.name: file.read_bytes() for file in (folder / "views").iterdir()}
        for file in (folder / "views").iterdir():
            file.unlink()
        return found if len(drawn) > before else {"kept": b"", **found}

    first = views(slide=OPEN_M)
    assert len(first) == 5 and views(slide=OPEN_M) == {"kept": b"", **first}
    shut = views(slide=0.0)
    assert shut.keys() == first.keys() and shut != first, "another state"
    assert "kept" not in views(SMALL.model_copy(update={"width": 32}), slide=0.0)
    views(slide=0.0)
    mesh = folder / "textured_objs" / "new.obj"
    mesh.parent.mkdir(exist_ok=True)
    for text in ("v 0 0 0", "v 0 0 1"):
        mesh.write_text(text)
        assert "kept" not in views(slide=0.0) and "kept" in views(slide=0.0)
    urdf = folder / "mobility.urdf"
    urdf.write_text(urdf.read_text().replace("</robot>", "<!-- another --></robot>"))
    assert "kept" not in views(slide=0.0)
    kept.write_bytes(b"cut off")
    assert "kept" not in views(slide=0.0)
