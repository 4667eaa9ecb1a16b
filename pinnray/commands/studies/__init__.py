"""Commands that solve many problems: sweep, predict, optimise, crossval."""
