"""Bad input ends with exit code 2 and a message that tells what is wrong where."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from plumb_tools.score.__main__ import main
from synthetic import flight, tum_lines, write_asl, write_replay, write_tum

Lines = list[str]


def fields(line: str, **changes: str) -> str:
    """A TUM line with some fields replaced, given as f<index>."""
    parts = line.split()
    for key, value in changes.items():
        parts[int(key[1:])] = value
    return " ".join(parts)


def refused(capsys: pytest.CaptureFixture[str], *arguments: Path | str) -> str:
    """Runs the scorer, which must refuse; returns its message."""
    assert main([str(argument) for argument in arguments]) == 2
    output = capsys.readouterr()
    assert "Traceback" not in output.err
    assert output.err.startswith("score: ")
    return output.err


BAD_LINES: list[tuple[str, Callable[[Lines], Lines], str]] = [
    ("empty", lambda _: [], "holds no data line"),
    ("few fields", lambda x: [*x[:4], "1.0 2.0 3.0", *x[5:]], ":5: 3 fields, TUM has 8"),
    ("many fields", lambda x: [*x[:4], x[4] + " 0", *x[5:]], ":5: 9 fields"),
    ("not a number", lambda x: [*x[:6], fields(x[6], f2="two")], ":7: 'two' is not a number"),
    ("not a stamp", lambda x: [fields(x[0], f0="now"), *x[1:]], ":1: 'now' is not a stamp"),
    ("infinite stamp", lambda x: [fields(x[0], f0="inf"), *x[1:]], ":1: 'inf' is not a stamp"),
    ("nan", lambda x: [*x[:2], fields(x[2], f1="nan"), *x[3:]], ":3: 'nan' is not finite"),
    ("stamp repeated", lambda x: [*x[:9], x[8], *x[9:]], ":10: stamp"),
    ("stamps reversed", lambda x: x[::-1], ":2: stamp"),
    ("quaternion not unit", lambda x: [*x[:3], fields(x[3], f7="1.5"), *x[4:]], ":4: quaternion has length"),
    ("quaternion zero", lambda x: ["1 0 0 0 0 0 0 0"], ":1: quaternion has length 0.000000"),
    ("nanoseconds", lambda x: [x[0].replace(".", "", 1), *x[1:]], "are seconds and nanoseconds mixed up?"),
    ("csv", lambda x: [line.replace(" ", ",") for line in x], ":1: looks like csv"),
    ("too few poses", lambda x: x[:9], "est.tum: 9 of 9 poses can be compared with "),
]


@pytest.mark.parametrize(("change", "message"), [row[1:] for row in BAD_LINES], ids=[row[0] for row in BAD_LINES])
def test_bad_estimate(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: Callable[[Lines], Lines], message: str
) -> None:
    truth = write_tum(tmp_path / "truth.tum", flight())
    est = tmp_path / "est.tum"
    est.write_text("\n".join(change(tum_lines(flight()))) + "\n")
    error = refused(capsys, truth, est)
    assert message in error
    assert str(est) in error


def test_missing_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = write_tum(tmp_path / "good.tum", flight())
    assert "no such file" in refused(capsys, tmp_path / "absent.tum", good)
    assert "no such file" in refused(capsys, good, tmp_path / "absent.tum")
    assert "not an ASL folder with truth" in refused(capsys, tmp_path, good)
    assert "trajectory.tum is missing" in refused(capsys, good, tmp_path)


def test_binary_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = write_tum(tmp_path / "good.tum", flight())
    binary = tmp_path / "binary.tum"
    binary.write_bytes(bytes([0xFF, 0xFE, 0x00, 0x81]))
    assert "cannot be read as text" in refused(capsys, good, binary)


def test_different_time_bases_print_both_spans(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = write_tum(tmp_path / "truth.tum", flight())
    est = tmp_path / "est.tum"
    lines = [fields(line, f0=f"{index / 20:.3f}") for index, line in enumerate(tum_lines(flight()))]
    est.write_text("\n".join(lines))
    error = refused(capsys, truth, est)
    assert "do not overlap in time" in error
    assert "1403636584.763556 to" in error
    assert "0.000000 to 19.950000 s" in error


def test_window_without_poses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = write_tum(tmp_path / "good.tum", flight())
    error = refused(capsys, good, good, "--start", "100")
    assert f"{good}: 0 of 400 poses" in error and "--start" in error and "expected at least 10 poses" in error
    assert "--end 1 is not after --start 2" in refused(capsys, good, good, "--start", "2", "--end", "1")


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("states.csv", "v_WI_y_m_s", "speed", "missing column(s) v_WI_y_m_s; it has t_ns"),
        ("states.csv", ",1,1,0,", ",1,1,0,9,", ":3: 9 fields, the header names 8"),
        ("states.csv", "1403636585013555584", "14036365850135.5", ":8: '14036365850135.5' is not a stamp"),
        ("covariance.csv", "P_ax_ay", "P_oops", "missing column(s) P_ax_ay"),
        (
            "covariance.csv",
            "1403636584763555584",
            "1403636584763500000",
            "no row for 1 stamps of trajectory.tum, the first of them 1403636584.763555584 s",
        ),
        ("covariance.csv", "t_ns,", "1,", "missing column(s) t_ns"),
    ],
)
def test_bad_replay_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, old: str, new: str, message: str
) -> None:
    truth = write_tum(tmp_path / "truth.tum", flight())
    folder = write_replay(tmp_path / "out", flight(), np.eye(9))
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new))
    assert message in refused(capsys, truth, folder)


@pytest.mark.parametrize("name", ["trajectory.tum", "states.csv", "covariance.csv"])
def test_incomplete_replay_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    truth = write_tum(tmp_path / "truth.tum", flight())
    folder = write_replay(tmp_path / "out", flight(), np.eye(9))
    (folder / name).unlink()
    assert f"{name} is missing" in refused(capsys, truth, folder)


def test_asl_truth_without_columns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = write_asl(tmp_path / "asl", flight())
    truth = folder / "mav0/state_groundtruth_estimate0/data.csv"
    good = write_tum(tmp_path / "good.tum", flight())
    text = truth.read_text()
    truth.write_text(text.replace("q_RS_w", "q"))
    assert "missing column(s) q_RS_w" in refused(capsys, folder, good)
    truth.write_text(text.split("\n", 1)[1])
    assert ":1: the first line must name the columns" in refused(capsys, truth, good)


@pytest.mark.parametrize(
    "option", [["--max-time-diff", "0"], ["--align", "9dof"], ["--start", "nan"], ["--plot", "a.xyz"]]
)
def test_bad_options(tmp_path: Path, capsys: pytest.CaptureFixture[str], option: list[str]) -> None:
    good = str(write_tum(tmp_path / "good.tum", flight()))
    with pytest.raises(SystemExit) as stop:
        main([good, good, *option])
    assert stop.value.code == 2
    assert option[0] in capsys.readouterr().err


def test_result_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = write_tum(tmp_path / "good.tum", flight())
    for option in ("--json", "--plot"):
        target = good / "a.png"
        told = f"{option} {target}: cannot be written, {good}: is not a folder"
        assert told in refused(capsys, tmp_path / "absent.tum", good, option, target)
