"""A link's covering in words: the materials of its OBJ and COLLADA files and of its URDF, by the area they cover."""

import colorsys
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import yourdfpy
from lxml import etree
from PIL import Image

from asset2sim.assets.urdf.mesh_files import libraries_of, library_problem
from asset2sim.storage.regular_files import is_file

MOST_PAINTS = 6
"""Paints that are named of a link: those that cover most of it."""
CLEAR = 0.95
"""Opacity below which a paint is called see-through."""
SHINY = 0.3
"""Specular level from which a paint is called shiny; exporters write less without meaning it."""
_NO_NAME = re.compile(
    r"(?:materials?|mat|color|colour|default|initialshadinggroup|lambert|blinn|phong|none|foo)?[\W\d_]*$", re.I
)
"""Names that exporters give."""
_NO_PART = re.compile(r"(?:objs?|mesh|original|visual|shape|new)?[\W\d_]*$", re.I)


@dataclass(frozen=True)
class MtlPaint:
    """One material of a library: its name, RGB 0 to 1, opacity 0 to 1, specular level 0 to 1, and its picture."""

    name: str
    rgb: tuple[float, float, float] = (0.8, 0.8, 0.8)
    opacity: float = 1.0
    specular: float = 0.0
    picture: Path | None = None

    def words(self) -> str:
        """The paint in words, such as "dark brown picture" or "light blue, see-through 40 %"."""
        mean = None if self.picture is None else mean_color(self.picture)
        said = color_words(self.rgb) if mean is None else f"{color_words(mean)} picture"
        if self.opacity < CLEAR:
            said += f", see-through {100 * (1 - self.opacity):.0f} %"
        if self.specular > SHINY:
            said += ", shiny"
        return said if _NO_NAME.match(self.name) else f"{said} ({self.name})"


def color_words(rgb: tuple[float, float, float]) -> str:
    """A colour in plain words; ``rgb`` is sRGB, 0 to 1."""
    hue, saturation, value = colorsys.rgb_to_hsv(*(min(max(level, 0.0), 1.0) for level in rgb))
    if value < 0.13:
        return "black"
    if saturation * value < 0.1:
        greys = ((0.35, "dark grey"), (0.6, "grey"), (0.85, "light grey"))
        return next((word for most, word in greys if value < most), "white")
    degrees = 360.0 * hue
    if 15.0 <= degrees < 50.0 and (value < 0.7 or saturation < 0.45):
        shade = "beige" if value >= 0.7 else "brown"
        return f"dark {shade}" if value < 0.35 else shade
    hues = ((15, "red"), (42, "orange"), (70, "yellow"), (165, "green"), (195, "turquoise"), (260, "blue"),
            (290, "purple"), (340, "pink"))  # fmt: skip
    word = next((word for most, word in hues if degrees < most), "red")
    return f"dark {word}" if value < 0.45 else f"light {word}" if saturation < 0.45 else word


def mean_color(picture: Path) -> tuple[float, float, float] | None:
    """A picture's mean colour, sRGB 0 to 1; None where it cannot be read."""
    try:
        return _mean_color(picture, picture.stat().st_mtime_ns)
    except OSError:
        return None


@lru_cache(maxsize=256)
def _mean_color(picture: Path, _mtime_ns: int) -> tuple[float, float, float] | None:
    try:
        with Image.open(picture) as image:
            image.draft("RGB", (16, 16))
            small = np.asarray(image.convert("RGB").resize((8, 8), Image.Resampling.BOX), dtype=float)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):  # what Pillow raises on a bad picture
        return None
    red, green, blue = (small.reshape(-1, 3).mean(axis=0) / 255.0).tolist()
    return red, green, blue


def obj_paints(obj: Path) -> dict[MtlPaint, float]:
    """Material of an OBJ → the share of its faces that it covers; empty where it names none that can be read."""
    try:
        content = b"\n" + obj.read_bytes()
        known = {paint.name: paint for name in libraries_of(obj) for paint in library_paints(obj.parent / name)}
    except OSError:
        return {}
    pieces = re.split(rb"\n[ \t]*usemtl[ \t]+([^\r\n]*)", content)
    faces: dict[MtlPaint, int] = {}
    for name, text in zip(pieces[1::2], pieces[2::2], strict=True):
        paint = known.get(name.decode("utf-8", "replace").strip())
        if paint is not None:
            faces[paint] = faces.get(paint, 0) + text.count(b"\nf ")
    total = sum(faces.values())
    return {paint: count / total for paint, count in faces.items() if count}


def dae_paints(dae: Path) -> dict[MtlPaint, float]:
    """Material of a COLLADA file → the share of its faces that it covers; empty where none can be read."""
    try:
        root = etree.parse(str(dae), etree.XMLParser(resolve_entities=False, no_network=True)).getroot()
    except (OSError, etree.XMLSyntaxError):
        return {}
    bound = {item.get("symbol"): str(item.get("target"))[1:] for item in root.iter("{*}instance_material")}
    materials = {item.get("id"): item for item in root.iter("{*}material")}
    effects = {item.get("id"): item for item in root.iter("{*}effect")}
    faces: dict[MtlPaint, int] = {}
    for item in root.iter("{*}triangles", "{*}polylist", "{*}polygons"):
        material = materials.get(bound.get(item.get("material"), str(item.get("material"))))
        if material is not None and str(item.get("count")).isdigit():
            effect = effects.get(str(next((i.get("url") for i in material.iter("{*}instance_effect")), ""))[1:])
            colors = [] if effect is None else [c.text for d in effect.iter("{*}diffuse") for c in d.iter("{*}color")]
            name = str(material.get("name") or material.get("id"))
            paint = paint_of({"name": name, "kd": " ".join(str(next(iter(colors), "")).split())}, dae.parent)
            faces[paint] = faces.get(paint, 0) + int(str(item.get("count")))
    total = sum(faces.values())
    return {paint: count / total for paint, count in faces.items() if count}


def library_paints(library: Path) -> tuple[MtlPaint, ...]:
    """The materials of an MTL file; none where it cannot be read."""
    if library_problem(library) is not None:
        return ()
    found: list[dict[str, str]] = []
    for line in library.read_text(encoding="utf-8", errors="replace").splitlines():
        key, _, rest = line.strip().partition(" ")
        if key.lower() == "newmtl":
            found.append({"name": rest.strip()})
        elif found and rest.strip():
            found[-1][key.lower()] = rest.strip()
    return tuple(paint_of(item, library.parent) for item in found)


def paint_of(item: Mapping[str, str], folder: Path) -> MtlPaint:
    """One material from its lines, key → words; what is no number counts as left out."""
    rgb, shine = colour_levels(item.get("kd", ""), 3), colour_levels(item.get("ks", ""), 3)
    clear, hidden = colour_levels(item.get("d", "").split(" ")[-1], 1), colour_levels(item.get("tr", ""), 1)
    picture = folder / item["map_kd"].split(" -")[-1] if "map_kd" in item else None
    if picture is not None and not is_file(picture):
        picture = folder / item["map_kd"].split(" ")[-1]
    return MtlPaint(
        item["name"],
        (rgb[0], rgb[1], rgb[2]) if rgb else MtlPaint.rgb,
        clear[0] if clear else 1.0 - hidden[0] if hidden else 1.0,
        max(shine) if shine else 0.0,
        picture if picture is not None and is_file(picture) else None,
    )


def colour_levels(text: str, count: int) -> list[float]:
    """The first ``count`` numbers of a line, each brought into 0 to 1; empty where they are not that many."""
    try:
        found = [float(word) for word in text.split()[:count]]
    except ValueError:
        return []
    return [min(max(value, 0.0), 1.0) for value in found] if len(found) == count and np.isfinite(found).all() else []


def part_words(name: str | None) -> str:
    """A visual's name as the word for a part ("rotation_lid-part12" is "rotation lid"); "" where it says nothing."""
    said = re.sub(r"\[.*?\]|[-_ ]*part(?=\W|\d|$)|[-_ .]?\d+$", "", name or "").strip(" -_.\"'")
    return "" if _NO_PART.match(said) else said.replace("_", " ")


def link_paints(painted: Iterable[tuple[yourdfpy.Visual, Path | None, float]]) -> tuple[str, ...]:
    """The paints of a link's visuals in words, those that cover most first: part, colour, share of the link's area.
    ``painted``: each visual with its mesh file (None for a primitive) and its area, m²."""
    areas: dict[str, float] = {}
    for visual, file, area in painted:
        part = part_words(visual.name)
        read = None if file is None else {".obj": obj_paints, ".dae": dae_paints}.get(file.suffix.lower())
        found = read(file) if read is not None and file is not None else {}
        own = [(paint.words(), share) for paint, share in found.items()]
        for words, share in own or [(urdf_paint(visual.material), 1.0)]:
            said = f"{part}: {words}" if part and words else part or words
            if said:
                areas[said] = areas.get(said, 0.0) + share * area
    total = sum(areas.values()) or 1.0
    most = sorted(areas.items(), key=lambda item: (-item[1], item[0]))[:MOST_PAINTS]
    return tuple(f"{said}, {max(100 * area / total, 1.0):.0f} %" if len(areas) > 1 else said for said, area in most)


def urdf_paint(material: "yourdfpy.Material | None") -> str:
    """A URDF's material in words; "" without one."""
    if material is None:
        return ""
    rgba = None if material.color is None else material.color.rgba
    if rgba is None or not np.isfinite(rgba).all():
        return str(material.name or "")
    red, green, blue, alpha = (float(value) for value in rgba)
    return MtlPaint(str(material.name or ""), (red, green, blue), alpha).words()
