"""The tables of objects from other hands, an origin a row: how many are read and pass, what of their files is kept, and
why others fail. Pure."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import pandas as pd

from asset2sim.catalog.text import NOTHING, markdown_table, percent
from schemas.errors import shortened
from schemas.vocabulary import Source, Status

BLOCK = "origins"
"""Name of the page's block."""
SAME_SCALE = 1e-3
"""How far a scale may be from 1 for the object to have the size that its file states."""
QUANTITIES: Mapping[str, tuple[str, str]] = {
    "mass": ("links", "mass_source"),
    "centre": ("links", "com_source"),
    "inertia": ("links", "inertia_source"),
    "damping": ("joints", "damping_source"),
    "friction": ("joints", "friction_source"),
    "springs": ("joints", "stiffness_source"),
    "limits": ("joints", "limits_source"),
}
"""Heading of each quantity → the table and the column that say where its numbers come from."""
REASON_LENGTH = 200
"""Longest reason in the table, in characters; the catalog has it whole."""


class Origin(NamedTuple):
    """One origin: its name, and the rows of its run in three tables of the catalog."""

    name: str
    assets: pd.DataFrame
    links: pd.DataFrame
    joints: pd.DataFrame


def origins_tables(origins: Sequence[Origin]) -> str:
    """Two Markdown tables, an origin a row: what becomes of its objects, with how many numbers of how many are as their
    files have them and what else supplied them; and the objects that fail, with the reason."""
    whole = Origin("all", *(pd.concat(frames) for frames in zip(*(origin[1:] for origin in origins), strict=True)))
    rows = [outcome(origin) for origin in (*origins, *([whole] if len(origins) > 1 else []))]
    headings = ["origin", "objects", "read", "ok", "share", "size kept", *(f"{name} kept" for name in QUANTITIES)]
    first = markdown_table([*headings, "supplied"], rows, right=range(1, len(headings)))
    failed = [
        [origin.name, str(row.asset_id), str(row.failure_mode), shortened(str(row.reason), REASON_LENGTH - 1)]
        for origin in origins
        for row in origin.assets.sort_values("asset_id").itertuples()
        if row.status != Status.OK.value
    ]
    if not failed:
        return first
    return f"{first}\n\n{markdown_table(['origin', 'fails', 'mode', 'reason'], failed)}"


def outcome(origin: Origin) -> list[str]:
    """The cells of an origin: objects are read that came to an overlay, and of those numbers are counted."""
    assets = origin.assets
    read = assets[assets["scale"].notna()]
    good = int((assets["status"] == Status.OK.value).sum())
    same = int(((read["scale"] - 1.0).abs() <= SAME_SCALE).sum())
    counts = [str(len(assets)), str(len(read)), str(good), percent(good, len(assets)), f"{same} of {len(read)}"]
    return [origin.name, *counts, *(kept_of(origin, name) for name in QUANTITIES), supplied_by(origin)]


def sources_of(origin: Origin, quantity: str) -> "pd.Series[str]":
    """Where an origin's numbers of one quantity come from, one a link or joint."""
    table, column = QUANTITIES[quantity]
    return (origin.links if table == "links" else origin.joints)[column]


def kept_of(origin: Origin, quantity: str) -> str:
    """How many of an origin's numbers of one quantity are as its files have them."""
    sources = sources_of(origin, quantity)
    return f"{int((sources == Source.AUTHORED.value).sum())} of {len(sources)}" if len(sources) else NOTHING


def supplied_by(origin: Origin) -> str:
    """The sources of the other numbers, with how many, the most first."""
    every = pd.concat([sources_of(origin, name) for name in QUANTITIES])
    others = every[every != Source.AUTHORED.value].value_counts()
    return ", ".join(f"{source} {count}" for source, count in others.items()) or NOTHING
