"""Coverage-guided fuzzing of one reader by Atheris, in a process of its own.

`python -m benchmarks.reliability.fuzzing READER SECONDS FOLDER` writes what it found as JSON into the folder.
"""

import json
import logging
import os
import random
import re
import resource
import sys
import time
import traceback
import warnings
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from geometry.atomic import write_text

MOST_MEMORY = 4 * 2**30
"""Memory that a reader may take, bytes."""


def main(name: str, seconds: float, folder: Path) -> None:
    """Fuzz a reader until the time is over."""
    import atheris

    from benchmarks.reliability.readers import LONGEST_S, READERS, EndedError

    reader = READERS[name]
    guides = atheris.instrument_imports(include=list(reader.modules), enable_loader_override=False)
    with guides if reader.modules else nullcontext():
        seeds = reader.seeds()
        place = folder / f"input{reader.suffix}"
        for seed in seeds:
            place.write_bytes(seed)
            reader.try_file(place)
    warnings.simplefilter("ignore")
    logging.disable(logging.CRITICAL)
    corpus = folder / "corpus"
    corpus.mkdir(exist_ok=True)
    for number, seed in enumerate(seeds):
        (corpus / f"seed-{number}").write_bytes(seed)
    started = time.monotonic()
    counts = {"runs": 0, "read": 0, "slowest": 0.0, "ended": 0}
    wrong: dict[str, str] = {}

    def keep() -> None:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        found = {
            **counts,
            "seconds": time.monotonic() - started,
            "peak": peak,
            "wrong": wrong,
            "seeds": len(seeds),
        }
        write_text(folder / "found.json", json.dumps(found))

    def one(data: bytes) -> None:
        if len(data) <= reader.longest:
            place.write_bytes(data)
            begun = time.monotonic()
            try:
                counts["read"] += reader.try_file(place)
            except EndedError:
                counts["ended"] += 1
                (folder / f"crash-{counts['ended'] % 10}{reader.suffix}").write_bytes(data)
            except Exception as error:
                key = _key(error)
                if key not in wrong:
                    wrong[key] = f"{type(error).__name__}: {str(error)[:200]}"
                    (folder / f"wrong-{len(wrong)}{reader.suffix}").write_bytes(data)
                    keep()
            counts["slowest"] = max(counts["slowest"], time.monotonic() - begun)
        counts["runs"] += 1
        if time.monotonic() - started > seconds:
            keep()
            os._exit(0)
        if counts["runs"] % 200 == 0:
            keep()

    words = folder / "words"
    words.write_text("\n".join(f'"{word}"' for word in sorted(_words(seeds))) + "\n")
    if not reader.modules:
        generator = random.Random(time.time_ns())
        while True:
            one(_changed(generator.choice(seeds), generator))
    atheris.Setup(
        [
            *(
                sys.argv[0],
                str(corpus),
                f"-max_len={reader.longest}",
                f"-timeout={2 * LONGEST_S}",
                f"-dict={words}",
            ),
            *(
                f"-artifact_prefix={folder}/crash-",
                f"-rss_limit_mb={MOST_MEMORY // 2**20}",
                "-print_final_stats=0",
            ),
            "-verbosity=0",
        ],
        one,
    )
    atheris.Fuzz()


def _changed(content: bytes, generator: random.Random) -> bytes:
    """A file with up to three bytes changed, parts taken out or parts said again elsewhere."""
    changed = bytearray(content)
    for _ in range(generator.randint(1, 3)):
        at, kind = generator.randrange(len(changed)), generator.randrange(3)
        if kind == 0:
            changed[at] = generator.randrange(256)
        elif kind == 1:
            del changed[at : at + generator.randint(1, 8)]
        else:
            start = generator.randrange(len(changed))
            changed[at:at] = changed[start : start + generator.randint(1, 40)]
    return bytes(changed)


def _key(error: Exception) -> str:
    """Where in this project's code an exception began."""
    own: Any = [
        frame for frame in traceback.extract_tb(error.__traceback__) if "site-packages" not in frame.filename
    ]
    frame = own[-1]
    return f"{type(error).__name__} at {Path(frame.filename).name}:{frame.name}"


def _words(seeds: list[bytes]) -> set[str]:
    """Words of the seeds that are texts."""
    found: set[str] = set()
    for seed in seeds:
        if b"\0" not in seed:
            text = seed.decode("ascii", errors="ignore")
            found |= set(re.findall(r"[\w-]+", text))
    return {word for word in found if len(word) < 30} | {"nan", "inf", "1e999", "-1", "0", "[[", "{}"}


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), Path(sys.argv[3]))
