"""Images, depth and laser range agree with one another and with the true poses."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from plumb_tools.sim import lens as lens_model
from plumb_tools.sim import lrf
from plumb_tools.sim.camera import Optics
from plumb_tools.sim.frames import FrameMaker
from plumb_tools.sim.motion import Trajectory
from plumb_tools.sim.renderer import Renderer
from plumb_tools.sim.rig import rig
from plumb_tools.sim.sensors import Lens
from plumb_tools.sim.simulate import Plan
from plumb_tools.trajectory import FloatArray
from sim_scenes import plan

LENSES = {
    "none": Lens(model="none", coefficients=(0.0, 0.0, 0.0, 0.0)),
    "radial-tangential": Lens(coefficients=(-0.28, 0.074, 2e-4, 2e-5)),
    "equidistant": Lens(model="equidistant", coefficients=(-0.012, 0.004, -0.001, 0.0)),
    "fov": Lens(model="fov", coefficients=(0.9, 0.0, 0.0, 0.0)),
}

#: A camera of ordinary size without noise.
LARGE = {
    "sensors.camera.ideal": True,
    "sensors.camera.width_px": 640,
    "sensors.camera.height_px": 480,
    "sensors.lrf.ideal": True,
}


@pytest.mark.parametrize("name", LENSES)
def test_the_lens_is_inverted_exactly(name: str) -> None:
    lens = LENSES[name]
    v, u = np.mgrid[0:480:7, 0:640:7].astype(float)
    pixels = np.column_stack([u.ravel(), v.ravel()])
    assert np.abs(lens_model.project(lens, lens_model.unproject(lens, pixels)) - pixels).max() < 1e-6


@pytest.mark.parametrize("name", ["radial-tangential", "equidistant"])
def test_the_lens_is_that_of_opencv(name: str) -> None:
    lens = LENSES[name]
    rays = np.random.default_rng(0).uniform(-0.6, 0.6, (50, 1, 2))
    matrix = np.array([[lens.focal_px[0], 0, lens.center_px[0]], [0, lens.focal_px[1], lens.center_px[1]], [0, 0, 1]])
    zero = np.zeros(3)
    if name == "equidistant":
        expected, _ = cv2.fisheye.projectPoints(
            np.dstack([rays, np.ones((50, 1))]), zero, zero, matrix, np.array(lens.coefficients)
        )
    else:
        points = np.dstack([rays, np.ones((50, 1))])
        expected, _ = cv2.projectPoints(points, zero, zero, matrix, np.array(lens.coefficients))
    assert np.abs(lens_model.project(lens, rays[:, 0]) - expected[:, 0]).max() < 1e-9


def _image(maker: FrameMaker, t_s: float) -> np.ndarray:
    positions, rotations = maker.poses(np.array([t_s]), np.zeros(1))
    return np.clip(450.0 * maker.radiance(positions[0], rotations[0]), 0.0, 255.0).astype(np.uint8)


def _seen_again(of: Plan, pixels: FloatArray, t_s: tuple[float, float]) -> tuple[FloatArray, np.ndarray]:
    """Where what is seen at pixels (N, 2) at one time is seen at another, and whether it is in sight there."""
    camera = of.scene.sensors.camera
    position, R_WC = rig(camera, of.scene.sensors.lrf).cameras(Trajectory.of(of.scene, of.seed).at(np.array(t_s)))
    rays = np.column_stack([lens_model.unproject(camera.lens, pixels), np.ones(len(pixels))])
    directions = rays / np.linalg.norm(rays, axis=1, keepdims=True) @ R_WC[0].T
    distance = of.caster.distance(np.tile(position[0], (len(pixels), 1)), directions)
    points = position[0] + distance[:, None] * directions
    back = points - position[1]
    reached = of.caster.distance(np.tile(position[1], (len(pixels), 1)), back / np.linalg.norm(back, axis=1)[:, None])
    in_camera = back @ R_WC[1]
    again = lens_model.project(camera.lens, in_camera[:, :2] / in_camera[:, 2:])
    return again, np.abs(reached - np.linalg.norm(back, axis=1)) < 0.01


@pytest.mark.parametrize("name", LENSES)
def test_a_point_is_tracked_to_where_it_projects(name: str, tmp_path: Path) -> None:
    lens = LENSES[name]
    lens_keys = {
        "model": lens.model,
        "coefficients": list(lens.coefficients),
        "focal_px": list(lens.focal_px),
        "center_px": list(lens.center_px),
    }
    of = plan(tmp_path, LARGE | {"sensors.camera.lens": lens_keys})
    maker = FrameMaker(of.scene, of.world, of.seed)
    times = (0.2, 0.35)
    first, second = (_image(maker, t) for t in times)
    corners = cv2.goodFeaturesToTrack(first, 300, 0.01, 9, mask=None)[:, 0].astype(np.float32)
    expected, in_sight = _seen_again(of, corners.astype(float), times)
    inside = np.all((expected > 20) & (expected < [620, 460]), axis=1) & in_sight
    found, status, _ = cv2.calcOpticalFlowPyrLK(first, second, corners, None, winSize=(21, 21), maxLevel=3)
    tracked = inside & (status[:, 0] == 1)
    assert tracked.sum() > 100
    error = np.linalg.norm(found[tracked] - expected[tracked], axis=1)
    motion = np.linalg.norm(expected[tracked] - corners[tracked], axis=1)
    assert np.median(motion) > 5.0
    assert np.median(error) < 0.1  # the requirement is 0.2 px


def test_the_laser_range_is_the_rendered_depth(tmp_path: Path) -> None:
    of = plan(tmp_path, LARGE)
    camera = of.scene.sensors.camera
    on_board = rig(camera, of.scene.sensors.lrf)
    times = np.arange(0.0, 1.2, 0.05)
    motion = Trajectory.of(of.scene, 0).at(np.concatenate([times, times]))
    motion.p_WI_m[len(times) :, 0] += 3.5  # once more, over the roof
    measured = lrf.true_ranges(of.scene.sensors.lrf, on_board, of.caster, motion)
    origins, beams = on_board.beams(motion)
    positions, rotations = on_board.cameras(motion)
    pinhole = Optics(camera).pinhole
    renderer = Renderer(of.world, pinhole)
    errors = []
    for range_m, origin, beam, position, R_WC in zip(measured, origins, beams, positions, rotations, strict=True):
        depth = renderer.depth(position, R_WC)
        spot = R_WC.T @ (origin + range_m * beam - position)
        x, y = pinhole.focal_px * spot[:2] / spot[2] + [pinhole.cx, pinhole.cy]
        around = depth[int(y) : int(y) + 2, int(x) : int(x) + 2]
        if np.ptp(around) < 0.05:  # not across an edge
            u, v = x - int(x), y - int(y)
            errors.append(spot[2] - np.array([1 - v, v]) @ around @ np.array([1 - u, u]))
    assert len(errors) > 0.8 * len(measured)
    assert np.ptp(measured) > 1.0  # ground and roof
    assert np.abs(errors).max() < 1e-3


def test_texture_holds_up_at_every_height(tmp_path: Path) -> None:
    detector = cv2.FastFeatureDetector_create(10)
    for height in (0.3, 2.0, 10.0, 60.0):
        half = 12 + height
        of = plan(
            tmp_path,
            LARGE
            | {
                "scene.objects": [],
                "scene.ground": {"extent_m": [-half, -half, half, half], "material": "grass", "map_m_per_px": 0.06},
                "trajectory.start.position_m": [0, 0, height + 0.05],
            },
        )
        image = _image(FrameMaker(of.scene, of.world, 0), 0.1)
        assert len(detector.detect(image)) > 150, height
