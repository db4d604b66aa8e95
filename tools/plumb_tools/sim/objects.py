"""What can stand on or be painted on the ground of a scene: the items of `scene.objects`.

Lengths in metres in the world frame, z up; `material` names a texture of `materials.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from plumb_tools.sim.materials import MATERIALS
from plumb_tools.sim.schema import Choice, Items, Points, Real, Vector, Whole, key

#: Nothing in a scene is further away than this; larger numbers are slips of the pen.
FURTHEST_M = 2000.0

POSITION = Real("m", low=-FURTHEST_M, high=FURTHEST_M)
SIZE = Real("m", above=0.0, high=FURTHEST_M)
HEIGHT = Real("m", above=0.0, high=200.0)
ANGLE = Real("deg", low=-360.0, high=360.0)
MATERIAL = Choice(tuple(MATERIALS))
#: Reflected share of the light when the texture is at its mean.
ALBEDO = Real("", above=0.0, high=1.0)
AREA = Vector(4, POSITION)


@dataclass(frozen=True, kw_only=True)
class Tagged:
    """An item that names its kind in the file."""

    TAG_KEY: ClassVar[str] = "kind"
    TAG: ClassVar[str] = ""


@dataclass(frozen=True, kw_only=True)
class Box(Tagged):
    """An upright block."""

    TAG = "box"
    center_m: tuple[float, float] = key(Vector(2, POSITION))
    size_m: tuple[float, float, float] = key(Vector(3, SIZE))
    yaw_deg: float = key(ANGLE, 0.0)
    base_m: float = key(Real("m", low=0.0, high=200.0), 0.0)
    material: str = key(MATERIAL, "cardboard")
    albedo: float = key(ALBEDO, 0.45)


@dataclass(frozen=True, kw_only=True)
class BoxLine(Tagged):
    """Boxes of different heights side by side in a line, as the paper's indoor test."""

    TAG = "box_line"
    from_m: tuple[float, float] = key(Vector(2, POSITION))
    to_m: tuple[float, float] = key(Vector(2, POSITION))
    width_m: float = key(SIZE, 0.6)
    length_m: tuple[float, float] = key(Vector(2, SIZE), (0.3, 0.7))
    height_m: tuple[float, float] = key(Vector(2, HEIGHT), (0.1, 0.6))
    gap_m: tuple[float, float] = key(Vector(2, Real("m", low=0.0, high=100.0)), (0.0, 0.25))
    material: str = key(MATERIAL, "cardboard")


@dataclass(frozen=True, kw_only=True)
class Building(Tagged):
    """A house with a flat or pitched roof."""

    TAG = "building"
    center_m: tuple[float, float] = key(Vector(2, POSITION))
    size_m: tuple[float, float] = key(Vector(2, SIZE))
    eaves_m: float = key(HEIGHT, 3.0)
    ridge_m: float = key(HEIGHT, 5.5)
    roof: str = key(Choice(("flat", "gable", "hip")), "gable")
    yaw_deg: float = key(ANGLE, 0.0)


@dataclass(frozen=True, kw_only=True)
class Town(Tagged):
    """Rows of buildings with flat and pitched roofs and gaps between them, filling a rectangle x0 y0 x1 y1."""

    TAG = "town"
    area_m: tuple[float, float, float, float] = key(AREA)
    plot_m: tuple[float, float] = key(Vector(2, SIZE), (14.0, 12.0))
    gap_m: tuple[float, float] = key(Vector(2, Real("m", low=0.0, high=100.0)), (1.0, 3.5))
    eaves_m: tuple[float, float] = key(Vector(2, HEIGHT), (2.5, 4.5))
    flat_share: float = key(Real("", low=0.0, high=1.0), 0.35)


@dataclass(frozen=True, kw_only=True)
class StreetLight(Tagged):
    """A mast with a horizontal arm and a lamp at its end."""

    TAG = "street_light"
    mast_m: tuple[float, float] = key(Vector(2, POSITION))
    height_m: float = key(HEIGHT, 7.0)
    arm_m: float = key(SIZE, 4.0)
    yaw_deg: float = key(ANGLE, 0.0)


@dataclass(frozen=True, kw_only=True)
class Steps(Tagged):
    """Platforms of random heights that fill a rectangle: a stepped scene."""

    TAG = "steps"
    area_m: tuple[float, float, float, float] = key(AREA)
    tread_m: tuple[float, float] = key(Vector(2, SIZE), (2.0, 5.0))
    height_m: tuple[float, float] = key(Vector(2, HEIGHT), (0.2, 2.5))
    clear_m: float = key(Real("m", low=0.0, high=100.0), 0.0)
    material: str = key(MATERIAL, "concrete")


@dataclass(frozen=True, kw_only=True)
class Road(Tagged):
    """A paved strip along a line, with markings when it is wide enough."""

    TAG = "road"
    points_m: tuple[tuple[float, ...], ...] = key(Points(2, 2))
    width_m: float = key(SIZE, 6.0)
    material: str = key(MATERIAL, "asphalt")


@dataclass(frozen=True, kw_only=True)
class Patch(Tagged):
    """A blob of another material on the ground."""

    TAG = "patch"
    center_m: tuple[float, float] = key(Vector(2, POSITION))
    radius_m: float = key(SIZE, 5.0)
    material: str = key(MATERIAL, "soil")


@dataclass(frozen=True, kw_only=True)
class Water(Tagged):
    """Still water level with the ground: no texture, and the laser gets nothing back."""

    TAG = "water"
    center_m: tuple[float, float] = key(Vector(2, POSITION))
    size_m: tuple[float, float] = key(Vector(2, SIZE))
    level_m: float = key(Real("m", low=0.0, high=10.0), 0.03)


@dataclass(frozen=True, kw_only=True)
class Trees(Tagged):
    """Trees at random places in a rectangle."""

    TAG = "trees"
    area_m: tuple[float, float, float, float] = key(AREA)
    count: int = key(Whole(1, 2000), 10)
    height_m: tuple[float, float] = key(Vector(2, HEIGHT), (2.0, 6.0))


@dataclass(frozen=True, kw_only=True)
class Rocks(Tagged):
    """Rocks at random places in a rectangle, many small and few large ones."""

    TAG = "rocks"
    area_m: tuple[float, float, float, float] = key(AREA)
    count: int = key(Whole(1, 5000), 100)
    radius_m: tuple[float, float] = key(Vector(2, SIZE), (0.05, 0.6))
    material: str = key(MATERIAL, "rock")


OBJECTS = Items("kind", (Box, BoxLine, Building, Town, StreetLight, Steps, Road, Patch, Water, Trees, Rocks))
