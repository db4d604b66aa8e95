"""Automatic exposure: how long, and with which gain, each image is taken."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plumb_tools.sim.sensors import Camera
from plumb_tools.trajectory import FloatArray

#: The scene's brightness is looked at this often; in between it is interpolated.
METER_PERIOD_S = 0.2


@dataclass(frozen=True)
class Settings:
    """Exposure times and gains of all images."""

    exposure_s: FloatArray  #: (N,)
    gain: FloatArray  #: (N,)


def settings(camera: Camera, light: float, radiance: FloatArray) -> Settings:
    """Follows the mean radiance (N,) of the images as a camera does: from the image before, with some inertia."""
    control, pixel = camera.exposure, camera.pixel
    full_at_unit_gain_s = pixel.full_well_e / (pixel.electrons_per_s * light)  # for radiance 1
    shortest, longest = control.time_s
    if not control.automatic:
        return Settings(np.full(len(radiance), longest), np.ones(len(radiance)))
    share = 1.0 - np.exp(-1.0 / (camera.rate_hz * control.settling_s))
    wanted = np.log(control.target * full_at_unit_gain_s / np.maximum(radiance, 1e-3))
    level = np.empty(len(wanted))
    now = wanted[0] if len(wanted) else 0.0
    for k, value in enumerate(wanted):
        level[k] = now
        now += share * (value - now)
    product = np.exp(level)
    exposure = np.clip(product, shortest, longest)
    return Settings(exposure, np.clip(product / exposure, 1.0, control.gain_max))
