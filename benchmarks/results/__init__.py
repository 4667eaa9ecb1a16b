"""The default run: its tables on the pages, its time, and readings of the choices that the paper leaves open."""
