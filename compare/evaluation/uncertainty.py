"""A solver's estimate of its own error, in the terms of a comparison."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from compare.evaluation.differences import ReferenceDifferences
from compare.evaluation.evaluation import Evaluation
from compare.evaluation.metrics import reference_differences
from geometry.mesh.triangle_mesh import TriangleMesh
from solvers.solution import Solution


def evaluated(solution: Solution, mesh: TriangleMesh, markers: ArrayLike | None = None) -> Evaluation:
    """The evaluation of a solution, with its uncertainty if its solver estimates its error.

    The uncertainty is how the improved field of the estimate differs from the solution. For displacements
    that are prescribed, the energy of the error is the error of the energy.
    """
    own, error = Evaluation.of(solution, mesh, markers), solution.error
    if error is None:
        return own
    energy = solution.energy * (1 - error.energy_norm**2)
    better = Evaluation.of(replace(solution, field=error.field, energy=energy), mesh, markers)
    return replace(
        own,
        uncertainty=reference_differences(better, own),
        marker_uncertainty=np.abs(better.marker_displacement - own.marker_displacement),
    )


def indistinct(differences: ReferenceDifferences, uncertainty: ReferenceDifferences | None) -> list[str]:
    """Quantities in which a solver differs from the reference by less than the reference's error."""
    if uncertainty is None:
        return []
    pairs = {
        "displacement": (differences.displacement.rel_l2, uncertainty.displacement.rel_l2),
        "von Mises stress": (differences.von_mises.rel_l2, uncertainty.von_mises.rel_l2),
        "energy": (differences.energy, uncertainty.energy),
        "displacement of the markers": (differences.mae_markers, uncertainty.mae_markers),
    }
    return [name for name, (difference, own) in pairs.items() if abs(difference) < abs(own)]
