"""Many assets at once: what is asked, what there is to do, who does it, and what can go wrong on the way."""
