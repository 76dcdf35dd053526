"""Making the loops and the size picture of one object: read, record, draw, and write."""

import filecmp
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.formats.source import open_source
from asset2sim.assets.views.surface import Surface
from asset2sim.engines.child import in_child
from asset2sim.report.loops.figure import Figure, read_alike, read_figure, sweep
from asset2sim.report.loops.film import Act, Scenes, clouds_of, filmed, lens_of
from asset2sim.report.loops.record import DROP_STEP_S, FRAMES, RELEASE_STEP_S, Recording, half_open, let_fall, let_go
from asset2sim.report.loops.sizes import cube, size_picture, standing
from schemas.errors import AssetError
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine

SWEEP, DROP, RELEASE, SIZE = "sweep", "drop", "release", "size"
NAMES = (SWEEP, DROP, RELEASE, SIZE)
SHOWN_MS = {SWEEP: 80, DROP: 80, RELEASE: 67}
"""How long a frame is shown, ms: a release at its own speed, a fall at under half of it."""
STEPS_S = {SWEEP: 0.0, DROP: DROP_STEP_S, RELEASE: RELEASE_STEP_S}
LEAST_FRAMES = 10
"""Frames that a joint is given for its range, at least."""
RAW_FRICTION = 0.5
"""PyBullet's default friction coefficient, which raw objects have."""
RAW_LIMIT_S = 10.0
"""Wall time that a raw object is given in the engine, s."""

Recordings = Mapping[str, Recording]


def make_loops(refined: Path, raw_urdf: Path | None, to: Path) -> list[str]:
    """Write the loops and the size picture of one refined object into a folder, each whole or not at all; the names
    written. Raises AssetError where the refined object cannot be read or loaded."""
    overlay = PhysicsOverlay.model_validate_json((refined / "overlay.json").read_text(encoding="utf-8"))
    urdf, settings, loaded = refined / URDF_NAME, EngineSettings(), dict[Path, tuple[Surface, ...]]()
    start = overlay.initial_positions
    figure = read_figure(urdf, start, loaded)
    half = {
        joint.name: 0.5 * (joint.closed + joint.open)
        for joint in overlay.joints
        if joint.asked_position is None and joint.lower is not None
    }
    names = [joint.name for joint in overlay.joints]
    go_from = half_open(urdf, start, half, settings) if names else None
    fall_from = None if overlay.support.fixed else start
    played = play(urdf, fall_from, go_from, overlay.contact_friction, settings)
    if names:
        played[SWEEP] = sweep(figure, start, names, FRAMES, LEAST_FRAMES)
    resting = Recording(np.eye(4)[None], {name: np.array([value]) for name, value in start.items()})
    items = [standing(figure, resting, "refined"), cube()]
    raw: dict[str, Act] = {}
    source = None if raw_urdf is None or raw_urdf.suffix == ".urdf" else open_source(raw_urdf.parent)
    raw_urdf = raw_urdf if source is None else source.urdf
    as_raw = {name: value for name, value in unscaled(start, overlay).items()}
    try:
        if raw_urdf is not None:
            remember_twins(loaded, refined, raw_urdf.parent)
            before = read_alike(raw_urdf, as_raw, loaded, figure, overlay.scale)
            raw = raw_acts(raw_urdf, before, overlay, played, go_from, settings)
            items.insert(0, standing(before, at_rest({}, 1), "raw"))
    except AssetError:
        pass  # nothing of it can be drawn; its picture says so
    films = [
        Scenes(name, (raw.get(name), act(figure, name, played[name])), STEPS_S[name], SHOWN_MS[name])
        for name in (SWEEP, DROP, RELEASE)
        if name in played
    ]
    lenses = [lens_of(film) for film in films]
    clouds = clouds_of(films, lenses)
    to.mkdir(parents=True, exist_ok=True)
    written = {film.name: filmed(film, lens, clouds) for film, lens in zip(films, lenses, strict=True)}
    written[SIZE] = size_picture(items)
    for name in NAMES:
        save(to / f"{name}.webp", written.get(name))
    return [f"{name}.webp" for name in NAMES if name in written]


def play(
    urdf: Path,
    fall_from: Mapping[str, float] | None,
    go_from: Mapping[str, float] | None,
    friction: float,
    settings: EngineSettings,
) -> dict[str, Recording]:
    """One object's recordings: let fall with its joints at these positions, and let go of at those; none where None."""
    found = {}
    if fall_from is not None:
        found[DROP] = let_fall(urdf, fall_from, friction, settings)
    if go_from is not None:
        found[RELEASE] = let_go(urdf, go_from, friction, settings)
    return found


def raw_acts(
    urdf: Path,
    figure: Figure,
    overlay: PhysicsOverlay,
    refined: Recordings,
    go_from: Mapping[str, float] | None,
    settings: EngineSettings,
) -> dict[str, Act]:
    """What the raw object shows in the loops of the refined one: let fall as it came, let go of where the refined one
    is. Where the engine refuses it, dies or hangs, it stands still, and a word says so."""
    let_go_from = None if go_from is None else unscaled(go_from, overlay)
    fall_from: Mapping[str, float] | None = {} if DROP in refined else None
    outcome = in_child(
        Engine.PYBULLET, play, urdf, fall_from, let_go_from, RAW_FRICTION, settings, time_limit_s=RAW_LIMIT_S
    )
    found: dict[str, Act] = {}
    for name in refined:
        if name == SWEEP:
            names = [joint.name for joint in overlay.joints]
            found[name] = act(figure, name, sweep(figure, {}, names, FRAMES, LEAST_FRAMES))
        elif outcome.value is not None:
            found[name] = act(figure, name, outcome.value[name])
        else:
            still = at_rest({} if name == DROP else let_go_from or {}, FRAMES)
            word = "the engine dies of it" if outcome.died else "the engine refuses it"
            found[name] = Act(figure, figure.normalised(figure.placed(still), floor=True), word)
    return found


def act(figure: Figure, name: str, recording: Recording) -> Act:
    """What a recording shows."""
    motions = figure.normalised(figure.placed(recording), floor=name != DROP)
    return Act(figure, motions, "" if recording.finite else "explodes")


def at_rest(positions: Mapping[str, float], frames: int) -> Recording:
    """An object that does not move."""
    joints = {name: np.full(frames, value) for name, value in positions.items()}
    return Recording(np.tile(np.eye(4), (frames, 1, 1)), joints)


def unscaled(positions: Mapping[str, float], overlay: PhysicsOverlay) -> dict[str, float]:
    """These joint positions of the refined object at the authored scale."""
    sliders = {joint.name for joint in overlay.all_joints if joint.type == "prismatic"}
    return {name: value / overlay.scale if name in sliders else value for name, value in positions.items()}


def remember_twins(loaded: dict[Path, tuple[Surface, ...]], refined: Path, raw: Path) -> None:
    """Note that mesh files of the raw object with the same content as the refined one's are read already."""
    for file, surfaces in list(loaded.items()):
        if file.is_relative_to(refined):
            twin = raw / file.relative_to(refined)
            if twin.is_file() and filecmp.cmp(file, twin, shallow=False):
                loaded[twin] = surfaces


def save(path: Path, content: bytes | None) -> None:
    """Write a file whole, or remove it where there is no content."""
    if content is None:
        path.unlink(missing_ok=True)
        return
    temporary = path.with_name(f".{path.name}.new")
    temporary.write_bytes(content)
    os.replace(temporary, path)
