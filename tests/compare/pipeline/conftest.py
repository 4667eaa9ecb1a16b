"""A small job of the main pipeline with two measured markers."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pinnray.comparison.pipeline.job import Job
from pinnray.geometry.finger.design import Design
from pinnray.geometry.mesh.settings import MeshSettings


@pytest.fixture
def measured(tmp_path: Path) -> Path:
    """Two markers, measured, which are not those of the design."""
    path = tmp_path / "measured.csv"
    path.write_text("x_mm,y_mm,u_mm,v_mm\n20,-1,-0.5,-5\n85,-1,-2,-0.5\n")
    return path


@pytest.fixture
def job(tmp_path: Path, measured: Path, without_pictures: None, few_elements: None) -> Callable[..., Job]:
    """`job(solver, ...)`: a small job with those solvers, changed by keyword."""

    def make(*solvers: Any, **changes: Any) -> Job:
        mesh = MeshSettings(size=2.0)
        made = Job(Design(), solvers, mesh=mesh, measurements=measured, out=tmp_path / "out" / "run")
        return replace(made, **changes)

    return make
