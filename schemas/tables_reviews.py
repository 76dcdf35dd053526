"""The table of reviews: what people say of assets that they have looked at and touched."""

from schemas.table import ASSET_COLUMNS, ASSET_KEY, TEXT, TIME, Column, make_table

_REVIEWS: tuple[Column, ...] = (
    *(
        (name, kind, unit, "Run that had refined the asset as it was reviewed" if name == "run_id!" else text)
        for name, kind, unit, text in ASSET_COLUMNS
    ),
    ("reviewed_at!", TIME, "UTC", "When it was reviewed"),
    ("reviewer!", TEXT, "", "Who reviewed it"),
    ("verdict!", TEXT, "", "good or bad, as a person sees it, whatever the checks say"),
    ("note!", TEXT, "", "What they wrote of it; may be empty"),
)

REVIEWS = make_table(
    "reviews", "one row per review of an asset, method and model", (*ASSET_KEY, "reviewed_at", "reviewer"),
    "What people said of an asset in the viewer; no run removes or rewrites it", _REVIEWS,
)  # fmt: skip
"""Reviews: a folder of files, each written by one viewer."""
