"""From a scene file to a plan that can be flown: world built, everything checked."""

from __future__ import annotations

from pathlib import Path

from plumb_tools.sim import checks, world
from plumb_tools.sim.scene import Scene
from plumb_tools.sim.simulate import Plan, Report
from plumb_tools.trajectory import InputError


def plan(scene: Scene, path: Path, seed: int, duration_s: float | None, textures: Path | None, report: Report) -> Plan:
    """Builds the world of a scene and checks that the flight fits into it. `duration_s` cuts the flight short."""
    checks.check_values(scene, path)
    pictures = world.find_pictures(textures)
    report("building the world", 0, 0)
    geometry = world.shape(scene)
    checks.check_path(scene, geometry.caster, seed, path)
    model = world.paint(scene, geometry, pictures)
    length_s = scene.trajectory.length_s
    if duration_s is not None:
        length_s = min(length_s, duration_s)
    least_s = 2.0 / min(scene.sensors.camera.rate_hz, scene.sensors.lrf.rate_hz)
    if length_s < least_s:
        raise InputError(f"{path}: the flight is {length_s:g} s long; expected at least {least_s:g} s, two images")
    return Plan(scene, model, geometry.caster, seed, length_s)
