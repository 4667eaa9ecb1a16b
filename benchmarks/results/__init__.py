"""The default run: its tables on the pages, its time, and readings of the paper's open choices."""
