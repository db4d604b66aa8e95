"""Small scenes for the tests of the simulator: seconds of flight, little to draw."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import yaml
from plumb_tools.sim import kept, prepare, scene_file, simulate
from plumb_tools.sim.simulate import Plan

#: A flat yard with a house and a box, flown over with a small camera.
SMALL: dict[str, Any] = {
    "scene": {
        "ground": {"extent_m": [-12, -12, 14, 12], "material": "linoleum", "contrast": 1.5, "map_m_per_px": 0.04},
        "objects": [
            {"kind": "building", "center_m": [5, 1], "size_m": [4, 3], "eaves_m": 1.2, "ridge_m": 2.0},
            {"kind": "box", "center_m": [1, -1], "size_m": [1.0, 1.2, 0.8], "yaw_deg": 20, "material": "concrete"},
        ],
    },
    "trajectory": {
        "start": {"position_m": [0, 0, 4], "velocity_m_s": [1, 0, 0]},
        "segments": [{"do": "hold", "duration_s": 1.2}],
    },
    "sensors": {
        "camera": {
            "width_px": 160,
            "height_px": 120,
            "rate_hz": 10,
            "lens": {"focal_px": [100, 101], "center_px": [80.3, 59.1]},
        }
    },
}


def changed(changes: dict[str, Any]) -> dict[str, Any]:
    """The small scene with values set by dotted keys; None takes a key away."""
    content = copy.deepcopy(SMALL)
    for dotted, value in changes.items():
        *path, last = dotted.split(".")
        node = content
        for key in path:
            node = node.setdefault(key, {})
        if value is None:
            node.pop(last, None)
        else:
            node[last] = value
    return content


def write(folder: Path, content: dict[str, Any]) -> Path:
    """A scene file."""
    path = folder / "scene.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def plan(folder: Path, changes: dict[str, Any] | None = None, seed: int = 0) -> Plan:
    """The small scene, changed, ready to be flown."""
    path = write(folder, changed(changes or {}))
    return prepare.plan(scene_file.read(path), path, seed, None, None, lambda *_: None)


def fly_yard(folder: Path, duration_s: float, with_log: bool = False) -> Path:
    """A flight over a longer yard, simulated into a folder of its own. The log is that of its devices' bytes."""
    changes = {
        "trajectory.segments": [{"do": "hold", "duration_s": duration_s}],
        "scene.ground.extent_m": [-12, -12, 24, 12],
        "sensors.camera.rate_hz": 20,
        "sensors.lrf.device": "can",
    }
    flown = plan(folder, changes, seed=1)
    flight = folder / "flight"
    simulate.fly(flown, flight, kept.origin(flown.scene, 1, None, None, with_log), report=lambda *_: None)
    return flight
