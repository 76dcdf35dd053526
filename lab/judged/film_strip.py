"""A strip of a task's films, a row of pictures for each method; ``python -m lab.judged.film_strip OUT TASK FILE``
writes it."""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from asset2sim.report.loops.film import INK, text
from lab.judged.variant_folders import variant_folders
from lab.runner import latest_own
from lab.schemas.tables_trials import TRIALS
from lab.trials.figures import ORDER
from lab.trials.study import motion_folder
from lab.trials.trial import FILM
from schemas.errors import DONE, UsageError, exit_code_of

PICTURES, SIDE = 6, 200
"""Pictures a film, and the edge of each, pixels."""
LABEL = 22
"""Height of the line above a row, pixels."""


def film_pictures(film: Path, count: int) -> list[Image.Image]:
    """So many pictures of a film at even times, the first and the last among them."""
    import av

    with av.open(str(film)) as container:
        frames = [Image.fromarray(frame.to_ndarray(format="rgb24")) for frame in container.decode(video=0)]
    return [frames[round(share * (len(frames) - 1))] for share in np.linspace(0.0, 1.0, count)]


def strip(rows: Sequence[tuple[str, Sequence[Image.Image]]]) -> Image.Image:
    """Rows of pictures, each below its label."""
    sheet = Image.new("RGB", (PICTURES * SIDE, len(rows) * (SIDE + LABEL)), (255, 255, 255))
    for place, (label, pictures) in enumerate(rows):
        top = place * (SIDE + LABEL)
        text(sheet, (6, top + LABEL - 6), label, 13, INK, "ls")
        for column, picture in enumerate(pictures):
            sheet.paste(picture.resize((SIDE, SIDE), Image.Resampling.LANCZOS), (column * SIDE, top + LABEL))
    return sheet


def write_strip(out: Path, task: str, to: Path) -> int:
    """Write the strip of a task whose trials are in a comparison. Raises UsageError where none was filmed."""
    folders = [Path(folder) for folder in variant_folders([out])]
    found = []
    for folder in folders:
        for row in latest_own([folder], TRIALS).to_dict("records"):
            film = motion_folder(folder, str(row["asset_id"]), task) / FILM
            if row["task"] == task and film.is_file():
                label = f"{row['method']}: {row['outcome']}" + (f" ({row['reason']})" if row["reason"] else "")
                found.append((ORDER.get(str(row["method"]), len(ORDER)), label, film_pictures(film, PICTURES)))
    if not found:
        raise UsageError(f"{out} has no film of '{task}'; asset2sim record-motion makes them")
    strip([(label, pictures) for _, label, pictures in sorted(found, key=lambda item: item[0])]).save(to, quality=82)
    return DONE


if __name__ == "__main__":
    folder, named, file = sys.argv[1:4]
    sys.exit(exit_code_of("strip", lambda: write_strip(Path(folder), named, Path(file))))
