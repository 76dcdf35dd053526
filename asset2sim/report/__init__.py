"""The report of a run for people: an index and a page an object, static HTML made from the catalog's tables."""
