"""Datasets and outputs behind a URL (fsspec): everything else works on local folders that mirror them."""
