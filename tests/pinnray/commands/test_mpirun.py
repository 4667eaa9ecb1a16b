"""`compare` on one and on two MPI ranks."""

import json

import numpy as np
import pytest

from pinnray.cli import main
from tests.pinnray.commands.programs import FEW_ELEMENTS, WITHOUT_PICTURES

SMALL = "compare --design default --mesh-size 2 --solvers fem --quiet"

pytestmark = [pytest.mark.mpi, pytest.mark.slow]


def numbers(path):
    """The cells of a CSV file that are numbers."""
    rows = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines() if line[0] != "#"]
    return np.array([[float(cell) for cell in row if is_number(cell)] for row in rows[1:]])


def is_number(cell):
    try:
        float(cell)
    except ValueError:
        return False
    return True


def test_one_and_two_ranks_give_the_same_tables(
    start_ranks, tmp_path, monkeypatch, few_elements, without_pictures
):
    """To 1e-8 mm: the order of sums differs. The simulated markers are those of `fem-nonlinear`."""
    assert main([*SMALL.split(), "--out", str(tmp_path / "1")]) == 0
    monkeypatch.setenv("PINNRAY_CACHE", str(tmp_path / "cache"))  # empty, so that the ranks mesh, too
    program = FEW_ELEMENTS + WITHOUT_PICTURES
    process = start_ranks(2, "-c", program, *SMALL.split(), "--out", str(tmp_path / "2"))
    output, errors = process.communicate()
    assert (process.returncode, output, errors) == (0, "", "")
    one, two = (numbers(tmp_path / str(ranks) / "markers.csv") for ranks in (1, 2))
    assert len(one) == 9
    np.testing.assert_allclose(two, one, rtol=0, atol=1e-8)
    energies = [
        [entry["energy"] for entry in json.loads(path.read_text(encoding="utf-8"))["solvers"].values()]
        for path in sorted(tmp_path.glob("*/metrics.json"))
    ]
    np.testing.assert_allclose(*energies, rtol=1e-9)
