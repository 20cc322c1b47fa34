"""A timer for an absolute instant of the monotonic clock, inside an asyncio loop.

Linux's timerfd wakes the loop some 60 us after the instant. `loop.call_at` is the fallback elsewhere: it
rounds to milliseconds and is ten times as late.
"""

import asyncio
import os
import sys
import time
from collections.abc import Callable
from typing import Protocol

AT_ONCE = 1
"""An instant that has passed: the loop gets its turn, no more."""


class Timer(Protocol):
    """Calls a function once for each instant it is set to."""

    def wake_at(self, instant_ns: int) -> None:
        """Call at `instant_ns` (> 0) of `time.monotonic_ns`; an instant set before is forgotten."""

    def close(self) -> None:
        """Stop calling."""


class LoopTimer:
    """The loop's own timer."""

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._loop = asyncio.get_running_loop()
        self._handle: asyncio.TimerHandle | None = None

    def wake_at(self, instant_ns: int) -> None:
        self.close()
        self._handle = self._loop.call_at(instant_ns * 1e-9, self._wake)

    def close(self) -> None:
        if self._handle is not None:
            self._handle.cancel()
            self._handle = None


class TimerFd:
    """A timerfd. Linux only.

    `AT_ONCE` is a turn of the loop, in which all that has come in by then is read first: to set a timerfd to
    an instant that has passed costs some 18 us on a virtual machine.
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        self._fd = _create()
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._fd, self._woken)
        self._wake = wake
        self._waits = False  # for an instant, and not for a turn
        self._turn: asyncio.TimerHandle | None = None

    def wake_at(self, instant_ns: int) -> None:
        if instant_ns == AT_ONCE:
            self._waits = False
            if self._turn is None:  # what is due the loop calls behind what it has just read
                self._turn = self._loop.call_at(0.0, self._turned)
            return
        self._forget_turn()
        self._waits = True
        _set(self._fd, instant_ns)

    def close(self) -> None:
        self._forget_turn()
        self._loop.remove_reader(self._fd)
        os.close(self._fd)

    def _turned(self) -> None:
        self._turn = None
        self._wake()

    def _forget_turn(self) -> None:
        if self._turn is not None:
            self._turn.cancel()
            self._turn = None

    def _woken(self) -> None:
        try:
            os.read(self._fd, 8)
        except BlockingIOError:  # set again since it expired: the earlier instant is forgotten
            return
        if self._waits:  # else it is called in its turn, and the instant is forgotten
            self._waits = False
            self._wake()


def open_timer(wake: Callable[[], None]) -> Timer:
    """The best timer of this machine, for the running loop."""
    return TimerFd(wake) if sys.platform == "linux" else LoopTimer(wake)


if sys.version_info >= (3, 13):

    def _create() -> int:
        return os.timerfd_create(time.CLOCK_MONOTONIC, flags=os.TFD_NONBLOCK | os.TFD_CLOEXEC)

    def _set(fd: int, instant_ns: int) -> None:
        os.timerfd_settime_ns(fd, flags=os.TFD_TIMER_ABSTIME, initial=instant_ns)

else:
    import ctypes

    class _TimerSpec(ctypes.Structure):
        """struct itimerspec of timerfd_settime(2)."""

        _fields_ = (
            ("interval_s", ctypes.c_long),
            ("interval_ns", ctypes.c_long),
            ("instant_s", ctypes.c_long),
            ("instant_ns", ctypes.c_long),
        )

    _TFD_TIMER_ABSTIME = 1  # <sys/timerfd.h>
    _libc = ctypes.CDLL(None, use_errno=True)

    def _checked(result: int) -> int:
        if result < 0:
            code = ctypes.get_errno()
            raise OSError(code, os.strerror(code))
        return result

    def _create() -> int:
        # TFD_NONBLOCK and TFD_CLOEXEC are defined as the flags of open(2).
        return _checked(_libc.timerfd_create(time.CLOCK_MONOTONIC, os.O_NONBLOCK | os.O_CLOEXEC))

    def _set(fd: int, instant_ns: int) -> None:
        spec = _TimerSpec(0, 0, *divmod(instant_ns, 1_000_000_000))
        _checked(_libc.timerfd_settime(fd, _TFD_TIMER_ABSTIME, ctypes.byref(spec), None))
