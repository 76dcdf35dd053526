"""Loops show raw and refined in step, are made anew for another object alone, and cost no report where they fail."""

import json
import logging
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from asset2sim.assets.authored import read_overlay
from asset2sim.assets.checksums import write_checksums
from asset2sim.assets.surfaces import scene
from asset2sim.assets.surfaces.load import load_surfaces
from asset2sim.assets.surfaces.surface import Surface
from asset2sim.assets.urdf.references import AllowedFolders
from asset2sim.report import pictures
from asset2sim.report.loops import film, make
from asset2sim.report.loops.figure import read_alike, read_figure
from asset2sim.report.loops.film import MOST_BYTES, SIDE
from asset2sim.report.loops.make import SWEEP_FRAMES, Before, draw_before, make_loops
from asset2sim.report.loops.record import DROP_TIMES_S, RELEASE_TIMES_S, as_hulls, let_fall, points_of
from asset2sim.report.loops.stills import HEIGHT, WIDTH
from asset2sim.report.pictures import is_current, loops_key, write_loops
from schemas.settings import EngineSettings, Settings, ViewSettings
from schemas.vocabulary import Engine
from tasks.pipeline import refine_asset
from tests.assets import ROOT, cabinet, prior, sample, written

SETTINGS = Settings(views=ViewSettings(write=False), engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False))
LOOPS = {"sweep.webp": SWEEP_FRAMES, "drop.webp": len(DROP_TIMES_S), "release.webp": len(RELEASE_TIMES_S)}


@pytest.fixture(scope="module")
def refined(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("out")
    refine_asset(sample("scissors_paper"), out, SETTINGS, prior)
    return out / "assets" / "scissors_paper"


def raw_of(asset_id: str) -> Path:
    return Path(sample(asset_id).path) / "mobility.urdf"


def frames(file: Path) -> np.ndarray:
    """(n, h, w, 3) pixels of an animation."""
    with Image.open(file) as image:
        found = []
        for number in range(image.n_frames):  # type: ignore[attr-defined]
            image.seek(number)
            found.append(np.asarray(image.convert("RGB"), dtype=int))
    return np.array(found)


@pytest.mark.system
def test_loops_have_their_frames_and_move(refined: Path, tmp_path: Path) -> None:
    assert make_loops(refined, raw_of("scissors_paper"), tmp_path) == [*LOOPS, "size.webp"]
    for name, count in LOOPS.items():
        found = frames(tmp_path / name)
        assert found.shape == (count, SIDE, 2 * SIDE, 3)
        assert (tmp_path / name).stat().st_size <= MOST_BYTES
        for half in (found[:, :, :SIDE], found[:, :, SIDE:]):
            moved = np.abs(half - half[0]).max(axis=(1, 2, 3))
            assert name == "release.webp" or moved.max() > 60
        # The sweep ends where it begins.
        assert (
            name != "sweep.webp"
            or np.abs(found[-1] - found[0]).mean() < 0.2 * np.abs(found - found[0]).mean(axis=(1, 2, 3)).max()
        )
    with Image.open(tmp_path / "size.webp") as image:
        assert image.size == (WIDTH, HEIGHT)


WITHOUT_PYBULLET = """
import sys
sys.modules["pybullet"] = None
from asset2sim.engines import registry
real, registry.find_spec = registry.find_spec, lambda name: None if name == "pybullet" else real(name)
from pathlib import Path
from asset2sim.report.loops.make import make_loops
print(*make_loops(Path(sys.argv[1]), Path(sys.argv[2]), Path(sys.argv[3])))
"""


@pytest.mark.system
def test_without_pybullet_the_sweep_alone_is_drawn(refined: Path, tmp_path: Path) -> None:
    words = [sys.executable, "-c", WITHOUT_PYBULLET, str(refined), str(raw_of("scissors_paper")), str(tmp_path)]
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT)
    assert done.stdout.split() == ["sweep.webp", "size.webp"], done.stderr


@pytest.mark.system
def test_raw_and_refined_are_in_step(refined: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(film, "QUALITIES", (100,))  # what WebP changes differs from side to side
    make_loops(refined, refined / "mobility.urdf", tmp_path)
    both = frames(tmp_path / "release.webp")[:, 40 : SIDE - 24, :]  # without the words
    assert np.abs(both[..., 4 : SIDE - 4, :] - both[..., SIDE + 4 : -4, :]).mean() < 1.0, "the same object twice"
    assert np.abs(both - both[0]).max() > 60, "which moves"


@pytest.mark.system
def test_a_fall_begins_as_high_as_it_says(refined: Path) -> None:
    overlay = read_overlay(refined)
    figure = read_figure(refined / "mobility.urdf", overlay.initial_positions, {})
    settings = EngineSettings()
    seen = let_fall(refined / "mobility.urdf", overlay.initial_positions, 0.5, settings)
    height = figure.spanned(figure.placed(seen)[:1])[:, 2].min(), figure.spanned(figure.placed(seen)[-1:])[:, 2].min()
    assert height == pytest.approx((settings.reset_m, 0.0), abs=2e-3)


@pytest.mark.system
def test_a_raw_object_that_cannot_be_read_loaded_or_borne_moves_nothing(
    refined: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused = tmp_path / "refused"
    shutil.copytree(raw_of("scissors_paper").parent, refused)
    text = (refused / "mobility.urdf").read_text()
    for number, mesh in enumerate(sorted({line.split('"')[1] for line in text.splitlines() if "<mesh" in line})):
        if number == 0:
            (refused / mesh).unlink()
    assert set(LOOPS) < set(make_loops(refined, refused / "mobility.urdf", tmp_path / "one"))
    real, parent = make.play_all, os.getpid()

    def dies(*args: object) -> object:
        if os.getpid() != parent:
            os.kill(os.getpid(), signal.SIGKILL)
        return real(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(make, "play_all", dies)
    make_loops(refined, raw_of("scissors_paper"), tmp_path / "two")
    (refused / "mobility.urdf").write_text("no URDF")
    assert make_loops(refined, refused / "mobility.urdf", tmp_path / "three") == [*LOOPS, "size.webp"]
    for place in ("one", "two", "three"):
        drop = frames(tmp_path / place / "drop.webp")
        changed = np.abs(drop - drop[0]).mean(axis=(0, 1, 3))
        assert 5.0 * changed[: SIDE - 4].mean() < changed[SIDE + 4 :].mean()


@pytest.mark.system
def test_every_mesh_is_read_once_for_all_pictures(
    refined: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    raw, read = raw_of("scissors_paper"), list[bytes]()

    def counted(path: Path) -> tuple[Surface, ...]:
        read.append(path.read_bytes())
        return load_surfaces(path)

    monkeypatch.setattr(scene, "load_surfaces", counted)
    before = Before(raw.parent, AllowedFolders((raw.parent,)), tmp_path / "before.webp", 82)
    assert make_loops(refined, raw, tmp_path, before) == [*LOOPS, "size.webp"]
    assert len(read) == len(set(read)) > 1 and before.to.is_file()
    broken = Before(tmp_path, before.reach, tmp_path / "none.webp", 82)
    assert make_loops(refined, raw, tmp_path / "more", broken) == [*LOOPS, "size.webp"]


@pytest.mark.system
def test_the_refined_picture_is_taken_only_where_the_raw_object_looks_the_same(tmp_path: Path) -> None:
    raw, loaded = raw_of("scissors_paper"), dict[Path, tuple[Surface, ...]]()
    rest = read_figure(raw, {}, loaded)
    turned = dict.fromkeys(rest.limits, 0.2)
    opened = read_figure(raw, turned, loaded)
    assert turned and make.look_alike(read_alike(raw, {}, loaded, rest, 1.0), rest, {})
    assert not make.look_alike(read_alike(raw, turned, loaded, opened, 1.0), opened, turned)
    assert not make.look_alike(rest, opened, turned), "other triangles"
    before = Before(raw.parent, AllowedFolders((raw.parent,)), tmp_path / "before.webp", 100)
    for edge, taken in ((ViewSettings().width, True), (64, False)):
        Image.new("RGB", (edge, edge), (255, 0, 0)).save(tmp_path / "view.png")
        draw_before(before, loaded, raw, tmp_path / "view.png")
        with Image.open(before.to) as image:
            assert image.size == (ViewSettings().width,) * 2
            assert bool(np.asarray(image)[0, 0, 1] < 20) is taken


@pytest.mark.system
def test_a_raw_object_falls_as_its_files_do_when_the_engine_is_given_their_points_alone(tmp_path: Path) -> None:
    raw = raw_of("scissors_paper")
    loaded = {file: load_surfaces(file) for file in (raw.parent / "textured_objs").glob("*.obj")}
    falls = [let_fall(raw, {}, 0.5, EngineSettings())]
    for name, known in (("bare", {}), ("points", loaded)):
        folder = tmp_path / name
        folder.mkdir()
        falls.append(let_fall(as_hulls(raw, folder, known), {}, 0.5, EngineSettings()))
        contents = [file.read_bytes() for file in folder.glob("*.obj")]
        assert len(contents) > 1 and not any(b"mtllib" in content for content in contents), "it decodes their pictures"
        assert all((b"usemtl" in content) is (name == "bare") for content in contents)
    assert np.ptp(falls[0].root, axis=0).max() > 1e-2
    for fall in falls[1:]:
        assert np.allclose(fall.root, falls[0].root, rtol=0.0, atol=1e-9)
        assert all(np.allclose(fall.joints[name], path, rtol=0.0, atol=1e-9) for name, path in falls[0].joints.items())


def test_groups_of_which_the_engine_makes_hulls_of_their_own_stay_apart(tmp_path: Path) -> None:
    corners = "".join(f"v {x} {y} {z}\n" for x in (0, 1, 5, 6) for y, z in ((0, 0), (0, 1), (1, 0)))
    for line, alone in (("o other", False), ("g other", False), ("usemtl other", True), ("s off", True)):
        file = tmp_path / "two.obj"
        file.write_text(f"{corners}o one\nf 1 2 3\nf 1 2 4\n{line}\nf 7 8 9\nf 7 8 10\n")
        found = points_of(file.read_bytes(), load_surfaces(file))
        assert (found is not None) is alone
        assert found is None or sorted(found.splitlines()[:8]) == sorted(
            b"v %.1f %.1f %.1f" % point for point in [(0, 0, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0),
                                                      (5, 0, 0), (5, 0, 1), (5, 1, 0), (6, 0, 0)]
        )  # fmt: skip


def dies(*args: object) -> None:
    """What an engine does that crashes."""
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.system
def test_what_fails_is_an_empty_list_and_a_line_in_the_log(
    refined: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    out = tmp_path / "out"
    torn, whole = out / "assets" / "torn", out / "assets" / "whole"
    for folder in (torn, whole):
        shutil.copytree(refined, folder)
    shutil.rmtree(torn / "textured_objs")
    raws: dict[Path, Path | None] = {torn: None, whole: raw_of("scissors_paper")}

    def due() -> dict[str, list[str]]:
        to = {folder: tmp_path / folder.name for folder in raws}
        return {
            folder.name: write_loops(folder, raw, to[folder])
            for folder, raw in raws.items()
            if not is_current(folder, raw, to[folder])
        }

    with caplog.at_level(logging.WARNING):
        assert due() == {"torn": [], "whole": [*LOOPS, "size.webp"]}
    assert [record.message.partition(":")[0] for record in caplog.records] == ["torn"]
    assert "cannot find 'textured_objs" in caplog.text
    monkeypatch.setattr(pictures, "make_loops", dies)
    assert due().keys() == {"torn"}, "made only for what changed"
    (whole / "mobility.urdf").write_text((whole / "mobility.urdf").read_text().replace('effort="', 'effort="1'))
    write_checksums(whole)
    assert due() == {"torn": [], "whole": []}
    assert "SIGKILL" in caplog.text


def test_the_key_is_the_object_s_and_not_the_time_s(tmp_path: Path) -> None:
    refined, raw = written(tmp_path / "refined", cabinet(), {"overlay.json": "{}", "measurement.json": "[]"}), tmp_path
    raw = written(tmp_path / "raw", cabinet().replace("<box", '<mesh filename="a.obj"/><box', 1), {"a.obj": "v 0 0 0"})
    write_checksums(refined)
    key = loops_key(refined, raw / "mobility.urdf")
    os.utime(refined / "mobility.urdf", (1, 1))
    (refined / "measurement.json").write_text("[1]")
    write_checksums(refined)
    assert loops_key(refined, raw / "mobility.urdf") == key
    keys = {key, loops_key(refined, None)}
    (raw / "a.obj").write_text("v 0 0 0\nv 1 0 0")
    keys.add(loops_key(refined, raw / "mobility.urdf"))
    for file in ("overlay.json", "mobility.urdf"):
        (refined / file).write_text((refined / file).read_text() + " ")
        write_checksums(refined)
        keys.add(loops_key(refined, raw / "mobility.urdf"))
    assert len(keys) == 5
    record = {"key": loops_key(refined, None), "files": ["sweep.webp"]}
    (tmp_path / "loops.json").write_text(json.dumps(record))
    assert not is_current(refined, None, tmp_path), "what it names is not there"
    (tmp_path / "sweep.webp").write_bytes(b"")
    assert is_current(refined, None, tmp_path) and not is_current(refined, raw / "mobility.urdf", tmp_path)
