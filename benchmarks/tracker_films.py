"""Films of the virtual rig that are kept in memory, tracked, and scored against their truth."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from compare.virtual_experiment import simulation
from geometry.arrays import BoolArray, FloatArray
from geometry.cache import finger_mesh
from geometry.mesh import TriangleMesh
from geometry.parameters import Parameters
from geometry.settings import MeshSettings
from solvers.problem import Problem
from vision.frames import Frames, Image, Shot
from vision.rig.recording import Truth
from vision.tracking import Tracking

ELEMENT = 1.0
"""Size of the elements whose displacements are filmed, mm; with 0.5 they move the markers by 0.0003 mm."""


@dataclass(frozen=True)
class Finger:
    """A finger, and how its mesh's nodes move when it is pressed, shape (n, 2), mm."""

    parameters: Parameters
    mesh: TriangleMesh
    displacement: FloatArray

    @classmethod
    def pressed(cls, parameters: Parameters) -> "Finger":
        """By the default indenter, at finite strain."""
        mesh = finger_mesh(parameters, settings=MeshSettings(size=ELEMENT))
        solution = simulation(Problem(mesh))
        return cls(parameters, mesh, solution.displacement(mesh.at_nodes()))


@dataclass(frozen=True)
class Score:
    """What was measured of the m markers of a film, and what is true.

    Attributes:
        expected: Where they were, shape (m, 2), mm.
        true: How their discs moved, shape (m, 2), mm.
        centres: How the points in the middle of the discs before loading moved, shape (m, 2), mm.
        measured: What the tracker says, shape (m, 2), mm; nan for those that it reports missing.
        covariances: Of every marker's displacement, as the tracker has it, shape (m, 2, 2), mm².
        overall: Mean of the squares over all displacements, weighted by the inverse of their covariance; 1 if
            that is right.
    """

    expected: FloatArray
    true: FloatArray
    centres: FloatArray
    measured: FloatArray
    covariances: FloatArray
    overall: float

    @classmethod
    def of(cls, tracking: Tracking, first: Truth, last: Truth) -> "Score":
        """Compare what was tracked in a film with the truth of its first and last frame."""
        seen = tracking.visible
        covariance = tracking.displacement_covariance
        count = int(seen.sum())
        blocks = covariance.reshape(count, 2, count, 2)
        covariances = np.full((len(seen), 2, 2), np.nan)
        covariances[seen] = blocks[np.arange(count), :, np.arange(count)]
        observations = tracking.observations("the virtual rig")
        measured = np.where(seen[:, None], observations.displacements, np.nan)
        true = last.discs - first.discs
        missed = (measured - true)[seen].ravel()
        return cls(
            expected=first.discs,
            true=true,
            centres=(last.world - first.world)[:, :2],
            measured=measured,
            covariances=covariances,
            overall=float(missed @ np.linalg.solve(covariance, missed)) / len(missed),
        )

    @property
    def seen(self) -> BoolArray:
        """Which markers are not reported missing, shape (m,)."""
        return np.asarray(np.isfinite(self.measured).all(axis=1))

    @property
    def missed(self) -> FloatArray:
        """Measured minus true, shape (m, 2), mm."""
        return self.measured - self.true

    @property
    def lengths(self) -> FloatArray:
        """|du| + |dv| of the seen markers, mm, as in the paper."""
        return np.asarray(np.abs(self.missed)[self.seen].sum(axis=1))

    @property
    def ratios(self) -> FloatArray:
        """Errors of the seen markers over their standard deviations, shape (s, 2)."""
        deviations = np.sqrt(np.diagonal(self.covariances, axis1=1, axis2=2))
        return np.asarray((self.missed / deviations)[self.seen])

    @property
    def squares(self) -> FloatArray:
        """Squared error of every seen marker by its covariance; 2 on the average if that is right."""
        missed = self.missed[self.seen]
        solved = np.linalg.solve(self.covariances[self.seen], missed[:, :, None])[:, :, 0]
        return np.asarray((missed * solved).sum(axis=1))

    @property
    def swapped(self) -> int:
        """How many markers were found nearer to where another one is than to where they are."""
        places = self.expected + self.true
        away = np.linalg.norm((self.expected + self.measured)[self.seen, None] - places, axis=2)
        return int((away.argmin(axis=1) != np.nonzero(self.seen)[0]).sum())


def coverage(ratios: FloatArray) -> tuple[float, float]:
    """Shares of the errors below 1 and below 1.96 standard deviations: 0.683 and 0.950 if those are right."""
    below = np.abs(ratios)
    return float((below < 1).mean()), float((below < 1.96).mean())


def film_of(pictures: Sequence[Image], *, rate: float = 30.0) -> Frames:
    """Images as a film of so many frames a second."""

    def shots() -> Iterator[Shot]:
        for number, picture in enumerate(pictures):
            yield Shot(picture, number / rate, f"picture {number}")

    return Frames("the virtual rig", shots(), rate=rate, count=len(pictures))
