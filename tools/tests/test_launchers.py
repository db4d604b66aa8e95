"""The commands in tools/ bring their Python environment up to date before they use it."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

TOOLS = Path(__file__).resolve().parents[1]


def _program(path: Path, script: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/usr/bin/env bash\n{script}\n")
    path.chmod(0o755)


LAUNCHERS = ["ablation", "command", "demo", "import", "interface", "mavlink_bridge", "report", "score", "simulate"]


@pytest.mark.parametrize("name", LAUNCHERS)
def test_a_stale_environment_is_renewed_first(name: str, tmp_path: Path) -> None:
    """The environment that is there ends every program with an error; the stand-in for the set-up replaces it."""
    (tmp_path / "tools").mkdir()
    shutil.copy(TOOLS / name, tmp_path / "tools" / name)
    python = tmp_path / "build/venv/bin/python"
    _program(python, "exit 70")
    renew = f"printf '#!/bin/sh\\necho ran \"$@\"\\n' >'{python}'; echo set up"
    _program(tmp_path / "tools/setup", renew)
    done = subprocess.run([tmp_path / "tools" / name, "--out", "x"], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stdout.startswith("ran -m plumb_tools.") and done.stdout.rstrip().endswith("--out x")
    assert done.stderr == "set up\n"


@pytest.mark.parametrize("name", ["endurance", "faults", "package", "target"])
def test_what_builds_first_helps_without_building(name: str, tmp_path: Path) -> None:
    (tmp_path / "tools").mkdir()
    shutil.copy(TOOLS / name, tmp_path / "tools" / name)
    for program in ("tools/setup", "bin/cmake"):
        _program(tmp_path / program, "exit 70")
    path = {"PATH": f"{tmp_path / 'bin'}:/usr/bin:/bin"}
    done = subprocess.run([tmp_path / "tools" / name, "--help"], env=path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(f"Usage: tools/{name} ")


def test_a_long_set_up_shows_that_it_goes_on(tmp_path: Path) -> None:
    """With a stand-in for sleep whose ten seconds pass at once; nothing is told once the set-up has ended."""
    (tmp_path / "tools").mkdir()
    shutil.copy(TOOLS / "demo", tmp_path / "tools/demo")
    _program(tmp_path / "bin/sleep", '[[ $1 == 10 ]] || exit 1; exec /bin/sleep 0.2')
    _program(tmp_path / "tools/setup", "/bin/sleep 1; echo ready")
    _program(tmp_path / "build/venv/bin/python", "/bin/sleep 0.5; echo ran >&2")
    path = {"PATH": f"{tmp_path / 'bin'}:/usr/bin:/bin"}
    run = {"capture_output": True, "text": True, "timeout": 30, "check": False}
    done = subprocess.run([tmp_path / "tools/demo"], env=path, **run)
    assert done.returncode == 0
    before, after = done.stderr.split("ready\n")
    assert len(before.splitlines()) >= 2
    assert all(line.startswith("demo: still setting up, ") for line in before.splitlines())
    assert after == "ran\n"


def test_a_failed_set_up_runs_nothing(tmp_path: Path) -> None:
    (tmp_path / "tools").mkdir()
    shutil.copy(TOOLS / "score", tmp_path / "tools/score")
    _program(tmp_path / "build/venv/bin/python", "echo ran")
    _program(tmp_path / "tools/setup", "exit 1")
    done = subprocess.run([tmp_path / "tools/score"], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and done.stdout == ""
