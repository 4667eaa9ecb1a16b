"""Every picture of a comparison.

`draw_all` is the one entry; what it needs is imported when it runs, so that a run without pictures starts
fast.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from compare.evaluation.evaluation import Evaluation
from geometry.finger.parameters import Parameters
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.observations import Observations
from solvers.problem import Load


@dataclass(frozen=True)
class Figure:
    """A picture that has been written.

    Attributes:
        path: The PNG file.
        title: What it shows, in a few words.
        caption: What a reader must know to read it, in sentences.
    """

    path: Path
    title: str
    caption: str


def draw_all(
    folder: Path,
    *,
    design: Parameters,
    mesh: TriangleMesh,
    load: Load,
    evaluations: Sequence[Evaluation],
    observations: Observations,
    reference: Evaluation,
    progress: Callable[[float, str], None] = lambda done, what: None,
) -> list[Figure]:
    """Draw every picture of a comparison, each written atomically as PNG.

    Args:
        folder: Where to write; created if it is missing.
        design: The finger.
        mesh: The mesh that the solvers shared.
        load: What moved the finger.
        evaluations: One for each solver, in the order of panels and colours.
        observations: What the markers did.
        reference: One of the evaluations, which the others are compared with.
        progress: Called before every picture with the share done, from 0 to 1, and what comes next.

    Returns:
        The pictures in the order of a report.
    """
    from compare.figures.gallery import Gallery

    gallery = Gallery(folder, design, mesh, load, tuple(evaluations), observations, reference)
    tasks = gallery.tasks()
    figures: list[Figure] = []
    for number, (what, draw) in enumerate(tasks):
        progress(number / len(tasks), what)
        figures += [figure for figure in [draw()] if figure is not None]
    progress(1.0, "pictures drawn")
    return figures
