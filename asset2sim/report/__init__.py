"""The report of a run: pages that people look at, and what is drawn for them."""
