"""Every module that a result in a cache or a resumable folder depends on counts in its key."""

from importlib.util import find_spec

import grimp
import pytest

from compare.crossval.solver_folds import run_folds
from compare.crossval.true_fields import simulate_truth
from compare.emulator.emulator import Emulator
from compare.evaluation.metrics import evaluated
from compare.evaluation.virtual_experiment import virtual_experiment
from compare.gridsearch.training_run import train
from compare.optimum.search import search_front
from compare.sweep.sweep import run_sweep
from geometry.cache import cache_key
from geometry.content_hash import PROGRAM, source_files

MAKERS = {
    "mesh and CAD": cache_key,
    "simulated truth": virtual_experiment,
    "solution of --resume": evaluated,
    "truth of crossval": simulate_truth,
    "folds of crossval": run_folds,
    "run of gridsearch": train,
    "samples of sweep": run_sweep,
    "emulator": Emulator,
    "search of optimise": search_front,
}

MISSED = [  # what the lists kept by hand have left out
    ("simulated truth", "solvers.cylinder_contact"),
    ("simulated truth", "solvers.lagrange"),
    ("simulated truth", "solvers.constrained_elimination"),
    ("solution of --resume", "compare.evaluation.metrics"),
    ("solution of --resume", "compare.evaluation.differences"),
    ("samples of sweep", "compare.evaluation.deformed_body"),
    ("samples of sweep", "compare.evaluation.plausibility"),
    ("folds of crossval", "compare.evaluation.deformed_body"),
    ("run of gridsearch", "compare.evaluation.differences"),
]


@pytest.fixture(scope="module")
def imports() -> grimp.ImportGraph:
    """The imports of the program, also those inside functions, by another reader of sources."""
    return grimp.build_graph(*filter(find_spec, PROGRAM), exclude_type_checking_imports=True, cache_dir=None)


@pytest.mark.parametrize("result", MAKERS)
def test_all_that_a_result_imports_is_in_its_digest(imports, result):
    maker = MAKERS[result]
    needed = {maker.__module__, *imports.find_upstream_modules(maker.__module__)}
    assert len(needed) > 20
    assert needed - source_files(maker).keys() == set()


@pytest.mark.parametrize(("result", "module"), MISSED)
def test_modules_that_were_once_left_out_count(result, module):
    assert module in source_files(MAKERS[result])


def test_a_simulated_truth_depends_on_its_solver_which_the_registry_names(imports):
    """It is imported by its name in a table."""
    solver = imports.find_upstream_modules("solvers.fem.finite_strain.solver")
    assert solver <= source_files(virtual_experiment).keys()
