"""Names of the refused expressions of `compare`."""

from functools import partial

from compare.evaluation.truths import Truth

truth = partial(Truth, name="mine", description="pressed in by {:.4g} mm")
