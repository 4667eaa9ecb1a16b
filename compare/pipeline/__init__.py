"""One comparison of solvers, and the folder of its files: `pipeline.run` makes the comparison of a `job.Job`.

Imports `compare.camera`, `compare.report`, `compare.figures`, `compare.evaluation`, `compare.runtime`.
"""
