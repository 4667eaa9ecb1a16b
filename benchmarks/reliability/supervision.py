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
from pathlib import Path
from typing import NamedTuple

from pinnray.runtime.errors import UserError

KINDS = ("kill", "ENOSPC", "EIO")
"""Faults: killed before a call, disk full from a call on, one failed call."""

BY_FILE = {
    **{1: ("write", 0), 18: ("pwrite64", 0), 20: ("writev", 0), 40: ("sendfile", 0)},
    **{74: ("fsync", 0), 75: ("fdatasync", 0), 77: ("ftruncate", 0), 326: ("copy_file_range", 2)},
}
"""Name, and argument with the number of the changed file."""
BY_PATH = {
    **{82: ("rename", None, 1), 264: ("renameat", 2, 3), 316: ("renameat2", 2, 3), 87: ("unlink", None, 0)},
    **{263: ("unlinkat", 0, 1), 84: ("rmdir", None, 0), 83: ("mkdir", None, 0), 258: ("mkdirat", 0, 1)},
    **{2: ("open", None, 0), 257: ("openat", 0, 1)},
}
"""Name, arguments with the folder's number and the (new) path; the flags of open and openat follow it."""
GROWING = {
    *("write", "pwrite64", "writev", "sendfile", "ftruncate", "copy_file_range", "mkdir", "mkdirat"),
    *("open", "openat"),
}
"""Calls that a full disk refuses."""
FUTILE = {"mkdir": True, "mkdirat": True, "unlink": False, "unlinkat": False, "rmdir": False}
"""Whether the path exists where a call changes nothing: a folder that is there, a file that is not."""

LIMIT_S, PATIENCE_S = 300.0, 15.0
"""Time in which a process has to end, and its children after it."""

_NOTIFICATION, _ANSWER = struct.Struct("=QIIiIQ6Q"), struct.Struct("=QqiI")
_RECEIVE, _SEND, _CONTINUE = 0xC0502100, 0xC0182101, 1
_HERE = -100  # the working folder, in place of a folder's number


class Point(NamedTuple):
    """A change of a file in a watched folder: the system call, and the file after it."""

    call: str
    path: str


class Fault(NamedTuple):
    """One of `KINDS` at the point with a number, from 0."""

    kind: str
    at: int


class Ending(NamedTuple):
    """The end of a supervised process."""

    code: int  # of its exit; the negative number of the signal that ended it
    text: str  # standard output and error, also of its children
    points: tuple[Point, ...]  # the changes of files that it had begun
    orphans: bool  # whether processes were still there `PATIENCE_S` after its end


def supervised(
    work: Callable[[], int], watched: Sequence[Path], log: Path, *, fault: Fault | None = None
) -> Ending:
    """Run a function in a forked process and put a fault into one of its changes of files.

    Args:
        work: Returns an exit code.
        watched: Folders; what lies in them, or would, counts.
        log: File for the output, outside of the folders.
        fault: None only counts.

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
        return _Supervisor(child, listener, [str(path) for path in watched], fault).run(log)
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
    load, equal, answer, allow, notify = 0x20, 0x15, 0x06, 0x7FFF0000, 0x7FC00000
    program = [statement.pack(load, 0, 0, 4), statement.pack(equal, 1, 0, 0xC000003E)]  # x86-64
    program += [statement.pack(answer, 0, 0, allow), statement.pack(load, 0, 0, 0)]
    for number in (*BY_FILE, *BY_PATH):
        program += [statement.pack(equal, 0, 1, number), statement.pack(answer, 0, 0, notify)]
    program.append(statement.pack(answer, 0, 0, allow))
    code = ctypes.create_string_buffer(b"".join(program))
    header = ctypes.create_string_buffer(struct.pack("@HP", len(program), ctypes.addressof(code)))
    library = ctypes.CDLL(None, use_errno=True)
    library.prctl(38, 1, 0, 0, 0)  # PR_SET_NO_NEW_PRIVS
    return int(library.syscall(317, 1, 1 << 3 | 1 << 5, header))  # new listener, its waits killable


class _Supervisor:
    """Answers the notifications of one process and its children."""

    def __init__(self, child: int, listener: int, watched: list[str], fault: Fault | None) -> None:
        self.child, self.listener, self.watched, self.fault = child, listener, watched, fault
        self.points: list[Point] = []

    def run(self, log: Path) -> Ending:
        """Answer until all processes have ended, or those that are left over have had their time."""
        limit = time.monotonic() + LIMIT_S
        poll = select.poll()
        poll.register(self.listener, select.POLLIN)
        code: int | None = None
        left = False
        while True:
            events = poll.poll(50)
            if events and events[0][1] & select.POLLIN:
                self._serve()
            if code is None:
                pid, status = os.waitpid(self.child, os.WNOHANG)
                if pid:
                    code, limit = os.waitstatus_to_exitcode(status), time.monotonic() + PATIENCE_S
            if code is not None and events and events[0][1] & select.POLLHUP:
                break
            if time.monotonic() > limit and code is None:
                os.kill(self.child, signal.SIGKILL)
                limit += PATIENCE_S
            elif time.monotonic() > limit:
                left = True
                with suppress(ProcessLookupError):  # they may have ended just now
                    os.killpg(self.child, signal.SIGKILL)
                break
        return Ending(code, log.read_text(errors="replace"), tuple(self.points), left)

    def _serve(self) -> None:
        received = ctypes.create_string_buffer(80)
        try:
            fcntl.ioctl(self.listener, _RECEIVE, received)
        except OSError:  # the caller was killed
            return
        identity, task, _, number, _, _, *arguments = _NOTIFICATION.unpack(received.raw)
        point = self._point(task, number, arguments)
        error = self._strike(point, task) if point else 0
        if error is None:  # the caller was killed; an answer would let its call begin before it ends
            return
        answer = _ANSWER.pack(identity, 0, -error, 0 if error else _CONTINUE)
        with suppress(OSError):  # the caller was killed
            fcntl.ioctl(self.listener, _SEND, ctypes.create_string_buffer(answer, len(answer)))

    def _point(self, task: int, number: int, arguments: Sequence[int]) -> Point | None:
        """The point, if the call changes a file in a watched folder."""
        try:
            if number in BY_FILE:
                name, place = BY_FILE[number]
                path = os.readlink(f"/proc/{task}/fd/{_signed(arguments[place])}")
            else:
                name, folder, place = BY_PATH[number]
                if name in ("open", "openat") and not arguments[place + 1] & (os.O_CREAT | os.O_TRUNC):
                    return None
                path = _text(task, arguments[place])
                above = _HERE if folder is None else _signed(arguments[folder])
                if not path.startswith("/"):
                    start = f"/proc/{task}/{'cwd' if above == _HERE else f'fd/{above}'}"
                    path = os.path.normpath(f"{os.readlink(start)}/{path}")
        except OSError:
            return None
        futile = os.path.lexists(path) == FUTILE.get(name)
        return Point(name, path) if path.startswith(tuple(self.watched)) and not futile else None

    def _strike(self, point: Point, task: int) -> int | None:
        """Count a point and put the fault into it; the error number that the call ends with, or 0.

        None if the process that waits for the answer was killed.
        """
        number = len(self.points)
        self.points.append(point)
        fault = self.fault
        if fault is None or number < fault.at or (number > fault.at and fault.kind != "ENOSPC"):
            return 0
        if fault.kind == "ENOSPC":
            return errno.ENOSPC if point.call in GROWING else 0
        if fault.kind == "EIO":
            return errno.EIO
        own = os.path.exists(f"/proc/{self.child}/task/{task}")
        os.kill(self.child, signal.SIGKILL)
        return None if own else 0


def _text(task: int, address: int) -> str:
    """The text that ends with a zero at an address; read page by page, because the next may be missing."""
    found = b""
    with open(f"/proc/{task}/mem", "rb", buffering=0) as memory:
        memory.seek(address)
        while b"\0" not in found:
            found += memory.read(4096 - memory.tell() % 4096)
    return os.fsdecode(found.partition(b"\0")[0])


def _signed(argument: int) -> int:
    """A file's number, which is a signed whole number of 32 bits."""
    return ctypes.c_int32(argument & 0xFFFFFFFF).value
