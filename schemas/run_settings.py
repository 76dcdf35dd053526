"""Settings of how a dataset is spread over processes, and when a run is good enough."""

from pydantic import Field

from schemas.base import Fraction, Frozen, Positive
from schemas.secret import Secret
from schemas.vocabulary import Gate, Redo


class RunSettings(Frozen):
    """How a dataset is spread over processes, and what one asset may use."""

    workers: int = Field(2, ge=1)
    scheduler: str | None = None
    asset_time_limit_s: Positive = 300.0
    """Wall time of one asset, s: the slowest of the real objects, a keyboard of 115 keys, needs about a tenth of it."""
    asset_memory_limit_mb: int = Field(4096, ge=256)
    """Address space that one asset's process may add, MB."""
    retries_alone: int = Field(20, ge=0)
    """Most assets of a run that are tried once more, one after the other, after their process died: hundreds that hang
    for five minutes each would take the night. The next run tries the others."""
    max_model_errors: int = Field(5, ge=0)
    """Assets in a row that the model fails with the same error, from which on no further one is tried: a wrong key or a
    server that is down fails them all. The next run tries the rest. 0: all are tried."""
    max_timeouts: int = Field(3, ge=0)
    """Runs in a row in which an asset took too long, from which on it is left until it, the code, the settings or a
    longer ``asset_time_limit_s`` give another try. 0: every run tries."""
    worker_memory_mb: int = Field(768, ge=1)
    """Memory that one asset at work takes of this machine's, MB, by which ``workers`` is bounded: of 15 real objects in
    three engines the heaviest (a box whose 376 meshes have 9 MB) took 485 MB, the median 284 MB."""
    own_memory_mb: int = Field(1536, ge=0)
    """Memory that a run takes besides, MB: itself (690 for 1,000 assets), Prefect's server (200), the process of which
    the assets' are forked (180), and room for larger datasets."""
    min_success: Fraction | None = None
    """Gate: least share of the run's assets, unchanged ones included, that must pass; None: any."""
    max_new_failures: int | None = Field(None, ge=0)
    """Gate: most assets that may fail that did not fail before the run; None: any number."""
    gate: Gate = Gate.ERROR
    """Action of a run that misses a gate: an exit code of its own, or a warning."""
    hook: Secret | None = None
    """A shell command to run after the run, with the run's figures in its environment; see ``asset2sim.runs.alert``."""
    hook_time_limit_s: Positive = 60.0
    """Wall time of the hook, s: enough for a slow mail server, and a run is not held up by one that never answers."""
    report: bool = True
    """Whether a run writes its report for people, ``OUT/report``; of objects that it left unchanged nothing is made."""
    keep_days: int | None = Field(None, ge=1)
    """How long the history's rows and MLflow's artifacts of a run are kept, days; None for ever. The newest run over
    each dataset stays in any case."""
    redo: Redo = Redo.CHANGED
    """Which assets are refined again although an earlier run has their result."""
