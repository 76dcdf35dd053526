"""Where the project runs from."""

from pathlib import Path


def checkout_folder() -> Path | None:
    """The project's own folder, if it runs from a checkout, as it does with ``pip install -e``."""
    folder = Path(__file__).resolve().parents[1]
    return folder if (folder / "pyproject.toml").is_file() else None
