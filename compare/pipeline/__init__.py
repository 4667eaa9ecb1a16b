"""One comparison of solvers, and the folder of its files: `pipeline.run` makes the comparison of a `job.Job`.

Imports `comparison.camera`, `comparison.report`, `comparison.figures`, `comparison.evaluation`,
`comparison.runtime`.
"""
