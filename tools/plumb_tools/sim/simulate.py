"""Flies a scene: motion, sensors, images, and the folder they go to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from plumb_tools.sim import asl, clock, exposure, frames, imu, kept, lrf
from plumb_tools.sim.clock import Instants
from plumb_tools.sim.devices.log import write_log
from plumb_tools.sim.flight import RangeData, SimulatedFlight
from plumb_tools.sim.motion import Trajectory
from plumb_tools.sim.raycast import RayCaster
from plumb_tools.sim.rig import Rig, calibration, rig
from plumb_tools.sim.scene import Scene
from plumb_tools.sim.schema import as_plain
from plumb_tools.sim.sensors import CameraDark, CameraOutage, Fault, ImuOutage, RangeOutage, RangeOutliers
from plumb_tools.sim.world import WorldModel
from plumb_tools.trajectory import FloatArray

SCENE_FILE = "scene.yaml"
LOG_FILE = "flight.lcmlog"
_SCRATCH_FILE = "world.pickle"

#: Told what is being done, how much of it is done, and how much there is.
Report = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Plan:
    """A checked scene with its world: all that is left is to fly it."""

    scene: Scene
    world: WorldModel
    caster: RayCaster
    seed: int
    length_s: float


def _active(scene: Scene, kind: type[Fault], t_s: FloatArray) -> np.ndarray:
    """Instants (N,) at which a fault of a kind is present."""
    active = np.zeros(len(t_s), bool)
    for fault in scene.faults:
        if isinstance(fault, kind):
            active |= (t_s >= fault.start_s) & (t_s < fault.start_s + fault.duration_s)
    return active


def _outlier_share(scene: Scene, t_s: FloatArray) -> FloatArray:
    share = np.zeros(len(t_s))
    for fault in scene.faults:
        if isinstance(fault, RangeOutliers):
            during = (t_s >= fault.start_s) & (t_s < fault.start_s + fault.duration_s)
            share[during] = np.maximum(share[during], fault.share)
    return share


@dataclass(frozen=True)
class _Images:
    """Images on disk and how they were taken."""

    files: list[tuple[int, Path]]
    settings: exposure.Settings


def _range_data(plan: Plan, trajectory: Trajectory, on_board: Rig) -> RangeData:
    sensor = plan.scene.sensors.lrf
    instants = clock.instants("lrf", sensor.clock, sensor.rate_hz, plan.length_s, plan.seed)
    true_m = lrf.true_ranges(sensor, on_board, plan.caster, trajectory.at(instants.t_s))
    outage = _active(plan.scene, RangeOutage, instants.t_s)
    return lrf.sample(sensor, true_m, instants, _outlier_share(plan.scene, instants.t_s), outage, plan.seed)


def _exposures(plan: Plan, trajectory: Trajectory, on_board: Rig, instants: Instants) -> exposure.Settings:
    looks = np.arange(0.0, plan.length_s + exposure.METER_PERIOD_S, exposure.METER_PERIOD_S)
    seen = frames.meter(plan.scene, plan.world, *on_board.cameras(trajectory.at(looks)))
    seen = np.interp(instants.t_s, looks, seen)
    return exposure.settings(plan.scene.sensors.camera, plan.scene.scene.light.level, seen)


def _take_images(plan: Plan, trajectory: Trajectory, on_board: Rig, root: Path, report: Report) -> _Images:
    camera = plan.scene.sensors.camera
    instants = clock.instants("camera", camera.clock, camera.rate_hz, plan.length_s, plan.seed)
    report("metering the light", 0, 0)
    chosen = _exposures(plan, trajectory, on_board, instants)
    dark = _active(plan.scene, CameraDark, instants.t_s)
    keep = np.flatnonzero(~_active(plan.scene, CameraOutage, instants.t_s))
    folder = asl.folder(root, "cam0/data")
    todo = [
        frames.Frame(
            number=int(k),
            t_s=float(instants.t_s[k]),
            exposure_s=float(chosen.exposure_s[k]),
            gain=float(chosen.gain[k]),
            dark=bool(dark[k]),
            path=folder / f"{instants.stamp_ns[k]}.png",
        )
        for k in keep
    ]
    done = 0

    def advance(count: int) -> None:
        nonlocal done
        done += count
        report("taking images", done, len(todo))

    report("taking images", 0, len(todo))
    frames.take_all(plan.scene, plan.world, plan.seed, todo, root / _SCRATCH_FILE, advance)
    files = [(int(instants.stamp_ns[k]), frame.path) for k, frame in zip(keep, todo, strict=True)]
    return _Images(files, exposure.Settings(chosen.exposure_s[keep], chosen.gain[keep]))


def _assemble(plan: Plan, root: Path, report: Report) -> SimulatedFlight:
    """Flies the plan; images go to the folder at once, everything else is returned."""
    scene = plan.scene
    trajectory, on_board = Trajectory.of(scene, plan.seed), rig(scene.sensors.camera, scene.sensors.lrf)
    report("flying IMU and range finder", 0, 0)
    instants = clock.instants("imu", scene.sensors.imu.clock, scene.sensors.imu.rate_hz, plan.length_s, plan.seed)
    motion = trajectory.at(instants.t_s)
    record = imu.sample(scene.sensors.imu, motion, instants, scene.scene.gravity_m_s2, plan.seed)
    arrives = ~_active(scene, ImuOutage, instants.t_s)
    ranges = _range_data(plan, trajectory, on_board)
    images = _take_images(plan, trajectory, on_board, root, report)
    return SimulatedFlight(
        scene=scene,
        seed=plan.seed,
        calibration=calibration(scene.sensors.camera, on_board),
        imu_t_ns=record.data.t_ns[arrives],
        imu_gyro_rad_s=record.data.gyro_rad_s[arrives],
        imu_accel_m_s2=record.data.accel_m_s2[arrives],
        range_t_ns=ranges.t_ns,
        range_m=ranges.range_m,
        range_status=ranges.status,
        images=images.files,
        image_exposure_s=images.settings.exposure_s,
        image_gain=images.settings.gain,
        truth_t_ns=clock.true_ns(instants.t_s),
        truth_p_m=motion.p_WI_m,
        truth_q_wxyz=motion.q_WI,
        truth_v_m_s=motion.v_WI_m_s,
        truth_b_gyro_rad_s=record.gyro_bias_rad_s,
        truth_b_accel_m_s2=record.accel_bias_m_s2,
    )


def fly(plan: Plan, target: Path, made_from: kept.Origin, report: Report) -> None:
    """Flies the plan into a folder: the ASL layout, the scene as flown and, when the origin names one, the log of raw
    device bytes. The folder appears under its name only when it is complete.
    """
    with kept.whole_or_nothing(target) as root:
        flight = _assemble(plan, root, report)
        report("writing", 0, 0)
        asl.write(root, flight)
        as_flown = yaml.safe_dump(as_plain(plan.scene), sort_keys=False, default_flow_style=None, width=110)
        (root / SCENE_FILE).write_text(f"# As flown, seed {plan.seed}.\n{as_flown}", encoding="utf-8")
        if made_from.log is not None:
            write_log(
                flight,
                root / LOG_FILE,
                "can" if plan.scene.sensors.lrf.device == "can" else "lidar_lite",
                progress=lambda share: report("writing the log", round(1000 * share), 1000),
            )
        kept.mark(root, made_from)
