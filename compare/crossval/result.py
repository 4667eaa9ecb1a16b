"""The scores of a finished cross-validation, and the rows of its CSV files."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from math import isnan, nan
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from pinnray.comparison.crossval.folds import ALL, SCHEMES, Fold, SeedResults
from pinnray.comparison.crossval.scores import (
    BASELINES,
    LEVEL,
    MARKERS,
    Difference,
    Score,
    ScoreInterval,
    differences,
    of_scheme,
    score,
)
from pinnray.comparison.crossval.study import CrossvalStudy, SolverVariant
from pinnray.comparison.crossval.true_fields import TrueContact
from pinnray.geometry.observations import Observations
from pinnray.runtime.notebook import brief
from pinnray.runtime.tables import Cell
from pinnray.solvers.solver import Traits

if TYPE_CHECKING:
    import pandas as pd


class Case(NamedTuple):
    """A truth and a layout of its markers; with measurements both are called `measured` or `simulated`."""

    truth: str
    layout: str

    def said_among(self, cases: Collection["Case"]) -> str:
        """The names in which cases differ, for messages; an empty text for a single case."""
        return ", ".join(
            own for own, others in zip(self, zip(*cases, strict=True), strict=True) if len(set(others)) > 1
        )

    def named(self, text: str, cases: Collection["Case"]) -> str:
        """A text with the names in which cases differ after it."""
        return ", ".join(filter(None, [text, self.said_among(cases)]))


@dataclass(frozen=True, eq=False)
class CaseResult:
    """The scores of all solvers with one truth and the markers of one layout.

    Attributes:
        source: One sentence on the source of the markers' displacements, opened by simulated or measured.
        markers: Number of markers.
        folds: The folds of every solver.
        scores: By solver and scheme.
        differences: By solver, baseline, scheme and entry of `COMPARED`.
        failed: Error messages of the solvers that have no score.
        remarks: Faults of results: solvers that did not converge, and impossible bodies.
    """

    source: str
    markers: int
    folds: Sequence[Fold]
    scores: Mapping[str, Mapping[str, Score]]
    differences: Mapping[str, Mapping[str, Mapping[str, Mapping[str, Difference]]]]
    failed: Mapping[str, str]
    remarks: Sequence[str] = ()

    def difference(self, label: str, baseline: str, scheme: str, what: str) -> Difference | None:
        """One of the `differences`, if it exists."""
        return self.differences[label].get(baseline, {}).get(scheme, {}).get(what)

    def verdict(self, label: str, baseline: str, scheme: str, what: str) -> str:
        """The verdict of one of the `differences`; an empty text if it does not exist."""
        found = self.difference(label, baseline, scheme, what)
        return found.verdict if found else ""

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
        found = {
            label: {
                baseline: {
                    scheme: differences(each[scheme], by_scheme[baseline][scheme]) for scheme in schemes
                }
                for baseline in BASELINES
                if baseline in by_scheme and baseline != label
            }
            for label, each in by_scheme.items()
        }
        scores = {
            label: {scheme: score(found) for scheme, found in each.items()}
            for label, each in by_scheme.items()
        }
        remarks = list(_remarks(results))
        return cls(observations.origin, len(observations.points), folds, scores, found, failed, remarks)

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
                    "solver": variant.solver.name,
                    "settings": variant.settings,
                    "assimilates": Traits.of(variant.make(0)).assimilates,
                    "schemes": {scheme: asdict(one) for scheme, one in self.scores[variant.label].items()},
                    "against": {
                        baseline: {
                            scheme: {
                                what: {**asdict(one), "verdict": one.verdict} for what, one in each.items()
                            }
                            for scheme, each in by_scheme.items()
                        }
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
    """A finished cross-validation.

    Attributes:
        study: Its settings.
        cases: The scores by truth and layout of the markers; of a single one with measurements.
        true_contacts: Force and place of the contact of each truth at the full load.
    """

    study: CrossvalStudy
    cases: Mapping[Case, CaseResult]
    true_contacts: Mapping[str, TrueContact] = field(default_factory=dict)

    __repr__ = brief

    @property
    def truths(self) -> list[str]:
        """Names of the truths; `measured` or `simulated` with measurements."""
        return list(dict.fromkeys(case.truth for case in self.cases))

    @property
    def layouts(self) -> list[str]:
        """Names of the layouts, likewise."""
        return list(dict.fromkeys(case.layout for case in self.cases))

    def of_truth(self, truth: str) -> dict[str, CaseResult]:
        """The scores with a truth by layout."""
        return {case.layout: each for case, each in self.cases.items() if case.truth == truth}

    def of_layout(self, layout: str) -> dict[str, CaseResult]:
        """The scores with a layout by truth."""
        return {case.truth: each for case, each in self.cases.items() if case.layout == layout}

    @property
    def schemes(self) -> list[str]:
        """The schemes of the folds, in the order of `SCHEMES`."""
        present = {fold.scheme for each in self.cases.values() for fold in each.folds}
        return [scheme for scheme in SCHEMES if scheme in present]

    @property
    def main_scheme(self) -> str:
        """The scheme whose held-out error stands for a solver: one marker at a time if it was asked for."""
        return next(scheme for scheme in self.schemes if scheme != ALL)

    @property
    def source(self) -> str:
        """The sources of the markers' displacements."""
        return "; ".join(dict.fromkeys(each.source for each in self.cases.values()))

    def every_score(self) -> Iterator[tuple[dict[str, Cell], CaseResult, Score]]:
        """Every score with its truth, layout, solver and scheme, the first columns of all CSV files."""
        for case, each in self.cases.items():
            for label, by_scheme in each.scores.items():
                for scheme, found in by_scheme.items():
                    yield {**case._asdict(), "solver": label, "scheme": scheme}, each, found

    @property
    def has_fields(self) -> bool:
        """True if fields were compared with a truth."""
        return any(found.fields for _, _, found in self.every_score())

    @property
    def failed(self) -> dict[str, str]:
        """Error messages of the solvers without a score, by solver (and truth and layout, if several)."""
        return {
            case.named(label, self.cases): message
            for case, each in self.cases.items()
            for label, message in each.failed.items()
        }

    @property
    def remarks(self) -> list[str]:
        """Faults of results, with truth and layout if there are several."""
        return [
            ", ".join(filter(None, [case.said_among(self.cases), remark]))
            for case, each in self.cases.items()
            for remark in each.remarks
        ]

    def table(self) -> "pd.DataFrame":
        """The columns of `held_out.csv` by truth, layout, solver and scheme; NaN where there is no number."""
        import pandas as pd

        rows = self.held_out_rows()
        numbers = [{name: nan if cell == "" else cell for name, cell in row.items()} for row in rows]
        return pd.DataFrame(numbers).set_index(["truth", "layout", "solver", "scheme"])

    def held_out_rows(self) -> list[dict[str, Cell]]:
        """The rows of `held_out.csv`: errors at given and held-out markers."""
        rows = []
        for row, each, found in self.every_score():
            for kind, errors in (("in_sample", found.in_sample), ("held_out", found.held_out)):
                for name in MARKERS:
                    row |= _interval_cells(f"{kind}_{name}", "_mm", errors.get(name))
            row["within_stated"] = "" if found.coverage is None else found.coverage
            row |= _difference_cells(row, each, "mae_sum", "_mm") | _contact_cells(found)
            rows.append(row | {"converged": found.converged})
        return rows

    def field_rows(self) -> list[dict[str, Cell]]:
        """The rows of `fields.csv`: relative L2 distances from the truth by field."""
        return [
            {**row, "field": name}
            | _interval_cells("rel_l2", "", interval)
            | _difference_cells(row, each, name, "")
            for row, each, found in self.every_score()
            for name, interval in found.fields.items()
        ]

    def truth_rows(self) -> list[dict[str, Cell]]:
        """The rows of `truths.csv`: held-out error; stress and force with every marker given; verdicts."""
        rows = []
        for row, each, found in self.every_score():
            if row["scheme"] != self.main_scheme:
                continue
            label, truth = str(row["solver"]), str(row["truth"])
            full = each.scores[label][ALL]
            row |= self.true_contacts[truth].cells if truth in self.true_contacts else {}
            row |= _interval_cells("held_out_mae_sum", "_mm", found.held_out.get("mae_sum"))
            row |= _interval_cells("von_mises_rel_l2", "", full.fields.get("von_mises"))
            row |= _contact_cells(full)
            for what, at in (("mae_sum", self.main_scheme), ("von_mises", ALL), ("force", ALL)):
                for baseline in ("gp", "statfem", "fem-asm"):
                    row[f"{what}_against_{baseline}"] = each.verdict(label, baseline, at, what)
            rows.append(row)
        return rows

    def content(self) -> dict[str, Any]:
        """The part of `crossval.json` that holds the result."""
        simulations = dict.fromkeys(each.simulation for each in self.study.chosen_truths.values())
        return {
            "schema": 3,
            "seeds": self.study.seeds,
            "level": LEVEL,
            "truth_mesh": ", ".join(simulations) or None,
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
    """A sentence on each solver whose results have faults."""
    for label, seeds in results.items():
        every = [found for seed in seeds for found in seed]
        against = [found.message for found in every if found.message]
        if against:
            yield f"{label}, {len(against)} of {len(every)} folds and seeds, the first of them: {against[0]}"


def _difference_cells(row: Mapping[str, Cell], each: CaseResult, what: str, unit: str) -> dict[str, Cell]:
    """Differences of a row's score from every baseline, with verdicts."""
    cells: dict[str, Cell] = {}
    for baseline in BASELINES:
        found = each.difference(str(row["solver"]), baseline, str(row["scheme"]), what)
        cells |= _interval_cells(f"from_{baseline}", unit, found, "_mean")
        cells[f"from_{baseline}"] = found.verdict if found else ""
    return cells


def _contact_cells(score: Score) -> dict[str, Cell]:
    """Errors of force and place of the contact, and how often stated intervals hold the truth."""
    row = _interval_cells("force_error", "", score.force)
    row |= _interval_cells("position_error", "_mm", score.position)
    return row | {name: "" if share is None else share for name, share in score.stated.items()}


def _interval_cells(name: str, unit: str, interval: ScoreInterval | None, mean: str = "") -> dict[str, Cell]:
    """A mean and the ends of its interval in three columns, empty where there is none."""
    values = (None, None, None) if interval is None else (interval.mean, interval.low, interval.high)
    return {
        f"{name}{end}{unit}": "" if value is None or isnan(value) else value
        for end, value in zip((mean, "_low", "_high"), values, strict=True)
    }
