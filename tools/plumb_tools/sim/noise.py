"""Building blocks of procedural textures. Everything repeats seamlessly at the edges."""

from __future__ import annotations

from typing import cast

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft2, rfft2
from scipy.spatial import cKDTree

from plumb_tools.sim.streams import Generator

Image = npt.NDArray[np.float32]


def _frequencies(shape: tuple[int, int]) -> Image:
    """Radial frequency in cycles per image for the half spectrum."""
    y = np.fft.fftfreq(shape[0], 1.0 / shape[0]).astype(np.float32)[:, None]
    x = np.fft.rfftfreq(shape[1], 1.0 / shape[1]).astype(np.float32)[None, :]
    return cast(Image, np.sqrt(x * x + y * y))


def standardised(image: npt.NDArray[np.floating]) -> Image:
    """Mean 0 and standard deviation 1."""
    centred = image - image.mean()
    deviation = float(centred.std())
    return cast(Image, (centred / deviation if deviation > 0.0 else centred).astype(np.float32))


def fractal(random: Generator, shape: tuple[int, int], slope: float, low: float = 1.0, high: float = 1e9) -> Image:
    """Noise of amplitude frequency**-slope between two frequencies in cycles per image, standardised."""
    frequency = _frequencies(shape)
    amplitude = np.zeros_like(frequency)
    band = (frequency >= low) & (frequency <= high)
    amplitude[band] = frequency[band] ** -slope
    spectrum = np.empty(frequency.shape, np.complex64)
    spectrum.real = random.standard_normal(frequency.shape, dtype=np.float32)
    spectrum.imag = random.standard_normal(frequency.shape, dtype=np.float32)
    spectrum *= amplitude
    return standardised(irfft2(spectrum, s=shape))


def blurred(image: npt.NDArray[np.floating], sigma_px: float) -> Image:
    """Gaussian blur with wrap-around."""
    shape = image.shape[0], image.shape[1]
    frequency_y = np.fft.fftfreq(shape[0])[:, None]
    frequency_x = np.fft.rfftfreq(shape[1])[None, :]
    kernel = np.exp(-2.0 * (np.pi * sigma_px) ** 2 * (frequency_x**2 + frequency_y**2))
    return cast(Image, irfft2(rfft2(image) * kernel, s=shape).astype(np.float32))


def cells(random: Generator, size: int, count: int, warp_px: float = 0.0) -> tuple[Image, Image, npt.NDArray[np.int64]]:
    """Voronoi cells in a square: distances [px] to the nearest and the second nearest centre, and the cell's number."""
    centres = random.uniform(0.0, size, (count, 2))
    y, x = np.mgrid[0:size, 0:size].astype(np.float64)
    if warp_px > 0.0:
        x += warp_px * fractal(random, (size, size), 1.6, low=3.0)
        y += warp_px * fractal(random, (size, size), 1.6, low=3.0)
    points = np.column_stack([x.ravel() % size, y.ravel() % size])
    distance, number = cKDTree(centres, boxsize=size).query(points, k=2)
    shape = (size, size)
    nearest = distance[:, 0].reshape(shape).astype(np.float32)
    second = distance[:, 1].reshape(shape).astype(np.float32)
    return nearest, second, number[:, 0].reshape(shape).astype(np.int64)


def shaded_relief(height: npt.NDArray[np.floating], strength: float) -> Image:
    """Light from the upper left on a height field: what gives stones and bricks their volume."""
    slope_x = np.roll(height, -1, axis=1) - np.roll(height, 1, axis=1)
    slope_y = np.roll(height, -1, axis=0) - np.roll(height, 1, axis=0)
    return cast(Image, np.tanh(strength * (slope_x + slope_y)).astype(np.float32))
