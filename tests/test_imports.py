"""The program's imports, also those inside functions and for type checkers alone."""

import grimp
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from geometry.content_hash import PROGRAM


def test_no_modules_import_one_another_in_a_circle():
    graph = grimp.build_graph(*PROGRAM, cache_dir=None)
    names = sorted(graph.modules)
    place = {name: number for number, name in enumerate(names)}
    pairs = [(place[a], place[b]) for a in names for b in graph.find_modules_directly_imported_by(a)]
    imports = coo_matrix((np.ones(len(pairs)), tuple(zip(*pairs, strict=True))), shape=(len(names),) * 2)
    _, circle = connected_components(imports, connection="strong")
    assert [name for name in names if np.count_nonzero(circle == circle[place[name]]) > 1] == []
