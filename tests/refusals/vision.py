"""Names of the refused expressions of `vision`."""
