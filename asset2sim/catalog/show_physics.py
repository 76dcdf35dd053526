"""Tables of one asset's links and joints, and of what each engine measured, for the terminal."""

from collections.abc import Mapping, Sequence

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.read import FrameRow
from asset2sim.catalog.text import NOTHING, number_table, numbers_in_brackets, significant
from schemas.settings import Thresholds

CHECKS = ("drop", "nudge", "jam", "hold", "release", "reset")
"""The interaction checks in the order of the columns."""

UNITS = {
    "m": {"position": "m", "damping": "N·s/m", "friction": "N", "stiffness": "N/m", "inertia": "kg"},
    "rad": {"position": "rad", "damping": "N·m·s/rad", "friction": "N·m", "stiffness": "N·m/rad", "inertia": "kg·m²"},
}
"""Unit of a joint's positions → the units of its terms."""


def physics_tables(own: Mapping[str, Sequence[FrameRow]]) -> list[RenderableType]:
    """Tables of links and joints, as far as there are any; each number with its source."""
    parts: list[RenderableType] = []
    if own["links"]:
        headings = ("link", "label", "mass kg", "density kg/m³ × hollow or wall", "volume m³", "centre of mass m")
        rows = map(_link, own["links"])
        parts.append(number_table("Links", (*headings, "ixx, iyy, izz kg·m²"), rows, left=2))
    if own["joints"]:
        headings = ("joint", "moves", "starts at", "limits", "closed → open", "damping")
        rows = map(_joint, own["joints"])
        parts.append(number_table("Joints", (*headings, "friction", "stiffness", "effective inertia"), rows, left=2))
    return parts


def _link(link: FrameRow) -> tuple[str, ...]:
    return (
        link["link"],
        link["label"],
        f"{significant(link['mass_kg'])}\n{link['mass_source']}",
        f"{significant(link['density_kg_m3'])} × {_wall(link)}\n{link['material'] or NOTHING}",
        f"{significant(link['volume_m3'])}\n{link['volume_source']}",
        f"{numbers_in_brackets(link[f'com_{axis}_m'] for axis in 'xyz')}\n{link['com_source']}",
        f"{numbers_in_brackets(link[f'i{axis}{axis}_kg_m2'] for axis in 'xyz')}\n{link['inertia_source']}",
    )


def _wall(link: FrameRow) -> str:
    """A shell's wall in millimetres, else the hollow factor."""
    return f"{significant(1e3 * link['wall_m'])} mm" if link.get("wall_m") else significant(link["hollow_factor"])


def _joint(joint: FrameRow) -> tuple[str, ...]:
    units = UNITS[joint["position_unit"]]
    limits = "no limits" if joint["lower"] is None else f"{significant(joint['lower'])} … {significant(joint['upper'])}"
    sure = joint["openness_confidence"]
    return (
        f"{joint['joint']}\n{joint['type']}",
        f"{joint['label']}\n{joint['child'] or ''}",
        f"{significant(joint['initial_position'], units['position'])}\n{joint['position_source']}",
        f"{limits} {units['position']}\n{joint['limits_source']}",
        f"{significant(joint['closed'])} → {significant(joint['open'])}\n"
        + ("" if sure is None else f"{significant(sure, digits=2)} sure"),
        *(
            f"{significant(joint[term], units[term])}\n{joint[f'{term}_source']}"
            for term in ("damping", "friction", "stiffness")
        ),
        significant(joint["effective_inertia"], units["inertia"]),
    )


def measurement_table(asset: FrameRow, limits: Thresholds) -> list[RenderableType]:
    """Table of the measured figures beside the thresholds."""
    if asset["engine"] is None:
        return [Text("\nnot measured", style="dim")]
    title = f"Measured in {asset['engine']} {asset['engine_version']}, Δt {1000.0 * asset['timestep_s']:.2f} ms"
    figures = (
        ("penetration Φ", asset["penetration_mm"], 1000.0 * limits.penetration_m, "mm"),
        ("drift", asset["drift_m"], limits.drift_m, "m"),
        ("drift", asset["drift_rad"], limits.drift_rad, "rad"),
        ("peak speed", asset["peak_speed_m_s"], limits.peak_speed_m_s, "m/s"),
        ("oscillating joints", asset["oscillating_joints"], 0, ""),
    )
    rows = (
        (
            name,
            significant(value, unit),
            significant(limit, unit),
            _verdict(value is not None and value <= limit, "fails"),
        )
        for name, value, limit, unit in figures
    )
    table = number_table(title, ("what", "value", "passes at most", ""), rows, left=1)
    return [table] if asset["finite"] else [table, Text("the simulation left the finite numbers", style="bold red")]


def engine_tables(own: Mapping[str, Sequence[FrameRow]]) -> list[RenderableType]:
    """A table of engines, one of joint efforts, and one of overlapping pairs, as far as there are rows."""
    parts: list[RenderableType] = []
    if measured := own.get("measurements"):
        headings = ("engine", "verdict", "Φ mm", "drift m", "drift rad", *CHECKS, "s")
        parts.append(number_table("Engines", headings, [_engine(row, own["interactions"]) for row in measured], left=2))
    efforts = [row for row in own.get("interactions", ()) if row["test"] in ("opening", "closing")]
    if efforts:
        parts.append(_efforts(efforts))
    if overlaps := own.get("link_overlaps"):
        title, columns = "Links that overlap in the initial state", ("link", "link", "cause", "seen", "deepest mm")
        parts.append(number_table(title, columns, map(_overlap, overlaps), left=4))
    return parts


def _engine(row: FrameRow, checks: Sequence[FrameRow]) -> tuple[str | Text, ...]:
    own = [check for check in checks if check["engine"] == row["engine"] and check["passed"] is not None]
    return (
        f"{row['engine']} {row['engine_version']}",
        _verdict(row["passed"], row["failure_mode"]),
        *(significant(row[name]) for name in ("penetration_mm", "drift_m", "drift_rad")),
        *(_passed([check for check in own if check["test"] == name]) for name in CHECKS),
        f"{row['seconds']:.2f}",
    )


def _verdict(passed: bool, failure: str) -> Text:
    return Text("ok", style="green") if passed else Text(failure, style="bold red")


def _passed(checks: Sequence[FrameRow]) -> Text:
    if not checks:
        return Text(NOTHING, style="dim")
    passed = sum(bool(check["passed"]) for check in checks)
    return Text(f"{passed}/{len(checks)}", style="green" if passed == len(checks) else "bold red")


def _efforts(rows: Sequence[FrameRow]) -> Table:
    """The least efforts in the first engine that measured them: they agree between engines within a few per cent."""
    first = rows[0]["engine"]
    found = {(row["subject"], row["test"]): row["value"] for row in rows if row["engine"] == first}
    title = f"Least effort that moves a joint, in {first} (N·m, or N for sliders)"
    joints = dict.fromkeys(joint for joint, _ in found)
    cells = ((joint, *(significant(found.get((joint, way))) for way in ("opening", "closing"))) for joint in joints)
    return number_table(title, ("joint", "open", "close"), cells, left=1)


def _overlap(row: FrameRow) -> tuple[str, ...]:
    seen = "not seen by default: parent and child" if row["related"] else "by every engine"
    return row["link_a"], row["link_b"], row["cause"], seen, significant(row["depth_mm"])
