"""The film of a trial: the object, the arm and the bowl as the recording has them, as an MP4 that browsers play."""

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np

from asset2sim.assets.surfaces.surface import Ints
from asset2sim.gym.arm.gripper import PANDA, Gripper
from asset2sim.physics.arrays import Array
from asset2sim.render.camera import FILM_FOV, Camera, fitted_camera
from asset2sim.render.draw import Picture, background, over_ground
from asset2sim.render.sight import Known
from lab.trials.actors import Actor, arm_actor, bowl_actor, object_actor, pusher_actor
from lab.trials.record import Track
from lab.trials.scene import Bowl
from schemas.errors import UsageError

SIDE, RATE = 512, 15
"""Edge of a picture, pixels, and pictures a second."""
BEFORE_S, AFTER_S, MOVES = 1.0, 1.0, 0.02
"""Time shown before the action and after it, s, and the speed of a joint or link from which it is one, rad/s or m/s:
slower creeping is not seen."""
VIEWS = (0.6, -0.6, 0.2, -0.2, 1.1, -1.1)
"""Azimuths from which it may be filmed, rad from where the object's front faces, best first."""
BESIDE = 0.9
"""Least angle between that and where the arm's base stands, rad: the arm is not before the object."""
ABOVE = 0.42
"""How far above, as the tangent of the angle."""
STILL_M = 2e-4
"""Change of any number of a transform below which a picture is the one before."""
ROOM_M = 0.07
"""How much is seen around the object, m."""


def film_frames(track: Track) -> Ints:
    """(frames,) the samples that are shown, ``RATE`` a second: from a little before the object is touched or moves
    until it rests; all where neither happens."""
    moves = np.abs(np.diff(track.positions, axis=0)).max(axis=1, initial=0.0) / np.diff(track.times_s) > MOVES
    travels = np.linalg.norm(np.diff(track.poses[:, :, :3, 3], axis=0), axis=2).max(axis=1, initial=0.0)
    acts = np.flatnonzero(track.touched[1:] | moves | (travels / np.diff(track.times_s) > MOVES))
    ends = track.times_s[[0, -1]]
    if len(acts):
        ends = np.clip(track.times_s[acts[[0, -1]]] + (-BEFORE_S, AFTER_S), *ends)
    due = np.arange(ends[0], ends[1] + 1e-9, 1.0 / RATE)
    return np.unique(np.clip(np.searchsorted(track.times_s, due - 1e-9), 0, len(track.times_s) - 1))


def film(folder: Path, track: Track, base: Array, bowl: Bowl | None, gripper: Gripper = PANDA) -> Iterator[Picture]:
    """(SIDE, SIDE, 3) pictures of a trial with the refined object in ``folder``, ``RATE`` a second."""
    chosen = film_frames(track)
    thing, front = object_actor(folder, track, chosen)
    tool = track.tool[chosen]
    actors = [pusher_actor(tool) if tool.shape[1] == 3 else arm_actor(tool, base, gripper), thing]
    if bowl is not None:
        actors.append(bowl_actor(bowl, len(chosen)))
    camera = camera_of(thing, front, base, bowl)
    ground, known = background(camera, disc=False), Known()
    before: list[Array] = []
    for frame in range(len(chosen)):
        motions = [actor.motions[frame] for actor in actors]
        if not before or max(np.abs(now - then).max() for now, then in zip(motions, before, strict=True)) > STILL_M:
            faces = [actor.faces for actor in actors]
            picture, before = over_ground(list(zip(faces, motions, strict=True)), camera, ground, known), motions
        yield picture


def wrapped(angle: float) -> float:
    """An angle as one between -π and π, rad."""
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def camera_of(thing: Actor, front: Array, base: Array, bowl: Bowl | None) -> Camera:
    """A camera beside the arm that shows the object wherever it is at the start, and the hand about it."""
    corners = thing.faces.corners.reshape(-1, 3)
    links = np.repeat(thing.faces.link, 3)
    first = thing.motions[0]
    points = np.einsum("pjk,pk->pj", first[links, :, :3], corners) + first[links, :, 3]
    low, high = points.min(axis=0) - ROOM_M, points.max(axis=0) + ROOM_M
    if bowl is not None:
        reach = bowl.radius_m * 1.4
        low = np.minimum(low, [bowl.at[0] - reach, bowl.at[1] - reach, 0.0])
        high = np.maximum(high, [bowl.at[0] + reach, bowl.at[1] + reach, 0.0])
    low[2], high[2] = 0.0, max(high[2], 0.2)
    box = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    arm, ahead = (float(np.arctan2(vector[1], vector[0])) for vector in (base[:2, 3], front))
    azimuth = next((ahead + view for view in VIEWS if abs(wrapped(ahead + view - arm)) >= BESIDE), arm + BESIDE)
    towards = np.array([np.cos(azimuth), np.sin(azimuth), ABOVE])
    towards /= np.linalg.norm(towards)
    return fitted_camera(box, towards, FILM_FOV, SIDE, SIDE)


def write_mp4(frames: Iterator[Picture], to: Path, rate: float = RATE) -> int:
    """Write the pictures, ``rate`` a second, as H.264 in an MP4 that browsers play from its first bytes; how many there
    were. Raises UsageError where the package ``av`` is not installed."""
    try:
        import av
    except ImportError:
        raise UsageError("writing MP4 files needs the package av: pip install ./lab") from None
    count = 0
    with av.open(str(to), "w", options={"movflags": "+faststart"}) as container:
        stream = container.add_stream("libx264", rate=Fraction(rate), options={"crf": "24", "preset": "fast"})
        stream.pix_fmt = "yuv420p"
        for picture in frames:
            if not count:
                stream.height, stream.width = picture.shape[:2]
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
            count += 1
        container.mux(stream.encode())
    return count
