"""When sensors sample and what their stamps say."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plumb_tools.sim.flight import EPOCH_NS
from plumb_tools.sim.sensors import Clock
from plumb_tools.sim.streams import stream
from plumb_tools.trajectory import FloatArray, IntArray

_NS_PER_S = 1_000_000_000


@dataclass(frozen=True)
class Instants:
    """The sampling instants of one sensor."""

    t_s: FloatArray  #: (N,) true time after the flight's start
    stamp_ns: IntArray  #: (N,) what the flight computer writes down, strictly increasing

    def where(self, keep: np.ndarray) -> Instants:
        """Some of the instants."""
        return Instants(self.t_s[keep], self.stamp_ns[keep])


def true_ns(t_s: FloatArray) -> IntArray:
    """Time after the flight's start on the flight computer's clock."""
    return EPOCH_NS + np.round(np.asarray(t_s) * _NS_PER_S).astype(np.int64)


def instants(name: str, clock: Clock, rate_hz: float, length_s: float, seed: int) -> Instants:
    """Samples at a steady rate from the clock's phase to the end of the flight. A stamp never overtakes the next one:
    jitter is cut at two fifths of a period.
    """
    period_s = 1.0 / rate_hz
    count = max(0, int(np.floor(length_s * rate_hz - clock.phase + 1e-9)) + 1)
    true = true_ns(period_s * (clock.phase + np.arange(count, dtype=np.float64)))
    jitter = clock.jitter_s * stream(seed, f"{name}.clock").standard_normal(count)
    error = clock.offset_s + np.clip(jitter, -0.4 * period_s, 0.4 * period_s)
    return Instants((true - EPOCH_NS) / _NS_PER_S, true + np.round(error * _NS_PER_S).astype(np.int64))
