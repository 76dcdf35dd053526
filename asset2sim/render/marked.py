"""Pictures for a model that is asked about an asset: its looks with every edge drawn, and its links in colours of their
own with their names beside them, as it stands, closed and open."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from scipy.ndimage import distance_transform_edt

from asset2sim.assets.extract import Extraction
from asset2sim.assets.surfaces.scene import Scene, load_scene
from asset2sim.assets.surfaces.surface import Floats, Paint, Surface
from asset2sim.guidance.link_colors import GREY, PALETTE, mark_names
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from asset2sim.render.camera import Camera, Singles, view_camera
from asset2sim.render.canonical import over_background, png_bytes
from asset2sim.render.faces import faces_of
from asset2sim.render.sight import Sight, seen, standing
from schemas.features import Features, JointFeatures
from schemas.model_names import is_local
from schemas.request import LabelledImage
from schemas.settings import Settings

OVERSAMPLING = 1.25
"""Pixels drawn per pixel shown, along each side; the edges that are drawn hide the steps of more."""
LOOKS = ("perspective", "front", "left", "back")
"""Views of the looks; the perspective is from the front right and above: it shows the right side and the top."""
CREASE = 0.5
"""Change of a surface's slope from one pixel to the next from which an edge is drawn: that of a bend by 27°."""
MOVED = 0.03
"""Distance that a link must move, as a share of the object's longest edge, for a picture of its own."""
HIDDEN_PX, MUCH_MORE = 60, 3.0
"""Pixels of a link below which it is looked for from behind, and how much more must be seen of it there."""
Links = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Marked:
    """A picture of the links in their colours: the frame's edges drawn, and (h, w) which link each pixel shows, -1 for
    none, as numbers into ``links``."""

    image: Image.Image
    shown: Links
    links: tuple[str, ...]

    def seen_px(self, link: str) -> int:
        """Pixels that show a link."""
        return int((self.shown == self.links.index(link)).sum()) if link in self.links else 0


def question_pictures(
    extraction: Extraction, settings: Settings, names: Mapping[str, str] | None = None, views: Sequence[str] = LOOKS
) -> tuple[LabelledImage, ...]:
    """The labelled pictures for a question about the asset, its looks from these ``views`` first; none for a model that
    takes none, being tables or files. ``names`` are those that are written beside the links, where they are called
    otherwise. Raises AssetError where there is nothing to draw."""
    if is_local(settings.model.model):
        return ()
    side = settings.model.image_side_px
    loaded: dict[Path, tuple[Surface, ...]] = {}
    scene = load_scene(extraction.urdf, {}, loaded, extraction.features.front)
    pictures = plain_pictures(scene, side, views)
    names = {link: link for link in mark_names(extraction.features)} if names is None else names
    parts = marked_pictures(scene, extraction.features, side)
    behind = marked_pictures(scene, extraction.features, side, behind=True)
    pictures["parts"] = with_names(parts.image, parts.shown, shown_names(parts, extraction.features, names))
    colors = mark_names(extraction.features)
    hidden = [
        link
        for link in behind.links
        if colors[link] in PALETTE and parts.seen_px(link) < HIDDEN_PX <= behind.seen_px(link) / MUCH_MORE
    ]
    if hidden:
        pictures["parts_behind"] = with_names(
            behind.image, behind.shown, shown_names(behind, extraction.features, names)
        )
    for label, positions in end_poses(extraction.features).items():
        scene = load_scene(extraction.urdf, positions, loaded, extraction.features.front)
        posed = marked_pictures(scene, extraction.features, side)
        pictures[label] = with_names(posed.image, posed.shown, shown_names(posed, extraction.features, names))
    return tuple(LabelledImage(label=label, png=png_bytes(image)) for label, image in pictures.items())


def end_pictures(
    extraction: Extraction, settings: Settings, shown: Sequence[tuple[JointFeatures, Mapping[str, float]]]
) -> tuple[LabelledImage, ...]:
    """A picture of the looks, and of each joint at each labelled position (rad or m at the authored scale) one with the
    links in their colours, all others closed, from the side from which more of its part is seen; none for a model that
    takes none. Raises AssetError where there is nothing to draw."""
    if is_local(settings.model.model):
        return ()
    features, side = extraction.features, settings.model.image_side_px
    loaded: dict[Path, tuple[Surface, ...]] = {}
    scene = load_scene(extraction.urdf, {}, loaded, features.front)
    pictures = plain_pictures(scene, side, LOOKS[:1])
    closed = {joint.name: joint.closed or 0.0 for joint in features.movable_joints if joint.mimic is None}
    names = {link: link for link in mark_names(features)}
    for joint, labelled in shown:
        poses = [{**closed, joint.name: position} for position in labelled.values()]
        scenes = [load_scene(extraction.urdf, pose, loaded, features.front) for pose in poses]
        sides = [[marked_pictures(scene, features, side, behind=far) for scene in scenes] for far in (False, True)]
        best = max(sides, key=lambda found: sum(picture.seen_px(joint.child) for picture in found))
        for label, picture in zip(labelled, best, strict=True):
            tags = shown_names(picture, features, names)
            pictures[label] = with_names(picture.image, picture.shown, tags)
    return tuple(LabelledImage(label=label, png=png_bytes(image)) for label, image in pictures.items())


def plain_pictures(scene: Scene, side: int, views: Sequence[str]) -> dict[str, Image.Image]:
    """View → picture of the asset as it looks, with its edges."""
    faces = faces_of(scene)
    found = {}
    for name in views:
        camera = view_camera(name, faces.points, scene.front, side, side).magnified(OVERSAMPLING)
        sight = seen([standing(faces)], camera)
        found[name] = over_background(sight, camera, side, side, outlines(sight, camera))
    return found


def marked_pictures(scene: Scene, features: Features, side: int, *, behind: bool = False) -> Marked:
    """The links in their colours, seen from the front right and above, or from behind on the left."""
    colors = mark_names(features)
    links = tuple(colors)
    paints = {link: Paint((*PALETTE.get(color, GREY), 1.0)) for link, color in colors.items()}
    surfaces = tuple(
        replace(surface, paint=paints[link], uv=None) for surface, link in zip(scene.surfaces, scene.links, strict=True)
    )
    faces = faces_of(replace(scene, surfaces=surfaces))
    front = -scene.front if behind else scene.front
    camera = view_camera("perspective", faces.points, front, side, side).magnified(OVERSAMPLING)
    sight = seen([standing(faces)], camera)
    owner = np.array([links.index(link) for link in faces.links])
    shown = np.where(sight.face >= 0, owner[faces.link[sight.face]], -1).reshape(camera.height, camera.width)
    edges = np.maximum(outlines(sight, camera), borders(shown))
    image = over_background(sight, camera, side, side, edges)
    steps = np.minimum((np.arange(side) + 0.5) * OVERSAMPLING, camera.width - 1).astype(np.int64)
    return Marked(image, shown[steps][:, steps], links)


def outlines(sight: Sight, camera: Camera) -> Singles:
    """(h, w) 0 to 1: silhouettes, and creases where the surface bends. Over a plane one over the distance is linear in
    the picture, so that its second difference, over itself, is how the slope changes."""
    distance = sight.depth.reshape(camera.height, camera.width)
    near = 1.0 / distance
    bend = np.zeros_like(near)
    bend[1:-1] = np.abs(near[2:] - 2.0 * near[1:-1] + near[:-2])[:]
    bend[:, 1:-1] = np.maximum(bend[:, 1:-1], np.abs(near[:, 2:] - 2.0 * near[:, 1:-1] + near[:, :-2]))
    slope = bend * np.where(np.isfinite(distance), distance, 0.0) * camera.focal
    return np.clip(slope / CREASE - 1.0, 0.0, 1.0).astype(np.float32)


def borders(shown: Links) -> Singles:
    """(h, w) 1 where a pixel and its right or lower neighbour show different links."""
    edge = np.zeros(shown.shape, dtype=np.float32)
    edge[:, :-1] = shown[:, :-1] != shown[:, 1:]
    edge[:-1] = np.maximum(edge[:-1], shown[:-1] != shown[1:])
    return edge


def shown_names(picture: Marked, features: Features, names: Mapping[str, str]) -> dict[int, tuple[str, Floats]]:
    """Number of a link → the name to write beside it and its colour, of the links that have one of their own."""
    colors = mark_names(features)
    return {
        index: (names.get(link, link), np.asarray(PALETTE[colors[link]]))
        for index, link in enumerate(picture.links)
        if colors[link] in PALETTE
    }


def end_poses(features: Features) -> dict[str, dict[str, float]]:
    """Label → joint positions of the pictures at the ends of travel, each only where it differs from position 0. Of
    parts that hang from a part that opens, only the outer one is opened."""
    closed = {joint.name: joint.closed or 0.0 for joint in features.movable_joints if joint.mimic is None}
    opening = [
        joint for joint in features.movable_joints if joint.mimic is None and moves_visibly(features, joint, closed)
    ]
    children = {joint.child for joint in opening}
    parents = {joint.child: joint.parent for joint in features.joints}

    def hangs(link: str) -> bool:
        seen = set[str]()
        while link in parents and link not in seen and link not in children:
            seen.add(link)
            link = parents[link]
        return link in children

    outer = {joint.name: joint.open or 0.0 for joint in opening if not hangs(joint.parent)}
    found = {}
    if visible_shift(features, {}, closed) > MOVED:
        found["parts_closed"] = closed
    if outer and visible_shift(features, {}, closed | outer) > MOVED:
        found["parts_open"] = closed | outer
    return found


def moves_visibly(features: Features, joint: JointFeatures, closed: Mapping[str, float]) -> bool:
    """Whether a joint moves its part far enough to be seen."""
    return visible_shift(features, closed, {**closed, joint.name: joint.open or 0.0}) > 2.0 * MOVED


def visible_shift(features: Features, before: Mapping[str, float], after: Mapping[str, float]) -> float:
    """How far the corners of the links' boxes move between two states, at most, as a share of the longest edge."""
    tree = tree_of(features.joints)
    poses = [link_to_root(tree, features.root, positions) for positions in (before, after)]
    farthest = 0.0
    for link in features.links:
        if link.has_geometry:
            grid = np.array(np.meshgrid(*zip(link.box_min, link.box_max, strict=True))).reshape(3, -1).T
            first, second = (apply(pose[link.name], grid) for pose in poses)
            farthest = max(farthest, float(np.linalg.norm(first - second, axis=1).max()))
    return farthest / max(max(features.closed_size), 1e-12)


TEXT_PX = 14
"""Height of the names, px."""
MARGIN = 3
"""Space around a name, px."""
FEWEST_PX = 12
"""Pixels of a part below which it gets no name: it cannot be seen."""
WAYS = 24
"""Directions in which a place for a name is looked for."""
RADII = (0, 24, 36, 50, 66, 84, 104, 128, 156, 190)
"""Distances from the part at which it is, px."""
Box = tuple[int, int, int, int]


def with_names(image: Image.Image, shown: Links, names: Mapping[int, tuple[str, Floats]]) -> Image.Image:
    """The picture with the name of each part that it shows, on a tag bordered in the part's colour; a line leads to the
    part where the tag is not on it. ``shown`` is (h, w) the number of the part in each pixel, ``names`` number → name
    and colour, sRGB 0 to 1."""
    canvas = image.convert("RGB")
    draw = ImageDraw.Draw(canvas)
    font = ImageFont.load_default(TEXT_PX)
    areas = {number: int((shown == number).sum()) for number in names}
    weight = np.full(shown.shape, 1e-5)
    for number, area in areas.items():
        if area:
            weight[shown == number] = 1.0 / area
    placed: list[Box] = []
    tags: list[tuple[Box, tuple[int, int], str, tuple[int, ...]]] = []
    for number in sorted((n for n in names if areas[n] >= FEWEST_PX), key=lambda n: areas[n]):
        name, color = names[number]
        inside = distance_transform_edt(np.pad(shown == number, 1))[1:-1, 1:-1]
        y, x = (int(v) for v in np.unravel_index(int(inside.argmax()), inside.shape))
        left, _, right, bottom = (int(v) for v in draw.textbbox((0, 0), name, font=font))
        size = (right - left + 2 * MARGIN, bottom + 2 * MARGIN)
        box = tag_box((x, y), size, weight, placed)
        if box is None:
            continue
        placed.append(box)
        tags.append((box, (x, y), name, tuple(int(255 * level) for level in color)))
    for box, at, _, paint in tags:
        nearest = (min(max(at[0], box[0]), box[2]), min(max(at[1], box[1]), box[3]))
        if nearest != at:
            draw.line((nearest, at), fill=(255, 255, 255), width=4)
            draw.line((nearest, at), fill=(0, 0, 0), width=2)
            draw.ellipse((at[0] - 4, at[1] - 4, at[0] + 4, at[1] + 4), fill=paint, outline=(0, 0, 0))
    for box, _, name, paint in tags:
        draw.rectangle(box, fill=(255, 255, 255), outline=(0, 0, 0), width=1)
        draw.rectangle((box[0] + 1, box[1] + 1, box[2] - 1, box[3] - 1), outline=paint, width=2)
        draw.text((box[0] + MARGIN, box[1] + MARGIN - 1), name, fill=(0, 0, 0), font=font)
    return canvas


def tag_box(at: tuple[int, int], size: tuple[int, int], weight: Floats, placed: list[Box]) -> Box | None:
    """The box (left, top, right, bottom) of a tag of this ``size`` near a point, px: on no other tag, where it hides
    least; None where there is no room. ``weight`` is what hiding each pixel costs."""
    height, width = weight.shape
    best: tuple[float, Box | None] = (np.inf, None)
    for radius in RADII:
        for way in range(WAYS if radius else 1):
            angle = 2.0 * np.pi * way / WAYS
            left = round(at[0] + radius * np.cos(angle) * 1.4 - size[0] / 2)
            top = round(at[1] + radius * np.sin(angle) - size[1] / 2)
            box = (left, top, left + size[0], top + size[1])
            if left < 0 or top < 0 or box[2] >= width or box[3] >= height:
                continue
            if any(box[0] < b[2] + 2 and b[0] < box[2] + 2 and box[1] < b[3] + 2 and b[1] < box[3] + 2 for b in placed):
                continue
            cost = float(weight[top : box[3], left : box[2]].sum()) + radius / 400.0
            if cost < best[0]:
                best = (cost, box)
    return best[1]
