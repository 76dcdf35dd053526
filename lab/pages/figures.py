"""Every measured block of the documentation by one command: ``python -m lab.pages.figures SHARED OUT [NAME,…]``.

A block that is no older than what it measures is left as it is, so that a command that was stopped goes on where it
was, and each step goes on with its own runs in OUT. ``--stale`` only names the blocks that are older."""

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from lab.pages.blocks import block_of
from lab.pages.stamp import SOURCES, Stamp, code_hash, split_stamp, text_hash
from schemas.errors import DONE, UnknownChoiceError, UsageError, exit_code_of

DOCS = Path("docs")
SAMPLES = "flow OUT={out}/samples"
NINE = (
    'compare DATA={shared}/partnet_mobility OUT={out}/nine ARGS="--subset paper9 '
    '--methods reference,ivw,direct,asset2sim"'
)
FIGURES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "summary": (SAMPLES, "summary OUT={out}/samples"),
        "questions": (SAMPLES, "questions OUT={out}/samples"),
        "loaders": (SAMPLES, "loaders OUT={out}/samples"),
        "held": (SAMPLES, "held OUT={out}/samples"),
        "weights": ("weights SHARED={shared}",),
        "origins": ("origins SHARED={shared} OUT={out}/origins",),
        "first": ("first SHARED={shared} OUT={out}/first",),
        "corrections": (
            "corrections DATA={shared}/partnet_mobility OUT={out}/corrections "
            'ARGS="--subset paper9 --models recorded/{shared}/vlm_answers,prior/noisy,prior/noisy@2"',
        ),
        "shapes": ("shapes SHARED={shared} OUT={out}/shapes",),
        "judged": (NINE, 'recorded OUT={out}/nine ARGS="--page docs/trials.md"'),
        "probe": (
            NINE,
            'probe OUT={out}/nine ARGS="--no-film --published {shared}/paper_tables --page docs/probes.md"',
        ),
        "learn": (
            NINE,
            'learn OUT={out}/nine ARGS="--tasks paper9 --methods reference,ivw,direct,asset2sim --seeds 3 '
            '--budget 65536 --minutes 240 --published {shared}/paper_tables --page docs/learn.md"',
        ),
        "rules": ("rules DATA={shared}/partnet_mobility OUT={out}/rules",),
        "dataset": (
            "rules DATA={shared}/partnet_mobility OUT={out}/rules",
            'flow DATA={shared}/other_furniture OUT={out}/furniture ARGS="--no-views"',
            'dataset OUT={out} ARGS="PartNet-Mobility={out}/rules/ours furniture={out}/furniture"',
        ),
        "compare": (
            'compare DATA={shared}/partnet_mobility OUT={out}/compared ARGS="--no-interaction --page docs/compared.md"',
        ),
        "withheld": ("withheld DATA={shared}/partnet_mobility OUT={out}/rules",),
    }
)
"""Block → the words of ``make`` that make it, one after the other; quickest first."""


def measured_blocks(docs: Path) -> dict[str, tuple[Path, str, Stamp | None]]:
    """Block → its page, its text without the stamp, and that (None without one), of all that are measured. Raises
    UsageError where a page lacks one."""
    pages = {page: page.read_text(encoding="utf-8") for page in sorted(docs.glob("*.md"))}
    found = {}
    for name in SOURCES:
        own = [page for page, text in pages.items() if block_of(text, name) is not None]
        if len(own) != 1:
            where = " and ".join(page.name for page in own) or "no page"
            raise UsageError(f"block '{name}' is on {where} of {docs}; put its markers on one")
        found[name] = (own[0], *split_stamp(block_of(pages[own[0]], name) or ""))
    return found


def edited(docs: Path) -> list[str]:
    """Blocks whose text is not the one that was stamped, or which have no stamp: they were changed by hand."""
    blocks = measured_blocks(docs).items()
    return [name for name, (_, text, stamp) in blocks if text and (stamp is None or stamp.block != text_hash(text))]


def stale(docs: Path) -> list[str]:
    """Blocks that are older than a change of what they measure, code, prompts or tables, or were never made."""
    blocks = measured_blocks(docs).items()
    return [name for name, (_, _, stamp) in blocks if stamp is None or stamp.code != code_hash(name)]


def make_figures(shared: Path, out: Path, only: Sequence[str] = ()) -> int:
    """Make the blocks named, or all that are older than what they measure; returns the exit code. Raises
    UnknownChoiceError for a block that is none, UsageError for a folder that is not there, or where ``make`` fails."""
    for name in only:
        if name not in FIGURES:
            raise UnknownChoiceError("block", name, FIGURES)
    if not (shared / "partnet_mobility").is_dir():
        raise UsageError(f"{shared} holds no partnet_mobility; name the folder of the test data with SHARED=")
    shared = Path(os.path.relpath(shared))  # tables name what they were made of, and no machine's folders
    wanted = [name for name in FIGURES if name in (only or stale(DOCS))]
    done = set[str]()
    for name in wanted:
        for words in FIGURES[name]:
            step = words.format(shared=shared, out=out)
            if step not in done and subprocess.run(f"make --no-print-directory {step}", shell=True).returncode:
                raise UsageError(f"make {step} failed; mend it and run make figures again, which goes on from here")
            done.add(step)
    sys.stdout.write(f"made: {', '.join(wanted) or 'nothing, every block is as new as what it measures'}\n")
    return DONE


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    if "--stale" in words:
        older = stale(DOCS)
        sys.stdout.write(f"older than what they measure: {', '.join(older) or 'none'}\n")
        return int(bool(older))
    shared, out, *only = words
    names = [name for item in only for name in item.split(",") if name]
    return exit_code_of("figures", lambda: make_figures(Path(shared), Path(out), names))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
