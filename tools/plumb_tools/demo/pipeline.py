"""Simulates a scene, flies it with and without range, and judges both. What is there already is not made again."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from plumb_tools.demo.process import StepFailed, Steps
from plumb_tools.demo.results import RANGE_VIO, VIO, Figures, Outcome
from plumb_tools.report.headline import cost_of, headline_of
from plumb_tools.report.run import Run, read_run
from plumb_tools.trajectory import InputError, read_truth

ROOT = Path(__file__).resolve().parents[3]
SCENES = ROOT / "tools" / "scenes"
SIMULATE = ROOT / "tools" / "simulate"
SIMULATOR_SOURCES = ROOT / "tools" / "plumb_tools" / "sim"
REPLAY = ROOT / "build" / "flight" / "bin" / "plumb-replay"

#: Written last into a flight folder: what was simulated. A flight without it was interrupted.
STAMP_FILE = "simulated.json"


@dataclass(frozen=True)
class Scene:
    """A scene file."""

    name: str
    file: Path

    @property
    def summary(self) -> str:
        """What the file says of itself."""
        try:
            content = yaml.safe_load(self.file.read_text(encoding="utf-8"))
        except (OSError, yaml.YAMLError):
            return ""
        section = content.get("scene") if isinstance(content, dict) else None
        return " ".join(str(section.get("summary", "")).split()) if isinstance(section, dict) else ""


@dataclass(frozen=True)
class Folders:
    """Where one flight and what is made of it lies."""

    base: Path

    @property
    def flight(self) -> Path:
        """The flight in ASL layout."""
        return self.base / "flight"

    def run(self, name: str) -> Path:
        """Output folder of a replay, by the replay's name."""
        return self.base / ("range" if name == RANGE_VIO else "vio")

    def log(self, step: str) -> Path:
        """Output of a tool."""
        return self.base / f"{step}.log"


def known_scenes() -> list[str]:
    """Names of the scenes that come with Plumb."""
    return sorted(path.stem for path in SCENES.glob("*.yaml"))


def find_scene(name: str) -> Scene:
    """A scene by its name, or a scene file by its path."""
    for file in (SCENES / f"{name}.yaml", Path(name)):
        if file.is_file():
            return Scene(file.stem, file)
    raise InputError(f"{name}: no such scene; expected a scene file or one of {', '.join(known_scenes()) or 'none'}")


def digest(*files: Path) -> str:
    """Hash over the contents of files."""
    whole = hashlib.sha256()
    for file in files:
        whole.update(hashlib.sha256(file.read_bytes()).digest())
    return whole.hexdigest()[:16]


def stamp(scene: Scene, seed: int) -> dict[str, Any]:
    """What determines a simulated flight: scene file, seed and simulator."""
    found = SIMULATOR_SOURCES.rglob("*")
    sources = sorted(path for path in found if path.is_file() and "__pycache__" not in path.parts)
    return {"scene": scene.name, "scene_file": digest(scene.file), "simulator": digest(*sources), "seed": seed}


def read_json(path: Path) -> Any:
    """Contents of a JSON file; None when there is none to read."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def write_json(path: Path, tree: Any) -> None:
    """Writes a JSON file that is there as a whole or not at all."""
    unfinished = path.with_suffix(".part")
    unfinished.write_text(json.dumps(tree, indent=2) + "\n", encoding="utf-8")
    unfinished.replace(path)


def simulate(steps: Steps, scene: Scene, seed: int, folders: Folders) -> None:
    """Simulates a scene unless this very flight is there."""
    title = f"simulate {scene.name}, seed {seed}"
    wanted = stamp(scene, seed)
    if read_json(folders.flight / STAMP_FILE) == wanted:
        steps.note(title, 0.0, "there already")
        return
    if not SIMULATE.exists():
        raise StepFailed("tools/simulate is not in this checkout; tools/demo --flight DIR flies a recording instead")
    shutil.rmtree(folders.flight, ignore_errors=True)
    with steps.step(title) as step:
        command = [SIMULATE, scene.file, "--no-log", "--out", folders.flight, "--seed", str(seed)]
        step.run(title, command, folders.log("simulate"))
    write_json(folders.flight / STAMP_FILE, wanted)


def fly(steps: Steps, name: str, flight: Path, folders: Folders) -> None:
    """Flies a flight twice, with and without range, side by side where there are two processors."""
    if not REPLAY.exists():
        raise StepFailed("plumb-replay is not built: cmake --preset flight && cmake --build --preset flight")
    with steps.step(f"fly {name}") as step, ThreadPoolExecutor(min(2, os.cpu_count() or 1)) as workers:

        def replay(run: str) -> None:
            shutil.rmtree(folders.run(run), ignore_errors=True)
            options = ["--no-range"] if run == VIO else []
            command = [REPLAY, "--asl", flight, "--out", folders.run(run), *options]
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
        try:
            runs[name] = read_run(folders.run(name), name)
        except InputError as error:
            reasons[name] = str(error)
    return runs, reasons


def judge(scene: str, seed: int | None, flight: Path, folders: Folders) -> Outcome:
    """Figures of both replays against the truth."""
    truth = read_truth(flight)
    runs, reasons = read_runs(folders)
    figures: dict[str, Figures | None] = {RANGE_VIO: None, VIO: None}
    for name, run in runs.items():
        try:
            headline, _ = headline_of(truth, run)
        except InputError as error:
            reasons[name] = str(error)
            continue
        figures[name] = Figures(headline, cost_of(run))
    return Outcome(scene, seed, figures[RANGE_VIO], figures[VIO], reasons)
