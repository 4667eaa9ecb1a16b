"""Names of the refused expressions of `geometry`."""
