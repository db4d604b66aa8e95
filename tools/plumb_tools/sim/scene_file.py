"""Reads scene files: strictly, and with everything that is wrong in one message."""

from __future__ import annotations

from pathlib import Path

from plumb_tools.sim.scene import Scene
from plumb_tools.sim.schema import Faults, read_section
from plumb_tools.trajectory import InputError
from plumb_tools.yaml_text import read_yaml

#: The scenes that come with the project.
SCENES = Path(__file__).resolve().parents[2] / "scenes"
#: Where flights go when nothing else is said, shared by all commands.
FLIGHTS = Path(__file__).resolve().parents[3] / "build" / "flights"


class SceneFaults(InputError):
    """What is wrong with a scene file, one line each."""

    def __init__(self, path: Path, faults: Faults) -> None:
        """Collects the faults under the file's name."""
        super().__init__("\n".join(f"{path}: {fault}" for fault in faults.items))


def names() -> list[str]:
    """The scenes that come with the project."""
    return sorted(path.stem for path in SCENES.glob("*.yaml"))


def find(name: str) -> Path:
    """The file of a scene, given by name or by path."""
    path = Path(name)
    if path.suffix in (".yaml", ".yml"):
        return path
    built_in = SCENES / f"{name}.yaml"
    if not built_in.exists():
        raise InputError(f"{name}: no such scene; expected one of {', '.join(names())}, or a .yaml file")
    return built_in


def flight_folder(path: Path, seed: int) -> Path:
    """Where a flight of a scene file goes when nothing else is said."""
    return FLIGHTS / f"{path.stem}-{seed}"


def read(path: Path) -> Scene:
    """A scene with all defaults filled in; `SceneFaults` names every key that is wrong."""
    content = read_yaml(path)
    faults = Faults()
    scene = read_section(Scene, content, "", faults)
    if faults or not isinstance(scene, Scene):
        raise SceneFaults(path, faults)
    return scene
