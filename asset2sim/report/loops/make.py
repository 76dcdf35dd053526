"""Pictures of one object: loops, sizes, joints, as it came; in a child, since an engine and files may crash it."""

import filecmp
import logging
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from asset2sim.assets.authored import read_overlay
from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.surfaces.surface import Surface
from asset2sim.assets.urdf.references import AllowedFolders
from asset2sim.checks.mechanism import span_of
from asset2sim.engines.child import ChildOutcome, in_child
from asset2sim.engines.registry import installed
from asset2sim.intake.origin import open_origin
from asset2sim.render import render_views
from asset2sim.render.sight import ALIKE
from asset2sim.report.loops.figure import LoopFigure, read_alike, read_figure, sweep
from asset2sim.report.loops.film import Act, Scenes, filmed
from asset2sim.report.loops.record import (
    DROP_TIMES_S,
    RELEASE_TIMES_S,
    LoopMotion,
    as_hulls,
    half_open,
    let_fall,
    let_go,
)
from asset2sim.report.loops.stills import axes_picture, cube, size_picture, standing_item
from asset2sim.storage.regular_files import write_whole
from schemas.errors import AssetError
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings, ViewSettings
from schemas.vocabulary import Engine

SWEEP, DROP, RELEASE, SIZE, AXES = "sweep", "drop", "release", "size", "axes"
NAMES = (SWEEP, DROP, RELEASE, SIZE, AXES)
SHOWN_MS = {SWEEP: 90, DROP: 125, RELEASE: 125}
"""How long a frame is shown, ms: a release at its own speed, a fall at a tenth of it until it is over."""
SWEEP_FRAMES = 21
TIMES_S = {SWEEP: None, DROP: DROP_TIMES_S, RELEASE: RELEASE_TIMES_S}
MANY_JOINTS = 40
"""Joints beyond which an object is shown without an engine: a step of a keyboard of 115 takes 30 ms."""
LEAST_FRAMES = 11
"""Frames that a joint is given for its range, at least."""
RAW_FRICTION = 0.5
"""PyBullet's default friction coefficient, which raw objects have."""
RAW_LIMIT_S = 10.0
"""Wall time that a raw object is given in the engine, s."""

Recordings = Mapping[str, LoopMotion]

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Before:
    """The picture of an asset as it came: of the folder ``raw``, of what is within ``reach``, into the file ``to``, as
    a WebP of this quality (0 to 100) and effort (0 to 6)."""

    raw: Path
    reach: AllowedFolders
    to: Path
    quality: int
    method: int = 2


def make_loops(
    refined: Path, raw_urdf: Path | None, to: Path, before: Before | None = None, moving: bool = True
) -> list[str]:
    """Write the loops, if it is to be shown ``moving``, the size picture and that of the joints of one refined object
    into a folder, each whole or not at all; the names written. Then the picture of it ``before``, of the meshes that
    are read by then, if it can be drawn. Raises AssetError where the refined object cannot be read or loaded."""
    overlay = read_overlay(refined)
    urdf, settings, loaded = refined / URDF_NAME, EngineSettings(), dict[Path, tuple[Surface, ...]]()
    start = overlay.initial_positions
    figure = read_figure(urdf, start, loaded)
    names = [joint.name for joint in overlay.joints]
    starts = starts_of(urdf, overlay, settings) if moving else Starts(None, None, {})
    played = play_all(urdf, starts, overlay.contact_friction, settings)
    if names and moving:
        played[SWEEP] = sweep(figure, start, names, SWEEP_FRAMES, LEAST_FRAMES)
    resting = LoopMotion(np.eye(4)[None], {name: np.array([value]) for name, value in start.items()})
    items = [standing_item(figure, resting, "refined"), cube()]
    raw: dict[str, Act] = {}
    came: LoopFigure | None = None
    try:
        if raw_urdf is not None:
            source = None if raw_urdf.suffix == ".urdf" else open_origin(raw_urdf)
            raw_urdf = raw_urdf if source is None else source.urdf
            remember_twins(loaded, refined, raw_urdf.parent)
            came = read_alike(raw_urdf, unscaled(start, overlay), loaded, figure, overlay.scale)
            raw = raw_acts(raw_urdf, loaded, came, overlay, played, starts, settings) if played else {}
            items.insert(0, standing_item(came, at_rest({}, 1), "raw"))
    except (AssetError, ValueError) as error:  # it cannot be drawn, and its picture says so
        log.warning("raw %s: %s", raw_urdf, error)
    films = [
        Scenes(name, (raw.get(name), act_of(figure, name, played[name])), TIMES_S[name], SHOWN_MS[name])
        for name in (SWEEP, DROP, RELEASE)
        if name in played
    ]
    to.mkdir(parents=True, exist_ok=True)
    view = refined / "views" / "perspective.png"
    drawn: dict[str, bytes | None] = {film.name: filmed(film) for film in films}
    drawn |= {SIZE: size_picture(items), AXES: axes_picture(figure, view)}
    written = [f"{name}.webp" for name in NAMES if drawn.get(name) is not None]
    for name in NAMES:
        content = drawn.get(name)
        if content is None:
            (to / f"{name}.webp").unlink(missing_ok=True)
        else:
            write_whole(to / f"{name}.webp", content)
    if before is not None:
        with suppress(Exception):  # it is drawn alone then, and what is wrong with it said there
            same = came is not None and look_alike(came, figure, start)
            draw_before(before, loaded, raw_urdf if came is not None else None, view if same else None)
    return written


def look_alike(came: LoopFigure, figure: LoopFigure, start: Mapping[str, float]) -> bool:
    """Whether a raw object with every joint at zero is the picture of the refined one at ``start``, whatever the scale:
    the same triangles and paints, the links in the same places."""
    if came.faces is not figure.faces or not np.allclose(came.scene.front, figure.scene.front):
        return False
    if any(one.paint != other.paint for one, other in zip(came.scene.surfaces, figure.scene.surfaces, strict=True)):
        return False
    joints = {name: np.array([value]) for name, value in start.items()}
    refined = figure.placed(LoopMotion(np.eye(4)[None], joints)) / figure.size_m
    raw = came.placed(at_rest({}, 1)) / came.size_m
    return bool(
        np.abs(refined[..., :3, 3] - raw[..., :3, 3]).max() < ALIKE
        and np.abs(refined[..., :3, :3] * figure.size_m - raw[..., :3, :3] * came.size_m * came.scale).max() < ALIKE
    )


@dataclass(frozen=True)
class Starts:
    """Where an object's motions start: joint positions, rad or m, at which it is let fall, or None, and at which its
    joints are let go of, or None, with these ``speeds``, rad/s or m/s."""

    fall: Mapping[str, float] | None
    go: Mapping[str, float] | None
    speeds: Mapping[str, float]


def starts_of(urdf: Path, overlay: PhysicsOverlay, settings: EngineSettings) -> Starts:
    """Of the refined object: let fall as it is, but for a fixed one; let go of where a position is asked, else half
    open as far as that is free, with a nudge towards the further end. None of it where it has too many
    joints, or PyBullet is not installed: then it is shown swept alone."""
    start, joints = overlay.initial_positions, overlay.joints
    if len(joints) > MANY_JOINTS or Engine.PYBULLET not in installed():
        return Starts(None, None, {})
    fall = None if overlay.support.fixed else start
    if not joints:
        return Starts(fall, None, {})
    half = {
        joint.name: 0.5 * (joint.closed + joint.open)
        for joint in joints
        if joint.asked_position is None and joint.lower is not None
    }
    go = half_open(urdf, start, half, settings)
    speeds = {}
    for joint in joints:
        speed = settings.nudge_m_s if joint.type == "prismatic" else settings.nudge_rad_s
        lower, upper = span_of(joint)
        speeds[joint.name] = speed if upper - go[joint.name] > go[joint.name] - lower else -speed
    return Starts(fall, go, speeds)


def play_all(urdf: Path, starts: Starts, friction: float, settings: EngineSettings) -> dict[str, LoopMotion]:
    """One object's recordings, of the motions that have a start."""
    found = {}
    if starts.fall is not None:
        found[DROP] = let_fall(urdf, starts.fall, friction, settings)
    if starts.go is not None:
        found[RELEASE] = let_go(urdf, starts.go, starts.speeds, friction, settings)
    return found


def raw_acts(
    urdf: Path,
    loaded: Mapping[Path, tuple[Surface, ...]],
    figure: LoopFigure,
    overlay: PhysicsOverlay,
    refined: Recordings,
    starts: Starts,
    settings: EngineSettings,
) -> dict[str, Act]:
    """Acts of the raw object in the loops of the refined one: let fall as it came, let go of where the refined one
    is. Where the engine refuses it, dies or hangs, it stands still, and a word says so."""
    go = None if starts.go is None else unscaled(starts.go, overlay)
    own = Starts(None if starts.fall is None else {}, go, unscaled(starts.speeds, overlay))
    with TemporaryDirectory(prefix="asset2sim-loops-") as place:
        bare = as_hulls(urdf, Path(place), loaded)
        outcome: ChildOutcome[dict[str, LoopMotion]] = in_child(
            Engine.PYBULLET, play_all, bare, own, RAW_FRICTION, settings, time_limit_s=RAW_LIMIT_S
        )
    found: dict[str, Act] = {}
    for name in refined:
        if name == SWEEP:
            names = [joint.name for joint in overlay.joints]
            found[name] = act_of(figure, name, sweep(figure, {}, names, SWEEP_FRAMES, LEAST_FRAMES))
        elif outcome.value is not None:
            found[name] = act_of(figure, name, outcome.value[name])
        else:
            still = at_rest({} if name == DROP else go or {}, len(refined[name].root))
            word = "the engine dies of it" if outcome.died else "the engine refuses it"
            found[name] = Act(figure, figure.normalised(figure.placed(still), floor=True), word)
    return found


def act_of(figure: LoopFigure, name: str, recording: LoopMotion) -> Act:
    """The act of a recording."""
    motions = figure.normalised(figure.placed(recording), floor=name != DROP)
    return Act(figure, motions, "" if recording.finite else "explodes")


def at_rest(positions: Mapping[str, float], frames: int) -> LoopMotion:
    """An object that does not move."""
    joints = {name: np.full(frames, value) for name, value in positions.items()}
    return LoopMotion(np.tile(np.eye(4), (frames, 1, 1)), joints)


def unscaled(positions: Mapping[str, float], overlay: PhysicsOverlay) -> dict[str, float]:
    """These joint positions or speeds of the refined object at the authored scale."""
    sliders = {joint.name for joint in overlay.all_joints if joint.type == "prismatic"}
    return {name: value / overlay.scale if name in sliders else value for name, value in positions.items()}


def remember_twins(loaded: dict[Path, tuple[Surface, ...]], refined: Path, raw: Path) -> None:
    """Note that mesh files of the raw object with the same content as the refined one's are read already."""
    for file, surfaces in list(loaded.items()):
        if file.is_relative_to(refined):
            twin = raw / file.relative_to(refined)
            if twin.is_file() and filecmp.cmp(file, twin, shallow=False):
                loaded[twin] = surfaces


def draw_before(
    before: Before,
    loaded: dict[Path, tuple[Surface, ...]] | None = None,
    urdf: Path | None = None,
    view: Path | None = None,
) -> None:
    """Draw an asset's own files, every joint at zero, from the view that its refined picture has. ``loaded`` remembers
    mesh files already read; ``urdf`` is the asset's own as it is read, if that is known, all of whose files are within
    reach; ``view`` a picture that shows the same, which is taken where it is as large. Raises AssetError."""
    settings = ViewSettings()
    if view is not None and view.is_file():
        with Image.open(view) as image:
            if image.size == (settings.width, settings.height):
                image.convert("RGB").save(before.to, quality=before.quality, method=before.method)
                return
    if urdf is None:
        source = open_origin(before.raw, reach=before.reach)  # what is made of it is there as long as this is
        urdf = source.urdf
    picture = render_views(urdf, {}, settings, ("perspective",), loaded)["perspective"]
    picture.save(before.to, quality=before.quality, method=before.method)
