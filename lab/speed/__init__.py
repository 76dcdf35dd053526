"""``make bench``: what refining takes without caches, on one worker and two, and where there is nothing to do."""
