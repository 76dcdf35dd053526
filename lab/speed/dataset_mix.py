"""Mean over PartNet-Mobility of a figure of some of its objects, weighted as the dataset's categories are."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import mean

with Path(__file__).with_name("partnet_mobility.csv").open(encoding="utf-8", newline="") as file:
    OBJECTS = {row["category"]: int(row["objects"]) for row in csv.DictReader(file)}
"""Objects of each category in PartNet-Mobility."""
NIGHT = sum(OBJECTS.values())


def weighted_mean(measured: Mapping[str, Sequence[float]]) -> tuple[float, float]:
    """(mean over the dataset of a figure that was measured of some objects of each category, share of the dataset whose
    categories were measured); a category of which none was has the mean of all that were."""
    known = {category: mean(values) for category, values in measured.items() if values and category in OBJECTS}
    other = mean(value for values in measured.values() for value in values)
    whole = sum(count * known.get(category, other) for category, count in OBJECTS.items())
    return whole / NIGHT, sum(OBJECTS[category] for category in known) / NIGHT
