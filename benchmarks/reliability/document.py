"""Faults at every change of a file, random and mutated input; writes `docs/reliability.md`.

Each command runs in a forked process whose changes of files are counted. Then it runs again for each,
with a fault there: killed before it, killed in the middle of a write, a disk that is full from there on, one
failed call. The same command goes on and must give the numbers of the undisturbed run to the bit. x86-64
Linux only. Trials that are kept are not run again; `--rows compare` makes those of the jobs with this word in
their names. All take some five hours of one core.
"""

import os
import platform
from collections import Counter
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one thread: numbers are to agree to the bit

from rich.table import Table

from benchmarks.reliability import (
    audit,
    fuzz_all,
    inputs,
    memory,
    mutants,
    same_answer,
    same_image,
    two_threads,
)
from benchmarks.reliability.defects import DEFECTS
from benchmarks.reliability.faults import Row, run_faults
from benchmarks.reliability.jobs import JOBS
from geometry.atomic import write_text

PAGE = Path(__file__).parents[2] / "docs" / "reliability.md"
HEADER = ("job", "points", "killed", "torn write", "full disk", "failed call", "as promised", "left over")


def main(rows: str = "") -> Table:
    """Run the trials of the jobs with one of the words, write the page and return its table."""
    found = run_faults(rows.split(",") if rows else ())
    write_text(PAGE, page(found))
    table = Table(*HEADER, title="faults")
    for cells in fault_rows(found):
        table.add_row(*cells)
    return table


def page(rows: Sequence[Row]) -> str:
    """The page of all results that are kept."""
    return "\n".join(
        [
            *_faults(rows),
            *_inputs(),
            *_fuzzing(),
            *_same(),
            *_image(),
            *_audit(),
            *_memory(),
            *_mutants(),
            *_defects(),
        ]
    )


def fault_rows(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """A row of the table for each job, and the sum."""
    jobs = [job.name for job in JOBS if any(row.job == job.name for row in rows)]
    groups = {name: [row for row in rows if row.job == name] for name in jobs}
    return [_counted(name, group) for name, group in {**groups, "all": list(rows)}.items()]


def _counted(name: str, rows: Sequence[Row]) -> tuple[str, ...]:
    kinds = Counter(row.kind for row in rows)
    return (
        name,
        str(len({(row.job, row.at) for row in rows})),
        *(str(kinds[kind]) for kind in ("kill", "torn", "ENOSPC", "EIO")),
        str(sum(not row.faults for row in rows)),
        str(sum(bool(row.leftovers) for row in rows)),
    )


def _faults(rows: Sequence[Row]) -> list[str]:
    wrong = [row for row in rows if row.faults]
    return [
        "# Reliability",
        "",
        "## Faults at every change of a file",
        "",
        f"`make bench ARGS=reliability`: {platform.machine()}, Python {platform.python_version()}, numpy "
        f"{version('numpy')}, one thread.",
        "",
        "A *point* is a system call that changes a file in the output folder, in what stands in for it while "
        "it is made, or in the cache: `write`, `rename`, `unlink`, `mkdir`, `ftruncate`, `fsync` and their "
        "relatives, of the command, its libraries and its child processes; of a series of equal calls on one "
        "file the first, the middle and the last. The kernel stops the command there (seccomp), and it is "
        "*killed*; or killed after half of a *torn write*; or the *disk is full* from there on; or this one "
        "*call fails* with EIO. *As promised*:",
        "",
        "- after a kill no process is left, and no file is in part under its final name, nor in the cache;",
        "- an output folder that is replaced as a whole is the last result or the new one;",
        "- after an error the command ends with code 2 and one line, or, if it is in the cache, goes on;",
        "- the same command, `compare` with `--resume`, then ends well, with the numbers of an undisturbed "
        "run to the bit: every JSON, CSV, array and VTU file without its times, every row of the journal.",
        "",
        "Kills strike at every point, torn writes and a full disk where they can; of the faults that do not "
        "kill the table counts those that were tried so far, and the command goes on with the rest. *Left "
        "over*: trials after which temporary files remain, all of them in the cache. Pictures of `compare` "
        "are blank here, which changes no file but the PNGs. Meshes are coarse (4 mm).",
        "",
        *_table(HEADER, fault_rows(rows), left=1),
        "",
        *([f"{len(wrong)} of {len(rows)} trials are not as promised:", ""] if wrong else []),
        *(f"- {row.job}, {row.kind} at {row.call} {row.path}: {row.faults}" for row in wrong),
        *([""] if wrong else []),
        "Every trial is a row of `benchmarks/reliability/faults.csv`.",
        "",
        *_two_threads(),
    ]


def _two_threads() -> list[str]:
    """Kills on two threads."""
    if (found := two_threads.kept()) is None:
        return []
    return [
        "On two threads (`python -m benchmarks.reliability.two_threads`), "
        f"`compare {' '.join(two_threads.ARGUMENTS)}` was killed {found.kills} times, evenly over its "
        "changes of files, and resumed. Largest difference of the numbers in `metrics.json` and in the "
        f"solutions from those of a run that was never interrupted: {_relative(found.after_kills)}; between "
        f"two whole runs: {_relative(found.undisturbed)}.",
        "",
    ]


def _relative(difference: float) -> str:
    return f"{difference:.1e} of the largest of them" if difference else "none, they are equal to the bit"


def _inputs() -> list[str]:
    header = ("solver", "inputs", "solved", "not converged", "refused", "wrong", "slowest, s", "memory, MB")
    rows = [
        (f"`{each.solver}`", *map(str, each[1:6]), f"{each.slowest:.1f}", f"{each.peak / 1e6:.0f}")
        for each in inputs.kept_rows()
    ]
    return [
        "## Random fingers, drawings, settings, materials and loads",
        "",
        "`python -m benchmarks.reliability.inputs COUNT SOLVER` (Hypothesis): three of four are presets with "
        "up to four parameters of the design changed, one is a random drawing, an SVG file with lines of a "
        "description, read as by `--section`. Up to three values of material and load are changed, and in "
        "half of all inputs up to two settings of the solver. The other half is gentle: factors near one "
        "instead of any value in the range or at its ends. One of four has a value that is none: NaN, "
        "infinity, a number of 400 digits, text, a list; one drawing of three a word where a number belongs, "
        "an end in the middle or a curve drawn twice. Coarse elements, 2 to 20 mm. *Wrong* are different "
        "errors of the program, refusals without a reason, in several lines or for programmers, quantities "
        f"that are not finite, and more than {inputs.LONGEST_S:.0f} s. An earlier time found four causes of "
        "such, which are mended, see below. The slowest is on a busy machine; memory is the largest of a "
        f"process of {inputs.BLOCK} inputs.",
        "",
        *_table(header, rows, left=1),
        "",
    ]


def _fuzzing() -> list[str]:
    header = ("reader", "runs", "good files", "unhandled", "ended by a library", "slowest, s", "memory, MB")
    rows = [
        (
            each.reader,
            *(f"{count:,}" for count in (each.runs, each.read, each.unhandled, each.ended)),
            f"{each.slowest:.2f}",
            f"{each.peak / 1e6:.0f}",
        )
        for each in fuzz_all.kept_rows()
    ]
    return [
        "## Mutated files",
        "",
        "`python -m benchmarks.reliability.fuzz_all SECONDS` (Atheris, guided by the readers' branches): "
        "files that start from good ones, over several times, each with the code of its day. Of the last "
        "time alone: *unhandled*, places of exceptions that are no refusal in one line; *ended by a "
        "library*, C code crashed or took longer than 10 s. What was found before is mended, see below. "
        "Gmsh's reader of meshes is the one that damaged files still crash: commands read drawings and "
        "meshes in a process of their own and say in one line that it ended, and so are they read here, "
        "unguided; as each crash costs seconds, far fewer of them. Designs are read without the ranges that "
        "a refusal proposes, for which it tries a thousand others.",
        "",
        *_table(header, rows, left=1),
        "",
    ]


def _memory() -> list[str]:
    header = ("repeated", "times", "after a tenth, MB", "at the end, MB", "growth, kB each time")
    rows = [
        (
            each.job,
            f"{each.count:,}",
            f"{each.after_tenth:.1f}",
            f"{each.after_all:.1f}",
            f"{each.growth:.1f}",
        )
        for each in memory.kept_rows()
    ]
    return [
        "## Memory",
        "",
        "`python -m benchmarks.reliability.memory`: resident memory of a process that repeats one thing, "
        "each time with another load, other markers or another picture. *Growth* is the slope over the "
        "second half.",
        "",
        *_table(header, rows, left=1),
        "",
    ]


def _same() -> list[str]:
    stored, others = same_answer.stored_on(), same_answer.systems()
    header = ("job", *(_system(other.versions, stored) for other in others))
    rows = [
        (f"`{name}`", *(f"{other.differences[name]:.1e}" for other in others))
        for name in others[0].differences
    ]
    here = ", ".join(f"{package} {version}" for package, version in stored.items())
    return [
        "## The same answer",
        "",
        "`python -m tests.solvers.golden`: energy, force, displacements of two markers and mean von Mises "
        "stress of every solver on one stored mesh of the default finger (1.5 mm, nine rounded marker "
        "displacements), and their largest relative difference from those that are kept, which "
        f"`tests/solvers/test_golden.py` asks for on every machine: {here}. Zero is equality to the bit. "
        "Small reactions and displacements are a thousandth of the largest, and differ the most.",
        "",
        *_table(header, rows, left=1),
        "",
    ]


def _system(versions: dict[str, str], stored: dict[str, str]) -> str:
    """What differs on a system."""
    return ", ".join(f"{name} {version}" for name, version in versions.items() if version != stored[name])


def _image() -> list[str]:
    """What two builds of the image have in common."""
    if (found := same_image.kept()) is None:
        return []
    names = [f"`/{name}`" for name in (*found.lone, *found.differ)]
    return [
        "## The image, built twice",
        "",
        "`.ci/image-twice`: two images, built one after the other without a cache, from the same packages, "
        "with a fixed time: of "
        f"{found.files:,} files {len(found.lone)} are in one image only and {len(found.differ)} differ. "
        + (f"These are {', '.join(names)}." if names else "All contents are the same to the bit."),
        "",
    ]


def _audit() -> list[str]:
    """Advisories of the locked packages."""
    if (found := audit.kept()) is None:
        return []
    unknown = [f"{each.name} {each.version}" for each in found.packages if each.advisories is None]
    weak = [
        f"{each.name} {each.version} ({', '.join(each.advisories or []) or 'withdrawn'})"
        for each in found.weak
    ]
    return [
        "## Dependencies",
        "",
        "`make sbom` lists all of them, with licences. `python -m benchmarks.reliability.audit` asked PyPI "
        f"on {found.day} for advisories of the {len(found.packages)} releases of both lock files, as the "
        f"slow test `test_sbom.py` does: {len(found.known)} can be judged from here, because they are the "
        f"newest of their projects. With an advisory, or withdrawn: {', '.join(weak) or 'none'}.",
        "",
        f"Not judged: {', '.join(unknown) or 'none'}. `pip-audit -r requirements/debian12.txt --no-deps` "
        "judges them where PyPI's pages of releases can be reached, and Debian's tracker its own packages.",
        "",
    ]


def _mutants() -> list[str]:
    rows = mutants.kept_rows()
    groups = {
        name: [row for row in rows if row.module == name]
        for name in dict.fromkeys(row.module for row in rows)
    }
    cells = [
        (
            f"`{name}`",
            str(len(group)),
            str(killed := sum(row.end == "killed" for row in group)),
            f"{100 * killed / len(group):.0f} %",
            str(sum(row.judgement.startswith("equal") for row in group)),
        )
        for name, group in {**groups, "all": rows}.items()
    ]
    survivors = [row for row in rows if row.end == "survived"]
    return [
        "## Mutants",
        "",
        "`python -m benchmarks.reliability.mutants MODULE`: one operator, comparison, number, sign, "
        "condition or returned value of the module changed at a time; killed if a quick test of its own "
        "fails. A survivor is *equal* if no input can tell it from the original.",
        "",
        *_table(("module", "mutants", "killed", "share", "equal"), cells, left=1),
        "",
        "Survivors:",
        "",
        *_table(
            ("module", "line", "change", "judgement"),
            [
                (f"`{row.module}`", str(row.line), row.change, row.judgement or "not judged")
                for row in survivors
            ],
            left=4,
        ),
        "",
    ]


def _defects() -> list[str]:
    return [
        "## Defects found and mended",
        "",
        "Each has a test that failed before.",
        "",
        *_table(("found by", "what happened", "test"), DEFECTS, left=3),
        "",
    ]


def _table(header: Sequence[str], rows: Sequence[Sequence[str]], left: int) -> list[str]:
    rule = ["---"] * left + ["---:"] * (len(header) - left)
    return [f"| {' | '.join(cells)} |" for cells in (header, rule, *rows)]
