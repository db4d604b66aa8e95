"""A small made-up flight with images, range finder and truth, and replays of it, as files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from plumb_tools.report.run import FACET, POSITION, Mode, RangeOutcome
from plumb_tools.trajectory import NS_PER_S, FloatArray, Trajectory
from synthetic import write_asl, write_replay

IMAGES = 120
RATE_HZ = 20
WIDTH, HEIGHT = 160, 120
HEIGHT_ABOVE_GROUND_M = 10.0
SPEED_M_S = 2.0
GATED_ROW = 60  #: its range is of something that the facet does not know
FIRST_VALID_ROW = 5
FACET_IDS = (1, 2, 3)

STAGES = ("front_end", "propagation", "range", "visual_update")
#: C looks down, its x axis along the flight.
T_BS = [1, 0, 0, 0.1, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]
IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]


def straight_flight() -> Trajectory:
    """Level flight along x at constant speed."""
    t_ns = NS_PER_S + np.arange(IMAGES, dtype=np.int64) * (NS_PER_S // RATE_HZ)
    t = (t_ns - t_ns[0]) / NS_PER_S
    p = np.column_stack([SPEED_M_S * t, 0.05 * np.sin(t), np.full(IMAGES, HEIGHT_ABOVE_GROUND_M)])
    v = np.column_stack([np.full(IMAGES, SPEED_M_S), 0.05 * np.cos(t), np.zeros(IMAGES)])
    return Trajectory("straight", t_ns, p, Rotation.identity(IMAGES), v)


def scaled(trajectory: Trajectory, scale: float) -> Trajectory:
    """The same flight as an estimator with a scale error sees it, from the first valid image on."""
    kept = slice(FIRST_VALID_ROW, None)
    assert trajectory.v_m_s is not None
    p = scale * (trajectory.p_m - trajectory.p_m[FIRST_VALID_ROW])
    v = scale * trajectory.v_m_s
    return Trajectory("scaled", trajectory.t_ns[kept], p[kept], trajectory.rotation[kept], v[kept])


def _yaml_list(values: list[float]) -> str:
    return "[" + ", ".join(f"{value:g}" for value in values) + "]"


def write_flight(folder: Path) -> Path:
    """An ASL folder with grey images."""
    trajectory = straight_flight()
    write_asl(folder, trajectory)
    pose = "T_BS:\n  cols: 4\n  rows: 4\n  data: "
    images = folder / "mav0/cam0/data"
    images.mkdir()
    for index, t_ns in enumerate(trajectory.t_ns):
        grey = np.add.outer(np.arange(HEIGHT), np.arange(WIDTH) + index) % 256
        Image.fromarray(grey.astype(np.uint8)).save(images / f"{t_ns}.png")
    (folder / "mav0/cam0/sensor.yaml").write_text(
        f"{pose}{_yaml_list(T_BS)}\nresolution: [{WIDTH}, {HEIGHT}]\ncamera_model: pinhole\n"
        "intrinsics: [100, 100, 80, 60]\ndistortion_model: none\n"
    )
    for name in ("imu0", "range0"):
        (folder / "mav0" / name).mkdir()
    (folder / "mav0/imu0/sensor.yaml").write_text(f"{pose}{_yaml_list(IDENTITY)}\n")
    samples = "".join(f"{t_ns},0,0,0,0,0,9.8\n" for t_ns in trajectory.t_ns)
    (folder / "mav0/imu0/data.csv").write_text("#timestamp [ns],w_x,w_y,w_z,a_x,a_y,a_z\n" + samples)
    (folder / "mav0/range0/sensor.yaml").write_text(
        "noise_stddev_m: 0.025\nmax_range_m: 40\naxis_in_cam: [0, 0, 1]\norigin_in_cam_m: [0, 0, 0]\n"
    )
    rows = "".join(f"{t_ns},{measured:.3f}\n" for t_ns, measured in zip(trajectory.t_ns, ranges(), strict=True))
    (folder / "mav0/range0/data.csv").write_text("#timestamp [ns],range [m]\n" + rows)
    return folder


def ranges() -> FloatArray:
    """What the range finder measured at each image."""
    measured = np.full(IMAGES, HEIGHT_ABOVE_GROUND_M)
    measured[GATED_ROW] = 7.0
    return measured


def write_run(folder: Path, scale: float = 1.0, with_range: bool = True, with_features: bool = True) -> Path:
    """An output folder of plumb-replay."""
    trajectory = straight_flight()
    write_replay(folder, scaled(trajectory, scale), 1e-4 * np.eye(9))
    _write_states(folder / "states.csv", trajectory, scale, with_range)
    header = "t_ns,sequence," + ",".join(f"{stage}_us" for stage in STAGES) + ",filter_us,step_us,step_heap_calls\n"
    costs = "".join(f"{t_ns},{i},3000.5,100,50,900,1050,4100,0\n" for i, t_ns in enumerate(trajectory.t_ns))
    (folder / "timing.csv").write_text(header + costs)
    if with_features:
        _write_features(folder / "features.csv", trajectory)
    summary = {
        "source": str(folder / "gone"),
        "configuration": "flight",
        "inputs": {"images": IMAGES, "imu_samples": IMAGES, "ranges": IMAGES if with_range else 0},
        "images_processed": IMAGES,
        "images_valid": IMAGES - FIRST_VALID_ROW,
        "run_hash": "0123456789abcdef",
        "image_span_s": (IMAGES - 1) / RATE_HZ,
        "wall_s": 2.0,
        "counters": {"estimator": {"ranges": IMAGES, "resets": 0}, "system": {"frames": IMAGES}},
        "parameters": {"range.noise": 0.025},
    }
    (folder / "summary.json").write_text(json.dumps(summary))
    return folder


def never_start(run: Path) -> Path:
    """Makes of an output folder one whose filter never started, as plumb-replay leaves it."""
    (run / "trajectory.tum").write_text("")
    summary = json.loads((run / "summary.json").read_text())
    (run / "summary.json").write_text(json.dumps(summary | {"images_valid": 0}))
    return run


def _write_states(path: Path, trajectory: Trajectory, scale: float, with_range: bool) -> None:
    counts = ("tracks", "slam_features", "slam_used", "slam_rejected", "msckf_used", "msckf_rejected")
    ranging = ("range_outcome", *FACET, "range_measured_m", "range_predicted_m", "range_sigma_m")
    velocity = ("v_WI_x_m_s", "v_WI_y_m_s", "v_WI_z_m_s")
    header = ("t_ns", "sequence", "valid", "mode", "reset_count", *POSITION, *velocity, *counts, *ranging)
    lines = [",".join((*header, "zero_velocity", "state_hash"))]
    assert trajectory.v_m_s is not None
    for row, t_ns in enumerate(trajectory.t_ns.tolist()):
        valid = row >= FIRST_VALID_ROW
        mode = Mode.INITIALISING if not valid else Mode.RANGE_VIO if with_range else Mode.VIO
        state = [*(scale * trajectory.p_m[row]), *(scale * trajectory.v_m_s[row])] if valid else ["nan"] * 6
        outcome, facet, measured = RangeOutcome.NONE, (0, 0, 0), 0.0
        if with_range and valid:
            outcome = RangeOutcome.GATED if row == GATED_ROW else RangeOutcome.USED
            facet, measured = FACET_IDS, float(ranges()[row])
        predicted = HEIGHT_ABOVE_GROUND_M if measured else 0.0
        numbers = [t_ns, row, int(valid), int(mode), 0, *state, 5, 4, 4, 0, 1, 0]
        numbers += [int(outcome), *facet, measured, predicted, 0.05, 0, "00000000000000ff"]
        lines.append(",".join(str(number) for number in numbers))
    path.write_text("\n".join(lines) + "\n")


def _write_features(path: Path, trajectory: Trajectory) -> None:
    """Four SLAM features around the middle, and one track that moves to the left by a pixel per image."""
    corners = ((1, 40, 30), (2, 120, 30), (3, 80, 100), (4, 20, 100))
    lines = ["t_ns,sequence,track_id,u_px,v_px,slam"]
    for row, t_ns in enumerate(trajectory.t_ns.tolist()):
        lines += [f"{t_ns},{row},{track},{u:.2f},{v:.2f},1" for track, u, v in corners]
        lines.append(f"{t_ns},{row},9,{150 - row},60.00,0")
    path.write_text("\n".join(lines) + "\n")
