"""Draws a world as an ideal pinhole camera sees it, on a GPU or on Mesa's software renderer alike."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from plumb_tools.sim.materials import MATERIALS, TILE_M
from plumb_tools.sim.mesh import Float32, Mesh
from plumb_tools.sim.shaders import DEPTH, RADIANCE, VERTEX
from plumb_tools.sim.world import WorldModel
from plumb_tools.trajectory import FloatArray, InputError

# One thread each: frames are spread over processes, which costs nothing in synchronisation.
os.environ.setdefault("LP_NUM_THREADS", "0")

import moderngl

_NEAR_M = 0.03
_FAR_M = 1000.0
_SKY = 0.9  #: radiance where there is no ground
_CHUNK_M = 12.0
_SAMPLES = 4  #: of multi-sample anti-aliasing
_ANISOTROPY = 8.0
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader")


@dataclass(frozen=True)
class Pinhole:
    """An undistorted camera: pixel = focal * normalised + centre, pixel centres at integer coordinates."""

    width: int
    height: int
    focal_px: float
    cx: float
    cy: float

    def clip_from_camera(self) -> Float32:
        """Projection to clip space. Image row 0 is drawn first, so that read-back needs no flip."""
        near, far = _NEAR_M, _FAR_M
        matrix = np.zeros((4, 4))
        matrix[0, 0] = 2.0 * self.focal_px / self.width
        matrix[0, 2] = 2.0 * (self.cx + 0.5) / self.width - 1.0
        matrix[1, 1] = 2.0 * self.focal_px / self.height
        matrix[1, 2] = 2.0 * (self.cy + 0.5) / self.height - 1.0
        matrix[2, 2] = (far + near) / (far - near)
        matrix[2, 3] = -2.0 * far * near / (far - near)
        matrix[3, 2] = 1.0
        return matrix.astype(np.float32)

    def side_planes(self) -> FloatArray:
        """Inward unit normals (4, 3), in C, of the planes through the image's edges."""
        left, right = -(self.cx + 0.5) / self.focal_px, (self.width - 0.5 - self.cx) / self.focal_px
        up, down = -(self.cy + 0.5) / self.focal_px, (self.height - 0.5 - self.cy) / self.focal_px
        normals = np.array([[1, 0, -left], [-1, 0, right], [0, 1, -up], [0, -1, down]], np.float64)
        return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


@dataclass(frozen=True)
class _Chunks:
    """Triangles sorted by place; each chunk is a range of vertices in a bounding sphere."""

    mesh: Mesh
    first: npt.NDArray[np.int64]
    count: npt.NDArray[np.int64]
    center_m: FloatArray
    radius_m: FloatArray


def _chunks(mesh: Mesh) -> _Chunks:
    # Seen from above what is higher is nearer: drawn first, and the ground last, it saves shading what gets hidden.
    corners = mesh.position_m.reshape(-1, 3, 3)
    ground = mesh.surface[::3, 1] == 0.0
    cell = np.column_stack([np.floor(corners.mean(axis=1)[:, :2] / _CHUNK_M), ground]).astype(np.int64)
    order = np.lexsort((-corners[:, :, 2].max(axis=1), cell[:, 0], cell[:, 1], ground))
    vertices = (3 * order[:, None] + np.arange(3)).ravel()
    sorted_mesh = Mesh(*(array[vertices] for array in (mesh.position_m, mesh.normal, mesh.uv_m, mesh.surface)))
    cell = cell[order]
    starts = np.flatnonzero(np.r_[True, np.any(np.diff(cell, axis=0) != 0, axis=1)])
    ends = np.r_[starts[1:], len(cell)]
    center, radius = [], []
    for a, b in zip(starts, ends, strict=True):
        points = sorted_mesh.position_m[3 * a : 3 * b].astype(np.float64)
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        center.append(middle)
        radius.append(np.linalg.norm(points - middle, axis=1).max())
    return _Chunks(sorted_mesh, 3 * starts, 3 * (ends - starts), np.array(center), np.array(radius))


def _write(program: moderngl.Program, name: str, values: npt.NDArray[np.floating] | npt.NDArray[np.integer]) -> None:
    """Sets an array or a matrix; those are column-major, so a matrix is given transposed."""
    uniform = program[name]
    assert isinstance(uniform, moderngl.Uniform)
    uniform.write(values.astype(np.float32).tobytes())


def open_context() -> moderngl.Context:
    """An off-screen OpenGL context."""
    try:
        settings: dict[str, Any] = {"standalone": True, "require": 330, "backend": "egl"}
        return moderngl.create_context(**settings)
    except Exception as error:  # moderngl raises bare Exception
        raise InputError(
            f"no OpenGL 3.3 through EGL ({error}); expected a GPU or Mesa's software renderer: run tools/setup, or "
            "install the packages libegl1 and libgl1-mesa-dri"
        ) from error


def software_renderer() -> str | None:
    """Name of the software renderer that will be used, None when a GPU draws."""
    context = open_context()
    name = str(context.info["GL_RENDERER"])
    context.release()
    return name if any(word in name.lower() for word in _SOFTWARE) else None


class Renderer:
    """Holds a world in an OpenGL context and draws it for one pinhole camera."""

    def __init__(self, world: WorldModel, pinhole: Pinhole) -> None:
        """Uploads the world. Make one per process."""
        self._context = open_context()
        self._pinhole = pinhole
        self._planes = pinhole.side_planes()
        self._chunks = _chunks(world.mesh)
        self._upload(world)
        self._colour = self._program(RADIANCE.replace("MATERIALS", str(len(MATERIALS))))
        self._set_surface(world)
        size = (pinhole.width, pinhole.height)
        samples = min(_SAMPLES, self._context.max_samples)
        self._drawn = self._context.framebuffer(
            [self._context.renderbuffer(size, 1, samples=samples, dtype="f2")],
            self._context.depth_renderbuffer(size, samples=samples),
        )
        self._resolved = self._context.framebuffer([self._context.renderbuffer(size, 1, dtype="f2")])

    def _upload(self, world: WorldModel) -> None:
        context, mesh = self._context, self._chunks.mesh
        self._buffers = [
            (context.buffer(mesh.position_m.tobytes()), "3f", "position_m"),
            (context.buffer(mesh.normal.tobytes()), "3f", "normal"),
            (context.buffer(mesh.uv_m.tobytes()), "2f", "uv_m"),
            (context.buffer(mesh.surface.tobytes()), "2f", "surface"),
        ]
        layers = world.textures.layers
        array = context.texture_array((layers.shape[2], layers.shape[1], layers.shape[0]), 1, layers.tobytes())
        height, width = world.ground.albedo.shape
        painted = np.stack([world.ground.albedo, world.ground.sunlit], axis=-1)
        ground = context.texture((width, height), 2, painted.tobytes(), alignment=1)
        for texture in (array, ground):
            texture.build_mipmaps()
            texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
            if not any(word in str(context.info["GL_RENDERER"]).lower() for word in _SOFTWARE):
                texture.anisotropy = _ANISOTROPY  # several times the cost in software, little gain looking down
        ground.repeat_x = ground.repeat_y = False
        material = context.texture((width, height), 1, world.ground.material.tobytes(), alignment=1)
        material.filter = (moderngl.NEAREST, moderngl.NEAREST)
        material.repeat_x = material.repeat_y = False
        self._textures: dict[str, moderngl.Texture | moderngl.TextureArray] = {
            "layers": array,
            "ground": ground,
            "ground_material": material,
        }

    def _program(self, fragment: str) -> tuple[moderngl.Program, moderngl.VertexArray]:
        program = self._context.program(vertex_shader=VERTEX, fragment_shader=fragment)
        _write(program, "clip_from_camera", self._pinhole.clip_from_camera().T)
        used = [(buffer, kind, name) for buffer, kind, name in self._buffers if name in program]
        return program, self._context.vertex_array(program, used)

    def _set_surface(self, world: WorldModel) -> None:
        program = self._colour[0]
        for unit, (name, texture) in enumerate(self._textures.items()):
            texture.use(unit)
            program[name] = unit
        x0, y0, x1, y1 = world.ground.extent_m
        program["extent_m"] = (x0, y0, x1 - x0, y1 - y0)
        _write(program, "layer_of", world.textures.layer_of)
        strengths = np.array([m.strengths for m in MATERIALS.values()], np.float32)
        _write(program, "strength_of", strengths)
        program["tile_m"] = TILE_M
        program["sun"] = tuple(float(v) for v in world.sun)
        program["ambient"] = world.light.ambient

    def _draw(
        self,
        target: moderngl.Framebuffer,
        drawing: tuple[moderngl.Program, moderngl.VertexArray],
        position_m: FloatArray,
        R_WC: FloatArray,
        background: float,
    ) -> None:
        program, vertices = drawing
        target.use()
        self._context.enable_only(moderngl.DEPTH_TEST)
        target.clear(background, background, background, 1.0)
        program["camera_m"] = tuple(float(v) for v in position_m)
        _write(program, "camera_from_world", R_WC)  # transposed it is world to camera
        center = (self._chunks.center_m - position_m) @ R_WC
        visible = np.all(center @ self._planes.T > -self._chunks.radius_m[:, None], axis=1)
        edges = np.flatnonzero(np.diff(np.r_[False, visible, False].astype(np.int8)))
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            first = int(self._chunks.first[a])
            vertices.render(vertices=int(self._chunks.first[b - 1] + self._chunks.count[b - 1]) - first, first=first)

    def radiance(self, position_m: FloatArray, R_WC: FloatArray) -> Float32:
        """The image (H, W): 1 is a white surface that lies flat in the sun. Camera position in W, rotation C to W."""
        self._draw(self._drawn, self._colour, position_m, R_WC, _SKY)
        self._context.copy_framebuffer(self._resolved, self._drawn)
        return self._read(self._resolved, np.dtype(np.float16)).astype(np.float32)

    def depth(self, position_m: FloatArray, R_WC: FloatArray) -> Float32:
        """Depth along the optical axis [m] at each pixel centre, (H, W); 0 where nothing is seen."""
        size = (self._pinhole.width, self._pinhole.height)
        target = self._context.framebuffer(
            [self._context.renderbuffer(size, 1, dtype="f4")], self._context.depth_renderbuffer(size)
        )
        self._draw(target, self._program(DEPTH), position_m, R_WC, 0.0)
        return self._read(target, np.dtype(np.float32))

    def _read(self, target: moderngl.Framebuffer, dtype: np.dtype[np.floating]) -> Float32:
        data = target.read(components=1, alignment=1, dtype=f"f{dtype.itemsize}")
        return np.frombuffer(data, dtype).reshape(self._pinhole.height, self._pinhole.width)
