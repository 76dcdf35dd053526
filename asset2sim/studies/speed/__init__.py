"""``make bench``: how fast a night is, what orchestrating it costs, and where the time goes."""
