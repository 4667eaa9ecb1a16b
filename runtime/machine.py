"""The memory of this machine, and a limit to what a process takes of it."""

import os
import resource
from pathlib import Path


def free_memory_gb() -> float:
    """Memory that can be had without swapping, GB."""
    told = Path("/proc/meminfo")  # Linux
    for line in told.read_text(encoding="ascii").splitlines() if told.exists() else ():
        if line.startswith("MemAvailable:"):
            return float(line.split()[1]) * 1024 / 1e9
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 1e9


def peak_memory_gb(usage: resource.struct_rusage) -> float:
    """Largest memory that a process ever had, GB; on Linux the parent's counts until a process takes more."""
    return usage.ru_maxrss * 1024 / 1e9


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
