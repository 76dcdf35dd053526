"""Datasets of samples named for a fault, runs over them in processes of their own, and the rows that these write."""

import os
import shutil
import subprocess
import uuid
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from asset2sim.catalog.read import read_table
from tests.assets import RAW, ROOT
from tests.faulty import processes
from tests.processes import MARK, alive, wait_until

PLAIN = ("--engines", "pybullet", "--no-interaction", "--no-views")
"""The quickest run that does all the stages."""
LIMIT_S = 900.0


@dataclass(frozen=True)
class Place:
    """Folders of one test, the address of a Prefect server, the first words of a command, and the environment of all
    that it starts, with a mark by which strays are found."""

    folder: Path
    server: str
    python: Sequence[str]
    mark: str = field(default_factory=lambda: f"asset2sim-fault-{uuid.uuid4().hex}")

    @property
    def data(self) -> Path:
        return self.folder / "data"

    @property
    def out(self) -> Path:
        return self.folder / "out"

    def environment(self, **more: object) -> dict[str, str]:
        given = {name: str(value) for name, value in more.items()}
        return {**os.environ, "PREFECT_API_URL": self.server, MARK: self.mark, **given}


def dataset(data: Path, assets: dict[str, str]) -> None:
    """Asset id → the sample that it is a copy of; ``""`` is an asset without a folder."""
    lines = ["asset_id,category,path,prompt"]
    folders = {path.name: path for path in RAW.glob("*/*")}
    for asset_id, sample in assets.items():
        if sample:
            shutil.copytree(folders[sample], data / asset_id)
        lines.append(f"{asset_id},Box,{asset_id},A small one.")
    data.mkdir(parents=True, exist_ok=True)
    (data / "manifest.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def start(place: Place, *options: str, **limits: object) -> "subprocess.Popen[str]":
    """A run, in a session of its own as under a service manager."""
    return subprocess.Popen(
        [*place.python, "-m", "tests.faulty", "refine", str(place.data), "--out", str(place.out), *PLAIN, *options],
        cwd=ROOT, env=place.environment(**limits), text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        start_new_session=True,
    )  # fmt: skip


def assert_met(run: "subprocess.Popen[str]", place: Place, asset_id: str, times: int = 1) -> None:
    """Wait until an asset has had so many processes; a run that ends before fails at once."""
    wait_until(lambda: run.poll() is not None or len(processes(place.out, asset_id)) >= times, LIMIT_S)
    assert len(processes(place.out, asset_id)) >= times, run.communicate(timeout=LIMIT_S)


def rows(out: Path) -> dict[str, dict[Hashable, Any]]:
    """Asset id → its row of ``assets``."""
    frame = read_table(out, "assets")
    return {str(row["asset_id"]): row for row in frame.to_dict("records")}


def findings(out: Path, code: str) -> dict[str, str]:
    """Asset id → the message of its finding of this code."""
    frame = read_table(out, "findings")
    return {row["asset_id"]: row["message"] for row in frame[frame["code"] == code].to_dict("records")}


def assert_nobody_left(mark: str) -> None:
    assert wait_until(lambda: not alive(mark), 60.0), alive(mark)
