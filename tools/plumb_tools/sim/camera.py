"""From radiance to 8-bit images: lens, exposure, vignetting, noise, quantisation."""

from __future__ import annotations

from typing import cast

import cv2
import numpy as np
import numpy.typing as npt

from plumb_tools.sim import lens as lens_model
from plumb_tools.sim.mesh import Float32
from plumb_tools.sim.renderer import Pinhole
from plumb_tools.sim.sensors import Camera
from plumb_tools.sim.streams import Generator, stream

Image8 = npt.NDArray[np.uint8]

_FULL_SCALE = 255.0
_MARGIN_PX = 2.0  #: around the wide image, for interpolation


class Optics:
    """The lens: a wider and finer pinhole image is drawn, then every pixel fetches what it sees."""

    def __init__(self, camera: Camera) -> None:
        """Inverts the lens for every pixel."""
        width, height = camera.width_px, camera.height_px
        focal = camera.supersample * max(camera.lens.focal_px)
        left, right, up, down = lens_model.half_widths(camera.lens, (width, height)) * focal + _MARGIN_PX
        self.pinhole = Pinhole(int(np.ceil(left + right)) + 1, int(np.ceil(up + down)) + 1, focal, left, up)
        v, u = np.mgrid[0:height, 0:width].astype(np.float64)
        normalised = lens_model.unproject(camera.lens, np.column_stack([u.ravel(), v.ravel()]))
        source = (focal * normalised + [left, up]).astype(np.float32).reshape(height, width, 2)
        self._x, self._y = np.ascontiguousarray(source[:, :, 0]), np.ascontiguousarray(source[:, :, 1])
        radius2 = np.sum(normalised**2, axis=1).reshape(height, width)
        fall_off = (1.0 + radius2) ** -2.0  # cos^4 of the field angle, relative to its value in the corner
        share = (1.0 - fall_off) / (1.0 - fall_off.min())
        self.vignetting = (1.0 - camera.lens.vignetting * share).astype(np.float32)

    def through_lens(self, radiance: Float32) -> Float32:
        """The distorted image of a pinhole image."""
        return cast(Float32, cv2.remap(radiance, self._x, self._y, cv2.INTER_LINEAR))


class Sensor:
    """The pixels: photons to numbers."""

    def __init__(self, camera: Camera, light: float, seed: int) -> None:
        """Draws the fixed pattern; `light` is the scene's light level."""
        self._pixel = camera.pixel
        self._ideal = camera.ideal
        self._light = light
        self._seed = seed
        shape = camera.height_px, camera.width_px
        pattern = stream(seed, "camera.pattern").standard_normal(shape, dtype=np.float32)
        self._response = 1.0 + (0.0 if self._ideal else self._pixel.pattern_noise) * pattern

    def image(self, radiance: Float32, exposure_s: float, gain: float, frame: int) -> Image8:
        """The image of frame number `frame`. Shot noise is Gaussian, which it is from a dozen electrons on."""
        electrons = radiance * (self._light * self._pixel.electrons_per_s * exposure_s) * self._response
        if not self._ideal:
            random: Generator = stream(self._seed, "camera.noise", frame)
            sigma = np.sqrt(electrons + self._pixel.read_noise_e**2)
            electrons = electrons + sigma * random.standard_normal(electrons.shape, dtype=np.float32)
        numbers = electrons * (gain * _FULL_SCALE / self._pixel.full_well_e) + 0.5
        return np.clip(numbers, 0.0, _FULL_SCALE).astype(np.uint8)
