"""The good sample objects, a few to a module, each a function that returns a blueprint."""
