"""Charts as inline SVG, by leather, in the page's own colours: they need no script and follow dark and light."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from typing import Any

import leather
from leather import theme
from leather.axis import Axis
from leather.scales import Ordinal, Scale
from leather.series import Series
from leather.shapes import Columns, Dots, Line

from asset2sim.catalog.text import significant

WIDTH, HEIGHT = 420, 190
"""Size of a chart's coordinates; the page scales it."""
MOST_TICKS = 6
"""Ticks of an axis at most."""
MOST_DOTS = 60
"""Points of a line up to which each has a dot, which shows its values."""
DECADE = (1.0, 2.0, 5.0)
"""Steps of bins and ticks within a decade."""

for _name in ("label_color", "axis_title_color", "title_color", "legend_color"):
    setattr(theme, _name, "var(--quiet)")
for _name in ("tick_font_family", "axis_title_font_family"):
    setattr(theme, _name, "inherit")
theme.background_color, theme.tick_color, theme.zero_color = "none", "var(--grid)", "var(--quiet)"
theme.tick_font_size = theme.axis_title_font_size = theme.axis_title_font_char_height = 11
theme.tick_font_char_height, theme.tick_font_char_width = 11, 6
theme.axis_title_gap, theme.margin = 5, 0.025


class Straight(Scale):  # type: ignore[misc]
    """A linear scale without leather's search for ticks, which takes most of a chart's time."""

    def __init__(self, low: float, high: float) -> None:
        self._low, self._way = low, (high - low) or 1.0

    def contains(self, v: float) -> bool:
        """Always: the caller made the scale of its data."""
        return True

    def project(self, value: float, range_min: float, range_max: float) -> float:
        """Where a value lies between the ends of the range, pixels."""
        return float(range_min) + (float(value) - self._low) / self._way * (float(range_max) - float(range_min))


class DottedLine(Line):  # type: ignore[misc]
    """A line with a dot at each point: one series, where leather's own two would want a legend."""

    def to_svg(
        self, width: float, height: float, x_scale: Scale, y_scale: Scale, series: Series, palette: object
    ) -> ET.Element:
        """The line's group, with its dots."""
        group: ET.Element = super().to_svg(width, height, x_scale, y_scale, series, palette)
        dots = Dots("var(--bar)", 3.5).to_svg(width, height, x_scale, y_scale, series, palette)
        group.extend(list(dots))
        return group


def histogram(values: Sequence[float | None], unit: str, title: str, what: str = "object") -> str:
    """Histogram of positive values, in bins of 1, 2, 5, 10, …; ``""`` where there are none. ``what`` is counted."""
    found = [value for value in values if value is not None and math.isfinite(value) and value > 0.0]
    if not found:
        return ""
    low, high = _bin_of(min(found)), _bin_of(max(found))
    edges = [float(f"{10.0 ** (i // 3) * DECADE[i % 3]:.6g}") for i in range(low, high + 2)]
    counts = [0] * (high - low + 1)
    for value in found:
        counts[_bin_of(value) - low] += 1
    names = [f"{edge:g}" for edge in edges[:-1]]
    told = [
        f"{name} to {after:g} {unit}: {count_in_words(count, what)}"
        for name, after, count in zip(names, edges[1:], counts, strict=True)
    ]
    every = max(1, math.ceil(len(names) / 9))
    return columns(names, counts, told, title, lambda name, index: name if index % every == 0 else "", unit)


def columns(
    names: Sequence[str],
    counts: Sequence[int],
    told: Sequence[str],
    title: str,
    label: Callable[[str, int], str] = lambda name, index: name,
    unit: str = "",
) -> str:
    """A column a name, ``told`` what each says when pointed at."""
    chart, ticks = leather.Chart(), ticks_of(0.0, float(max(counts)))
    chart.set_x_scale(Ordinal(list(names)))
    chart.set_y_scale(Straight(0.0, ticks[-1]))
    chart.set_x_axis(Axis(list(names), lambda name, index, _: label(name, index), unit or None))
    chart.set_y_axis(Axis(ticks, lambda value, *_: significant(value)))
    chart.add_series(Series(list(zip(names, counts, strict=True))), Columns("var(--bar)"))
    return _svg(chart, title, told)


def line(
    points: Sequence[tuple[float, float]],
    told: Sequence[str],
    title: str,
    x_label: Callable[[float], str],
    y_label: Callable[[float], str],
    span: tuple[float, float],
    x_name: str | None = None,
) -> str:
    """A line through points in the order given, with dots where they are few; ``span`` is the y axis's."""
    chart, ticks = leather.Chart(), ticks_of(*span)
    low, high = points[0][0], points[-1][0]
    chart.set_x_scale(Straight(low, high if high > low else low + 1.0))
    chart.set_y_scale(Straight(min(span[0], ticks[0]), max(span[1], ticks[-1])))
    step = max(1, math.ceil(len(points) / MOST_TICKS))
    chart.set_x_axis(Axis([x for x, _ in points][::step], lambda value, *_: x_label(value), x_name))
    chart.set_y_axis(Axis(ticks, lambda value, *_: y_label(value)))
    few = len(points) <= MOST_DOTS
    chart.add_series(Series(list(points)), (DottedLine if few else Line)("var(--bar)", 2))
    return _svg(chart, title, told if few else ())


def ticks_of(low: float, high: float) -> list[float]:
    """Round values from at or below ``low`` to at or above ``high``, ``MOST_TICKS`` at most."""
    high = high if high - low > max(1e-12, 1e-9 * abs(low)) else low + 1.0
    way = high - low
    steps = (10.0**power * step for power in range(math.floor(math.log10(way)) - 1, 20) for step in DECADE)
    step = next(step for step in steps if math.ceil(high / step) - math.floor(low / step) < MOST_TICKS)
    return [index * step for index in range(math.floor(low / step), math.ceil(high / step) + 1)]


def _bin_of(value: float) -> int:
    decade = math.floor(math.log10(value) + 1e-12)
    return 3 * decade + sum(value >= 10.0**decade * step * (1.0 - 1e-12) for step in DECADE) - 1


def count_in_words(count: int, what: str) -> str:
    """A count of things: "1 object", "2 objects"."""
    return f"1 {what}" if count == 1 else f"{count} {what}s"


def _svg(chart: Any, title: str, told: Sequence[str]) -> str:
    group = chart.to_svg_group(WIDTH, HEIGHT)
    svg = ET.Element("svg", {"viewBox": f"0 0 {WIDTH} {HEIGHT}", "role": "img", "class": "chart", "aria-label": title})
    svg.append(group)
    group.remove(group[0])
    marks = [mark for series in svg.iter("g") if "series" in series.get("class", "") for mark in series]
    pointed = [mark for mark in marks if mark.tag != "path"]
    for mark, words in zip(pointed, told, strict=False):
        ET.SubElement(mark, "title").text = words
    for element in svg.iter():
        for name, value in element.attrib.items():
            element.set(name, _short(value))
        if element.get("fill") == "var(--bar)":
            element.set("class", "mark")
    return ET.tostring(svg, encoding="unicode")


def _short(value: str) -> str:
    """Coordinates with one decimal: a tenth of a pixel is not visible, and the page is smaller."""
    words = value.split(" ") if value[:1].isdigit() or value[:2] == "M " or value[:1] == "-" else [value]
    return " ".join(f"{float(word):.1f}" if _is_long(word) else word for word in words)


def _is_long(word: str) -> bool:
    return len(word) > 5 and word.replace(".", "", 1).replace("-", "", 1).isdigit()
