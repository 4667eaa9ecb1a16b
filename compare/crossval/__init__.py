"""Cross-validation: solvers scored at markers, loads and fields that they were not given.

`cross_validation.cross_validate` is the entry. Imports `comparison.evaluation`, `comparison.figures`,
`comparison.runtime`.
"""
