"""Names of the refused expressions of `studies`."""
