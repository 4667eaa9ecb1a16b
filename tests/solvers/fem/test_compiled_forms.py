"""Forms that DOLFINx compiles, where another process was ended while it compiled them."""

import os
import sys
import time
from pathlib import Path

import dolfinx.jit
import pytest

from pinnray.solvers.fem import dolfinx_compat
from pinnray.solvers.fem.dolfinx_compat import DolfinxSpace
from pinnray.solvers.lagrange import LagrangeSpace


@pytest.fixture
def cache(monkeypatch, tmp_path):
    """An empty cache folder of compiled forms, and one second instead of ten to wait for another process."""
    name = "get_options" if hasattr(dolfinx.jit, "get_options") else "get_parameters"
    own = getattr(dolfinx.jit, name)
    monkeypatch.setattr(
        dolfinx.jit, name, lambda *given: {**own(*given), "cache_dir": tmp_path, "timeout": 1}
    )
    return tmp_path


def half_compiled(cache: Path, mesh) -> list[Path]:
    """Compile a space, and leave it as a process would that was killed before the compiler's end."""
    DolfinxSpace(LagrangeSpace(mesh, 2))
    left = list(cache.glob("libffcx_*.c"))
    for file in cache.iterdir():
        if file not in left:
            file.unlink()
    sys.path_importer_cache.clear()
    return left


def test_a_form_that_a_killed_run_left_half_compiled_is_compiled_again(cache, coarse_mesh):
    left = half_compiled(cache, coarse_mesh)
    assert left
    for file in left:
        os.utime(file, times=(0, time.time() - dolfinx_compat.ABANDONED_S - 1))
    DolfinxSpace(LagrangeSpace(coarse_mesh, 2))
    assert all(file.with_suffix(".c.cached").exists() for file in left)


def test_a_form_just_left_is_waited_for_until_it_is_old(cache, coarse_mesh, monkeypatch):
    left = half_compiled(cache, coarse_mesh)
    monkeypatch.setattr(dolfinx_compat, "ABANDONED_S", time.time() - min(f.stat().st_mtime for f in left) + 2)
    DolfinxSpace(LagrangeSpace(coarse_mesh, 2))
    assert all(file.with_suffix(".c.cached").exists() for file in left)


def test_an_interruption_leaves_no_half_compiled_form(cache):
    def interrupted():
        (cache / "libffcx_forms_1.c").write_text("int")
        raise KeyboardInterrupt

    for name in ("libffcx_forms_2.c", "libffcx_forms_2.c.cached"):
        (cache / name).touch()
    with pytest.raises(KeyboardInterrupt):
        dolfinx_compat._compiled(interrupted)
    assert sorted(file.name for file in cache.iterdir()) == ["libffcx_forms_2.c", "libffcx_forms_2.c.cached"]
