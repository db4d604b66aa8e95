"""Rays against a world's triangles, by Embree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from plumb_tools.sim.mesh import Mesh
from plumb_tools.trajectory import FloatArray


@dataclass(frozen=True)
class Hits:
    """First hits of rays; where nothing is hit the distance is infinite and the material -1."""

    distance_m: FloatArray  #: (N,) along the unit direction
    facing: FloatArray  #: (N,) cosine between normal and direction: negative when the outside was hit
    material: npt.NDArray[np.int32]  #: (N,) number of the material; 0 on the ground, whose materials are painted


class RayCaster:
    """Finds what rays hit first."""

    def __init__(self, mesh: Mesh) -> None:
        """Builds the search tree; the mesh's arrays are copied."""
        self._scene = EmbreeScene()
        points = np.ascontiguousarray(mesh.position_m, np.float32)
        TriangleMesh(self._scene, points, np.arange(len(points), dtype=np.int32).reshape(-1, 3))
        self._material = mesh.surface[::3, 0].astype(np.int32)

    def cast(self, origins_m: FloatArray, directions: FloatArray) -> Hits:
        """First hits of rays from origins (N, 3) along unit directions (N, 3)."""
        rays = _as_rays(directions)
        found = self._scene.run(_as_rays(origins_m), rays, output=True)
        triangle = found["primID"]
        hit = triangle >= 0
        normal = found["Ng"] / np.maximum(np.linalg.norm(found["Ng"], axis=1, keepdims=True), 1e-30)
        return Hits(
            np.where(hit, found["tfar"].astype(np.float64), np.inf),
            np.where(hit, np.sum(normal * rays, axis=1), 0.0),
            np.where(hit, self._material[np.maximum(triangle, 0)], -1).astype(np.int32),
        )

    def distance(self, origins_m: FloatArray, directions: FloatArray) -> FloatArray:
        """Distances to the first hits, infinite where there is none."""
        return self.cast(origins_m, directions).distance_m

    def occluded(self, origins_m: FloatArray, direction: FloatArray) -> npt.NDArray[np.bool_]:
        """Whether anything lies along one direction from many points."""
        directions = np.tile(_as_rays(direction.reshape(1, 3)), (len(origins_m), 1))
        return np.asarray(self._scene.run(_as_rays(origins_m), directions) >= 0)


def _as_rays(values: FloatArray) -> npt.NDArray[np.float32]:
    return np.ascontiguousarray(values, np.float32)
