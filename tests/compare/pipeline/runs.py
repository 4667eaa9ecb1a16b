"""Runs of the main pipeline in silence."""

from io import StringIO

from rich.console import Console

from compare.evaluation.comparison import Results
from compare.pipeline.job import Job
from compare.pipeline.pipeline import run
from compare.runtime.stages import Stages


def quiet() -> Stages:
    return Stages(Console(file=StringIO()), quiet=True)


def compare(job: Job) -> Results:
    with quiet() as stages:
        return run(job, stages)
