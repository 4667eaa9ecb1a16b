"""Tasks in processes of their own, each with a line of progress."""

from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack, closing
from typing import TypeVar

from compare.runtime.processes import ProcessFailed, in_processes
from compare.runtime.stages import Stages
from solvers.solver import Progress

Input = TypeVar("Input")
Output = TypeVar("Output")


def in_stages(
    work: Callable[[Input, Progress], Output],
    tasks: Mapping[str, Input],
    *,
    processes: int,
    stages: Stages,
    kind: str,
    note: Callable[[str, Output | ProcessFailed], str],
) -> Generator[tuple[str, Output | ProcessFailed], None, None]:
    """As `in_processes`, with a stage for every task and one for all.

    Args:
        work: What to do with a task.
        tasks: By name.
        processes: The most processes.
        stages: Where progress is shown.
        kind: What the tasks are called together, such as "runs".
        note: What to say of a task's answer.
    """
    lines: dict[str, tuple[ExitStack, Progress]] = {}

    def report(name: str, fraction: float, text: str) -> None:
        if name not in lines:
            stack = ExitStack()
            lines[name] = stack, stack.enter_context(stages.stage(name))
        lines[name][1](fraction, text)

    with (
        stages.stage(kind) as overall,
        closing(in_processes(work, tasks, processes=processes, report=report)) as answers,
    ):
        for done, (name, answer) in enumerate(answers, start=1):
            yield name, answer
            report(name, 1.0, note(name, answer))
            lines[name][0].close()
            overall(done / len(tasks), f"{done} of {len(tasks)} {kind}")
