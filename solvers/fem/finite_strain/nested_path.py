"""A load path on coarse elements that ends on fine or solid ones: a part of the work of one on these."""

from dataclasses import replace

import numpy as np

from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.runtime.arrays import FloatArray
from pinnray.runtime.errors import UserError
from pinnray.solvers.contact.contact_region import ContactRegion
from pinnray.solvers.extrusion import ExtrudedSpace
from pinnray.solvers.fem.finite_strain.load_path import LoadPath
from pinnray.solvers.problem import Problem
from pinnray.solvers.solver import Progress

COARSE, ACROSS, FINE = 1.0, 2, 3000
"""Size of coarse elements, mm; their least number through a wall; triangles from which on they are used."""


def coarser(problem: Problem, most: float = 0.5) -> Problem | None:
    """The problem on elements of the size `COARSE`; through walls that are thin for it, on one element.

    None where these are more than a share `most` of its own, or its mesh is of another body.
    """
    if problem.finger is None or len(problem.mesh.triangles) < FINE:
        return None
    edge = np.sqrt(4 / np.sqrt(3) * np.median(problem.mesh.areas))
    if edge > COARSE / np.sqrt(2):  # a coarse mesh, which takes seconds, would not have half as many
        return None
    settings = MeshSettings(size=COARSE)
    try:
        mesh = finger_mesh(problem.finger, settings=settings, across=ACROSS)
    except UserError:  # a wall is too thin for that
        mesh = finger_mesh(problem.finger, settings=settings, across=1)
    same_body = np.isclose(mesh.areas.sum(), problem.mesh.areas.sum(), rtol=1e-2)
    fewer = len(mesh.triangles) < most * len(problem.mesh.triangles)
    return replace(problem, mesh=mesh) if same_body and fewer else None


class NestedPath:
    """The equilibria of a way on coarse elements up to the full load, and the last one on fine or solid ones.

    Energies and forces on the way are scaled by what the fine elements change of the last ones: the error of
    coarse elements is nearly the same share of every one.

    Args:
        path: Has taken over the end of the way.
        way: On coarse elements.
    """

    def __init__(self, path: LoadPath, way: LoadPath) -> None:
        self._path, self._way = path, way

    def history(self) -> dict[str, FloatArray]:
        """See `LoadPath`."""
        coarse, fine = self._way.history(), self._path.history()
        forces = [np.hypot(each["reaction_x"][-1], each["reaction_y"][-1]) for each in (coarse, fine)]
        force = float(forces[1] / forces[0]) if forces[0] else 1.0
        energy = float(fine["energy"][-1] / coarse["energy"][-1]) if coarse["energy"][-1] else 1.0
        scales = {"energy": energy, "reaction_x": force, "reaction_y": force}
        return {
            name: np.append(scales.get(name, 1.0) * column[:-1], fine[name][-1])
            for name, column in coarse.items()
        }

    def states(self) -> list[FloatArray]:
        """Displacements of the fine nodes at every equilibrium, each of shape (N, d), mm."""
        before = [self._path.interpolated(self._way, nodal) for nodal in self._way.states()[:-1]]
        return [*before, self._path.points[-1].nodal]

    def regions(self) -> list[ContactRegion | None]:
        """See `LoadPath`."""
        return [*self._way.regions()[:-1], self._path.regions()[-1]]

    @property
    def phrase(self) -> str:
        """The steps taken, in words."""
        coarse, fine = f"on elements of {COARSE:g} mm", "on the mesh itself"
        if isinstance(self._path.space, ExtrudedSpace):
            coarse, fine = "in plane strain", "in three dimensions"
        return f"{self._way.phrase}, {coarse}; {self._path.stats['newton_iterations']} more {fine}"

    @property
    def stats(self) -> dict[str, float | int | str]:
        """The number of steps and iterations."""
        return self._way.stats

    def close(self) -> None:
        """Free what PETSc holds."""
        self._path.close()
        self._way.close()


def followed(path: LoadPath, way: LoadPath | None, progress: Progress) -> LoadPath | NestedPath:
    """A path to the full load: by a way on coarser elements as far as that leads, else on its own."""
    if way is not None:
        way.follow(progress)
        if path.take_over(way):
            return NestedPath(path, way)
        way.close()
    path.follow(progress)
    return path
