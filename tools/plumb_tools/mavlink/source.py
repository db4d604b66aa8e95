"""Where Plumb's messages come from: LCM on a network, or a log that is played as it was recorded."""

from __future__ import annotations

import select
import time
from collections.abc import Iterator
from pathlib import Path

import lcm

from plumb_tools.trajectory import InputError

US_PER_S = 1_000_000

#: Channel and message, in the order in which they come; none when the wait was over, or when something else came.
Messages = Iterator[tuple[str, bytes] | None]

#: At most so long until the next turn, for what is due by the clock.
WAIT_S = 0.1


def _wait(others: tuple[int, ...], seconds: float) -> list[int]:
    return select.select(others, (), (), max(seconds, 0.0))[0]


class Network:
    """Live messages; the flight clock is CLOCK_MONOTONIC of the computer that plumb-fsw runs on."""

    def __init__(self, url: str, channels: tuple[str, ...]) -> None:
        """InputError where LCM does not take the URL."""
        try:
            self._lcm = lcm.LCM(url)
        except RuntimeError:
            raise InputError(
                f"--lcm {url}: LCM cannot use it; expected a URL such as udpm://239.255.76.67:7667?ttl=0 and a network "
                "route to its address (on a host without one: ip route add 224.0.0.0/4 dev lo)"
            ) from None
        self._newest: list[tuple[str, bytes]] = []
        for channel in channels:
            self._lcm.subscribe(channel, lambda *message: self._newest.append(message))

    def now_ns(self) -> int:
        """The flight clock."""
        return time.monotonic_ns()

    def messages(self, others: tuple[int, ...]) -> Messages:
        """Without end; `others` are files that are waited for too."""
        while True:
            if self._lcm.fileno() in _wait((self._lcm.fileno(), *others), WAIT_S):
                self._lcm.handle()
                yield from self._newest
                self._newest.clear()
            else:
                yield None


class Log:
    """A log, whose clock goes on from its first event; as fast as possible there is no clock that others could know."""

    def __init__(self, path: Path, channels: tuple[str, ...], is_fast: bool) -> None:
        """InputError where there is no log with any of the channels in it."""
        try:
            path.open("rb").close()  # LCM would end the program with a message of its own
        except OSError as error:
            raise InputError(f"--log {path}: {error.strerror}; expected an LCM event log") from None
        self._path, self._channels, self._is_fast = path, channels, is_fast
        first = next(self._events(), None)
        if first is None:
            raise InputError(f"--log {path}: no message on {', '.join(channels)}; expected a log of a flight")
        self._start_us = first.timestamp
        self._started_ns = time.monotonic_ns()

    def _events(self) -> Iterator[lcm.Event]:
        return (event for event in lcm.EventLog(str(self._path), "r") if event.channel in self._channels)

    def now_ns(self) -> int:
        """The flight clock, were the flight now."""
        return 1000 * self._start_us + time.monotonic_ns() - self._started_ns

    def messages(self, others: tuple[int, ...]) -> Messages:
        """Until the log ends."""
        for event in self._events():
            while not self._is_fast and (early_s := event.timestamp / US_PER_S - self.now_ns() / 1e9) > 0.0:
                _wait(others, min(early_s, WAIT_S))
                yield None
            yield event.channel, event.data
