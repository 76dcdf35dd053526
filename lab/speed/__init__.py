"""``make bench``: speed of a nightly run, its orchestration overhead, and the time of each stage."""
