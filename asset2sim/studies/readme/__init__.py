"""Questions that somebody has in the morning, an SQL file each, whose first line asks in words; see ``answers``."""
