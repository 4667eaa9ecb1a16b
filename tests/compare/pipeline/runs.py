"""Runs of the main pipeline in silence."""

from io import StringIO

from rich.console import Console

from pinnray.comparison.evaluation.comparison import Results
from pinnray.comparison.pipeline.job import Job
from pinnray.comparison.pipeline.pipeline import run
from pinnray.runtime.stages import Stages


def quiet() -> Stages:
    return Stages(Console(file=StringIO()), quiet=True)


def compare(job: Job) -> Results:
    with quiet() as stages:
        return run(job, stages)
