"""Draws the images of a flight in several processes."""

from __future__ import annotations

import os
import pickle
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np

from plumb_tools.sim.camera import Optics, Sensor
from plumb_tools.sim.mesh import Float32
from plumb_tools.sim.motion import Trajectory
from plumb_tools.sim.renderer import Pinhole, Renderer
from plumb_tools.sim.rig import Rig, rig
from plumb_tools.sim.scene import Scene
from plumb_tools.sim.sensors import Camera
from plumb_tools.sim.world import WorldModel
from plumb_tools.trajectory import FloatArray

_FRAMES_PER_TASK = 8
#: Noise has no repetitions to look for; entropy coding alone, with one filter instead of a search, is fastest, and as
#: small.
_PNG = [
    cv2.IMWRITE_PNG_COMPRESSION,
    1,
    cv2.IMWRITE_PNG_STRATEGY,
    cv2.IMWRITE_PNG_STRATEGY_HUFFMAN_ONLY,
    cv2.IMWRITE_PNG_FILTER,
    cv2.IMWRITE_PNG_FILTER_AVG,
]
_METER_SCALE = 1.0 / 10.0


@dataclass(frozen=True)
class Frame:
    """One image to take."""

    number: int
    t_s: float  #: middle of the exposure, true time
    exposure_s: float
    gain: float
    dark: bool
    path: Path


class FrameMaker:
    """Takes images of one flight."""

    def __init__(self, scene: Scene, world: WorldModel, seed: int) -> None:
        """Opens the renderer; once per process."""
        camera = scene.sensors.camera
        cv2.setNumThreads(1)
        self._blur_frames = 1 if camera.ideal else camera.blur_frames
        self._optics = Optics(camera)
        self._renderer = Renderer(world, self._optics.pinhole)
        self._sensor = Sensor(camera, scene.scene.light.level, seed)
        self._trajectory = Trajectory.of(scene, seed)
        self._rig: Rig = rig(camera, scene.sensors.lrf)

    def poses(self, t_s: FloatArray, exposure_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Camera positions (N, B, 3) and rotations (N, B, 3, 3), B of them spread over each of N exposures."""
        shares = (np.arange(self._blur_frames) + 0.5) / self._blur_frames - 0.5
        instants = t_s[:, None] + exposure_s[:, None] * shares
        positions, rotations = self._rig.cameras(self._trajectory.at(instants.ravel()))
        return positions.reshape(*instants.shape, 3), rotations.reshape(*instants.shape, 3, 3)

    def radiance(self, positions_m: FloatArray, R_WC: FloatArray) -> Float32:
        """What reaches the pixels, averaged over the poses (B, 3), (B, 3, 3) of an exposure, before vignetting."""
        total = self._renderer.radiance(positions_m[0], R_WC[0])
        for position, rotation in zip(positions_m[1:], R_WC[1:], strict=True):
            total = total + self._renderer.radiance(position, rotation)
        return self._optics.through_lens(total / np.float32(self._blur_frames))

    def take_all(self, taken: list[Frame]) -> None:
        """Writes the PNGs of frames."""
        instants = np.array([frame.t_s for frame in taken]), np.array([frame.exposure_s for frame in taken])
        for frame, positions_m, R_WC in zip(taken, *self.poses(*instants), strict=True):
            self._take(frame, positions_m, R_WC)

    def _take(self, frame: Frame, positions_m: FloatArray, R_WC: FloatArray) -> None:
        if frame.dark:
            radiance = np.zeros_like(self._optics.vignetting)
        else:
            radiance = self.radiance(positions_m, R_WC) * self._optics.vignetting
        image = self._sensor.image(radiance, frame.exposure_s, frame.gain, frame.number)
        done, data = cv2.imencode(".png", image, _PNG)
        if not done:
            raise RuntimeError(f"{frame.path}: could not be encoded")
        frame.path.write_bytes(data.tobytes())  # unlike cv2.imwrite this tells why it fails


def meter(scene: Scene, world: WorldModel, positions_m: FloatArray, R_WC: FloatArray) -> FloatArray:
    """Mean radiance (N,) seen from camera poses: a small image each, as an exposure control would look at."""
    camera: Camera = scene.sensors.camera
    fine = Optics(camera).pinhole
    scale = _METER_SCALE
    small = Pinhole(
        round(fine.width * scale), round(fine.height * scale), fine.focal_px * scale, fine.cx * scale, fine.cy * scale
    )
    renderer = Renderer(world, small)
    return np.array([renderer.radiance(p, R).mean() for p, R in zip(positions_m, R_WC, strict=True)])


_maker: FrameMaker | None = None


def _start(scene: Scene, world_file: Path, seed: int) -> None:
    """A worker begins."""
    global _maker
    with world_file.open("rb") as file:
        world: WorldModel = pickle.load(file)
    _maker = FrameMaker(scene, world, seed)


def _take(frames: list[Frame]) -> int:
    assert _maker is not None
    _maker.take_all(frames)
    return len(frames)


@contextmanager
def _deaf_children() -> Iterator[None]:
    """Processes started here never see the interrupt key, which reaches the whole group; the parent sees it after."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def take_all(
    scene: Scene, world: WorldModel, seed: int, frames: list[Frame], scratch: Path, advance: Callable[[int], None]
) -> None:
    """Takes all images, on every core; `advance` is told how many more are done. Leaves no process and no file behind.

    `scratch`: a file for the world while the processes run; handed over through pipes it would stop the parent.
    """
    tasks = [frames[i : i + _FRAMES_PER_TASK] for i in range(0, len(frames), _FRAMES_PER_TASK)]
    workers = max(1, min(len(os.sched_getaffinity(0)), len(tasks)))
    with scratch.open("wb") as file:
        pickle.dump(world, file, protocol=pickle.HIGHEST_PROTOCOL)
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _start, (scene, scratch, seed))
    try:
        with _deaf_children():
            waiting: list[Future[int]] = [pool.submit(_take, task) for task in tasks]
        for future in as_completed(waiting):
            advance(future.result())
    except BaseException:
        processes = list((pool._processes or {}).values())
        pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.kill()  # also when it is stopped
        for process in processes:
            process.join()  # nobody may still be writing when the folder goes away
        raise
    pool.shutdown()
    scratch.unlink()
