"""Triangle meshes with what shading needs, and the primitives that worlds are put together from.

Triangles are counter-clockwise seen from outside: the geometric normal points out of solids and up from the ground.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from plumb_tools.sim.materials import INDEX, MATERIALS

#: Weights of x, y and z when a texture's plane is chosen: slopes up to 60 degrees still count as ground.
_UPRIGHT = np.array([1.0, 1.0, 1.75])

Float32 = npt.NDArray[np.float32]
Points = npt.NDArray[np.floating]


@dataclass(frozen=True)
class Mesh:
    """A piece of a world. All arrays are per vertex; three vertices in a row are a triangle."""

    position_m: Float32  #: (3 T, 3) in W
    normal: Float32  #: (3 T, 3) outward
    uv_m: Float32  #: (3 T, 2) coordinates in the surface, where the texture lies
    surface: Float32  #: (3 T, 2) material number and albedo; albedo 0: both come from the ground map

    @property
    def triangles(self) -> int:
        """Number of triangles."""
        return len(self.position_m) // 3


def empty() -> Mesh:
    """A mesh of nothing."""
    return join([])


def join(meshes: list[Mesh]) -> Mesh:
    """One mesh of several."""
    if not meshes:
        return Mesh(*(np.zeros((0, n), np.float32) for n in (3, 3, 2, 2)))
    return Mesh(
        np.concatenate([m.position_m for m in meshes]),
        np.concatenate([m.normal for m in meshes]),
        np.concatenate([m.uv_m for m in meshes]),
        np.concatenate([m.surface for m in meshes]),
    )


def surface_of(material: str, albedo: float | None, count: int) -> Float32:
    """Surface attribute of `count` vertices."""
    value = MATERIALS[material].albedo if albedo is None else albedo
    return np.tile(np.array([[INDEX[material], value]], np.float32), (count, 1))


def ground_surface(count: int) -> Float32:
    """Surface attribute that leaves material and albedo to the ground map."""
    return np.zeros((count, 2), np.float32)


def polygon(corners: Points, material: str, albedo: float | None = None, along: Points | None = None) -> Mesh:
    """A flat convex polygon (N, 3); `along`: direction of the texture's u axis, else the first edge."""
    points = np.asarray(corners, np.float64)
    normal = np.cross(points[1] - points[0], points[2] - points[0])
    normal /= np.linalg.norm(normal)
    axis_u = points[1] - points[0] if along is None else np.asarray(along, np.float64)
    axis_u = axis_u - normal * (axis_u @ normal)
    axis_u /= np.linalg.norm(axis_u)
    uv = np.column_stack([points @ axis_u, points @ np.cross(normal, axis_u)])
    order = [k for i in range(1, len(points) - 1) for k in (0, i, i + 1)]
    return Mesh(
        points[order].astype(np.float32),
        np.tile(normal.astype(np.float32), (len(order), 1)),
        uv[order].astype(np.float32),
        surface_of(material, albedo, len(order)),
    )


@dataclass(frozen=True)
class Placement:
    """Where something upright stands: local x along `yaw_rad` from the world's x, origin on the ground."""

    x_m: float
    y_m: float
    yaw_rad: float = 0.0

    def points(self, local: Points) -> npt.NDArray[np.float64]:
        """Local points (N, 3) in W."""
        c, s = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        p = np.asarray(local, np.float64)
        return np.column_stack([self.x_m + c * p[:, 0] - s * p[:, 1], self.y_m + s * p[:, 0] + c * p[:, 1], p[:, 2]])


def wall_ring(
    place: Placement, footprint: Points, low_m: float, high_m: float, material: str, albedo: float | None = None
) -> Mesh:
    """Upright walls over a counter-clockwise footprint (N, 2)."""
    parts = []
    for a, b in zip(footprint, np.roll(footprint, -1, axis=0), strict=True):
        corners = [[*a, low_m], [*b, low_m], [*b, high_m], [*a, high_m]]
        parts.append(polygon(place.points(np.array(corners)), material, albedo))
    return join(parts)


def rectangle(size_x_m: float, size_y_m: float, center: tuple[float, float] = (0.0, 0.0)) -> npt.NDArray[np.float64]:
    """Counter-clockwise corners (4, 2)."""
    hx, hy = 0.5 * size_x_m, 0.5 * size_y_m
    corners = [[-hx, -hy], [hx, -hy], [hx, hy], [-hx, hy]]
    return np.asarray(np.array(corners) + np.array(center))


def slab(place: Placement, footprint: Points, height_m: float, material: str, albedo: float | None = None) -> Mesh:
    """A horizontal polygon over a footprint (N, 2), facing up."""
    flat = np.column_stack([footprint, np.full(len(footprint), height_m)])
    return polygon(place.points(flat), material, albedo)


def block(
    place: Placement,
    footprint: Points,
    low_m: float,
    high_m: float,
    material: str,
    albedo: float | None = None,
    top: str | None = None,
) -> Mesh:
    """A closed prism; the underside only where it is off the ground."""
    parts = [
        wall_ring(place, footprint, low_m, high_m, material, albedo),
        slab(place, footprint, high_m, top or material, None if top else albedo),
    ]
    if low_m > 0.0:
        under = slab(place, footprint[::-1], low_m, material, albedo)
        parts.append(under)
    return join(parts)


def tube(start: Points, end: Points, radius_m: float, material: str, albedo: float, sides: int = 8) -> Mesh:
    """A straight closed tube between two points."""
    start, end = np.asarray(start, np.float64), np.asarray(end, np.float64)
    axis = (end - start) / np.linalg.norm(end - start)
    aside = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    aside /= np.linalg.norm(aside)
    angles = 2.0 * np.pi * np.arange(sides) / sides
    ring = radius_m * (np.cos(angles)[:, None] * aside + np.sin(angles)[:, None] * np.cross(axis, aside))
    parts = [polygon(start + ring[::-1], material, albedo), polygon(end + ring, material, albedo)]
    for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        parts.append(polygon(np.array([start + a, start + b, end + b, end + a]), material, albedo))
    return join(parts)


def indexed(points: Points, triangles: npt.NDArray[np.integer], material: str | None, albedo: float | None) -> Mesh:
    """A smooth surface from shared points (N, 3) and triangles (T, 3). Without a material it is ground."""
    corners = np.asarray(points, np.float64)[triangles]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = np.zeros_like(points, dtype=np.float64)
    for k in range(3):
        np.add.at(normal, triangles[:, k], face)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    flat = triangles.ravel()
    position = np.asarray(points)[flat]
    surface = ground_surface(len(flat)) if material is None else surface_of(material, albedo, len(flat))
    # The texture lies in the plane that each triangle faces most: nothing is stretched on slopes.
    facing = np.repeat(np.argmax(np.abs(face) * _UPRIGHT, axis=1), 3)
    uv = np.choose(facing[:, None], [position[:, 1:], position[:, ::2], position[:, :2]])
    return Mesh(position.astype(np.float32), normal[flat].astype(np.float32), uv.astype(np.float32), surface)
