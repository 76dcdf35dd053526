"""Packs that templates and exports alone make, a row of ``packs.csv`` each: Gazebo, Isaac Lab, LeRobot and others."""

import csv
from pathlib import Path

from asset2sim.packs.declared_pack import Pack
from schemas.vocabulary import Export

with Path(__file__).with_name("packs.csv").open(encoding="utf-8", newline="") as _stream:
    PACKS = tuple(
        Pack(row["name"], row["title"], row["contents"], row["opens"], tuple(map(Export, row["exports"].split())))
        for row in csv.DictReader(_stream)
    )
