"""A forked process whose changes of files wait for a supervisor, which lets them be, fails them, or kills it.

The kernel stops every system call that can change a file (seccomp's user notification), also those of C
libraries and of child processes. x86-64 Linux only. Source: seccomp_unotify(2), linux/seccomp.h.
"""

import ctypes
import errno
import fcntl
import os
import platform
import select
import signal
import socket
import struct
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from geometry.errors import UserError

Kind = Literal["kill", "torn", "ENOSPC", "EIO"]

KINDS: tuple[Kind, ...] = ("kill", "torn", "ENOSPC", "EIO")
"""Faults: killed before a call, killed within a write, disk full from a call on, one failed call."""

BY_FILE = {
    1: "write",
    18: "pwrite64",
    20: "writev",
    296: "pwritev",
    328: "pwritev2",
    40: "sendfile",
    74: "fsync",
    75: "fdatasync",
    77: "ftruncate",
    285: "fallocate",
}
"""Calls whose first argument is the file's number."""
BY_PATH = {
    76: ("truncate", None, 0),
    82: ("rename", None, 1),
    264: ("renameat", 2, 3),
    316: ("renameat2", 2, 3),
    87: ("unlink", None, 0),
    263: ("unlinkat", 0, 1),
    84: ("rmdir", None, 0),
    83: ("mkdir", None, 0),
    258: ("mkdirat", 0, 1),
    86: ("link", None, 1),
    265: ("linkat", 2, 3),
    88: ("symlink", None, 1),
    266: ("symlinkat", 1, 2),
    2: ("open", None, 0),
    257: ("openat", 0, 1),
}
"""Name, argument with the folder's number, argument with the (new) path."""
COPY = 326
"""copy_file_range, whose third argument is the number of the changed file."""
OPEN_FLAGS = {2: 1, 257: 2}
"""Arguments with the flags of the calls that open a file."""
MAKING = os.O_CREAT | os.O_TRUNC
GROWING = {"write", "pwrite64", "writev", "pwritev", "pwritev2", "sendfile", "ftruncate", "fallocate"} | {
    *("copy_file_range", "mkdir", "mkdirat", "open", "openat", "link", "linkat", "symlink", "symlinkat")
}
"""Calls that a full disk refuses."""
FUTILE = {"mkdir": True, "mkdirat": True, "unlink": False, "unlinkat": False, "rmdir": False}
"""Whether the path exists where a call changes nothing: a folder that is there, a file that is not."""

_SECCOMP, _SET_FILTER, _LISTENER, _KILLABLE = 317, 1, 1 << 3, 1 << 5
_NO_NEW_PRIVILEGES = 38
_RECEIVE, _SEND, _CONTINUE = 0xC0502100, 0xC0182101, 1
_ALLOW, _NOTIFY, _X86_64 = 0x7FFF0000, 0x7FC00000, 0xC000003E
_HERE = -100
_NOTIFICATION, _ANSWER = struct.Struct("=QIIiIQ6Q"), struct.Struct("=QqiI")


@dataclass(frozen=True)
class Point:
    """A change of a file in a watched folder.

    Attributes:
        call: Name of the system call.
        path: The file, after the call.
    """

    call: str
    path: str


@dataclass(frozen=True)
class Fault:
    """A fault at a point.

    Attributes:
        kind: One of `KINDS`.
        at: Number of the point, from 0.
    """

    kind: Kind
    at: int


@dataclass(frozen=True)
class Ending:
    """The end of a supervised process.

    Attributes:
        code: Its exit code; the negative number of the signal that ended it.
        text: What it and its children wrote to their standard output and error.
        points: The changes of files that it had begun.
        struck: Whether the fault's point was reached.
        orphans: Processes that were still there `PATIENCE_S` after its end.
        seconds: Processor time of the process, without its children, s.
        peak: Largest memory in use, bytes.
    """

    code: int
    text: str
    points: tuple[Point, ...]
    struck: bool
    orphans: int
    seconds: float
    peak: int


PATIENCE_S = 15.0
"""Time in which the children of a killed process have to end."""


def supervised(
    work: Callable[[], int],
    watched: Sequence[Path],
    log: Path,
    *,
    fault: Fault | None = None,
    limit_s: float = 300.0,
) -> Ending:
    """Run a function in a forked process and put a fault into one of its changes of files.

    Args:
        work: Returns an exit code.
        watched: Folders; what lies in them, or would, counts.
        log: File for the output, outside of the folders.
        fault: The fault; None only counts.
        limit_s: Time limit, s.

    Raises:
        UserError: If the system is not x86-64 Linux or refuses the filter.
    """
    if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
        raise UserError("faults are put into x86-64 Linux only")
    ours, theirs = socket.socketpair()
    child = os.fork()
    if child == 0:
        ours.close()
        _begin(work, theirs, log)
    theirs.close()
    with ours:
        message, (listener, *_), *_ = socket.recv_fds(ours, 1, 1)
    if message != b"y":
        os.waitpid(child, 0)
        raise UserError("the system refuses seccomp filters; run it outside of this container")
    try:
        return _Supervisor(child, listener, [str(path) for path in watched], fault).run(log, limit_s)
    finally:
        os.close(listener)


def _begin(work: Callable[[], int], parent: socket.socket, log: Path) -> None:
    """The child: give the parent the listener, work, and end."""
    code = 1
    try:
        os.setsid()
        output = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        os.dup2(output, 1)
        os.dup2(output, 2)
        listener = _install()
        socket.send_fds(parent, [b"y" if listener >= 0 else b"n"], [max(listener, 0)])
        parent.close()
        if listener >= 0:
            os.close(listener)
            code = work()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def _install() -> int:
    """Install the filter and return the listener's file number; negative if the system refuses."""
    statement = struct.Struct("=HBBI")
    load, equal, either, answer = 0x20, 0x15, 0x45, 0x06
    numbers = [*BY_FILE, *(each for each in BY_PATH if each not in OPEN_FLAGS), COPY]
    program = [statement.pack(load, 0, 0, 4), statement.pack(equal, 1, 0, _X86_64)]
    program += [statement.pack(answer, 0, 0, _ALLOW), statement.pack(load, 0, 0, 0)]
    for number in numbers:
        program += [statement.pack(equal, 0, 1, number), statement.pack(answer, 0, 0, _NOTIFY)]
    for number, place in OPEN_FLAGS.items():
        program += [
            statement.pack(equal, 0, 4, number),
            statement.pack(load, 0, 0, 16 + 8 * place),
            statement.pack(either, 0, 1, MAKING),
            statement.pack(answer, 0, 0, _NOTIFY),
            statement.pack(answer, 0, 0, _ALLOW),
        ]
    program.append(statement.pack(answer, 0, 0, _ALLOW))
    code = ctypes.create_string_buffer(b"".join(program))
    header = ctypes.create_string_buffer(struct.pack("@HP", len(program), ctypes.addressof(code)))
    library = ctypes.CDLL(None, use_errno=True)
    library.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0)
    return int(library.syscall(_SECCOMP, _SET_FILTER, _LISTENER | _KILLABLE, header))


class _CallerKilledError(Exception):
    """The process that waits for an answer is no more."""


@dataclass
class _Supervisor:
    """Answers the notifications of one process and its children."""

    child: int
    listener: int
    watched: list[str]
    fault: Fault | None

    def __post_init__(self) -> None:
        self.points: list[Point] = []
        self.struck = False
        self.peak = 0

    def run(self, log: Path, limit_s: float) -> Ending:
        """Answer until all processes have ended, or those that are left over have had their time."""
        limit = time.monotonic() + limit_s
        poll = select.poll()
        poll.register(self.listener, select.POLLIN)
        code: int | None = None
        seconds, left, timed_out = 0.0, 0, False
        while True:
            events = poll.poll(50)
            if events and events[0][1] & select.POLLIN:
                self._serve()
            if code is None:
                pid, status, usage = os.wait4(self.child, os.WNOHANG)
                if pid:
                    code, seconds = os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime
                    self.peak = usage.ru_maxrss * 1024
                    limit = time.monotonic() + PATIENCE_S
            if code is not None and events and events[0][1] & select.POLLHUP:
                break
            if time.monotonic() > limit:
                if code is None:
                    timed_out = True
                    os.kill(self.child, signal.SIGKILL)
                    limit += PATIENCE_S
                    continue
                left = self._end_all()
                break
        text = log.read_text(errors="replace") + ("\nended by the time limit" if timed_out else "")
        return Ending(code or 0, text, tuple(self.points), self.struck, left, seconds, self.peak)

    def _end_all(self) -> int:
        """Kill what is left of the child's session, and return the number of processes."""
        left = 0
        for entry in Path("/proc").glob("[0-9]*"):
            with suppress(OSError, ValueError):
                if int((entry / "stat").read_text().rpartition(")")[2].split()[3]) == self.child:
                    os.kill(int(entry.name), signal.SIGKILL)
                    left += 1
        return left

    def _serve(self) -> None:
        received = ctypes.create_string_buffer(80)
        try:
            fcntl.ioctl(self.listener, _RECEIVE, received)
        except OSError:  # the caller was killed
            return
        identity, task, _, number, _, _, *arguments = _NOTIFICATION.unpack(received.raw)
        point = self._point(task, number, arguments)
        try:
            error = self._strike(point, task, arguments) if point else 0
        except _CallerKilledError:  # an answer would let its call begin before it ends
            return
        answer = _ANSWER.pack(identity, 0, -error, 0 if error else _CONTINUE)
        with suppress(OSError):  # the caller was killed
            fcntl.ioctl(self.listener, _SEND, ctypes.create_string_buffer(answer, len(answer)))

    def _point(self, task: int, number: int, arguments: Sequence[int]) -> Point | None:
        """The point, if the file lies in a watched folder."""
        try:
            if number in BY_FILE or number == COPY:
                name = BY_FILE.get(number, "copy_file_range")
                path = os.readlink(f"/proc/{task}/fd/{_signed(arguments[2 if number == COPY else 0])}")
            else:
                name, folder, place = BY_PATH[number]
                path = _text(task, arguments[place])
                above = _HERE if folder is None else _signed(arguments[folder])
                if not path.startswith("/"):
                    start = f"/proc/{task}/{'cwd' if above == _HERE else f'fd/{above}'}"
                    path = os.path.normpath(f"{os.readlink(start)}/{path}")
        except OSError:
            return None
        if not any(path.startswith(each) for each in self.watched) or os.path.lexists(path) == FUTILE.get(
            name
        ):
            return None
        return Point(name, path)

    def _strike(self, point: Point, task: int, arguments: Sequence[int]) -> int:
        """Count a point and put the fault into it; the error number that the call ends with, or 0."""
        number = len(self.points)
        self.points.append(point)
        fault = self.fault
        if fault is None or number < fault.at or (number > fault.at and fault.kind != "ENOSPC"):
            return 0
        self.struck = True
        if fault.kind == "ENOSPC":
            return errno.ENOSPC if point.call in GROWING else 0
        if fault.kind == "EIO":
            return errno.EIO
        if fault.kind == "torn" and point.call == "write":
            _write_half(task, *arguments[:3])
        own = os.path.exists(f"/proc/{self.child}/task/{task}")
        os.kill(self.child, signal.SIGKILL)
        if own:
            raise _CallerKilledError
        return 0


def _write_half(task: int, file: int, address: int, length: int) -> None:
    """Do the first half of a write for a process that is about to be killed."""
    data = _memory(task, address, length // 2)
    info = Path(f"/proc/{task}/fdinfo/{file}").read_text().split()
    place = os.open(f"/proc/{task}/fd/{file}", os.O_WRONLY)
    try:
        os.pwrite(place, data, int(info[1]))
    finally:
        os.close(place)


def _memory(task: int, address: int, length: int) -> bytes:
    with open(f"/proc/{task}/mem", "rb", buffering=0) as memory:
        memory.seek(address)
        return memory.read(length)


def _text(task: int, address: int) -> str:
    """The text that ends with a zero at an address; read page by page, because the next may be missing."""
    found = b""
    while b"\0" not in found:
        found += _memory(task, address + len(found), 4096 - (address + len(found)) % 4096)
    return os.fsdecode(found.partition(b"\0")[0])


def _signed(argument: int) -> int:
    """A file's number, which is a signed whole number of 32 bits."""
    return ctypes.c_int32(argument & 0xFFFFFFFF).value
