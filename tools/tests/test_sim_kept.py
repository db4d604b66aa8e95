"""What makes a flight another one, what does not, and that a folder never holds half of one."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from plumb_tools import heartbeat
from plumb_tools.sim import __main__ as command
from plumb_tools.sim import kept, scene_file
from plumb_tools.sim.kept import Origin
from plumb_tools.trajectory import InputError
from sim_scenes import changed, write

TOOLS = Path(__file__).resolve().parents[1]


def _origin(folder: Path, changes: dict[str, Any], seed: int = 0, **more: Any) -> Origin:
    options = {"duration_s": None, "textures": None, "with_log": False} | more
    return kept.origin(scene_file.read(write(folder, changed(changes))), seed, **options)


def _pictures(folder: Path, name: str, grey: int) -> Path:
    folder.mkdir(exist_ok=True)
    cv2.imwrite(str(folder / name), np.full((64, 64), grey, np.uint8))
    return folder


def test_what_changes_a_flight_changes_its_origin(tmp_path: Path) -> None:
    origins = [
        _origin(tmp_path, {}),
        _origin(tmp_path, {}, seed=1),
        _origin(tmp_path, {}, duration_s=0.7),
        _origin(tmp_path, {}, with_log=True),
        _origin(tmp_path, {"sensors.lrf.noise_m": 0.03}),
        _origin(tmp_path, {}, textures=_pictures(tmp_path / "a", "grass.png", 90)),
        _origin(tmp_path, {}, textures=_pictures(tmp_path / "b", "grass.png", 91)),
        _origin(tmp_path, {}, textures=_pictures(tmp_path / "c", "other.png", 90)),
    ]
    assert len(set(origins)) == len(origins)


def test_texts_and_written_out_defaults_leave_the_origin(tmp_path: Path) -> None:
    texts = {"scene.summary": "another", "scene.shows": "something else", "sensors.lrf.noise_m": 0.025}
    assert _origin(tmp_path, texts) == _origin(tmp_path, {})


def _sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str, str], tuple[str, str | None]]:
    """A stand-in for the simulator's sources: writes one of them, and tells the digests."""
    (tmp_path / "sim/devices").mkdir(parents=True)
    monkeypatch.setattr(kept, "SOURCES", tmp_path / "sim")

    def digests(name: str, text: str) -> tuple[str, str | None]:
        (tmp_path / "sim" / name).write_text(text)
        kept._simulator_digest.cache_clear()
        kept._logging_digest.cache_clear()
        made = _origin(tmp_path, {}, with_log=True)
        return made.simulator, made.log

    return digests


def test_programs_count_and_their_comments_do_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    digests = _sources(tmp_path, monkeypatch)
    first = digests("lrf.py", "noise = 2.0\n")
    assert digests("lrf.py", "# in metres\nnoise   = 2.0\n") == first
    other = digests("lrf.py", "noise = 3.0\n")
    assert other[0] != first[0] and other[1] == first[1]
    assert digests("checks.py", "limit = 1\n") == other
    log = digests("devices/log.py", "size = 1\n")
    assert log[0] == other[0] and log[1] != other[1]
    kept._simulator_digest.cache_clear()
    kept._logging_digest.cache_clear()


def test_a_log_more_than_wanted_does_no_harm(tmp_path: Path) -> None:
    with_log, without = (_origin(tmp_path, {}, with_log=wanted) for wanted in (True, False))
    kept.mark(tmp_path, with_log)
    assert kept.holds(tmp_path, with_log) and kept.holds(tmp_path, without)
    kept.mark(tmp_path, without)
    assert not kept.holds(tmp_path, with_log) and kept.holds(tmp_path, without)
    assert not kept.holds(tmp_path, _origin(tmp_path, {}, seed=1))


def _flight(folder: Path, made_from: Origin) -> Path:
    """A folder with an image and two tables, marked."""
    (folder / "mav0/cam0/data").mkdir(parents=True)
    (folder / "mav0/cam0/data/1.png").write_bytes(bytes(100))
    (folder / "mav0/cam0/data.csv").write_text("1,1.png\n")
    (folder / "scene.yaml").write_text("scene: {}\n")
    kept.mark(folder, made_from)
    return folder


DAMAGE: list[tuple[str, bytes | None, str]] = [
    ("mav0/cam0/data/1.png", bytes(99), "1.png has 99 bytes, 100 were written"),
    ("mav0/cam0/data/1.png", None, "1.png is missing"),
    ("mav0/cam0/data.csv", b"", "data.csv has 0 bytes, 8 were written"),
    ("mav0/cam0/data.csv", b"2,1.png\n", "a table is not the one"),
    ("scene.yaml", b"scene: []\n", "a table is not the one"),
]


@pytest.mark.parametrize(("name", "content", "told"), DAMAGE)
def test_a_flight_whose_files_are_not_as_written_is_not_whole(
    name: str, content: bytes | None, told: str, tmp_path: Path
) -> None:
    made_from = _origin(tmp_path, {})
    flight = _flight(tmp_path / "flight", made_from)
    (flight / "report.html").write_text("came later")
    assert kept.holds(flight, made_from) and kept.damage(flight, made_from) is None
    (flight / name).unlink()
    if content is not None:
        (flight / name).write_bytes(content)
    assert not kept.holds(flight, made_from)
    assert told in str(kept.damage(flight, made_from))
    assert kept.damage(flight, _origin(tmp_path, {}, seed=1)) is None


def test_a_flight_from_before_sizes_were_noted_is_used_again(tmp_path: Path) -> None:
    made_from = _origin(tmp_path, {})
    (tmp_path / kept.FILE).write_text(json.dumps(vars(made_from)))
    assert kept.holds(tmp_path, made_from)


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"seed": 0}', '"x"'])
def test_a_folder_with_a_damaged_note_holds_nothing(text: str, tmp_path: Path) -> None:
    (tmp_path / kept.FILE).write_text(text)
    assert not kept.holds(tmp_path, _origin(tmp_path, {}))


def test_the_command_simulates_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [str(write(tmp_path, changed({}))), "--out", str(tmp_path / "flight"), "--duration", "0.3", "--no-log"]
    assert command.main(arguments) == 0
    before = (tmp_path / "flight").stat()
    assert command.main(arguments) == 0
    assert "there already" in capsys.readouterr().out
    assert (tmp_path / "flight").stat().st_ino == before.st_ino
    assert command.main([*arguments, "--seed", "1"]) == 0
    assert (tmp_path / "flight").stat().st_ino != before.st_ino


def test_steps_that_take_long_show_that_they_go_on(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(heartbeat, "PERIOD_S", 0.1)
    with command._Bar() as bar:
        bar("building the world", 0, 0)
        time.sleep(0.5)
        told = capsys.readouterr().err.splitlines()
        for done in range(20):
            bar("taking images", 5 * done, 100)
            time.sleep(0.01)
    assert told[0] == "simulate: building the world"
    assert len(told) >= 3 and all(line.startswith("simulate: building the world, ") for line in told[1:])
    assert not any("since the start" in line for line in capsys.readouterr().err.splitlines())


def test_what_a_killed_simulation_left_is_cleared_away(tmp_path: Path) -> None:
    left = tmp_path / "flight.partial/mav0"
    left.mkdir(parents=True)
    (left.parent / "world.pickle").write_text("half")
    with kept.whole_or_nothing(tmp_path / "flight") as folder:
        assert list(folder.iterdir()) == []
    assert [path.name for path in tmp_path.iterdir()] == ["flight"]


def test_a_flight_that_is_half_removed_does_not_look_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flight = tmp_path / "flight"
    (flight / "mav0").mkdir(parents=True)
    made_from = _origin(tmp_path, {})
    kept.mark(flight, made_from)
    assert kept.holds(flight, made_from)

    def interrupted(folder: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(kept.shutil, "rmtree", interrupted)
    with pytest.raises(KeyboardInterrupt):
        kept.remove(flight)
    assert not kept.holds(flight, made_from)


def test_two_simulations_into_one_folder_do_not_meet(tmp_path: Path) -> None:
    with kept.whole_or_nothing(tmp_path / "flight") as folder:
        (folder / "image").write_text("first")
        with (
            pytest.raises(InputError, match="another simulation is writing it"),
            kept.whole_or_nothing(tmp_path / "flight"),
        ):
            raise AssertionError("both write")
    assert (tmp_path / "flight/image").read_text() == "first"


def test_a_disk_that_takes_no_more_leaves_nothing(tmp_path: Path) -> None:
    """The kernel refuses to write more than 4 kB into a file, as it refuses on a full disk."""
    scene = write(tmp_path, changed({}))
    done = subprocess.run(
        [sys.executable, "-m", "plumb_tools.sim", str(scene), "--out", str(tmp_path / "flight"), "--duration", "0.3"],
        env={"PYTHONPATH": str(TOOLS), "PYTHONDONTWRITEBYTECODE": "1"},  # half a .pyc would stay
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 2
    assert "nothing is left behind" in done.stderr and "Traceback" not in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scene.yaml"]
