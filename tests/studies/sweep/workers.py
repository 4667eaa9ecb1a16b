"""Stand-ins for the measurement of a sample, in a module of their own, because every worker loads it."""

import os
import signal
import time

from pinnray.studies.sweep.measurement import Measurement


def die_at_one(task: object, report: object) -> list[Measurement]:
    if getattr(task, "number", None) == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return answered(task, report)


def hang_at_one(task: object, report: object) -> list[Measurement]:
    if getattr(task, "number", None) == 1:
        time.sleep(600)
    return answered(task, report)


def answered(task: object, report: object = None) -> list[Measurement]:
    return [Measurement(getattr(task, "number", -1), "done", "", 0.0, {"force": 1.0})]
