"""GLSL programs of the renderer."""

from __future__ import annotations

VERTEX = """
#version 330
uniform mat4 clip_from_camera;
uniform mat3 camera_from_world;
uniform vec3 camera_m;
in vec3 position_m;
in vec3 normal;
in vec2 uv_m;
in vec2 surface;
out vec3 world_m;
out vec3 world_normal;
out vec2 texture_m;
flat out vec2 material_albedo;
out float depth_m;
void main() {
  vec3 seen = camera_from_world * (position_m - camera_m);
  world_m = position_m;
  world_normal = normal;
  texture_m = uv_m;
  material_albedo = surface;
  depth_m = seen.z;
  gl_Position = clip_from_camera * vec4(seen, 1.0);
}
"""

#: Two texture scales over the albedo, Lambert's law with a sun and an even sky. 1.0 is a white surface that lies
#: flat in the sun. MATERIALS is replaced by their number.
RADIANCE = """
#version 330
uniform sampler2DArray layers;
uniform sampler2D ground;           // albedo, share of sun
uniform sampler2D ground_material;  // number / 255, not interpolated
uniform vec4 extent_m;              // x0, y0, width, height
uniform vec2 layer_of[MATERIALS];
uniform vec2 strength_of[MATERIALS];
uniform vec2 tile_m;
uniform vec3 camera_m;
uniform vec3 sun;
uniform float ambient;
in vec3 world_m;
in vec3 world_normal;
in vec2 texture_m;
flat in vec2 material_albedo;
out vec4 colour;

const mat2 kCoarseTurn = mat2(0.8253, 0.5646, -0.5646, 0.8253);
const float kBrightestSlope = 1.7;

void main() {
  bool painted = material_albedo.y == 0.0;
  vec2 on_map = abs(mod((world_m.xy - extent_m.xy) / extent_m.zw + 1.0, 2.0) - 1.0);  // mirrored beyond its edges
  vec2 map = texture(ground, on_map).rg;
  float number = painted ? texture(ground_material, on_map).r * 255.0 : material_albedo.x;
  int index = int(number + 0.5);
  vec2 layer = layer_of[index];
  vec2 strength = 2.0 * strength_of[index];
  float fine = texture(layers, vec3(texture_m / tile_m.x, layer.x)).r - 0.5;
  float coarse = texture(layers, vec3(kCoarseTurn * texture_m / tile_m.y, layer.y)).r - 0.5;
  float detail = (1.0 + strength.x * fine) * (1.0 + strength.y * coarse);
  float albedo = (painted ? map.r : material_albedo.y) * max(detail, 0.05);
  vec3 normal = normalize(world_normal);
  if (dot(normal, camera_m - world_m) < 0.0) normal = -normal;
  float direct = min(max(dot(normal, sun), 0.0) / sun.z, kBrightestSlope) * (painted ? map.g : 1.0);
  float light = ambient * (0.75 + 0.25 * normal.z) + (1.0 - ambient) * direct;
  colour = vec4(albedo * light, 0.0, 0.0, 1.0);
}
"""

#: Depth along the optical axis [m].
DEPTH = """
#version 330
in float depth_m;
out vec4 colour;
void main() { colour = vec4(depth_m, 0.0, 0.0, 1.0); }
"""
