"""Scene files: the shipped ones are good, bad ones are refused with key, value and what was expected."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from plumb_tools.sim import __main__ as command
from plumb_tools.sim import checks, scene_file, world
from plumb_tools.sim.schema import as_plain
from plumb_tools.trajectory import InputError
from sim_scenes import changed, write

SHIPPED = [
    "cruise",
    "demo",
    "descent",
    "dusk",
    "excitation",
    "hover",
    "indoor",
    "long",
    "mars",
    "outdoor",
    "water",
]


def test_every_scene_is_there() -> None:
    assert scene_file.names() == SHIPPED


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenes_are_good(name: str) -> None:
    path = scene_file.find(name)
    scene = scene_file.read(path)
    checks.check_values(scene, path)
    for seed in (0, 1):
        checks.check_path(scene, world.shape(scene).caster, seed, path)
    assert scene.scene.summary


@pytest.mark.parametrize("name", SHIPPED)
def test_a_scene_as_flown_is_the_same_scene(name: str, tmp_path: Path) -> None:
    scene = scene_file.read(scene_file.find(name))
    assert scene_file.read(write(tmp_path, as_plain(scene))) == scene


SLOW = {"do": "hold", "duration_s": 1}
MOVE = {"do": "move", "by_m": [5, 0, 0]}
SHAKE = {"do": "sway", "duration_s": 9, "amplitude_m": [0.2, 0, 0], "frequency_hz": [5, 1, 1]}

BAD: list[tuple[dict[str, Any], list[str]]] = [
    ({"scene.gravty_m_s2": 9.8}, ["scene.gravty_m_s2: unknown key", "'gravity_m_s2'"]),
    ({"sensors.imu.rate_hz": -250}, ["sensors.imu.rate_hz: -250", "above 0"]),
    ({"sensors.imu.rate_hz": "fast"}, ["sensors.imu.rate_hz: 'fast'", "a number"]),
    ({"sensors.imu.ideal": 1}, ["sensors.imu.ideal: 1", "true or false"]),
    ({"sensors.camera.lens.model": "fisheye"}, ["lens.model: 'fisheye'", "equidistant"]),
    ({"sensors.camera.width_px": 640.5}, ["width_px: 640.5", "a whole number"]),
    ({"sensors.camera.lens.coefficients": [-3, 0, 0, 0]}, ["lens.coefficients", "inverted"]),
    ({"sensors.camera.lens.center_px": [500, 60]}, ["lens.center_px", "inside the image"]),
    ({"sensors.camera.clock.phase": 1.5}, ["camera.clock.phase: 1.5", "from 0 to 1"]),
    ({"sensors.camera.exposure.time_s": [1e-4, 0.02], "sensors.camera.rate_hz": 60}, ["exposure.time_s", "period"]),
    ({"sensors.lrf.max_range_m": 0.01}, ["lrf.max_range_m: 0.01", "more than min_range_m"]),
    ({"sensors.lrf": [1, 2]}, ["sensors.lrf: [1, 2]", "a section with"]),
    ({"scene.ground.extent_m": [0, 0, -5, 5]}, ["ground.extent_m", "x0 < x1"]),
    ({"scene.ground.extent_m": [0, 0, 5]}, ["ground.extent_m: [0, 0, 5]", "a list of 4 numbers"]),
    ({"scene.ground.map_m_per_px": 0.001}, ["ground.map_m_per_px: 0.001", "from 0.01"]),
    ({"scene.objects": [{"kind": "castle"}]}, ["scene.objects[0].kind: 'castle'", "building"]),
    ({"scene.objects": [{"center_m": [1, 2]}]}, ["scene.objects[0].kind: is missing"]),
    ({"scene.objects": [{"kind": "box", "center_m": [1, 2]}]}, ["objects[0].size_m: is missing", "3 numbers"]),
    ({"trajectory.segments": None}, ["trajectory.segments: is missing", "'do'"]),
    ({"trajectory.segments": []}, ["trajectory.segments: []", "at least one"]),
    ({"trajectory.segments": [{"do": "loop"}]}, ["segments[0].do: 'loop'", "hold, move"]),
    ({"trajectory.segments": [{"do": "hold", "duration_s": 0}]}, ["segments[0].duration_s: 0", "above 0"]),
    ({"trajectory.segments": [SLOW, MOVE | {"duration_s": 0.01}]}, ["segments[1]: move within 0.01 s", "50 m/s, "]),
    ({"trajectory.segments": [SLOW, MOVE | {"duration_s": 0.4}]}, ["its acceleration to 2", "at most 100 m/s^2"]),
    ({"trajectory.segments": [MOVE | {"yaw_deg": 900, "duration_s": 1}]}, ["its rate of turn to", "at most 1000 deg/s"]),
    ({"trajectory.segments": [SHAKE]}, ["segments[0]: sway within 9 s", "at most 100 m/s^2"]),
    ({"faults": [{"kind": "camera_dark", "start_s": 99, "duration_s": 1}]}, ["faults[0].start_s: 99", "within"]),
    ({"trajectory.start.position_m": [0, 0, -1]}, ["trajectory.start.position_m", "below the ground", "free air"]),
    ({"trajectory.start.position_m": [5, 1, 1]}, ["trajectory.start.position_m", "inside an object"]),
    ({"trajectory.start.position_m": [2.3, 1, 1]}, ["trajectory.segments", "inside an object at 0."]),
    ({"trajectory.start.position_m": [50, 0, 4]}, ["trajectory.start.position_m", "leaves the ground"]),
    (
        {"trajectory.segments": [SLOW, {"do": "velocity", "to_m_s": [0, 0, -9], "duration_s": 0.7}]},
        ["trajectory.segments[1]", "falls with", "rotors push upwards"],
    ),
    ({"sensors.imu.rate_hz": 333}, ["sensors.imu.rate_hz: 333", "125, 250, 500, 1000, 2000", "--no-log"]),
    (
        {"faults": [{"kind": "imu_outage", "start_s": 0, "duration_s": 900}]},
        ["faults[0]: 0 samples", "at least 2 of the imu"],
    ),
    ({"sensors.imu.rate_hz": 10**400}, ["sensors.imu.rate_hz"]),
    (
        {"faults": [{"kind": "camera_outage", "start_s": 0, "duration_s": 900}]},
        ["faults[0]: 0 samples", "at least 2 of the camera"],
    ),
]


@pytest.mark.parametrize(("changes", "expected"), BAD, ids=lambda value: next(iter(value), None))
def test_bad_scenes_are_refused(
    changes: dict[str, Any], expected: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, changed(changes))
    assert command.main([str(path), "--out", str(tmp_path / "flight")]) == 2
    message = capsys.readouterr().err
    assert str(path) in message
    for part in expected:
        assert part in message
    assert sorted(p.name for p in tmp_path.iterdir()) == ["scene.yaml"]


def test_a_flight_just_within_the_limits_of_motion_is_good(tmp_path: Path) -> None:
    """A move of 5 m has at most 2.46 times its mean speed, and 9.4 m over its time squared of acceleration."""
    segments = [SLOW, MOVE | {"duration_s": 0.75}]
    path = write(tmp_path, changed({"trajectory.lean": 0, "trajectory.segments": segments}))
    checks.check_values(scene_file.read(path), path)


def test_all_faults_are_told_at_once(tmp_path: Path) -> None:
    path = write(tmp_path, changed({"scene.x": 1, "sensors.imu.rate_hz": 0, "trajectory.lean": 9}))
    with pytest.raises(scene_file.SceneFaults) as caught:
        scene_file.read(path)
    assert len(str(caught.value).splitlines()) == 3


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("scene: {a: [1}", "scene.yaml:1"),
        ("scene: {}\nscene: {}", "'scene' is given twice"),
        ("? [a, b]\n: 1", "expected YAML"),
        ("sensors: {imu: {rate_hz: 2020-13-45}}", "expected YAML"),
        ("- 1", "a section with"),
        ("", "trajectory.segments: is missing"),
    ],
)
def test_files_that_are_no_scene_are_refused(text: str, expected: str, tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        scene_file.read(path)
    assert expected in str(caught.value)


@pytest.mark.parametrize("text", ["1:30", "0x10"])
def test_numbers_that_only_yaml_knows_are_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(f"sensors: {{imu: {{rate_hz: {text}}}}}", encoding="utf-8")
    with pytest.raises(InputError, match=f"rate_hz: '{text}'"):
        scene_file.read(path)


def test_numbers_may_have_an_exponent_without_a_dot(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    text = yaml.safe_dump(changed({})).replace("rate_hz: 10", "rate_hz: 1e1")
    path.write_text(text, encoding="utf-8")
    assert scene_file.read(path).sensors.camera.rate_hz == 10.0


def test_unknown_names_and_folders_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main(["outdor"]) == 2
    assert "expected one of cruise, demo" in capsys.readouterr().err
    path = write(tmp_path, changed({}))
    assert command.main([str(path), "--textures", str(tmp_path / "none")]) == 2
    assert "no such folder" in capsys.readouterr().err
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "diary.txt").write_text("mine")
    assert command.main([str(path), "--out", str(tmp_path / "out"), "--duration", "0.5"]) == 2
    assert "not a simulated flight" in capsys.readouterr().err
    assert (tmp_path / "out" / "diary.txt").exists()
    assert command.main([str(path), "--out", str(path)]) == 2
    assert f"{path}: exists and is not a simulated flight; --out takes a new" in capsys.readouterr().err
    assert command.main([str(path), "--out", str(path / "flight")]) == 2
    assert f"--out {path / 'flight'}: cannot be written, {path}: is not a folder" in capsys.readouterr().err
