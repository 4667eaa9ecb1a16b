"""Films of the virtual rig in memory, tracked and compared with their truth."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from pinnray.comparison.evaluation.virtual_experiment import simulate
from pinnray.geometry.cache import finger_mesh
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings
from pinnray.geometry.mesh.triangle_mesh import TriangleMesh
from pinnray.runtime.arrays import BoolArray, FloatArray
from pinnray.solvers.problem import Problem
from pinnray.vision.frames.frame import CapturedImage, Frames, Image
from pinnray.vision.rig.recording import FrameTruth
from pinnray.vision.tracking.trajectories import Tracking

HIDDEN = 0.02
"""Visible share of a marker below which it counts as hidden."""


@dataclass(frozen=True)
class Finger:
    """A finger with the displacements of its mesh's nodes under the load, shape (n, 2), mm."""

    design: Design
    mesh: TriangleMesh
    displacement: FloatArray

    @classmethod
    def pressed(cls, design: Design) -> "Finger":
        """The finger under the default indenter, at finite strain."""
        mesh = finger_mesh(design, settings=MeshSettings(size=1.0))  # 0.5 changes the markers by 0.0003 mm
        solution = simulate(Problem(mesh))
        return cls(design, mesh, solution.displacement(mesh.at_nodes()))


@dataclass(frozen=True)
class Score:
    """Measured and true displacements of the m markers of a film, shape (m, 2), mm."""

    true: FloatArray  # of the centroids of their discs
    centres: FloatArray  # of the material points at their centres
    measured: FloatArray  # nan for missing markers
    covariances: FloatArray  # the tracker's, of every displacement, shape (m, 2, 2), mm²
    swapped: int  # markers that were, in some frame, nearer to another one's place than to their own
    invented: int  # markers reported in a frame in which they were hidden
    overall: float  # mean square of all displacements' errors by their covariance; 1 if that is right

    @classmethod
    def of(cls, tracking: Tracking, truths: Sequence[FrameTruth]) -> "Score":
        """Compare the tracking of a film with the truth of its frames."""
        first, last = truths[0], truths[-1]
        seen, covariance = tracking.visible, tracking.displacement_covariance
        count = int(seen.sum())
        covariances = np.full((len(seen), 2, 2), np.nan)
        covariances[seen] = covariance.reshape(count, 2, count, 2)[np.arange(count), :, np.arange(count)]
        observations = tracking.observations("the virtual rig")
        measured = np.where(seen[:, None], observations.displacements, np.nan)
        true = last.discs - first.discs
        missed = (measured - true)[seen].ravel()
        positions, places = tracking.positions, np.stack([truth.discs for truth in truths])
        found, own = np.isfinite(positions[..., 0]), np.arange(len(seen))
        away = np.linalg.norm(positions[:, :, None] - places[:, None], axis=3)
        nearest = np.where(found, np.where(found[..., None], away, 0.0).argmin(axis=2), own)
        hidden = np.stack([truth.seen for truth in truths]) < HIDDEN
        return cls(
            true=true,
            centres=(last.world - first.world)[:, :2],
            measured=measured,
            covariances=covariances,
            swapped=int((nearest != own).any(axis=0).sum()),
            invented=int((found & hidden).any(axis=0).sum()),
            overall=float(missed @ np.linalg.solve(covariance, missed)) / len(missed),
        )

    @property
    def seen(self) -> BoolArray:
        """Mask of the markers not reported missing, shape (m,)."""
        return np.asarray(np.isfinite(self.measured).all(axis=1))

    @property
    def missed(self) -> FloatArray:
        """Errors of the seen markers, shape (s, 2), mm."""
        return (self.measured - self.true)[self.seen]

    @property
    def lengths(self) -> FloatArray:
        """|du| + |dv| of the seen markers, mm, as in the paper."""
        return np.asarray(np.abs(self.missed).sum(axis=1))

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations of the seen markers, shape (s, 2), mm."""
        return np.sqrt(np.diagonal(self.covariances[self.seen], axis1=1, axis2=2))

    @property
    def ratios(self) -> FloatArray:
        """Errors of the seen markers over their standard deviations, shape (s, 2)."""
        return np.asarray(self.missed / self.deviations)

    @property
    def squares(self) -> FloatArray:
        """Squared error of every seen marker by its covariance; 2 on the average if that is right."""
        solved = np.linalg.solve(self.covariances[self.seen], self.missed[:, :, None])[:, :, 0]
        return np.asarray((self.missed * solved).sum(axis=1))


def coverage(scores: Sequence[Score]) -> tuple[float, float]:
    """Shares of the errors below 1 and below 1.96 standard deviations: 0.683 and 0.950 if those are right."""
    below = np.abs(np.concatenate([score.ratios for score in scores]))
    return float((below < 1).mean()), float((below < 1.96).mean())


def figures(scores: Sequence[Score], digits: int = 0) -> list[str]:
    """Mean error and worst marker, mm, median standard deviation, mm, and coverage of one and two, %."""
    lengths = np.concatenate([score.lengths for score in scores])
    deviation = np.median(np.concatenate([score.deviations for score in scores]))
    shares = (f"{100 * share:.{digits}f}" for share in coverage(scores))
    return [*(f"{value:.4f}" for value in (lengths.mean(), lengths.max(), deviation)), *shares]


def film_of(pictures: Sequence[Image]) -> Frames:
    """Images as a film of 30 frames a second."""
    shots = (CapturedImage(each, number / 30.0, f"picture {number}") for number, each in enumerate(pictures))
    return Frames("the virtual rig", shots, rate=30.0, count=len(pictures))


def one_thread() -> None:
    """Let OpenCV use one core, in a process of a pool."""
    cv2.setNumThreads(1)
