"""The good sample objects, a few to a module, each a plain function that answers a blueprint."""
