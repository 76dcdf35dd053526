"""Charts of the report: inline SVG that says its numbers, whatever they are."""

import xml.etree.ElementTree as ET

from hypothesis import given, settings
from hypothesis import strategies as st

from asset2sim.report.charts import histogram, line, ticks_of


def titles(svg: str) -> list[str]:
    return [item.text or "" for item in ET.fromstring(svg).iter("title")]


def test_a_histogram_counts_in_bins_of_1_2_5_and_leaves_out_what_is_no_size() -> None:
    svg = histogram([1.0, 1.9, 2.0, 5.0, 9.9, 0.0, -1.0, float("nan"), float("inf"), None], "kg", "mass")
    assert titles(svg) == ["1 to 2 kg: 2 objects", "2 to 5 kg: 1 object", "5 to 10 kg: 2 objects"]
    assert 'aria-label="mass"' in svg and histogram([0.0, None], "kg", "mass") == ""


@given(st.lists(st.floats(1e-9, 1e9), min_size=1, max_size=50))
@settings(derandomize=True)
def test_a_histogram_counts_every_value_once(values: list[float]) -> None:
    assert sum(int(title.split(": ")[1].split(" ")[0]) for title in titles(histogram(values, "N", "x"))) == len(values)


@given(st.floats(-1e6, 1e6), st.floats(0.0, 1e6))
@settings(derandomize=True)
def test_ticks_span_what_is_shown_and_are_few(low: float, way: float) -> None:
    ticks = ticks_of(low, low + way)
    assert 2 <= len(ticks) <= 7 and ticks[0] <= low + 1e-9 * max(abs(low), way) and ticks == sorted(ticks)


def test_a_line_has_a_dot_with_words_at_each_point_while_they_are_few() -> None:
    points = [(float(day), 90.0 + day) for day in range(5)]
    svg = line(points, [f"day {day}" for day in range(5)], "share", str, str, (90.0, 100.0))
    assert titles(svg) == [f"day {day}" for day in range(5)] and svg.count("<path") == 1
    many = [(float(day), 90.0) for day in range(365)]
    assert titles(line(many, [""] * 365, "share", str, str, (90.0, 100.0))) == []
    assert 'fill="var(--bar)"' in svg, "the page's own colours"
