"""What each failure mode means and what people do about it: for the documentation and for readers of the catalog."""

from typing import NamedTuple

from schemas.vocabulary import FailureMode


class Guide(NamedTuple):
    """One failure mode in words: what was seen, and what to do about it."""

    cause: str
    remedy: str


FAILURE_GUIDE = {
    FailureMode.UNREADABLE_ASSET: Guide(
        "The folder holds no URDF that can be read: not XML, no links, joints in a circle, a link or joint named twice",
        "mend what the finding names (file, link or joint); the next run tries it again because the file changed",
    ),
    FailureMode.MISSING_MESH: Guide(
        "A link that must have a shape has none: its meshes are missing, empty, broken or outside the dataset",
        "put the named mesh where the finding says, or name its package with `--package NAME=PATH`",
    ),
    FailureMode.NO_VALID_ESTIMATE: Guide(
        "The model's answer did not fit the schema, twice",
        "read `OUT/logs/<asset_id>.answers.txt`; use a model that follows a JSON schema",
    ),
    FailureMode.INVALID_JOINT_CONFIGURATION: Guide(
        "A joint cannot be: no parent, limits that leave no range, an axis of length zero",
        "mend the joint that the finding names",
    ),
    FailureMode.PENETRATION: Guide(
        "Links overlap by more than 2 mm in the initial state, and no state, hull or cut near it frees them",
        "look at the pairs in `link_overlaps`: `authored` overlaps are in the meshes; ask for another state",
    ),
    FailureMode.DRIFT: Guide(
        "Left alone, the root moves over 1 mm or turns over 0.01 rad",
        "see which part touches the floor: a single point or a rounded base; `--support` if it is mounted or held",
    ),
    FailureMode.OSCILLATION: Guide(
        "Left alone, a joint keeps moving to and fro",
        "a spring or a hull that pushes: `trace` says what was tried; give the joint damping in the guidance",
    ),
    FailureMode.STANDS: Guide(
        "Set down as asked, it tips over, leans over 5° or slides over 3 cm",
        "ask for another state (a closed lid), or say in the guidance or by `--support` that it is fixed or handheld",
    ),
    FailureMode.STATE: Guide(
        "A joint does not stay where it was asked to: it falls, swings or springs back",
        "ask for a position where gravity leaves it, or say that the part holds (`stiff`, `stays open`)",
    ),
    FailureMode.DROP: Guide(
        "Dropped from 5 cm it flies apart, or is not at rest within 6 s",
        "look for very light links and thin hulls in `links`; `--collision decompose` makes the pieces anew",
    ),
    FailureMode.NUDGE: Guide(
        "A joint that is set in motion speeds up or does not settle",
        "damping below what its inertia needs: the finding has both; give a settling time in the guidance",
    ),
    FailureMode.JAM: Guide(
        "A joint cannot move over 90 % of its range: something stops it that is not in the meshes, or is",
        "the finding names the pair; `--collision decompose`, or limits in the URDF that end where the part stops",
    ),
    FailureMode.HOLD: Guide(
        "A part that should stay where it is placed does not",
        "heavier than its friction bears within a hand's strength: a lighter material, or say that it falls shut",
    ),
    FailureMode.RELEASE: Guide(
        "A lid, door or key that gravity or a spring should bring back does not come back, or does not stay",
        "the finding says where it sticks; shapes that rub are cut by `--collision repair`",
    ),
    FailureMode.RESET: Guide(
        "Started 2 cm and 2° off, it does not come to rest upright, or a held joint slips",
        "see `interactions` for the start that fails; a tall or narrow foot is in its shape",
    ),
    FailureMode.EFFORT: Guide(
        "Opening it takes more or less than people expect of its kind, or tips it over first",
        "the reason has the force and the range (`efforts.csv`); say `stiff` or `light` in the guidance, or fix it",
    ),
    FailureMode.ENGINE_REFUSED: Guide(
        "An engine does not load the object as it is written: the reason has its words",
        "mend what it names; with `--method raw` and `asset2sim check` files are as they came: refining mends most",
    ),
    FailureMode.ENGINE_CRASH: Guide(
        "The process that worked on it died: a crash of an engine, or memory beyond its limit",
        "tried again each run; `OUT/logs/<asset_id>.log` has its last words; `--workers` fewer where memory is short",
    ),
    FailureMode.TIMEOUT: Guide(
        "It was not done within its time",
        "tried again each run; give it more time (`asset2sim settings`), or fewer meshes and joints",
    ),
    FailureMode.DISK_FULL: Guide(
        "The disk was full when its files were written", "make room; the next run tries it again"
    ),
    FailureMode.MODEL_ERROR: Guide(
        "The model's server refused or did not answer", "`asset2sim doctor` asks it; the next run tries the asset again"
    ),
    FailureMode.BUDGET: Guide(
        "The run's or the asset's budget was spent before its answer was there",
        "raise `--budget-usd`, `--budget-calls` or `--asset-budget-usd`; the next run goes on",
    ),
}
"""Every failure mode but ``none`` → its cause and remedy."""
