"""A short animated image of the overlay, for a README: camera images with features, facets and the range profile."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from plumb_tools import files
from plumb_tools.report.flight import Flight
from plumb_tools.report.analysis import thinned
from plumb_tools.report.overlay import View, read_image, views
from plumb_tools.report.run import AIDING, RangeOutcome, Run
from plumb_tools.trajectory import FloatArray

SUFFIXES = (".webp", ".gif")
WIDTH_PX = 440
STRIP_PX = 74  #: height of the range profile under the image
SUPERSAMPLING = 2  #: drawn this much larger, then reduced: smooth lines
FRAMES = 66
FRAME_MS = 130
WEBP_QUALITY = 34
GIF_COLOURS = 96

FACETS, TRACKS, SLAM, RANGED = "#4cc2ff", "#ffd23f", "#3ddc97", "#ff3b42"
STRIP, STRIP_LINE, STRIP_TEXT = "#10161e", "#5b6b80", "#c8d2de"


def save(flight: Flight, run: Run, path: Path) -> int:
    """Writes the animation; returns its size in bytes."""
    rows = thinned(len(run.states), FRAMES)
    strip = _strip(flight, run)
    frames = [_frame(flight, run, view, strip) for view in views(flight, run, rows)]
    timing = {"save_all": True, "append_images": frames[1:], "duration": FRAME_MS, "loop": 0}
    with files.whole(path) as unfinished:
        if path.suffix.lower() == ".webp":
            frames[0].save(unfinished, "WEBP", quality=WEBP_QUALITY, method=4, **timing)
        else:
            reduced = [frame.quantize(GIF_COLOURS, dither=Image.Dither.NONE) for frame in frames]
            reduced[0].save(unfinished, "GIF", optimize=True, **{**timing, "append_images": reduced[1:]})
    return path.stat().st_size


def _size(flight: Flight) -> tuple[int, int]:
    """Width and height of the image part, supersampled."""
    width = WIDTH_PX * SUPERSAMPLING
    return width, round(width * flight.camera.height / flight.camera.width)


def _frame(flight: Flight, run: Run, view: View, strip: Image.Image) -> Image.Image:
    width, height = _size(flight)
    canvas = Image.new("RGB", (width, height + strip.height))
    photo = read_image(view.file, width)
    canvas.paste(photo.resize((width, height)).convert("RGB"), (0, 0))
    canvas.paste(strip, (0, height))
    draw = ImageDraw.Draw(canvas, "RGBA")
    _draw_overlay(draw, view, width / flight.camera.width)
    x = width * view.t_s / max(float(flight.seconds(flight.t_images_ns[-1:])[0]), 1e-9)
    draw.line([(x, height), (x, canvas.height)], fill=RANGED, width=2 * SUPERSAMPLING)
    _label(draw, run, view)
    return canvas.resize((WIDTH_PX, canvas.height // SUPERSAMPLING), Image.Resampling.LANCZOS)


def _draw_overlay(draw: ImageDraw.ImageDraw, view: View, scale: float) -> None:
    unit = SUPERSAMPLING

    def points(pixels: FloatArray) -> list[tuple[float, float]]:
        return [(float(u) * scale, float(v) * scale) for u, v in pixels]

    def dot(at: tuple[float, float], radius: float, colour: str) -> None:
        x, y = at
        draw.ellipse([x - radius, y - radius, x + radius, y + radius], fill=colour)

    for facet in view.facets_px:
        draw.line([*points(facet), points(facet)[0]], fill=FACETS + "b0", width=unit)
    for tail in view.tails_px:
        draw.line(points(tail), fill=TRACKS + "a0", width=unit)
    for at in points(view.tracks_px):
        dot(at, 1.4 * unit, TRACKS)
    if view.ranged_px is not None:
        corners = points(view.ranged_px)
        draw.polygon(corners, fill=RANGED + "48")
        draw.line([*corners, corners[0]], fill=RANGED, width=2 * unit)
    for at in points(view.slam_px):
        dot(at, 3.4 * unit, "#000000a0")
        dot(at, 2.5 * unit, SLAM)
    if view.beam_px is not None:
        at = points(view.beam_px[None, :])[0]
        dot(at, 4.6 * unit, "#ffffff")
        dot(at, 3.2 * unit, RANGED)


def _font(size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size * SUPERSAMPLING)


def _label(draw: ImageDraw.ImageDraw, run: Run, view: View) -> None:
    states = run.states
    text = f"{view.t_s:.1f} s"
    outcome = int(states["range_outcome"][view.row])
    if outcome != RangeOutcome.NONE:
        text += f"   laser {float(states['range_measured_m'][view.row]):.2f} m"
    if outcome in (RangeOutcome.USED, RangeOutcome.GATED):
        text += f"   predicted {float(states['range_predicted_m'][view.row]):.2f} m"
        text += "   gated" if outcome == RangeOutcome.GATED else ""
    place = (10 * SUPERSAMPLING, 8 * SUPERSAMPLING)
    box = draw.textbbox(place, text, font=_font(13))
    margin = 5 * SUPERSAMPLING
    draw.rounded_rectangle(
        [box[0] - margin, box[1] - margin, box[2] + margin, box[3] + margin], margin, fill="#000000a0"
    )
    draw.text(place, text, font=_font(13), fill="#ffffff")


def _strip(flight: Flight, run: Run) -> Image.Image:
    """The range profile of the whole flight: measured ranges, red where gated."""
    width, height = WIDTH_PX * SUPERSAMPLING, STRIP_PX * SUPERSAMPLING
    image = Image.new("RGB", (width, height), STRIP)
    draw = ImageDraw.Draw(image, "RGBA")
    states = run.states
    shown = (states["range_measured_m"] > 0.0) & (states["range_outcome"] != RangeOutcome.NONE)
    ranges = states["range_measured_m"][shown]
    if not ranges.size:
        return image
    t_s = flight.seconds(states.t_ns)
    top, margin = float(np.max(ranges)), 10 * SUPERSAMPLING
    x = width * t_s[shown] / max(float(t_s[-1]), 1e-9)
    y = margin + (height - 2 * margin) * (1.0 - ranges / top)
    used = np.isin(states["range_outcome"][shown], AIDING)
    gated = states["range_outcome"][shown] == RangeOutcome.GATED
    for i in range(len(x)):
        colour = RANGED if gated[i] else FACETS if used[i] else STRIP_LINE
        radius = (2.0 if gated[i] else 1.1) * SUPERSAMPLING
        draw.ellipse([x[i] - radius, y[i] - radius, x[i] + radius, y[i] + radius], fill=colour)
    place = (10 * SUPERSAMPLING, height - 20 * SUPERSAMPLING)
    draw.text(place, f"laser range, 0 to {top:.1f} m", font=_font(11), fill=STRIP_TEXT)
    return image
