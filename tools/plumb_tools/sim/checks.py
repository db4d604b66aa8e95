"""What a scene must keep beyond the limits of single values: a camera that can be, a flight through free air."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from plumb_tools.sim import lens as lens_model
from plumb_tools.sim.motion import Trajectory
from plumb_tools.sim.raycast import RayCaster
from plumb_tools.sim.rig import rig
from plumb_tools.sim.scene import Gusts, Scene
from plumb_tools.sim.scene_file import SceneFaults
from plumb_tools.sim.schema import Faults, said
from plumb_tools.sim.sensors import CameraOutage, ImuOutage

_CHECK_PERIOD_S = 0.05
_LEAST_HEIGHT_M = 0.05
_WIDEST = 4.0  #: half width in the normalised plane that a single pinhole image can still cover
_MAX_MAP_PX = 12000
_LEAST_SAMPLES = 2

# What no drone of the size that carries these sensors flies: a faster flight is a slip in the scene file.
MAX_SPEED_M_S = 50.0
MAX_ACCELERATION_M_S2 = 100.0
MAX_TURN_DEG_S = 1000.0
_MOST_FALL = 0.9
#: Instants of each segment that are looked at: the fastest sway is 5 Hz, and the peak of a move is not missed.
_MOTION_PERIOD_S = 0.02
_MOTION_INSTANTS = 200


def check_values(scene: Scene, path: Path) -> None:
    """Combinations of values that make no sense."""
    faults = Faults()
    _check_camera(scene, faults)
    _check_ground(scene, faults)
    _check_times(scene, faults)
    if not faults:  # the motion follows from values that are good one by one
        _check_motion(scene, faults)
    if faults:
        raise SceneFaults(path, faults)


def _check_camera(scene: Scene, faults: Faults) -> None:
    camera = scene.sensors.camera
    lens, size = camera.lens, (camera.width_px, camera.height_px)
    if not all(0.0 < centre < side for centre, side in zip(lens.center_px, size, strict=True)):
        expected = f"a point inside the image of {size[0]} x {size[1]} px"
        faults.add("sensors.camera.lens.center_px", list(lens.center_px), expected)
        return
    if lens.model == "fov" and not 1e-3 <= lens.coefficients[0] <= 3.0:
        faults.add("sensors.camera.lens.coefficients", list(lens.coefficients), "w from 0.001 to 3 rad first")
        return
    widths = lens_model.half_widths(lens, size)
    if not np.all(np.isfinite(widths)) or widths.max() > _WIDEST or widths.min() <= 0.0:
        expected = f"a lens that can be inverted over the whole image and sees less than {_WIDEST:g} x its distance"
        faults.add("sensors.camera.lens.coefficients", list(lens.coefficients), expected)


def _check_ground(scene: Scene, faults: Faults) -> None:
    ground = scene.scene.ground
    x0, y0, x1, y1 = ground.extent_m
    if x1 <= x0 or y1 <= y0:
        faults.add("scene.ground.extent_m", list(ground.extent_m), "x0 y0 x1 y1 with x0 < x1 and y0 < y1")
        return
    if max(x1 - x0, y1 - y0) / ground.map_m_per_px > _MAX_MAP_PX:
        least = max(x1 - x0, y1 - y0) / _MAX_MAP_PX
        faults.add("scene.ground.map_m_per_px", ground.map_m_per_px, f"at least {least:.3g} m for this extent")
    if max(x1 - x0, y1 - y0) / ground.grid_m > 1500:
        least = max(x1 - x0, y1 - y0) / 1500
        faults.add("scene.ground.grid_m", ground.grid_m, f"at least {least:.3g} m for this extent")


def _check_times(scene: Scene, faults: Faults) -> None:
    length_s = scene.trajectory.length_s
    if not scene.trajectory.segments:
        faults.add("trajectory.segments", [], "at least one segment")
    for number, fault in enumerate(scene.faults):
        if fault.start_s >= length_s:
            faults.add(f"faults[{number}].start_s", fault.start_s, f"a time within the flight of {length_s:g} s")
    _check_counts(scene, length_s, faults)
    exposure = scene.sensors.camera.exposure
    if exposure.time_s[1] * scene.sensors.camera.rate_hz >= 1.0:
        expected = f"at most the period of the images, {1.0 / scene.sensors.camera.rate_hz:g} s"
        faults.add("sensors.camera.exposure.time_s", list(exposure.time_s), expected)
    if scene.sensors.lrf.max_range_m <= scene.sensors.lrf.min_range_m:
        expected = f"more than min_range_m, {scene.sensors.lrf.min_range_m:g} m"
        faults.add("sensors.lrf.max_range_m", scene.sensors.lrf.max_range_m, expected)


def _check_counts(scene: Scene, length_s: float, faults: Faults) -> None:
    """Camera and IMU must say something at least twice, outages apart."""
    for name, rate_hz, outage in (
        ("camera", scene.sensors.camera.rate_hz, CameraOutage),
        ("imu", scene.sensors.imu.rate_hz, ImuOutage),
    ):
        instants = np.arange(0.0, length_s, 1.0 / rate_hz)
        there = np.ones(len(instants), bool)
        keys = [f"sensors.{name}.rate_hz"]
        for number, fault in enumerate(scene.faults):
            if isinstance(fault, outage):
                there &= (instants < fault.start_s) | (instants >= fault.start_s + fault.duration_s)
                keys.append(f"faults[{number}]")
        if np.count_nonzero(there) < _LEAST_SAMPLES:
            found = said(f"{np.count_nonzero(there)} samples in a flight of {length_s:g} s")
            faults.add(keys[-1], found, f"at least {_LEAST_SAMPLES} of the {name}")


def _check_motion(scene: Scene, faults: Faults) -> None:
    """What a segment asks for must be something that flies. Gusts come on top and have limits of their own."""
    gravity_m_s2 = scene.scene.gravity_m_s2
    trajectory = Trajectory(replace(scene.trajectory, gusts=Gusts()), gravity_m_s2, seed=0)
    start_s = 0.0
    for number, segment in enumerate(scene.trajectory.segments):
        count = max(_MOTION_INSTANTS, round(segment.duration_s / _MOTION_PERIOD_S))
        motion = trajectory.at(start_s + np.linspace(0.0, segment.duration_s, count + 1))
        start_s += segment.duration_s
        falling_m_s2 = -scene.trajectory.lean * motion.a_WI_m_s2[:, 2].min()
        if falling_m_s2 > _MOST_FALL * gravity_m_s2:
            found = said(f"{segment.TAG} within {segment.duration_s:g} s falls with {falling_m_s2:.3g} m/s^2")
            expected = f"at most {_MOST_FALL * gravity_m_s2:.3g} m/s^2, {_MOST_FALL:g} of gravity: rotors push upwards"
            faults.add(f"trajectory.segments[{number}]", found, expected)
            continue  # without thrust there is no attitude to lean into it
        for what, fastest, limit, unit in (
            ("its speed", np.linalg.norm(motion.v_WI_m_s, axis=1).max(), MAX_SPEED_M_S, "m/s"),
            ("its acceleration", np.linalg.norm(motion.a_WI_m_s2, axis=1).max(), MAX_ACCELERATION_M_S2, "m/s^2"),
            ("its rate of turn", np.degrees(np.linalg.norm(motion.omega_I_rad_s, axis=1).max()), MAX_TURN_DEG_S, "deg/s"),
        ):
            if not fastest <= limit:
                found = said(f"{segment.TAG} within {segment.duration_s:g} s takes {what} to {fastest:.3g} {unit}")
                faults.add(f"trajectory.segments[{number}]", found, f"at most {limit:g} {unit}, as fast as a drone can be")


def check_path(scene: Scene, caster: RayCaster, seed: int, path: Path) -> None:
    """The camera must stay over the ground, above it, and out of everything that stands on it."""
    times = np.arange(0.0, scene.trajectory.length_s, _CHECK_PERIOD_S)
    trajectory = Trajectory.of(scene, seed)
    position, _ = rig(scene.sensors.camera, scene.sensors.lrf).cameras(trajectory.at(times))
    up = np.tile([0.0, 0.0, 1.0], (len(times), 1))
    above, below = caster.cast(position, up), caster.cast(position, -up)
    inside = np.isfinite(above.distance_m) & (above.facing > 0.0)
    x0, y0, x1, y1 = scene.scene.ground.extent_m
    off = (position[:, 0] < x0) | (position[:, 0] > x1) | (position[:, 1] < y0) | (position[:, 1] > y1)
    low = (below.distance_m < _LEAST_HEIGHT_M) & ~inside
    faults = Faults()
    for bad, what, expected in (
        (inside, "the camera is below the ground or inside an object", "a path through free air"),
        (
            off,
            "the camera leaves the ground",
            f"a path above scene.ground.extent_m {list(scene.scene.ground.extent_m)}",
        ),
        (low, "the camera touches something", f"at least {_LEAST_HEIGHT_M:g} m of air below it"),
    ):
        if np.any(bad):
            first = int(np.flatnonzero(bad)[0])
            x, y, z = position[first]
            key = "trajectory.start.position_m" if first == 0 else "trajectory.segments"
            faults.add(key, said(f"{what} at {times[first]:.2f} s, x {x:.2f} y {y:.2f} z {z:.2f} m"), expected)
    if faults:
        raise SceneFaults(path, faults)
