"""Functions of time with their first three derivatives, in closed form and for many instants at once.

A jet is an array (4, N): value and derivatives at N instants.
"""

from __future__ import annotations

import numpy as np

from plumb_tools.trajectory import FloatArray


def step(x: FloatArray) -> FloatArray:
    """0 before x = 0, 1 after x = 1, four times continuously differentiable; derivatives with respect to x."""
    x = np.clip(x, 0.0, 1.0)
    y = 1.0 - x
    x2, x3, x5 = x**2, x**3, x**5
    return np.stack(
        [
            x5 * (126.0 + x * (-420.0 + x * (540.0 + x * (-315.0 + x * 70.0)))),
            630.0 * x2**2 * y**4,
            2520.0 * x3 * y**3 * (1.0 - 2.0 * x),
            2520.0 * x2 * y**2 * (3.0 - 14.0 * x + 14.0 * x2),
        ]
    )


def ramp(x: FloatArray) -> FloatArray:
    """Integral of `step` from 0 to x: 0 before 0, x - 1/2 after 1."""
    inside = np.clip(x, 0.0, 1.0)
    polynomial = inside**6 * (21.0 + inside * (-60.0 + inside * (67.5 + inside * (-35.0 + inside * 7.0))))
    return np.stack([polynomial + np.maximum(x - 1.0, 0.0), *step(x)[:3]])


def stretched(jet: FloatArray, duration_s: float) -> FloatArray:
    """f(t / duration) with derivatives with respect to t, of a jet with respect to t / duration."""
    return jet * (duration_s ** -np.arange(4.0))[:, None]


def product(f: FloatArray, g: FloatArray) -> FloatArray:
    """Leibniz's rule to third order."""
    return np.stack(
        [
            f[0] * g[0],
            f[1] * g[0] + f[0] * g[1],
            f[2] * g[0] + 2.0 * f[1] * g[1] + f[0] * g[2],
            f[3] * g[0] + 3.0 * f[2] * g[1] + 3.0 * f[1] * g[2] + f[0] * g[3],
        ]
    )


def sine(t_s: FloatArray, frequency_hz: float, phase_rad: float) -> FloatArray:
    """sin(2 pi f t + phase)."""
    w = 2.0 * np.pi * frequency_hz
    s, c = np.sin(w * t_s + phase_rad), np.cos(w * t_s + phase_rad)
    return np.stack([s, w * c, -w * w * s, -(w**3) * c])


def window(t_s: FloatArray, start_s: float, end_s: float, blend_s: float) -> FloatArray:
    """1 between two instants, fading in after the first and out before the second."""
    rise = stretched(step((t_s - start_s) / blend_s), blend_s)
    fall = -stretched(step((t_s - end_s + blend_s) / blend_s), blend_s)
    fall[0] += 1.0
    return product(rise, fall)
