"""All numbers of a run: `Scores`, which are kept in `metrics.json`.

Units: mm, MPa, N/mm, s.
"""

from collections.abc import Iterator, Mapping
from math import nan
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, ValidationError

from pinnray.comparison.evaluation.certificate import ROUNDING
from pinnray.comparison.evaluation.differences import Differences, FieldDifference, Number, Numbers
from pinnray.runtime.atomic import write_json
from pinnray.runtime.errors import UserError
from pinnray.runtime.tables import Cell

FILE = "metrics.json"
"""File of the numbers. Keys may be added under its `schema`; renaming or removing one makes a new one."""

Vector = Annotated[
    tuple[Number, ...], BeforeValidator(lambda value: value.tolist() if hasattr(value, "tolist") else value)
]
"""Numbers in their order."""


class Means(Numbers):
    """Mean absolute errors at markers, mm."""

    mae_u: Number  #: Mean of `ae_u` over the visible markers.
    mae_v: Number  #: Mean of `ae_v` over the visible markers.
    mae_sum: Number  #: Mean of `|du| + |dv|`: the absolute error that the paper's text defines.
    mae_rss: Number  #: sqrt(mae_u^2 + mae_v^2), as in row `disp` of the paper's Table I.


MEANS = tuple(Means.model_fields)
"""Names of the mean absolute errors."""


class MarkerErrors(Means):
    """Errors at the visible markers; those at markers that were not seen are NaN."""

    ae_u: Vector  #: Absolute error of u at each marker, mm.
    ae_v: Vector  #: Absolute error of v at each marker, mm.


class AllMarkers(MarkerErrors):
    """Errors at every marker that was seen."""

    in_sample: bool  #: Whether the solver was given the markers: these are training errors.


class Interval(Numbers):
    """A number with its interval of 95 %."""

    value: Number
    low: Number
    high: Number


class ForceScore(Numbers):
    """Force of the indenter that was found from the markers."""

    force: Interval  #: Along the stroke, N/mm.
    tangential_force: Interval  #: Across it, N/mm.
    position: Interval | None  #: Abscissa where it acts, mm; None where it was no unknown.
    shares: Mapping[str, Number] = {}  #: Of the variance of `force`, by what they come from.
    advice: str = ""  #: A sentence on the largest share, and on what would narrow the interval.


class FigureScores(Numbers):
    """What the finger does: figures by their names with units, and drawn points of the largest, mm."""

    values: Mapping[str, Number]
    places: Mapping[str, Vector]


class CertificateScore(Numbers):
    """The numbers of a `Certificate`, which explains them."""

    energy: Number
    fem_energy: Number
    excess: Number
    rel_excess: Number
    violation: Number
    rel_violation: Number
    energy_norm_error: Number
    weak_residual: Number
    imbalance: Number
    missed: Number
    misses_energy: bool
    work: Number
    base: Number
    load: Vector

    @property
    def excess_beyond_rounding(self) -> float:
        """Excess over the energy of `fem`; 0 where rounding explains it."""
        return self.rel_excess if self.rel_excess > ROUNDING**2 else 0.0


class UncertaintyScores(Numbers):
    """A solver's estimate of its own error."""

    energy_norm: Number
    rel_l2_displacement: Number
    rel_l2_von_mises: Number
    mae_markers: Number  #: mm.
    markers_u: Vector  #: Absolute error of u at each marker, mm.
    markers_v: Vector  #: Absolute error of v at each marker, mm.


class ReferenceDifferences(Differences):
    """Differences from the reference, beside its own error."""

    reference_uncertainty: Differences | None  #: Of the exact solution from the reference, as estimated.


class TruthDifferences(Numbers):
    """Differences of a solver from the fields of the virtual experiment, on the shared mesh."""

    displacement: FieldDifference  #: Of the displacement vector, mm.
    strain: FieldDifference  #: Of the strain tensor; each law has its own strain.
    von_mises: FieldDifference  #: MPa.


class SolverScores(Numbers):
    """All numbers of one solver of a run."""

    family: str | None
    twin: str | None
    law: str
    status: str
    message: str
    seconds: Number
    energy: Number
    reaction: Vector
    stats: Mapping[str, int | str | Number]
    identified: ForceScore | None
    figures: FigureScores | None
    certificate: CertificateScore | None
    markers: AllMarkers
    #: At markers that the solver was not given: `markers` for a solver that was given none; each left out in
    #: its turn for one that was given all; None where no displacement is known, or it predicts none without.
    held_out: MarkerErrors | None
    rigid_motion_off: Means | None  #: Means as in `markers`; see `without_rigid_motion`.
    uncertainty: UncertaintyScores | None
    to_reference: ReferenceDifferences
    to_truth: TruthDifferences | None  #: None where the markers were measured: nobody knows a real field.
    force_to_truth_rel: Number  #: Signed relative error of the force along the stroke; NaN likewise.

    @property
    def converged(self) -> bool:
        """By the solver's own criterion and, where there is a certificate, its limits."""
        return self.status == "converged"

    @property
    def given(self) -> MarkerErrors | None:
        """Errors at markers that the solver was given: training errors; None if it was given none."""
        return self.markers if self.markers.in_sample else None

    @property
    def most_telling(self) -> MarkerErrors:
        """Errors at markers that the solver was not given, if they are known, else at all."""
        return self.held_out or self.markers


class Measurements(Numbers):
    """Where the displacements of the markers come from."""

    source: str  #: `simulated` or `measured`.
    description: str
    markers: int  #: Number of those that were seen.


class Scores(Numbers):
    """Every number of a run; `metrics.json` is its file."""

    version: Literal[2] = Field(alias="schema")
    design: Mapping[str, Any]
    material: Mapping[str, Any]
    load: Mapping[str, Any]
    measurements: Measurements
    warnings: tuple[str, ...]
    left_out: Mapping[str, str] = {}  #: Reasons why solvers do not support the problem, by their names.
    failed: Mapping[str, str] = {}  #: Messages of solvers that failed, by their names.
    reference: str
    truth: FigureScores | None  #: What the simulated finger does; None where the markers were measured.
    solvers: Mapping[str, SolverScores]

    @classmethod
    def read(cls, folder: Path) -> Self:
        """The numbers of the run in an output folder.

        Raises:
            UserError: If there is no finished run, or its file is damaged or of another program.
        """
        file = folder / FILE
        try:
            return cls.model_validate_json(file.read_bytes())
        except OSError:
            raise UserError(
                f"{folder} has no {FILE}: give an output folder of a finished `compare`"
            ) from None
        except ValidationError as error:
            first = error.errors()[0]
            said = ": ".join(filter(None, [".".join(map(str, first["loc"])), first["msg"]]))
            raise UserError(f"{file} is damaged, or of another program: {said}") from None

    def content(self) -> dict[str, Any]:
        """The content of the file, with NaN for a number that does not exist."""
        return self.model_dump(by_alias=True)

    def write(self, folder: Path) -> None:
        """Write the numbers into an output folder, atomically."""
        write_json(folder / FILE, self.content())

    def __getitem__(self, solver: str) -> SolverScores:
        return self.solvers[solver]

    def label(self, solver: str) -> str:
        """A solver's name, marked where it did not converge."""
        return solver if self.solvers[solver].converged else f"{solver} (not converged)"

    def rows(self) -> list[dict[str, Cell]]:
        """The main numbers, a row a solver, with units in the names of the columns; NaN for none.

        One that failed has a row with the reason as its status.
        """
        found = [self._row(name, own) for name, own in self.solvers.items()]
        none: dict[str, Cell] = dict.fromkeys(found[0], nan)
        failed = self.failed.items()
        return found + [none | {"solver": name, "converged": False, "status": said} for name, said in failed]

    def _row(self, name: str, own: SolverScores) -> dict[str, Cell]:
        row: dict[str, Cell] = {"solver": name, "converged": own.converged}
        row |= {"in_sample": own.markers.in_sample, "observations": self.measurements.source}
        row |= {"reference": self.reference}
        for kind, errors in (("", own.markers), ("in_sample_", own.given), ("held_out_", own.held_out)):
            row |= {f"{kind}{mean}_mm": getattr(errors, mean, nan) for mean in MEANS}
        to = own.to_reference
        row |= dict(_columns("to_reference", to))
        uncertainty = "reference_uncertainty"
        row |= dict.fromkeys(dict(_columns(uncertainty, to)), nan)
        row |= dict(_columns(uncertainty, to.reference_uncertainty)) if to.reference_uncertainty else {}
        for field in TruthDifferences.model_fields:
            row[f"to_truth_{field}_rel_l2"] = getattr(getattr(own.to_truth, field, None), "rel_l2", nan)
        does = own.figures.values if own.figures else {}
        row |= {name: does.get(name, nan) for name in FORCES}
        row |= {"to_truth_force_rel": own.force_to_truth_rel, "energy_N_mm_per_mm": own.energy}
        for column, attribute in CERTIFICATE_COLUMNS.items():
            row[column] = getattr(own.certificate, attribute, nan)
        for place, axis in enumerate("uv"):
            row[f"load_off_{axis}_mm"] = own.certificate.load[place] if own.certificate else nan
        row |= {f"reaction_{axis}_N_per_mm": own.reaction[place] for place, axis in enumerate("uv")}
        return row | {"seconds_s": own.seconds, "status": own.message}


FORCES = ("force_N", "force_low_N", "force_high_N", "tangential_force_N")
"""Columns of the forces in a table, of the figures."""
CERTIFICATE_COLUMNS = {
    "excess_rel": "rel_excess",
    "violation_rel": "rel_violation",
    "energy_norm_error_rel": "energy_norm_error",
    "weak_residual_rel": "weak_residual",
    "imbalance_rel": "imbalance",
    "misses_energy": "misses_energy",
    "base_off_mm": "base",
}
"""Columns of a certificate in a table, and its numbers there."""


def _columns(what: str, differences: Differences) -> Iterator[tuple[str, float]]:
    """Three columns a field and two more; dimensionless quantities carry the unit 1."""
    fields = [("displacement", "mm", differences.displacement), ("von_mises", "MPa", differences.von_mises)]
    fields += [(f"stress_{name}", "MPa", difference) for name, difference in differences.stress.items()]
    fields += [(f"strain_{name}", "1", difference) for name, difference in differences.strain.items()]
    for name, unit, difference in fields:
        yield f"{what}_{name}_rel_l2", difference.rel_l2
        yield f"{what}_{name}_mean_{unit}", difference.mean
        yield f"{what}_{name}_p95_{unit}", difference.p95
    yield f"{what}_markers_mae_sum_mm", differences.mae_markers
    yield f"{what}_energy_rel", differences.rel_energy
