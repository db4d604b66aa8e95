"""Simulates a scene, flies it with and without range, and judges both. What is there already is not made again."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from plumb_tools.demo.process import StepFailed, Steps
from plumb_tools.demo.results import RANGE_VIO, VIO, Figures, Outcome
from plumb_tools.report.headline import cost_of, headline_of
from plumb_tools.report.run import NO_TRUTH, Run, read_run
from plumb_tools.score.estimate import never_started
from plumb_tools.sim import kept, scene_file
from plumb_tools.sim.kept import Origin
from plumb_tools.trajectory import ASL_TRUTH, InputError, read_truth

ROOT = Path(__file__).resolve().parents[3]
SIMULATE = ROOT / "tools" / "simulate"
REPLAY = ROOT / "build" / "flight" / "bin" / "plumb-replay"


@dataclass(frozen=True)
class Scene:
    """A scene file."""

    name: str
    file: Path

    @property
    def summary(self) -> str:
        """What the file says of itself, in a line."""
        return " ".join(scene_file.read(self.file).scene.summary.split())

    @property
    def shows(self) -> str:
        """What the file says is to be learnt from it."""
        return " ".join(scene_file.read(self.file).scene.shows.split())

    def flight(self, seed: int) -> Path:
        """Where its flights are, shared with tools/simulate."""
        return scene_file.flight_folder(self.file, seed)

    def origin(self, seed: int) -> Origin:
        """What a flight of it follows from."""
        return kept.origin(scene_file.read(self.file), seed, None, None, with_log=False)


@dataclass(frozen=True)
class Folders:
    """Where what is made of one flight lies."""

    base: Path

    def run(self, name: str) -> Path:
        """Output folder of a replay, by the replay's name."""
        return self.base / ("range" if name == RANGE_VIO else "vio")

    def log(self, step: str) -> Path:
        """Output of a tool."""
        return self.base / f"{step}.log"


def find_scene(name: str) -> Scene:
    """A scene that comes with Plumb by its name, or a scene file by its path; one that can be read."""
    file = scene_file.find(name)
    if not file.is_file():
        raise InputError(f"{name}: no such scene file; expected one, or one of {', '.join(scene_file.names())}")
    scene_file.read(file)
    return Scene(file.stem, file)


def build(steps: Steps, out: Path, target: str = "plumb-replay", preset: str = "flight") -> None:
    """Builds what flies, with its logs in `out`."""
    with steps.step("build") as step:
        step.run("configure", ["cmake", "--preset", preset, "-S", ROOT, "--log-level=WARNING"], out / "configure.log")
        command = ["cmake", "--build", ROOT / "build" / preset, "--target", target]
        step.run("build", [*command, "--parallel", str(os.cpu_count() or 1)], out / "build.log")


def built_replay() -> Path:
    """The flight software that flies. Throws StepFailed when it is not built."""
    if not REPLAY.exists():
        raise StepFailed("plumb-replay is not built: cmake --preset flight && cmake --build --preset flight")
    return REPLAY


def replay_summary(recording: Path) -> Any:
    """Flies a recording in the ASL layout once, and what plumb-replay sums up of it."""
    with tempfile.TemporaryDirectory() as out:
        command = [str(built_replay()), "--asl", str(recording), "--out", out]
        subprocess.run(command, check=True, capture_output=True)
        return read_json(Path(out) / "summary.json")


def replay_digest() -> str:
    """Digest of the flight software that flies."""
    return hashlib.sha256(built_replay().read_bytes()).hexdigest()[:16]


def read_json(path: Path) -> Any:
    """Contents of a JSON file; None when there is none to read."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def simulate(steps: Steps, scene: Scene, seed: int, log: Path) -> Path:
    """The folder of a scene's flight, simulated unless it is there."""
    title, flight = f"simulate {scene.name}, seed {seed}", scene.flight(seed)
    if kept.holds(flight, scene.origin(seed)):
        steps.note(title, 0.0, "there already")
        return flight
    with steps.step(title) as step:
        step.run(title, [SIMULATE, scene.file, "--no-log", "--out", flight, "--seed", str(seed)], log)
    return flight


def fly(steps: Steps, name: str, flight: Path, folders: Folders) -> None:
    """Flies a flight twice, with and without range, side by side where there are two processors."""
    program = built_replay()
    with steps.step(f"fly {name}") as step, ThreadPoolExecutor(min(2, os.cpu_count() or 1)) as workers:

        def replay(run: str) -> None:
            shutil.rmtree(folders.run(run), ignore_errors=True)
            options = ["--no-range"] if run == VIO else []
            command = [program, "--asl", flight, "--out", folders.run(run), *options]
            step.run(f"fly {name}, {run}", command, folders.log(f"fly-{run}"))

        flown = [workers.submit(replay, run) for run in (RANGE_VIO, VIO)]
        try:
            for done in flown:
                done.result()
        except BaseException:
            step.stop()  # else leaving the pool waits for the other replay
            raise


def read_runs(folders: Folders) -> tuple[dict[str, Run], dict[str, str]]:
    """The replays that gave a solution, and why the others did not, by name."""
    runs: dict[str, Run] = {}
    reasons: dict[str, str] = {}
    for name in (RANGE_VIO, VIO):
        if (reason := never_started(folders.run(name))) is not None:
            reasons[name] = reason
            continue
        try:
            runs[name] = read_run(folders.run(name), name)
        except InputError as error:
            reasons[name] = f"no solution: {error}"
    return runs, reasons


def judge(scene: str, seed: int | None, flight: Path, folders: Folders) -> Outcome:
    """Figures of both replays against the truth."""
    runs, reasons = read_runs(folders)
    figures: dict[str, Figures | None] = {RANGE_VIO: None, VIO: None}
    if not (flight / ASL_TRUTH).exists():
        untold = {name: f"{NO_TRUTH}: {flight / ASL_TRUTH} is missing, there is nothing to score against" for name in runs}
        return Outcome(scene, seed, None, None, reasons | untold)
    truth = read_truth(flight)
    for name, run in runs.items():
        try:
            headline, _ = headline_of(truth, run)
        except InputError as error:
            reasons[name] = f"no solution: {error}"
            continue
        figures[name] = Figures(headline, cost_of(run))
    return Outcome(scene, seed, figures[RANGE_VIO], figures[VIO], reasons)
