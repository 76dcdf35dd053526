"""The tables of what is left when labels, or a category's own rows, are withheld."""

import subprocess
import sys

import pandas as pd
import pytest

from asset2sim.guidance.csv_rows import LEFT_OUT_VARIABLE
from lab.comparisons.withheld import LEFT_OUT, UNLABELLED, WHOLE, withheld_table
from tests.assets import ROOT


def assets(*rows: tuple[str, str, str, float, str]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["asset_id", "status", "failure_mode", "scale", "support"])


def joints(*rows: tuple[str, float, float | None]) -> pd.DataFrame:
    """Joints from 0 to 1: (asset, where it starts, where it is asked to be)."""
    found = pd.DataFrame(rows, columns=["asset_id", "initial_position", "asked_position"])
    return found.assign(joint="lid", lower=0.0, upper=1.0)


def test_sizes_states_and_failures_are_held_against_the_whole_run() -> None:
    whole = assets(("a", "ok", "none", 1.0, "fixed"), ("b", "ok", "none", 1.0, "freestanding"))
    changed = assets(("a", "ok", "none", 1.4, "fixed"), ("b", "failed", "stands", 2.0, "fixed"))
    asked = joints(("a", 0.5, 0.5), ("b", 0.0, None))
    found = joints(("a", 0.8, 0.8), ("b", 0.0, None))
    table = withheld_table(
        [(WHOLE, whole, asked), (UNLABELLED, changed, found), (LEFT_OUT, whole, asked)], [("Box", changed)]
    )
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if line.startswith("|")
    ]
    assert rows[2] == [WHOLE, "2", "2", "100 %", "100 %", "100 %", "1", "–"]
    # a's 1.4 is within 1.5 and b's 2 is not; a's lid is asked 0.3 of its range away, and b's is not asked.
    assert rows[3] == [UNLABELLED, "2", "1", "50.0 %", "50.0 %", "0 %", "2", "stands 1"]
    assert rows[-1] == ["Box", "2", "1", "50.0 %", "b stands"]


@pytest.mark.system
def test_a_category_left_out_is_in_no_table() -> None:
    program = (
        "from asset2sim.guidance import tables as t\n"
        "from asset2sim.guidance.supports import support_rows\n"
        "from asset2sim.guidance.object_info import ObjectInfo\n"
        "from asset2sim.models.prior.answer import prior_overlay\n"
        "assert 'Door' not in t.sizes() and 'Door' not in t.nouns().values() and 'Laptop' in t.sizes()\n"
        "assert all(row['phrase'] != 'door' for row in support_rows())\n"
        "info = ObjectInfo('17', 'Door', (1, 1, 1), (1, 1, 1), (), (), ())\n"
        "assert prior_overlay(info, 'A door.').support is None\n"
    )
    environment = {LEFT_OUT_VARIABLE: "Door", "PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True, timeout=60, cwd=ROOT)
