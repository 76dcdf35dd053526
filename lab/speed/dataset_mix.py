"""Mean over PartNet-Mobility of a figure of some of its objects, weighted as the dataset's categories are."""

from collections.abc import Mapping, Sequence
from statistics import mean

OBJECTS = {
    "Bottle": 57, "Box": 28, "Bucket": 36, "Camera": 37, "Cart": 61, "Chair": 81, "Clock": 31, "CoffeeMachine": 54,
    "Dishwasher": 48, "Dispenser": 57, "Display": 37, "Door": 36, "Eyeglasses": 65, "Fan": 81, "Faucet": 84,
    "FoldingChair": 26, "Globe": 61, "Kettle": 29, "Keyboard": 37, "KitchenPot": 25, "Knife": 44, "Lamp": 45,
    "Laptop": 55, "Lighter": 28, "Microwave": 16, "Mouse": 14, "Oven": 30, "Pen": 48, "Phone": 17, "Pliers": 25,
    "Printer": 29, "Refrigerator": 44, "Remote": 49, "Safe": 30, "Scissors": 47, "Stapler": 23,
    "StorageFurniture": 346, "Suitcase": 24, "Switch": 70, "Table": 101, "Toaster": 25, "Toilet": 69, "TrashCan": 70,
    "USB": 51, "WashingMachine": 17, "Window": 58,
}  # fmt: skip
"""Objects of each category in PartNet-Mobility."""
NIGHT = sum(OBJECTS.values())


def weighted_mean(measured: Mapping[str, Sequence[float]]) -> tuple[float, float]:
    """(mean over the dataset of a figure that was measured of some objects of each category, share of the dataset whose
    categories were measured); a category of which none was has the mean of all that were."""
    known = {category: mean(values) for category, values in measured.items() if values and category in OBJECTS}
    other = mean(value for values in measured.values() for value in values)
    whole = sum(count * known.get(category, other) for category, count in OBJECTS.items())
    return whole / NIGHT, sum(OBJECTS[category] for category in known) / NIGHT
