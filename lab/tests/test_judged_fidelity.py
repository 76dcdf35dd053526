"""Behavioural fidelity: the published means and SRCCs recomputed, and what may not be said."""

import io
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rich.console import Console, RenderableType

from asset2sim.catalog.text import NOTHING
from lab.judged.fidelity import NO_VARIANCE, REAL, agreements, correlation, fidelity_figures, rates_of, smallest_r
from lab.judged.published import published_rates
from lab.judged.show_fidelity import describe_fidelity, describe_probes, fidelity_block, short_block, task_tables
from lab.schemas.tables import PROBE_TRIALS
from schemas.table import Row
from schemas.vocabulary import Method

TABLES = Path(__file__).parents[2] / ".." / "shared" / "paper_tables"
OURS, DIRECT = Method.ASSET2SIM.value, Method.DIRECT.value
PUBLISHED = {
    ("pi0-FAST-DROID", "reference"): (7.27, 0.40), ("pi0-FAST-DROID", "ivw"): (16.36, 0.23),
    ("pi0-FAST-DROID", "direct"): (0.0, None), ("pi0-FAST-DROID", "asset2sim"): (32.73, 0.52),
    ("pi0.5-DROID", "reference"): (9.09, 0.32), ("pi0.5-DROID", "ivw"): (20.0, 0.25),
    ("pi0.5-DROID", "direct"): (0.0, None), ("pi0.5-DROID", "asset2sim"): (45.45, 0.68),
    ("GR00T-N1.6-DROID", "reference"): (1.82, 0.08), ("GR00T-N1.6-DROID", "ivw"): (10.91, 0.01),
    ("GR00T-N1.6-DROID", "direct"): (1.82, 0.08), ("GR00T-N1.6-DROID", "asset2sim"): (20.0, 0.34),
}  # fmt: skip
"""Policy and method → mean success, %, and SRCC, as the paper prints them; None where it prints a dash."""


def rates(policy: str, method: str, values: list[float]) -> pd.DataFrame:
    tasks = [f"task {number}" for number in range(len(values))]
    return pd.DataFrame(
        {"policy": policy, "method": method, "model": "none", "task": tasks, "rate": values, "trials": 5}
    )


def trial(**changes: object) -> Row:
    row = dict.fromkeys(PROBE_TRIALS.schema.names) | {
        "task": "box close", "asset_id": "100221", "method": OURS, "model": "none", "policy": "scripted", "trial": 0,
        "outcome": "done", "success": True,
    }  # fmt: skip
    return row | changes


def shown(parts: Sequence[RenderableType]) -> str:
    console = Console(width=200, record=True, file=io.StringIO())
    for part in parts:
        console.print(part)
    return console.export_text()


@pytest.mark.skipif(not TABLES.is_dir(), reason="the paper's tables are not in ../shared/paper_tables")
def test_the_twelve_published_means_and_srccs_come_out_to_two_digits_with_intervals() -> None:
    found = published_rates(TABLES)
    figures = {(item.policy, item.method): item for item in fidelity_figures(found, found[found["method"] == REAL])}
    assert len(PUBLISHED) == 12 and set(PUBLISHED) == {key for key in figures if key[1] != REAL}
    for key, (mean, srcc) in PUBLISHED.items():
        item = figures[key]
        assert round(100.0 * item.mean, 2) == mean and item.tasks == 11 and item.trials == 55
        assert item.low <= item.mean <= item.high
        assert item.srcc is not None and item.srcc.n == 11
        if srcc is None:
            assert item.srcc.undefined == NO_VARIANCE and math.isnan(item.srcc.r)
        else:
            assert round(item.srcc.r, 2) == srcc and item.srcc.low < item.srcc.r < item.srcc.high
            assert 0.0 < item.srcc.p <= 1.0
    for policy, mean in (("pi0-FAST-DROID", 67.27), ("pi0.5-DROID", 67.27), ("GR00T-N1.6-DROID", 32.73)):
        assert round(100.0 * figures[policy, REAL].mean, 2) == mean and figures[policy, REAL].srcc is None
    said = shown(describe_fidelity("Published", found, found[found["method"] == REAL]))
    assert "45.45" in said and "0.68" in said and "undefined (no variance)" in said and "below |r| = 0.60" in said


def test_a_correlation_with_noise_has_a_wide_interval_and_a_clear_one_a_small_p() -> None:
    draw = np.random.default_rng(1)
    first = draw.random(11)
    clear, noise = correlation(first, 0.5 * first + 0.1), correlation(first, draw.random(11))
    assert clear.r == pytest.approx(1.0) and clear.p < 0.01 and clear.low > 0.99
    assert noise.low < 0.0 < noise.high and noise.p > 0.05
    assert correlation(first, 0.5 * first + 0.1) == clear, "seeded"
    one = correlation(np.array([1.0] + [0.0] * 10), first)
    assert 0.3 < one.lost < 0.4, "a resample without the only success has no correlation"


def test_smallest_r_of_eleven_is_that_of_the_tables() -> None:
    assert smallest_r(11) == pytest.approx(0.602, abs=5e-4) and smallest_r(5) == pytest.approx(0.878, abs=5e-4)


@pytest.mark.parametrize("flat", ["simulated", "real"])
def test_an_srcc_without_variance_is_undefined_and_said(flat: str) -> None:
    varied = [0.0, 0.2, 1.0]
    simulated = rates("p", OURS, [0.4] * 3 if flat == "simulated" else varied)
    (item,) = fidelity_figures(simulated, rates("p", REAL, [0.4] * 3 if flat == "real" else varied))
    assert item.srcc is not None and item.srcc.undefined == NO_VARIANCE and math.isnan(item.srcc.p)


def test_a_probe_that_never_acted_in_reality_has_agreement_and_no_srcc() -> None:
    found = pd.concat([rates("scripted", OURS, [1.0, 0.5, 0.0]), rates("scripted", DIRECT, [0.5, 0.25, 0.0])])
    figures = fidelity_figures(found, rates("pi0.5-DROID", REAL, [1.0, 0.5, 0.0]))
    assert all(item.srcc is None for item in figures)
    (pair,) = agreements(found)
    assert [pair.r, pair.rho, pair.n] == pytest.approx([1.0, 1.0, 3])
    said = shown(describe_fidelity("Ours", found, rates("pi0.5-DROID", REAL, [1.0, 0.5, 0.0])))
    assert "no SRCC of scripted" in said and "r = 1.00, ρ = 1.00" in said and "SRCC is" not in said


def test_trials_without_a_final_state_are_counted_and_no_failure_of_the_object() -> None:
    rows = [trial(rang=True), trial(trial=1, outcome="not done", success=False),
            trial(trial=2, outcome="policy died", success=None)]  # fmt: skip
    trials = pd.DataFrame(rows)
    (found,) = rates_of(trials).to_dict("records")
    assert found["rate"] == 0.5 and found["trials"] == 2
    empty = rates("p", REAL, [])
    assert "| scripted | asset2sim | 3 | 0 | 0 | 0 | 0 | 1 | 0 | 0 | 1 |" in fidelity_block(trials, empty)
    assert "policy died" in shown(describe_probes(trials, empty))


def test_pages_have_each_task_in_the_papers_order_of_methods_and_name_who_was_not_run() -> None:
    rows = [trial(), trial(trial=1, outcome="not done", success=False), trial(method=DIRECT, success=False),
            trial(method=DIRECT, trial=1, outcome="policy died", success=None),
            trial(task="other", outcome="policy died", success=None)]  # fmt: skip
    found = pd.DataFrame(rows)
    said = task_tables(found)
    assert said.splitlines()[0] == f"| scripted: done | {DIRECT} | {OURS} |"
    first, second = rows[0]["task"], "other"
    assert f"| {first} | 0 of 1 | 1 of 2 |" in said and f"| {second} | {NOTHING} | {NOTHING} |" in said
    published = pd.concat([rates("real policy", OURS, [0.2, 0.4]), rates("real policy", REAL, [1.0, 1.0]),
                           rates("scripted", OURS, [1.0])])  # fmt: skip
    short = short_block(found, published).splitlines()
    assert short[2] == "| scripted | 0 % (1) | 50 % (2) |"
    assert short[3] == f"| real policy: not run; the paper's | {NOTHING} | 30 % |" and len(short) == 4
