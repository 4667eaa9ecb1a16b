"""The scores of a finished cross-validation."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from math import isnan, nan
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from compare.crossval.folds import SCHEMES, Fold, SeedResults
from compare.crossval.scores import (
    COMPARED,
    LEVEL,
    MARKERS,
    Difference,
    Interval,
    Score,
    difference,
    of_scheme,
    score,
)
from compare.crossval.study import SolverVariant, Study
from compare.crossval.true_fields import TrueContact
from compare.runtime.tables import Cell
from geometry.observations import Observations
from solvers.solver import Traits

if TYPE_CHECKING:
    import pandas as pd

BASELINES = ("fem", "gp", "statfem", "fem-asm")
"""Solvers that the others are compared with."""


class Case(NamedTuple):
    """A truth and a layout of its markers.

    Attributes:
        truth: Name of the truth; `measured` or `simulated` with measurements.
        layout: Name of the layout; likewise.
    """

    truth: str
    layout: str

    def said_among(self, cases: Collection["Case"]) -> str:
        """The names in which cases differ, for messages; an empty text for a single case."""
        return ", ".join(
            own for own, others in zip(self, zip(*cases, strict=True), strict=True) if len(set(others)) > 1
        )

    @property
    def cells(self) -> dict[str, Cell]:
        """The first columns of every CSV file."""
        return {"truth": self.truth, "layout": self.layout}


@dataclass(frozen=True, eq=False)
class LayoutResult:
    """The scores of all solvers in one case: with a truth and the markers of one layout.

    Attributes:
        source: One sentence on the source of the markers' displacements, opened by simulated or measured.
        markers: Number of markers.
        folds: The folds of every solver.
        scores: By solver and scheme.
        differences: By solver, baseline, scheme and entry of `COMPARED`.
        failed: Error messages of the solvers that have no score.
        remarks: What speaks against results: solvers that did not converge, and impossible bodies.
    """

    source: str
    markers: int
    folds: Sequence[Fold]
    scores: Mapping[str, Mapping[str, Score]]
    differences: Mapping[str, Mapping[str, Mapping[str, Mapping[str, Difference]]]]
    failed: Mapping[str, str]
    remarks: Sequence[str] = ()

    def difference(self, label: str, baseline: str, scheme: str, what: str) -> Difference | None:
        """One of the `differences`; None if there is no such one."""
        return self.differences[label].get(baseline, {}).get(scheme, {}).get(what)

    @classmethod
    def of(
        cls,
        observations: Observations,
        folds: Sequence[Fold],
        results: Mapping[str, SeedResults],
        failed: Mapping[str, str],
    ) -> Self:
        """Score the results of all folds of each solver."""
        schemes = list(dict.fromkeys(fold.scheme for fold in folds))
        by_scheme = {
            label: {scheme: of_scheme(each, scheme) for scheme in schemes} for label, each in results.items()
        }
        differences = {
            label: {
                baseline: {
                    scheme: {
                        what: found
                        for what in COMPARED
                        if (found := difference(each[scheme], by_scheme[baseline][scheme], what)) is not None
                    }
                    for scheme in schemes
                }
                for baseline in BASELINES
                if baseline in by_scheme and baseline != label
            }
            for label, each in by_scheme.items()
        }
        return cls(
            source=observations.origin,
            markers=len(observations.points),
            folds=folds,
            scores={
                label: {scheme: score(found) for scheme, found in each.items()}
                for label, each in by_scheme.items()
            },
            differences=differences,
            failed=failed,
            remarks=list(_remarks(results)),
        )

    def held_out_rows(self) -> list[dict[str, Cell]]:
        """Errors at given and held-out markers by solver and scheme."""
        rows: list[dict[str, Cell]] = []
        for label, scores in self.scores.items():
            for scheme, found in scores.items():
                row: dict[str, Cell] = {"solver": label, "scheme": scheme}
                for kind, errors in (("in_sample", found.in_sample), ("held_out", found.held_out)):
                    for name in MARKERS:
                        row |= interval_cells(f"{kind}_{name}", "_mm", errors.get(name))
                row["within_stated"] = "" if found.coverage is None else found.coverage
                row |= self._difference_cells(label, scheme, "mae_sum", "_mm")
                row |= interval_cells("force_error", "", found.force)
                row |= interval_cells("position_error", "_mm", found.position)
                row |= {name: "" if share is None else share for name, share in found.stated.items()}
                rows.append(row | {"converged": found.converged})
        return rows

    def field_rows(self) -> list[dict[str, Cell]]:
        """Relative L2 distances from the truth by solver, scheme and field."""
        return [
            {"solver": label, "scheme": scheme, "field": name}
            | interval_cells("rel_l2", "", interval)
            | self._difference_cells(label, scheme, name, "")
            for label, scores in self.scores.items()
            for scheme, found in scores.items()
            for name, interval in found.fields.items()
        ]

    def _difference_cells(self, label: str, scheme: str, what: str, unit: str) -> dict[str, Cell]:
        row: dict[str, Cell] = {}
        for baseline in BASELINES:
            found = self.difference(label, baseline, scheme, what)
            row |= interval_cells(f"from_{baseline}", unit, found, "_mean")
            row[f"from_{baseline}"] = found.verdict if found else ""
        return row

    def content(self, variants: Sequence[SolverVariant]) -> dict[str, Any]:
        """The entry of `crossval.json` for this layout."""
        return {
            "measurements": {"description": self.source, "markers": self.markers},
            "folds": [
                {"scheme": fold.scheme, "name": fold.name, "held": fold.held, "condition": fold.load_case}
                for fold in self.folds
            ],
            "solvers": {
                variant.label: {
                    "solver": variant.solver,
                    "settings": dict(variant.settings),
                    "assimilates": Traits.of(variant.make(0)).assimilates,
                    "schemes": {scheme: asdict(one) for scheme, one in self.scores[variant.label].items()},
                    "against": {
                        baseline: {scheme: _with_verdicts(each) for scheme, each in by_scheme.items()}
                        for baseline, by_scheme in self.differences[variant.label].items()
                    },
                }
                for variant in variants
                if variant.label in self.scores
            },
            "failed": dict(self.failed),
            "remarks": list(self.remarks),
        }


@dataclass(frozen=True, eq=False)
class CrossvalResult:
    """A finished study.

    Attributes:
        study: The study.
        cases: The scores by truth and layout of the markers; of a single one with measurements.
        true_contacts: Force and place of the contact of each truth at the full load.
    """

    study: Study
    cases: Mapping[Case, LayoutResult]
    true_contacts: Mapping[str, TrueContact] = field(default_factory=dict)

    @property
    def truths(self) -> list[str]:
        """Names of the truths; `measured` or `simulated` with measurements."""
        return list(dict.fromkeys(case.truth for case in self.cases))

    def of_truth(self, truth: str) -> dict[str, LayoutResult]:
        """The scores with a truth by layout."""
        return {case.layout: each for case, each in self.cases.items() if case.truth == truth}

    def of_layout(self, layout: str) -> dict[str, LayoutResult]:
        """The scores with a layout by truth."""
        return {case.truth: each for case, each in self.cases.items() if case.layout == layout}

    @property
    def schemes(self) -> list[str]:
        """The schemes of the folds, in the order of `SCHEMES`."""
        present = {fold.scheme for each in self.cases.values() for fold in each.folds}
        return [scheme for scheme in SCHEMES if scheme in present]

    @property
    def source(self) -> str:
        """The sources of the markers' displacements, which are the same for every layout."""
        return "; ".join(dict.fromkeys(each.source for each in self.cases.values()))

    @property
    def scores(self) -> list[Score]:
        """All scores, of every truth, layout, solver and scheme."""
        return [
            score
            for each in self.cases.values()
            for by_scheme in each.scores.values()
            for score in by_scheme.values()
        ]

    @property
    def has_fields(self) -> bool:
        """True if fields were compared with a truth."""
        return any(score.fields for score in self.scores)

    @property
    def failed(self) -> dict[str, str]:
        """Error messages of the solvers without a score, by solver (and truth and layout, if several)."""
        return {
            ", ".join(filter(None, [label, case.said_among(self.cases)])): message
            for case, each in self.cases.items()
            for label, message in each.failed.items()
        }

    @property
    def remarks(self) -> list[str]:
        """What speaks against results, with truth and layout if there are several."""
        return [
            ", ".join(filter(None, [case.said_among(self.cases), remark]))
            for case, each in self.cases.items()
            for remark in each.remarks
        ]

    def table(self) -> "pd.DataFrame":
        """The columns of `held_out.csv` by truth, layout, solver and scheme; NaN where there is no number."""
        import pandas as pd

        rows = [
            {name: nan if cell == "" else cell for name, cell in row.items()} for row in self.held_out_rows()
        ]
        return pd.DataFrame(rows).set_index(["truth", "layout", "solver", "scheme"])

    def held_out_rows(self) -> list[dict[str, Cell]]:
        """The rows of `held_out.csv`: errors at markers by truth, layout, solver and scheme."""
        return [case.cells | row for case, each in self.cases.items() for row in each.held_out_rows()]

    def field_rows(self) -> list[dict[str, Cell]]:
        """The rows of `fields.csv`: distances from the truth by truth, layout, solver, scheme and field."""
        return [case.cells | row for case, each in self.cases.items() for row in each.field_rows()]

    def content(self) -> dict[str, Any]:
        """The part of `crossval.json` that holds the result."""
        return {
            "schema": 3,
            "seeds": self.study.seeds,
            "level": LEVEL,
            "truth_mesh": None
            if self.study.measurements is not None
            else ", ".join(dict.fromkeys(each.simulation for each in self.study.chosen_truths.values())),
            "schemes": {scheme: SCHEMES[scheme] for scheme in self.schemes},
            "truths": {
                truth: {
                    "contact": self.true_contacts[truth].cells if truth in self.true_contacts else None,
                    "layouts": {
                        layout: each.content(self.study.variants)
                        for layout, each in self.of_truth(truth).items()
                    },
                }
                for truth in self.truths
            },
        }


def _remarks(results: Mapping[str, SeedResults]) -> Iterator[str]:
    """A sentence on each solver against whose results something speaks."""
    for label, seeds in results.items():
        every = [found for seed in seeds for found in seed]
        against = [found.message for found in every if found.message]
        if against:
            yield f"{label}, {len(against)} of {len(every)} folds and seeds, the first of them: {against[0]}"


def _with_verdicts(differences: Mapping[str, Difference]) -> dict[str, dict[str, Any]]:
    return {what: {**asdict(one), "verdict": one.verdict} for what, one in differences.items()}


def interval_cells(name: str, unit: str, interval: Interval | None, mean: str = "") -> dict[str, Cell]:
    """Three columns of a CSV file: a mean and the ends of its interval, empty where there is none."""
    values = (None, None, None) if interval is None else (interval.mean, interval.low, interval.high)
    return {
        f"{name}{end}{unit}": "" if value is None or isnan(value) else value
        for end, value in zip((mean, "_low", "_high"), values, strict=True)
    }
