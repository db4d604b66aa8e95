"""Puts a scene's world together: triangles, textures and the painted ground. The same for every seed of a scene."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from plumb_tools.sim import buildings, nature, objects
from plumb_tools.sim.ground_map import GroundMap, GroundPainter
from plumb_tools.sim.materials import INDEX, MATERIALS
from plumb_tools.sim.mesh import Mesh, join
from plumb_tools.sim.raycast import RayCaster
from plumb_tools.sim.scene import Light, Scene
from plumb_tools.sim.streams import Generator, stream
from plumb_tools.sim.textures import PICTURES, TextureSet, texture_set
from plumb_tools.trajectory import FloatArray, InputError

_WORLD_SEED = 1


@dataclass(frozen=True)
class WorldModel:
    """All that renderer and ray caster need."""

    mesh: Mesh
    ground: GroundMap
    textures: TextureSet
    light: Light

    @property
    def sun(self) -> FloatArray:
        """Unit vector towards the sun in W."""
        return sun_direction(self.light)


def sun_direction(light: Light) -> FloatArray:
    """Unit vector towards the sun in W; azimuth counts from x towards y."""
    elevation, azimuth = np.radians(light.sun_elevation_deg), np.radians(light.sun_azimuth_deg)
    return np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])


@dataclass(frozen=True)
class UserPictures:
    """Pictures of --textures: named after a material they replace its texture, any others are orthophotos."""

    materials: dict[str, Path]
    orthophotos: list[Path]


def find_pictures(folder: Path | None) -> UserPictures:
    """What a folder of pictures offers."""
    if folder is None:
        return UserPictures({}, [])
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; --textures expects one with pictures ({' '.join(PICTURES)})")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in PICTURES)
    if not paths:
        raise InputError(f"{folder}: holds no picture; --textures expects {' '.join(PICTURES)}")
    materials = {path.stem: path for path in paths if path.stem in MATERIALS}
    return UserPictures(materials, [path for path in paths if path.stem not in MATERIALS])


def _random(index: int, item: object) -> Generator:
    """The stream of one object: changing one leaves the others as they are."""
    return stream(_WORLD_SEED, type(item).__name__, index + zlib.crc32(repr(item).encode()))


def _solids(scene: Scene, height_at: nature.HeightAt) -> list[Mesh]:
    parts: list[Mesh] = []
    start = scene.trajectory.start.position_m[:2]
    for index, item in enumerate(scene.scene.objects):
        random = _random(index, item)
        match item:
            case objects.Box():
                parts.append(buildings.box(item))
            case objects.BoxLine():
                parts += [buildings.box(box) for box in buildings.box_line(item, random)]
            case objects.Steps():
                parts += [buildings.box(box) for box in buildings.steps(item, random)]
            case objects.Building():
                parts.append(buildings.building(item, random))
            case objects.Town():
                parts += [buildings.building(house, random) for house in buildings.town(item, random)]
            case objects.StreetLight():
                parts.append(buildings.street_light(item))
            case objects.Water():
                parts.append(nature.pond(item, random))
            case objects.Trees():
                parts.append(nature.trees(item, height_at, random))
            case objects.Rocks():
                parts.append(nature.rocks(item, height_at, (start[0], start[1]), random))
    return parts


@dataclass(frozen=True)
class Geometry:
    """The shapes of a world, without their looks."""

    mesh: Mesh
    caster: RayCaster
    height_at: nature.HeightAt  #: of the bare ground


def shape(scene: Scene) -> Geometry:
    """The shapes of a scene."""
    start = scene.trajectory.start.position_m
    terrain = nature.terrain(scene.scene.ground, (start[0], start[1]), stream(_WORLD_SEED, "terrain"))
    mesh = join([terrain.mesh(), *_solids(scene, terrain.at)])
    return Geometry(mesh, RayCaster(mesh), terrain.at)


def paint(scene: Scene, geometry: Geometry, pictures: UserPictures) -> WorldModel:
    """The world of a scene: its shapes with their looks."""
    painter = GroundPainter(scene.scene.ground, stream(_WORLD_SEED, "ground"))
    if pictures.orthophotos:
        painter.orthophotos(pictures.orthophotos)
    for index, item in enumerate(scene.scene.objects):
        if isinstance(item, objects.Road):
            painter.road(item, _random(index, item))
        elif isinstance(item, objects.Patch):
            painter.patch(item)
    sun = sun_direction(scene.scene.light)
    painted = painter.finish(lambda points: geometry.caster.occluded(points, sun), geometry.height_at)
    numbers = np.r_[np.unique(painted.material), np.unique(geometry.mesh.surface[:, 0])]
    used = {name for name, number in INDEX.items() if number in numbers}
    return WorldModel(geometry.mesh, painted, texture_set(used, pictures.materials), scene.scene.light)
