"""The main job: a comparison of solvers and the folder of its files.

`job.Job` says what is compared, `pipeline.run` makes it. Imports `compare.camera`, `compare.report`,
`compare.figures`, `compare.evaluation`, `compare.runtime`.
"""
