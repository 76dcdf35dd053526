"""Storage of datasets and outputs: locks, local copies, and objects behind a URL (fsspec)."""
