"""What measures how well features are followed finds the noise that was put in, and tells what was thrown off."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from plumb_tools.trajectory import FloatArray, InputError

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "test" / "budget"))
from track_noise import MIN_IMAGES, Cameras, Seen, main, noise_of, residuals_px, yaml_of  # noqa: E402

SEED = 5
FOCAL_PX = 400.0
NOISE_PX = 0.1
IMAGES = 20  # that a track lasts
POINTS = 1500


def _cameras() -> Cameras:
    """Along a curve over the ground and looking down, swaying."""
    t = np.linspace(0.0, 2.0, IMAGES)
    place = np.column_stack([2.0 * t, np.sin(2.0 * t), 10.0 + 0.5 * np.cos(t)])
    sway = Rotation.from_rotvec(0.1 * np.column_stack([np.sin(3.0 * t), np.cos(2.0 * t), t]))
    R_WC = sway * Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))
    return Cameras(R_WC.inv().as_matrix(), place, FOCAL_PX)


def _points(random: np.random.Generator) -> FloatArray:
    return random.uniform([-3.0, -4.0, 0.0], [7.0, 4.0, 3.0], (POINTS, 3))


def _seen(cameras: Cameras, points: FloatArray, errors_px: FloatArray) -> Seen:
    """Every point in every image, off by errors (POINTS, IMAGES, 2)."""
    in_C = np.einsum("mij,pmj->pmi", cameras.R_CW, points[:, None] - cameras.p_WC_m)
    plane = in_C[:, :, :2] / in_C[:, :, 2:] + errors_px / cameras.focal_px
    track, image = np.indices(plane.shape[:2])
    return Seen(track.ravel(), image.ravel(), plane.reshape(-1, 2))


def _errors_px(random: np.random.Generator) -> FloatArray:
    return random.normal(0.0, NOISE_PX, (POINTS, IMAGES, 2))


def test_noise_that_was_put_in_is_found() -> None:
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    cameras = _cameras()
    noise = noise_of(_seen(cameras, _points(random), _errors_px(random)), cameras)
    assert (noise.tracks, noise.observations, noise.images_a_track) == (POINTS, POINTS * IMAGES, IMAGES)
    left = NOISE_PX * np.sqrt(1.0 - 3.0 / (2.0 * IMAGES))  # three unknowns of two coordinates an image
    assert noise.rms_px == pytest.approx(left, rel=0.02)
    assert noise.median_px == pytest.approx(left * np.sqrt(2.0 * np.log(2.0)), rel=0.02)
    assert noise.beyond_followed < 1e-3
    assert np.abs(noise.correlations).max() < 0.15  # what is fitted takes a little out of neighbours


def test_what_lasts_is_found_in_neighbours() -> None:
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    cameras = _cameras()
    errors = _errors_px(random)
    errors[:, 1::2] = errors[:, ::2]  # the same in two images each
    noise = noise_of(_seen(cameras, _points(random), errors), cameras)
    assert noise.correlations[0] == pytest.approx(0.5, abs=0.1)
    assert np.abs(noise.correlations[1:]).max() < 0.25


def test_a_tenth_thrown_off_is_counted_and_moves_no_other() -> None:
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    cameras = _cameras()
    errors = _errors_px(random)
    wrong = random.random((POINTS, IMAGES)) < 0.1
    angle = random.uniform(0.0, 2.0 * np.pi, wrong.sum())
    errors[wrong] += 3.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    noise = noise_of(_seen(cameras, _points(random), errors), cameras)
    assert noise.beyond_lost == pytest.approx(wrong.mean(), abs=0.002)
    assert noise.beyond_followed == pytest.approx(wrong.mean(), abs=0.005)
    assert noise.rms_px == pytest.approx(NOISE_PX * np.sqrt(1.0 - 3.0 / (2.0 * IMAGES)), rel=0.1)


def test_tracks_that_tell_no_point_are_left_out() -> None:
    cameras = _cameras()
    points = np.array([[3.0, 0.0, 0.0], [3.0, 0.0, -300.0], [3.0, 0.0, 20.0]])  # seen well, too far, behind
    seen = _seen(cameras, points, np.zeros((len(points), IMAGES, 2)))
    residuals = residuals_px(seen, cameras).reshape(len(points), IMAGES, 2)
    assert np.abs(residuals[0]).max() < 1e-6
    assert np.isnan(residuals[1:]).all()
    assert noise_of(seen, cameras).tracks == 1
    with pytest.raises(InputError, match="no track can be measured"):
        noise_of(seen.select(seen.image < MIN_IMAGES - 1), cameras)


def test_parameters_become_a_file_and_bad_input_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert yaml_of(["tracker.window=11", "vision.spot_features=6", "tracker.levels=3"]) == (
        "tracker.window: 11\nvision.spot_features: 6\ntracker.levels: 3\n"
    )
    assert main([str(tmp_path / "none")]) == 2
    assert "no such folder" in capsys.readouterr().err
    assert main([str(tmp_path), "--params", "window=11"]) == 2
    assert "expected NAME=VALUE" in capsys.readouterr().err
