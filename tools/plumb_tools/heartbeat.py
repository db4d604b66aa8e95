"""Signs of life of work that takes long, where no terminal shows a bar."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

PERIOD_S = 10.0


@contextmanager
def every(period_s: float, tell: Callable[[float], None]) -> Iterator[None]:
    """Calls `tell` with the seconds since the start once in every period, until the work inside has ended."""
    ended, started = threading.Event(), monotonic()

    def beat() -> None:
        while not ended.wait(period_s):
            tell(monotonic() - started)

    thread = threading.Thread(target=beat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
