"""Which extra of the package brings what is not installed."""

import re
from importlib import metadata

from schemas.errors import UsageError

DISTRIBUTION, NOT_FOR_USERS = "asset2sim", ("dev", "browser")
OTHER_NAMES = {"pxr": "usd-core", "pybullet_utils": "pybullet"}
"""Imported package → distribution of another name that has it."""
_REQUIREMENT = re.compile(r"""^([\w.-]+).*;.*extra\s*==\s*['"]([\w-]+)['"]""")


def missing_package(error: ModuleNotFoundError) -> Exception:
    """The error for a package that cannot be imported: UsageError with what to install where an extra brings it, else
    the error itself, which is a broken program's."""
    package = (error.name or "").partition(".")[0]
    extra = extra_with(OTHER_NAMES.get(package, package))
    if extra is None:
        return error
    return UsageError(f"this needs {package}, which is not installed: pip install '{DISTRIBUTION}[{extra}]'")


def extra_with(name: str) -> str | None:
    """The first extra that brings a distribution; None where none does, or we are not installed."""
    try:
        requirements = metadata.requires(DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        return None
    wanted = name.replace("_", "-").lower()
    for found in filter(None, map(_REQUIREMENT.match, requirements)):
        distribution, extra = found.groups()
        if distribution.replace("_", "-").lower() == wanted and extra not in NOT_FOR_USERS:
            return extra
    return None
