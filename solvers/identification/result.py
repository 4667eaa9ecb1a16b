"""All fits of the unknowns, one a law, and the solution with its numbers and sentence."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pinnray.runtime.arrays import FloatArray
from pinnray.solvers.assimilation.estimation import LEVEL, MIN_RESOLUTION
from pinnray.solvers.assimilation.misfit import leave_one_out_displacements
from pinnray.solvers.elasticity import LawName
from pinnray.solvers.identification.field import IdentifiedField, IdentifiedSideFace, Member
from pinnray.solvers.identification.fit import NORMAL, Fit, split_phrase
from pinnray.solvers.identification.narrowing import narrowing_phrase
from pinnray.solvers.problem import Problem
from pinnray.solvers.solution import (
    Estimated,
    IdentifiedForce,
    Solution,
    Status,
    Uncertainty,
    stroke_axes,
    unstable_phrase,
)

WRAPPED = 0.5
"""Width of a contact over the front's extent from which its force is not believed: on a printed finger that
wraps around a cylinder with friction it was half of the forward one, with a contact of nine tenths."""
MISSED = 1.5
"""φ from which a misfit is more than chance: with the ten degrees of freedom that nine markers leave, noise
alone exceeds it once in a hundred times."""
CONTRADICTED = 20.0
"""φ from which the markers are not those of the finger: it is 1 to 2 over the truths of
`comparison.evaluation.truths`, 60 with a clamp that gave by 0.5 degrees and 0.4 mm, and 270 to 410 with
markers in another order."""
PROBABLE = 0.01
"""Least probability of a law whose field is kept."""


@dataclass(frozen=True, eq=False)
class Identified:
    """The fits to one measurement, one for each law in plane strain and with free side faces."""

    fits: Sequence[Fit]  # The most probable first
    probabilities: FloatArray  # Shape (number of fits,)
    lost: Sequence[LawName] = ()  # Laws of which no equilibrium was found near the markers

    @classmethod
    def ranked(cls, fits: Sequence[Fit], lost: Sequence[LawName] = ()) -> "Identified":
        """The fits, given in any order."""
        ordered = sorted(fits, key=lambda fit: -fit.log_posterior)
        logs = np.array([fit.log_posterior for fit in ordered])
        weights = np.exp(logs - logs.max())
        return cls(ordered, weights / weights.sum(), lost)

    @property
    def best(self) -> Fit:
        """The fit of the most probable law."""
        return self.fits[0]

    @cached_property
    def force(self) -> IdentifiedForce:
        """The force and its place: the mean over the laws, with an interval that holds their scatter."""
        stroke, side = stroke_axes(self.best.model.unknowns.problem.load)
        known = [fit.posterior for fit in self.fits]
        components = [each.component(stroke) for each in known]
        force, across = self._mean(components), self._mean([each.component(side) for each in known])
        found = np.array([value for value, _ in components]) - force.value
        parts = known[0].variances(stroke) | {"law": float(self.probabilities @ found**2)}
        whole = sum(parts.values()) or 1.0
        shares = {name: parts[name] / whole for name in sorted(parts, key=parts.__getitem__, reverse=True)}
        narrower = narrowing_phrase(self.best, stroke, parts["law"])
        advice = f"The variance of the force comes from: {split_phrase(parts)}. {narrower}"
        sought = "position" in self.best.model.unknowns.names
        position = self._mean([each.place for each in known]) if sought else None
        return IdentifiedForce(force, across, position, shares, advice, self.best.contact, self.best.learned)

    def _cylinder(self) -> float | None:
        """Probability of the contact of a cylinder; None where the load has none."""
        if self.best.model.unknowns.problem.load.kind != "cylinder":
            return None
        return float(self.probabilities @ np.array([fit.contact == "cylinder" for fit in self.fits]))

    def _mean(self, found: Sequence[tuple[float, float]]) -> Estimated:
        """The mean over the laws of a value with its standard deviation by each."""
        values, deviations = np.array(found).T
        mean = float(self.probabilities @ values)
        half = NORMAL * float(np.sqrt(self.probabilities @ (deviations**2 + (values - mean) ** 2)))
        return Estimated(mean, mean - half, mean + half)

    def solution(self, name: str, problem: Problem, stats: Mapping[str, float | int | str]) -> Solution:
        """The solution by the most probable law, with deviations that the others widen.

        Args:
            name: The solver's.
            problem: As it was given, with its observations.
            stats: Further columns of `Solution.stats`.
        """
        best = self.best
        hypothesis = best.response.hypothesis
        unstable = best.model.unstable(best.response)
        missed, without = self._residuals()
        members = [
            Member(float(probability), *fit.snapshots(problem), fit.response, fit.model)
            for fit, probability in zip(self.fits, self.probabilities, strict=True)
            if fit is best or probability >= PROBABLE
        ]
        kind = IdentifiedSideFace if best.model.body.thick else IdentifiedField
        field = kind(**vars(members[0].found), members=members)
        sentence, loose = self.sentence(missed), best.model.unknowns.unregistered
        contradicted = best.estimate.inflation > CONTRADICTED
        left_out = [f"{said}, and was left out" for said in self._contradictions()]
        return Solution(
            solver=name,
            problem=field.problem,
            field=field,
            energy=best.model.body.energy(best.response.state, hypothesis.lame, hypothesis.changes),
            reaction=best.response.force,
            status=Status(
                best.estimate.converged and best.exact and not unstable and not contradicted,
                f"{unstable_phrase(unstable)}; {sentence}" if unstable else sentence,
                [*self._unexplained(), *left_out, *self._wrapped()],
            ),
            stats={**stats, **self.stats(), "unstable_directions": unstable},
            left_out=leave_one_out_displacements(problem, -without),
            uncertainty=Uncertainty(
                field.standard_deviation, field.von_mises_deviation, field.shown_deviation if loose else None
            ),
            identified=self.force,
            pictures=hypothesis.pictures if loose else None,
        )

    def _residuals(self) -> tuple[FloatArray, FloatArray]:
        """Misfit of the markers that were seen, computed minus observed, and without each, (m, 2), mm."""
        best = self.best
        rows = np.arange(2 * len(best.measurement.points)).reshape(-1, 2)
        scale = best.estimate.inflation * best.measurement.noise[rows]
        without = np.array([best.estimate.residuals_without(each) for each in rows])
        return best.estimate.residuals[rows] * scale, without * scale

    def _laws(self) -> dict[LawName, float]:
        """Probability of every law, the most probable fit's first."""
        found = dict.fromkeys((fit.law for fit in self.fits), 0.0)
        for fit, probability in zip(self.fits, self.probabilities.tolist(), strict=True):
            found[fit.law] += probability
        return found

    def _free_sides(self) -> float | None:
        """Probability of free side faces; None if they were not weighed against plane strain."""
        free = np.array([fit.model.body.thick for fit in self.fits])
        return float(self.probabilities @ free) if free.any() else None

    def _contradictions(self) -> list[str]:
        """A clause on each marker that was left out."""
        missed, _ = self._residuals()
        return [
            f"MARKER {each + 1} of those seen CONTRADICTS the others by {np.linalg.norm(missed[each]):.2g} mm"
            for each in self.best.doubted
        ]

    def _unexplained(self) -> list[str]:
        """A sentence on markers that no values of the unknowns explain within their deviations."""
        off = self.best.estimate.inflation
        if off < MISSED:
            return []
        if off > CONTRADICTED:
            return [
                f"NO FINGER OF THIS DRAWING EXPLAINS THE MARKERS: they are {off:.0f} times as far off as "
                "they are known, so that force and intervals say nothing; see whether drawing, clamp, load, "
                "frames of the pictures and numbers of the markers are right"
            ]
        return [
            f"THE MARKERS ARE {off:.2g} TIMES AS FAR FROM ANY FINGER OF THIS DRAWING AS THEY ARE KNOWN, "
            "which chance does once in a hundred times: see the clamp, the camera and its plane, the scale "
            "and the stated deviations; force and walls make up for what is wrong, in intervals that are as "
            "much wider"
        ]

    def _wrapped(self) -> list[str]:
        """A sentence on a contact that is so wide that one patch of pressure is no picture of it."""
        unknowns = self.best.model.unknowns
        share = self.best.response.hypothesis.width / unknowns.traction.extent
        if share < WRAPPED:
            return []
        return [
            f"THE CONTACT THAT WAS FOUND COVERS {min(share, 1.0):.0%} OF THE FRONT: the wall wraps around "
            "the indenter, which one patch of pressure does not describe, so that the force may be off by a "
            "factor of two, whatever its interval; compare it with fem-nonlinear under the cylinder"
        ]

    def stats(self) -> dict[str, float | int | str]:
        """All that was found, for tables: parameters, how well they are known, force and laws."""
        found = self.best.estimate
        numbers: dict[str, float | int | str] = {}
        numbers |= {"evaluations": found.evaluations, "inflation": found.inflation}
        for name, _, value, *rest in self.best.parameters:
            columns = ("deviation", "low", "high", "resolution")
            numbers[name] = value
            numbers |= {f"{name}_{column}": each for column, each in zip(columns, rest, strict=True)}
        force, low, high = self.force.force
        numbers |= {"law": self.best.law, "force": force, "force_low": low, "force_high": high}
        for name, probability in self._laws().items():
            numbers[f"probability {name}"] = probability
        for fit in reversed(self.fits):  # that of the best one stays
            numbers[f"log_evidence {fit.law}"] = fit.log_evidence
        if (sides := self._free_sides()) is not None:
            numbers["probability free sides"] = sides
        if (cylinder := self._cylinder()) is not None:
            numbers["probability cylinder"] = cylinder
        return numbers | {"doubtful_markers": len(self.best.doubted)}

    def sentence(self, missed: FloatArray) -> str:
        """The status: force, parameters, law, goodness of fit, doubtful markers, undetermined parameters.

        `missed` are displacements of the markers, computed minus observed, shape (m, 2), mm.
        """
        found, parameters, parts = self.best.estimate, self.best.parameters, []
        if not found.converged:
            parts.append("the minimum was not found: take fewer parameters or a smaller prior")
        elif not self.best.exact:
            parts.append(
                "the equilibrium was not found to the last digit, or not by the finest discretisation: the "
                "field is that of the search; take another mesh or fewer parameters"
            )
        force, low, high = self.force.force
        parts.append(f"force {force:.4g} ({low:.4g} to {high:.4g}) N/mm, intervals of {LEVEL:.0%}")
        values = (f"{u.name} {u.value:.4g} ({u.low:.4g} to {u.high:.4g}) {u.unit}" for u in parameters)
        parts.append(", ".join(map(str.rstrip, values)))
        if len(laws := self._laws()) > 1:
            shares = ", ".join(f"{law} {share:.1%}" for law, share in laws.items())
            parts.append(f"law {shares} probable")
        if (cylinder := self._cylinder()) is not None:
            other = "" if cylinder else ", which was not fitted or has no equilibrium there,"
            parts.append(
                f"contact of the cylinder{other} {cylinder:.1%} probable, of a patch {1 - cylinder:.1%}"
            )
        seen = self.best.model.unknowns.problem.observations
        if (sides := self._free_sides()) is not None:
            parts.append(f"free side faces {sides:.1%} probable, plane strain {1 - sides:.1%}")
        elif seen is None or not seen.plane:
            parts.append("in plane strain: the third dimension takes fem-id and a finger with a depth")
        if known := self.best.model.unknowns.problem.learned:
            parts.append(f"with what {known.pictures} pictures, {known.weighed} weighed, have taught before")
        parts += [f"no equilibrium of the {law} law was found near the markers" for law in self.lost]
        parts += [f"{said}: not used" for said in self._contradictions()]
        missed = np.delete(missed, self.best.doubted, axis=0)
        parts.append(f"markers missed by {np.sqrt((missed**2).mean()):.2g} mm (root mean square)")
        if found.inflation > 1:
            off = f"{found.inflation:.3g} times their standard deviations"
            parts.append(f"{off}; intervals are as much wider")
        unresolved = [f"{u.name} ({u.resolution:.0%})" for u in parameters if u.resolution < MIN_RESOLUTION]
        if unresolved:
            parts.append(f"NOT DETERMINED by the markers, but held by its prior: {', '.join(unresolved)}")
        return "; ".join(parts)
