"""Packs that templates and exports alone make, a row of ``packs.csv`` each: Gazebo, Isaac Lab, LeRobot and others."""

from asset2sim.packs.declared_pack import Pack
from schemas.csv_rows import rows_beside
from schemas.vocabulary import Export

PACKS = tuple(
    Pack(row["name"], row["title"], row["contents"], row["opens"], tuple(map(Export, row["exports"].split())))
    for row in rows_beside(__file__, "packs.csv")
)
