"""Unmet expectations of the refined made objects in OUT: ``python -m tests.made.study OUT``; with
``--write FOLDER`` the dataset is written first, to be refined into OUT."""

import sys
from collections import Counter
from pathlib import Path

import pandas as pd

from asset2sim.catalog.read import latest_rows
from tests.made.shapes import Made, made, write_dataset


def missed(item: Made, asset: pd.Series, joints: pd.DataFrame, links: pd.DataFrame, efforts: pd.DataFrame) -> list[str]:
    """The expectations that a refined object does not meet, each as kind: sentence."""
    found = [] if asset.status == "ok" else [f"status: {asset.failure_mode}: {asset.reason}"]
    if pd.isna(asset.scale):
        return found

    def within(kind: str, what: str, value: float, bounds: tuple[float, float]) -> None:
        if not bounds[0] <= value <= bounds[1]:
            found.append(f"{kind}: {what}{value:.3g}, expected {bounds[0]:g} to {bounds[1]:g}")

    within("size", "", 100.0 * max(asset.size_x_m, asset.size_y_m, asset.size_z_m), item.size_cm)
    within("mass", "", asset.mass_kg, item.mass_kg)
    if asset.support not in item.support:
        found.append(f"support: {asset.support}, expected {' or '.join(item.support)}")
    by_joint, mass = joints.set_index("joint"), links.set_index("link").mass_kg
    for i, bounds in item.part_kg.items():
        within("part", f"{i} ", float(mass[by_joint.child[f"joint_{i}"]]), bounds)
    for i, bounds in item.force_n.items():
        felt = efforts[efforts.subject == f"joint_{i}"].value
        if len(felt):
            within("force", f"{i} ", float(felt.max()), bounds)
    for place in item.stays:
        joint = by_joint.loc[f"joint_{place}"]
        if joint.stiffness > 0.0 and not joint.holds:
            found.append(f"stays: {place} springs back")
    return found


def study(out: Path) -> dict[str, list[str]]:
    """Object → what it misses."""
    tables = latest_rows(out, "assets", "joints", "links", "interactions")
    own = {name: [table[table.asset_id == name] for table in tables] for name in tables[0].asset_id}
    found = {}
    for item in (one for one in made() if one.name in own):
        assets, joints, links, checks = own[item.name]
        found[item.name] = missed(item, assets.iloc[0], joints, links, checks[checks.test == "effort"])
    return found


def main(words: list[str]) -> None:
    """Print what each object misses, and how many by kind."""
    if words[0] == "--write":
        write_dataset(made(), Path(words[1]))
        return
    found = study(Path(words[0]))
    for name, said in found.items():
        sys.stdout.write(f"{name}: {'; '.join(said) or 'as expected'}\n")
    kinds = Counter(one.split(":")[0] for said in found.values() for one in said)
    good = sum(not said for said in found.values())
    sys.stdout.write(f"{good} of {len(found)} as expected; {', '.join(f'{k} {n}' for k, n in kinds.most_common())}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
