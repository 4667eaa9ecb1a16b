"""The default run: its tables on the pages, its time, and readings of what the paper leaves open."""
