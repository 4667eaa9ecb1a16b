"""Which pictures there are, in which order, and what their captions say."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from compare.evaluation.evaluation import Evaluation
from compare.evaluation.force_displacement import force_curves
from compare.evaluation.labels import IN_SAMPLE, solver_label
from compare.figures import Figure, body
from compare.figures.canvas import Canvas
from compare.figures.colours import PERCENT
from compare.figures.design_drawing import draw_design
from compare.figures.energy_chart import draw_energy
from compare.figures.excess import DECADES, draw_excess
from compare.figures.fields import QUANTITIES, Quantity, draw_field, field_extent
from compare.figures.force_chart import draw_force_displacement
from compare.figures.loss_chart import draw_losses
from compare.figures.marker_chart import draw_marker_errors
from compare.figures.mesh_drawing import draw_mesh, mesh_numbers
from compare.figures.overlay import draw_overlay
from geometry.finger.parameters import Parameters
from geometry.mesh.triangle_mesh import TriangleMesh
from geometry.observations import Observations
from solvers.problem import Load

Task = tuple[str, Callable[[], Figure | None]]


@dataclass(frozen=True)
class Gallery:
    """The pictures of one comparison; the attributes are the arguments of `draw_all`."""

    folder: Path
    design: Parameters
    mesh: TriangleMesh
    load: Load
    evaluations: tuple[Evaluation, ...]
    observations: Observations
    reference: Evaluation

    def tasks(self) -> list[Task]:
        """What to say before drawing, and what draws, for every picture."""
        fields: list[Task] = [
            (f"picture of {quantity.name}", partial(self.field, quantity)) for quantity in QUANTITIES
        ]
        return [
            ("picture of the deformed finger", self.overlay),
            ("chart of the errors at the markers", self.marker_errors),
            *fields,
            ("chart of force over displacement", self.force_displacement),
            ("picture of the excess energy", self.excess),
            ("chart of the energy", self.energy),
            ("chart of the losses", self.losses),
            ("drawing of the design", self.drawing),
            ("picture of the mesh", self.mesh_picture),
        ]

    def overlay(self) -> Figure:
        """The deformed finger of every solver."""
        path = self.folder / "overlay.png"
        draw_overlay(
            path,
            mesh=self.mesh,
            load=self.load,
            evaluations=self.evaluations,
            observations=self.observations,
        )
        cylinder = "" if self.load.radius is None else " Grey circle: the cylinder where it ends."
        return Figure(
            path,
            "Deformed finger",
            f"The deformed body of each solver, coloured by displacement magnitude on one scale; the "
            f"displacement is not exaggerated. Circles: {self.observations.label} marker positions. Crosses: "
            f"the solver’s. Grey: the undeformed body.{cylinder} {self._given()}{self._simulated()}",
        )

    def marker_errors(self) -> Figure:
        """Bars of the errors at the markers."""
        path = self.folder / "marker_errors.png"
        draw_marker_errors(path, evaluations=self.evaluations, observations=self.observations)
        hidden = int((~self.observations.visible).sum())
        unseen = (
            f" {hidden} of {len(self.observations.visible)} markers (×) were not seen and count nowhere."
            if hidden
            else ""
        )
        return Figure(
            path,
            "Errors at the markers",
            f"Absolute difference between each solver’s displacement and the {self.observations.label} one, "
            f"for both components, on one scale, which a solver that did not converge may exceed; markers "
            f"are numbered from base to tip. Full bars: at a marker that the solver was not given, predicted "
            f"from all others if it was given those. Hollow bars: training errors.{unseen} {self._given()}"
            f"{self._simulated()}",
        )

    def field(self, quantity: Quantity) -> Figure:
        """One scalar field of every solver."""
        path = self.folder / f"{quantity.name}.png"
        with Canvas(self.mesh, field_extent(self.mesh), width=body.PIXELS // 2) as canvas:
            draw_field(
                path,
                quantity,
                canvas=canvas,
                mesh=self.mesh,
                evaluations=self.evaluations,
                reference=self.reference,
            )
        mixed = (
            " The solvers have different laws: strain is Green-Lagrange where it is finite, stress is Cauchy."
            if len({evaluation.law for evaluation in self.evaluations}) > 1
            else ""
        )
        beside = (
            f" Right: the field minus that of {solver_label(self.reference)}, point by point; the scale ends "
            f"at the same share of the area of the solver that is farthest from it, but not beyond the scale "
            f"of the field itself: what is off by more takes the end colours."
            if len(self.evaluations) > 1
            else ""
        )
        return Figure(
            path,
            quantity.title,
            f"{quantity.title} of every solver on the undeformed body, each triangle in the colour of its "
            f"mean. One scale for all: {PERCENT:g} % of the area of {solver_label(self.reference)} lie "
            f"within it, the peaks at the corners take the end colours. At a sharp corner the field has no "
            f"bound: the largest mean of a triangle, printed beside, grows with refinement.{beside}{mixed}",
        )

    def force_displacement(self) -> Figure | None:
        """Force over displacement of the indenter, where a solver follows the load."""
        curves = force_curves(self.evaluations, self.load)
        if not curves:
            return None
        path = self.folder / "force_displacement.png"
        draw_force_displacement(path, curves=curves, depth=self.design.depth)
        return Figure(
            path,
            "Force over displacement",
            f"Force of the indenter along its travel: per mm of depth (left), and for the finger’s "
            f"{self.design.depth:g} mm (right). A point is an equilibrium that a solver found as the load "
            f"grew; a linear solver’s line (dashed) is straight by its law. Solvers that were given the "
            f"markers are left out: the markers pull too.",
        )

    def excess(self) -> Figure | None:
        """Where the energy sits by which every certified solver is above finite elements."""
        path = self.folder / "excess.png"
        with Canvas(self.mesh, field_extent(self.mesh), width=body.PIXELS // 2) as canvas:
            if not draw_excess(path, canvas=canvas, mesh=self.mesh, evaluations=self.evaluations):
                return None
        return Figure(
            path,
            "Excess energy",
            f"Energy of the difference between each solver’s displacement, taken over to the elements of "
            f"fem, and the displacement of least energy with the same values at base and contact: its mean "
            f"over each triangle, on one logarithmic scale of {DECADES} powers of ten. {PERCENT:g} % of the "
            f"area of every solver lie below its end. A solver without a certificate, or without any excess, "
            f"is left out.",
        )

    def energy(self) -> Figure | None:
        """The record of every solver that kept one."""
        path = self.folder / "energy.png"
        if not draw_energy(path, evaluations=self.evaluations, reference=self.reference):
            path.unlink(missing_ok=True)
            return None
        return Figure(
            path,
            "Energy",
            f"Elastic energy per unit depth as each solver went on and, beside it, its relative distance "
            f"from that of {solver_label(self.reference)} (dashed line). A solver that solves directly "
            f"keeps no record. One that was given the markers pays energy for them: assimilation never "
            f"lowers the least energy. Over factors of the markers’ weight: the energy that they add.",
        )

    def losses(self) -> Figure | None:
        """The terms of the loss of every network that is trained by gradients."""
        path = self.folder / "losses.png"
        if not draw_losses(path, evaluations=self.evaluations):
            return None
        return Figure(
            path,
            "Losses",
            f"The paper’s Fig. 7, for all terms of the loss. L_PDE is the mean energy density: its least "
            f"value is not zero, and where the conditions are met, every further one raises it. So markers "
            f"cannot lower it at convergence. A network with the lower L_PDE at some epoch has come farther "
            f"in its training or misses its conditions by more, which L_BC tells; it is no more accurate for "
            f"it. A curve that still falls is a training that has not ended. {self._given()}",
        )

    def drawing(self) -> Figure:
        """The design with its dimensions."""
        path = self.folder / "design.png"
        draw_design(path, self.design)
        return Figure(
            path,
            "Design",
            f"The finger “{self.design.name}”, to scale, with its dimensions under the paper’s symbols, the "
            f"clamped base, the contact and the markers.",
        )

    def mesh_picture(self) -> Figure:
        """The shared mesh."""
        path = self.folder / "mesh.png"
        draw_mesh(path, self.mesh)
        numbers = mesh_numbers(self.mesh)
        return Figure(
            path,
            "Mesh",
            f"The mesh that every solver shares: {numbers.nodes} nodes, {numbers.triangles} triangles, edges "
            f"from {numbers.shortest:.3g} to {numbers.longest:.3g} mm. Quality is twice the ratio of the "
            f"inscribed to the circumscribed radius (1 for an equilateral triangle): worst "
            f"{numbers.worst:.2f}, mean {numbers.mean:.2f}. Orange: the contact. Dots: the markers.",
        )

    def _given(self) -> str:
        """What the mark beside a solver's name means, if there is one."""
        return f"{IN_SAMPLE}. " if any(evaluation.in_sample for evaluation in self.evaluations) else ""

    def _simulated(self) -> str:
        if not self.observations.simulated:
            return ""
        return f"The marker positions are simulated, not measured: {self.observations.source.rstrip('.')}."
