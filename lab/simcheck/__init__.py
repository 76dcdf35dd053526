"""An independent checker over refined assets: simcheck, in an environment of its own."""
