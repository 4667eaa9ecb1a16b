"""States of plane strain, extruded, from which Newton's method starts in three dimensions."""

from dataclasses import replace

import numpy as np

from solvers.extrusion import ExtrudedSpace
from solvers.fem.finite_strain.constraints import LoadState
from solvers.fem.finite_strain.solver import FemNonlinearSolver
from solvers.problem import Problem
from solvers.solver import Progress


class PlaneGuide:
    """The load path in plane strain, as states of the extruded body at any fraction of the load.

    Args:
        problem: With a law of finite strain.
        space: The extruded body.
        progress: Of the plane solution.
    """

    def __init__(self, problem: Problem, space: ExtrudedSpace, progress: Progress) -> None:
        self._space = space
        path = FemNonlinearSolver().path(problem, space.section)
        path.follow(progress)
        self._points = path.points
        path.close()

    def __call__(self, fraction: float) -> LoadState:
        """The state at a fraction of the load, between two of the path; beyond its end the last one."""
        places = [point.fraction for point in self._points]
        after = min(int(np.searchsorted(places, fraction)), len(places) - 1)
        last, first = self._points[after], self._points[max(after - 1, 0)]
        share = (
            1.0 if last is first else min(1.0, (fraction - first.fraction) / (last.fraction - first.fraction))
        )
        nodal, forces, contact = (
            share * getattr(last, name) + (1 - share) * getattr(first, name)
            for name in ("nodal", "forces", "contact")
        )
        return replace(
            last,
            fraction=fraction,
            nodal=self._space.extruded(nodal),
            forces=forces,
            contact=np.outer(self._space.shares, contact).ravel(),
        )
