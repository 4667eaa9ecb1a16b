"""Files in the working folder that a library or Python itself would take for settings or code of the user."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from pinnray.runtime.processes.pool import Pool, child_environment


def sum_of(number: int, progress: Callable[..., None]) -> int:
    return number + 1


@pytest.fixture
def hostile_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with modules that end every Python program which imports them from there."""
    for name in ("selectors", "random", "signal", "tempfile"):
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'a').write('{name} ')\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_processes_run_no_module_of_the_working_folder(hostile_folder: Path) -> None:
    before = dict(os.environ)
    with Pool(1) as pool:
        assert dict(pool.answers(sum_of, {"a": 1})) == {"a": 2}
    assert not (hostile_folder / "ran").exists()
    assert dict(os.environ) == before


def run_in(folder: Path, code: str) -> str:
    """What a program prints that runs in a folder."""
    command = [sys.executable, "-c", code]
    done = subprocess.run(
        command, env=child_environment(os.environ), cwd=folder, capture_output=True, text=True, check=True
    )
    return done.stdout + done.stderr


def test_gmsh_takes_no_options_from_the_working_folder(tmp_path: Path) -> None:
    (tmp_path / ".petscrc").write_text(f"-history {tmp_path / 'written'}\n")
    assert run_in(tmp_path, "from pinnray.geometry.mesh.mesher import session\nwith session(): pass") == ""
    assert not (tmp_path / "written").exists()


def test_fem_takes_no_options_from_the_working_folder(tmp_path: Path) -> None:
    """PETSc would write a file of any name or load a library, DOLFINx pass any flag to the compiler."""
    for name in (".petscrc", "petscrc"):
        (tmp_path / name).write_text(f"-log_view :{tmp_path / 'written'}\n")
    for name in ("parameters", "options"):  # until 0.5, and later
        (tmp_path / f"dolfinx_jit_{name}.json").write_text('{"cffi_extra_compile_args": ["-fplugin=x.so"]}')
        (tmp_path / f"ffcx_{name}.json").write_text('{"epsilon": 0.5}')
    code = (
        "from pinnray.solvers.fem import dolfinx_compat as own\n"
        "for package in (own.dolfinx.jit, own.ffcx):\n"
        "    options = getattr(package, 'get_options', None) or package.get_parameters\n"
        "    print('found', options().get('cffi_extra_compile_args'), options().get('epsilon'))\n"
    )
    said = run_in(tmp_path, code)
    assert (said.count("found"), "x.so" in said, "0.5" in said) == (2, False, False)
    assert not (tmp_path / "written").exists()


def test_pictures_take_no_settings_from_the_working_folder(tmp_path: Path) -> None:
    """LaTeX would be started, and could read any file into a picture."""
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\ntext.latex.preamble: \\input{/etc/hostname}\n")
    code = (
        "import sys, subprocess\n"
        "from pathlib import Path\n"
        "from pinnray.runtime.figure import figure\n"
        "subprocess.check_output = lambda *given, **_: sys.exit('a program was started')\n"
        "with figure(1.0) as drawn:\n"
        "    drawn.text(0.5, 0.5, 'text')\n"
        "drawn.save(Path('a.png'))\n"
    )
    run_in(tmp_path, code)
