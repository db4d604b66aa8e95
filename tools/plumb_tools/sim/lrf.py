"""What the laser range finder says: rays across the beam against the world's triangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from plumb_tools.sim.clock import Instants
from plumb_tools.sim.flight import RangeData, RangeStatus
from plumb_tools.sim.materials import INDEX
from plumb_tools.sim.motion import Motion
from plumb_tools.sim.raycast import RayCaster
from plumb_tools.sim.rig import Rig
from plumb_tools.sim.sensors import RangeFinder
from plumb_tools.sim.streams import stream
from plumb_tools.trajectory import FloatArray

#: Rays of a beam with width: one in the middle and two rings, each ray for the same share of the light.
_RINGS = ((1, 0.0), (6, 0.5), (9, 0.85))

#: A return is seen when at least this share of the beam comes back.
_LEAST_SHARE = 0.2

_WATER = INDEX["water"]


def _fan(u_C: FloatArray, divergence_rad: float) -> FloatArray:
    """Unit directions of the beam's rays in C, (K, 3); `divergence_rad` is the full angle."""
    if divergence_rad == 0.0:
        return u_C[None, :]
    aside = np.cross(u_C, [1.0, 0.0, 0.0])
    aside /= np.linalg.norm(aside)
    other = np.cross(u_C, aside)
    rays = []
    for count, share in _RINGS:
        slope = 0.5 * divergence_rad * share
        for angle in 2.0 * np.pi * np.arange(count) / count:
            rays.append(u_C + slope * (np.cos(angle) * aside + np.sin(angle) * other))
    fan = np.array(rays)
    return np.asarray(fan / np.linalg.norm(fan, axis=1, keepdims=True))


def true_ranges(lrf: RangeFinder, rig: Rig, caster: RayCaster, motion: Motion) -> FloatArray:
    """Range [m] without errors at each instant, infinite where nothing comes back.

    `first`: the nearest of the rays, once enough light returns; `mean`: the average over what returns.
    """
    origin, _ = rig.beams(motion)
    _, R_WC = rig.cameras(motion)
    fan = _fan(rig.u_C, 0.0 if lrf.ideal else lrf.divergence_rad)
    directions = np.einsum("nij,kj->nki", R_WC, fan)
    count, rays = directions.shape[:2]
    hits = caster.cast(np.repeat(origin, rays, axis=0), directions.reshape(-1, 3))
    distance = np.where(hits.material == _WATER, np.inf, hits.distance_m).reshape(count, rays)
    returned = np.isfinite(distance)
    with np.errstate(invalid="ignore"):
        mean = np.sum(np.where(returned, distance, 0.0), axis=1) / np.maximum(returned.sum(axis=1), 1)
    value = mean if lrf.returns == "mean" else distance.min(axis=1)
    return np.where(returned.mean(axis=1) >= _LEAST_SHARE, value, np.inf)


def sample(
    lrf: RangeFinder,
    true_m: FloatArray,
    instants: Instants,
    outlier_share: FloatArray,
    outage: npt.NDArray[np.bool_],
    seed: int,
) -> RangeData:
    """Ranges with noise, drop-outs, limits and quantisation.

    `outlier_share`: probability (N,) of an echo from something in between; `outage`: when nothing returns (N,).
    """
    count = len(true_m)
    noise = lrf.noise_m * stream(seed, "lrf.noise").standard_normal(count)
    dropped = stream(seed, "lrf.dropout").random(count) < lrf.dropout
    random = stream(seed, "lrf.outlier")
    outlier, part = random.random(count) < outlier_share, random.random(count)
    value = np.where(outlier & np.isfinite(true_m), part * true_m, true_m)
    if not lrf.ideal:
        value = value + noise
        if lrf.quantisation_m > 0.0:
            value = lrf.quantisation_m * np.round(value / lrf.quantisation_m)
    status = np.full(count, int(RangeStatus.VALID), np.uint8)
    status[(value < lrf.min_range_m) | (value > lrf.max_range_m)] = RangeStatus.OUT_OF_LIMITS
    lost = ~np.isfinite(true_m) | outage | (dropped & (not lrf.ideal))
    status[lost] = RangeStatus.NO_RETURN
    return RangeData(instants.stamp_ns, np.where(status == RangeStatus.VALID, value, 0.0), status)


def effective_noise_m(lrf: RangeFinder) -> float:
    """White noise and quantisation together: what a filter should be told."""
    return float(np.hypot(lrf.noise_m, lrf.quantisation_m / np.sqrt(12.0)))
