"""Houses, street lights and boxes as meshes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from plumb_tools.sim import mesh, objects
from plumb_tools.sim.mesh import Mesh, Placement
from plumb_tools.sim.streams import Generator

_OVERHANG_M = 0.35
_ROOF_THICKNESS_M = 0.12
_WINDOW_M = (1.1, 1.3)
_STOREY_M = 2.8
_PROUD_M = 0.02  #: windows stand out this much: no two surfaces share a plane


def _windows(place: Placement, size: tuple[float, float], eaves_m: float) -> Mesh:
    """Windows with light frames on all four walls."""
    parts = []
    for side in range(4):
        width, depth = (size[0], size[1]) if side % 2 == 0 else (size[1], size[0])
        angle = 0.5 * np.pi * side
        c, s = np.cos(angle), np.sin(angle)
        count = int((width - 0.8) // 2.2)
        for floor in range(int(eaves_m // _STOREY_M)):
            base = floor * _STOREY_M + 0.9
            for i in range(count):
                u = (i + 0.5) * width / count - 0.5 * width
                for grow, proud, material in ((0.12, 0.0, "plaster"), (0.0, _PROUD_M, "glass")):
                    hw, out = 0.5 * _WINDOW_M[0] + grow, -0.5 * depth - _PROUD_M - proud
                    low, high = base - grow, min(base + _WINDOW_M[1], eaves_m - 0.2) + grow
                    local = np.array([[u - hw, out, low], [u + hw, out, low], [u + hw, out, high], [u - hw, out, high]])
                    turned = np.column_stack(
                        [c * local[:, 0] - s * local[:, 1], s * local[:, 0] + c * local[:, 1], local[:, 2]]
                    )
                    parts.append(mesh.polygon(place.points(turned), material, 0.8 if material == "plaster" else None))
    return mesh.join(parts)


def _flat_roof(place: Placement, size: tuple[float, float], eaves_m: float, random: Generator) -> Mesh:
    """Gravel or bitumen behind a parapet, with boxes of machinery and light domes."""
    parapet, rim = 0.35, 0.25
    parts = [mesh.slab(place, mesh.rectangle(*size), eaves_m, "bitumen" if random.random() < 0.6 else "gravel")]
    for side in range(4):
        length, offset = (size[0], size[1]) if side % 2 == 0 else (size[1] - 2 * rim, size[0])
        center = (0.0, 0.5 * (offset - rim)) if side % 2 == 0 else (0.5 * (offset - rim), 0.0)
        sign = 1.0 if side < 2 else -1.0
        foot = mesh.rectangle(*((length, rim) if side % 2 == 0 else (rim, length)))
        foot = foot + sign * np.array(center)
        parts.append(mesh.block(place, foot, eaves_m - 0.01, eaves_m + parapet, "concrete"))
    for _ in range(int(random.integers(2, 6))):
        spot = (random.random(2) - 0.5) * (np.array(size) - 3.0)
        extent = random.uniform(0.6, 1.8, 2)
        kind = ("metal", "glass", "concrete")[int(random.integers(3))]
        foot = mesh.rectangle(extent[0], extent[1], (float(spot[0]), float(spot[1])))
        parts.append(mesh.block(place, foot, eaves_m - 0.01, eaves_m + random.uniform(0.3, 1.2), kind))
    return mesh.join(parts)


def _roof_points(size: tuple[float, float], eaves_m: float, ridge_m: float, hip: bool) -> npt.NDArray[np.float64]:
    """Four eaves corners and the two ends of the ridge, which runs along the longer side (x)."""
    hx, hy = 0.5 * size[0] + _OVERHANG_M, 0.5 * size[1] + _OVERHANG_M
    drop = eaves_m - _OVERHANG_M * (ridge_m - eaves_m) / (0.5 * size[1])
    ridge = max(hx - hy, 0.3) if hip else hx
    return np.array(
        [[-hx, -hy, drop], [hx, -hy, drop], [hx, hy, drop], [-hx, hy, drop], [-ridge, 0, ridge_m], [ridge, 0, ridge_m]]
    )


def _pitched_roof(
    place: Placement, size: tuple[float, float], eaves_m: float, ridge_m: float, hip: bool, random: Generator
) -> Mesh:
    """Tiled slopes with a rim, chimneys and roof windows. Surfaces show both sides, so there is nothing underneath."""
    p = _roof_points(size, eaves_m, ridge_m, hip)
    tiles, albedo = ("roof_tiles", None) if random.random() < 0.65 else ("slate", None)
    faces = [[0, 1, 5, 4], [2, 3, 4, 5]]
    ends = [[1, 2, 5], [3, 0, 4]]
    top = p + np.array([0.0, 0.0, _ROOF_THICKNESS_M])
    parts = [mesh.polygon(place.points(top[f]), tiles, albedo) for f in faces]
    parts += [mesh.polygon(place.points(top[f]), tiles, albedo) for f in (ends if hip else [])]
    rim = [(0, 1), (1, 2), (2, 3), (3, 0)] if hip else [(0, 1), (2, 3)]
    parts += [mesh.polygon(place.points(np.array([p[a], p[b], top[b], top[a]])), "wood") for a, b in rim]
    slope = (ridge_m - eaves_m) / (0.5 * size[1])
    for _ in range(int(random.integers(1, 3))):
        x = random.uniform(-0.3, 0.3) * size[0]
        y = random.uniform(-0.25, 0.25) * size[1]
        foot = mesh.rectangle(0.7, 0.55, center=(x, y))
        base = ridge_m - slope * (abs(y) + 0.4)
        parts.append(mesh.block(place, foot, base, ridge_m + 0.7, "brick", top="concrete"))
    for _ in range(int(random.integers(0, 4))):
        x, side = random.uniform(-0.3, 0.3) * size[0], 1.0 if random.random() < 0.5 else -1.0
        y = side * random.uniform(0.15, 0.32) * size[1]
        half = np.array([[-0.45, -0.6], [0.45, -0.6], [0.45, 0.6], [-0.45, 0.6]])
        height = ridge_m + _ROOF_THICKNESS_M + 0.03 - slope * np.abs(y + half[:, 1])
        pane = np.column_stack([x + half[:, 0], y + half[:, 1], height])
        parts.append(mesh.polygon(place.points(pane), "glass"))
    return mesh.join(parts)


def building(item: objects.Building, random: Generator) -> Mesh:
    """One house. Local x runs along the longer side, as does the ridge."""
    size, yaw = item.size_m, np.radians(item.yaw_deg)
    if size[1] > size[0]:
        size, yaw = (size[1], size[0]), yaw + 0.5 * np.pi
    place = Placement(*item.center_m, yaw)
    wall = "brick" if random.random() < 0.45 else "plaster"
    parts = [
        mesh.wall_ring(place, mesh.rectangle(*size), 0.0, item.eaves_m, wall),
        _windows(place, size, item.eaves_m),
    ]
    if item.roof == "flat":
        parts.append(_flat_roof(place, size, item.eaves_m, random))
    else:
        ridge = max(item.ridge_m, item.eaves_m + 0.3)
        hip = item.roof == "hip"
        parts.append(_pitched_roof(place, size, item.eaves_m, ridge, hip, random))
        if not hip:
            hx, hy = 0.5 * size[0], 0.5 * size[1]
            for sign in (1.0, -1.0):
                gable = np.array(
                    [
                        [sign * hx, -sign * hy, item.eaves_m],
                        [sign * hx, sign * hy, item.eaves_m],
                        [sign * hx, 0.0, ridge],
                    ]
                )
                parts.append(mesh.polygon(place.points(gable), wall))
    return mesh.join(parts)


def town(item: objects.Town, random: Generator) -> list[objects.Building]:
    """The buildings that fill a rectangle, row by row."""
    x0, y0, x1, y1 = item.area_m
    result = []
    y = y0
    while y < y1:
        depth = item.plot_m[1] * random.uniform(0.85, 1.15)
        x = x0 + random.uniform(0.0, 3.0)
        while x < x1:
            length = item.plot_m[0] * random.uniform(0.65, 1.25)
            gap = random.uniform(*item.gap_m)
            if x + length > x1 or y + depth > y1:
                break
            eaves = random.uniform(*item.eaves_m)
            roof = "flat" if random.random() < item.flat_share else ("gable", "hip")[int(random.integers(2))]
            result.append(
                objects.Building(
                    center_m=(x + 0.5 * length, y + 0.5 * depth + random.uniform(-0.6, 0.6)),
                    size_m=(length, depth - 1.5),
                    eaves_m=eaves,
                    ridge_m=eaves + random.uniform(1.6, 3.0),
                    roof=roof,
                    yaw_deg=random.uniform(-3.0, 3.0),
                )
            )
            x += length + gap
        y += depth + random.uniform(*item.gap_m)
    return result


def street_light(item: objects.StreetLight) -> Mesh:
    """Mast, arm and lamp; the arm is level at the given height."""
    place = Placement(*item.mast_m, np.radians(item.yaw_deg))
    top = place.points(np.array([[0, 0, 0], [0, 0, item.height_m], [item.arm_m, 0, item.height_m]]))
    lamp = mesh.rectangle(0.9, 0.35, center=(item.arm_m, 0.0))
    return mesh.join(
        [
            mesh.tube(top[0], top[1], 0.09, "metal", 0.45),
            mesh.tube(top[1], top[2], 0.06, "metal", 0.45),
            mesh.block(place, lamp, item.height_m - 0.08, item.height_m + 0.1, "metal", 0.6),
        ]
    )


def box(item: objects.Box) -> Mesh:
    """An upright block with a strip of tape across its top, as parcels have."""
    place = Placement(*item.center_m, np.radians(item.yaw_deg))
    x, y, z = item.size_m
    parts = [mesh.block(place, mesh.rectangle(x, y), item.base_m, item.base_m + z, item.material, item.albedo)]
    if item.material == "cardboard":
        strip = mesh.rectangle(x, 0.05)
        parts.append(mesh.slab(place, strip, item.base_m + z + 0.002, "cardboard", min(1.0, 1.25 * item.albedo)))
    return mesh.join(parts)


def box_line(item: objects.BoxLine, random: Generator) -> list[objects.Box]:
    """The boxes of a line, left to right, with random lengths, heights and gaps."""
    start, end = np.array(item.from_m), np.array(item.to_m)
    total = float(np.linalg.norm(end - start))
    along = (end - start) / total
    yaw = float(np.degrees(np.arctan2(along[1], along[0])))
    result: list[objects.Box] = []
    s = 0.0
    while True:
        length = random.uniform(*item.length_m)
        if s + length > total:
            return result
        center = start + (s + 0.5 * length) * along
        result.append(
            objects.Box(
                center_m=(float(center[0]), float(center[1])),
                size_m=(length, item.width_m * random.uniform(0.8, 1.2), random.uniform(*item.height_m)),
                yaw_deg=yaw + random.uniform(-4.0, 4.0),
                material=item.material,
                albedo=float(random.uniform(0.3, 0.65)),
            )
        )
        s += length + random.uniform(*item.gap_m)


def steps(item: objects.Steps, random: Generator) -> list[objects.Box]:
    """Platforms without gaps; `clear_m` about the origin stays free for standing on."""
    x0, y0, x1, y1 = item.area_m
    result: list[objects.Box] = []
    y = y0
    while y < y1:
        depth = min(random.uniform(*item.tread_m), y1 - y)
        x = x0
        while x < x1:
            width = min(random.uniform(*item.tread_m), x1 - x)
            height = random.uniform(*item.height_m)
            far = max(abs(x + 0.5 * width) - 0.5 * width, abs(y + 0.5 * depth) - 0.5 * depth)
            if far >= item.clear_m and width > 0.05 and depth > 0.05:
                result.append(
                    objects.Box(
                        center_m=(x + 0.5 * width, y + 0.5 * depth),
                        size_m=(width, depth, height),
                        material=item.material,
                        albedo=float(random.uniform(0.3, 0.65)),
                    )
                )
            x += width
        y += depth
    return result
