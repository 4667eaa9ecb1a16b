"""The emulator of the fields of a sweep's folder, which is fitted once and kept in the cache."""

from pathlib import Path

from pinnray.runtime.content_hash import sources_digest
from pinnray.runtime.stages import Stages
from pinnray.studies.emulator.store import kept
from pinnray.studies.fields.emulator import FieldEmulator, fitted_fields
from pinnray.studies.fields.snapshots import KnownSamples, Snapshots


def fields_of(folder: Path, stages: Stages | None = None) -> FieldEmulator:
    """The emulator of the fields in a sweep's folder: the one that the cache has, or fitted and kept.

    Args:
        folder: Of the sweep, whose study has `strokes`.
        stages: Shows the progress of a fit.

    Raises:
        UserError: If the sweep has no fields or too few.
    """
    found = KnownSamples.of(folder)
    known = [found.samples, found.results, found.lost, found.reasons]
    digest = sources_digest(__name__)
    return kept(found.inputs, known, digest, lambda: fitted_fields(Snapshots.load(found), stages))
