"""Made-up trajectories with known errors, and the files that hold them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from plumb_tools.score.estimate import ATTITUDE_ERRORS, POSITION_ERRORS, VELOCITY_ERRORS, Covariances, Estimate
from plumb_tools.trajectory import NS_PER_S, FloatArray, Trajectory, Truth

EPOCH_NS = 1_403_636_584_763_555_584
RATE_HZ = 20
ERRORS = POSITION_ERRORS + VELOCITY_ERRORS + ATTITUDE_ERRORS


def stamps(count: int, rate_hz: int = RATE_HZ) -> np.ndarray:
    """Stamps [ns] at a steady rate."""
    return EPOCH_NS + np.arange(count, dtype=np.int64) * (NS_PER_S // rate_hz)


def flight(count: int = 400) -> Trajectory:
    """A lively flight in all axes with its exact velocity; body x axis up, as in EuRoC."""
    t_ns = stamps(count)
    t = (t_ns - t_ns[0]) / NS_PER_S
    p = np.column_stack([2.0 * np.sin(0.7 * t), 1.5 * np.cos(0.9 * t), 0.4 * np.sin(1.3 * t) + 0.05 * t])
    v = np.column_stack([1.4 * np.cos(0.7 * t), -1.35 * np.sin(0.9 * t), 0.52 * np.cos(1.3 * t) + 0.05])
    turn = Rotation.from_rotvec(np.column_stack([0.2 * np.sin(t), 0.1 * np.cos(1.1 * t), 0.3 * t]))
    return Trajectory("flight", t_ns, p, turn * Rotation.from_euler("y", -90.0, degrees=True), v)


def truth_of(trajectory: Trajectory) -> Truth:
    """A trajectory as the truth over its own span."""
    return Truth(trajectory, (int(trajectory.t_ns[0]), int(trajectory.t_ns[-1])), "truth")


def estimate_of(trajectory: Trajectory, covariances: Covariances | None = None) -> Estimate:
    """A trajectory as an estimate without re-initialisation."""
    return Estimate(trajectory, covariances, np.zeros(len(trajectory), dtype=np.int64))


def moved(
    trajectory: Trajectory, rotation: Rotation, translation: tuple[float, float, float], scale: float = 1.0
) -> Trajectory:
    """The trajectory in another world frame: p' = scale * rotation * p + translation."""
    assert trajectory.v_m_s is not None
    p = scale * rotation.apply(trajectory.p_m) + np.array(translation)
    v = scale * rotation.apply(trajectory.v_m_s)
    return Trajectory("moved", trajectory.t_ns, p, rotation * trajectory.rotation, v)


def yaw(degrees: float) -> Rotation:
    """Rotation about the vertical."""
    return Rotation.from_euler("z", degrees, degrees=True)


def tum_lines(trajectory: Trajectory) -> list[str]:
    """The lines of a TUM file."""
    lines = []
    for t_ns, p, q in zip(trajectory.t_ns.tolist(), trajectory.p_m, trajectory.rotation.as_quat(), strict=True):
        values = " ".join(f"{value:.12f}" for value in [*p, *q])
        lines.append(f"{t_ns // NS_PER_S}.{t_ns % NS_PER_S:09d} {values}")
    return lines


def write_tum(path: Path, trajectory: Trajectory) -> Path:
    """Writes a TUM file."""
    path.write_text("# t tx ty tz qx qy qz qw\n" + "\n".join(tum_lines(trajectory)) + "\n")
    return path


def write_asl(folder: Path, trajectory: Trajectory) -> Path:
    """Writes an ASL folder with truth and image stamps."""
    assert trajectory.v_m_s is not None
    truth = folder / "mav0/state_groundtruth_estimate0/data.csv"
    images = folder / "mav0/cam0/data.csv"
    names = [f"p_RS_R_{axis}" for axis in "xyz"] + [f"q_RS_{axis}" for axis in "wxyz"]
    names += [f"v_RS_R_{axis}" for axis in "xyz"]
    rows = np.column_stack([trajectory.p_m, trajectory.rotation.as_quat(scalar_first=True), trajectory.v_m_s])
    for path in (truth, images):
        path.parent.mkdir(parents=True)
    truth.write_text(
        "#timestamp [ns]," + ",".join(f"{name} [unit]" for name in names) + "\n"
        ""
        + "".join(
            f"{t}," + ",".join(f"{x:.12f}" for x in row) + "\n" for t, row in zip(trajectory.t_ns, rows, strict=True)
        )
    )
    images.write_text("#timestamp [ns],filename\n" + "".join(f"{t},{t}.png\n" for t in trajectory.t_ns))
    return folder


def write_replay(folder: Path, trajectory: Trajectory, covariance: FloatArray) -> Path:
    """Writes an output folder of plumb-replay; `covariance` (9, 9) of position, velocity, attitude at every pose.

    The first row of states.csv is an image before initialisation, as plumb-replay writes it.
    """
    assert trajectory.v_m_s is not None
    folder.mkdir(parents=True, exist_ok=True)
    write_tum(folder / "trajectory.tum", trajectory)
    upper = [(i, j) for i in range(9) for j in range(i, 9)]
    values = ",".join(f"{covariance[i, j]:.17g}" for i, j in upper)
    states = ["t_ns,sequence,valid,reset_count,v_WI_x_m_s,v_WI_y_m_s,v_WI_z_m_s,state_hash"]
    states.append(f"{trajectory.t_ns[0] - NS_PER_S // RATE_HZ},0,0,0,nan,nan,nan,00000000000000ff")
    for t_ns, v in zip(trajectory.t_ns, trajectory.v_m_s, strict=True):
        states.append(f"{t_ns},1,1,0,{v[0]:.12f},{v[1]:.12f},{v[2]:.12f},00000000000000ff")
    covariances = ["t_ns," + ",".join(f"P_{ERRORS[i]}_{ERRORS[j]}" for i, j in upper)]
    covariances += [f"{t_ns},{values}" for t_ns in trajectory.t_ns]
    (folder / "states.csv").write_text("\n".join(states) + "\n")
    (folder / "covariance.csv").write_text("\n".join(covariances) + "\n")
    return folder
