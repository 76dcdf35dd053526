"""The nightly schedule, as ``catalog.yaml`` holds it."""

from pathlib import Path
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

import yaml

from schemas.errors import UsageError


def nightly_schedule(path: Path) -> tuple[str, str]:
    """(cron line of five fields, name of its time zone) from ``metadata: nightly:`` of a catalog file.

    Raises UsageError, naming the file and what to put there, where either is missing or malformed.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror}") from error
    except yaml.YAMLError as error:
        raise UsageError(f"{path} is not YAML: {str(error).splitlines()[0]}") from error
    nightly = content
    for name in ("metadata", "nightly"):
        nightly = nightly.get(name) if isinstance(nightly, dict) else None
    if not isinstance(nightly, dict) or "cron" not in nightly:
        raise UsageError(f'{path} has no schedule; add metadata: nightly: cron: "0 2 * * *"')
    cron, zone = str(nightly["cron"]), str(nightly.get("timezone", "UTC"))
    if len(cron.split()) != 5:
        raise UsageError(f"{path}: cron '{cron}' needs five fields: minute, hour, day, month, weekday")
    try:
        ZoneInfo(zone)
    except (ZoneInfoNotFoundError, ValueError) as error:
        raise UsageError(f"{path}: unknown timezone '{zone}'; use a name such as UTC or Europe/Berlin") from error
    return cron, zone
