"""This machine: processor, memory, versions of packages; and a limit to the memory of a process."""

import os
import platform
import resource
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from pinnray.runtime.errors import UserError

PACKAGES = (
    *("pinn-ray", "numpy", "scipy", "scikit-learn", "torch", "fenics-dolfinx", "fenics-ufl", "petsc4py"),
    *("mpi4py", "gmsh", "cadquery", "pyvista", "vtk", "opencv-python-headless"),
)


def package_versions() -> dict[str, str]:
    """Versions of all packages that affect the numbers or pictures."""
    return {"python": platform.python_version()} | {package: package_version(package) for package in PACKAGES}


def program_version() -> str:
    """Version of pinn-ray, as it is installed."""
    return package_version("pinn-ray")


def package_version(package: str) -> str:
    """Version of a package; that of its module where it is not installed by pip."""
    try:
        return _installed_version(package)
    except PackageNotFoundError:
        module = sys.modules.get({"fenics-dolfinx": "dolfinx", "fenics-ufl": "ufl"}.get(package, package))
        return str(getattr(module, "__version__", "unknown"))


_installed_version = cache(version)


def machine() -> dict[str, str | int]:
    """The operating system, the processor and its cores."""
    return {"system": platform.platform(), "processor": platform.machine(), "cores": cores()}


def cores() -> int:
    """Number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def process_count(given: int | None, name: str) -> int:
    """Processes at a time: as many as there are cores if None; other than a whole number, a `UserError`."""
    if given is None:
        return cores()
    if isinstance(given, bool) or not isinstance(given, int) or given < 1:
        raise UserError(f"{name} {given!r}: give a whole number from 1")
    return given


def free_memory_gb() -> float:
    """Memory that can be had without swapping, GB."""
    told = Path("/proc/meminfo")  # Linux
    for line in told.read_text(encoding="ascii").splitlines() if told.exists() else ():
        if line.startswith("MemAvailable:"):
            return float(line.split()[1]) * 1024 / 1e9
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1e9


def limit_memory(more_gb: float) -> None:
    """Let this process take so much more memory, GB, and no more: then it runs out without its neighbours.

    Systems without `/proc` set no limit.
    """
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
    except OSError:
        return
    (taken,) = (int(line.split()[1]) for line in status.splitlines() if line.startswith("VmData:"))
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    wanted = int(1024 * taken + 1e9 * more_gb)
    soft = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))
