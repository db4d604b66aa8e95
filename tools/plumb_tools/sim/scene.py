"""The whole of a scene file: world, trajectory, sensors and faults, with their defaults and limits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from plumb_tools.sim.objects import ALBEDO, AREA, FURTHEST_M, MATERIAL, OBJECTS, POSITION
from plumb_tools.sim.schema import Items, Real, Text, Vector, key, section
from plumb_tools.sim.sensors import FAULTS, Sensors

DURATION = Real("s", above=0.0, high=3600.0)
SPEED = Real("m/s", low=-50.0, high=50.0)
YAW = Real("deg", low=-3600.0, high=3600.0)


@dataclass(frozen=True, kw_only=True)
class Light:
    """The sun, and how much of it there is."""

    level: float = key(Real("(1 is a bright day)", above=0.0, high=10.0), 1.0)
    sun_elevation_deg: float = key(Real("deg", low=5.0, high=90.0), 48.0)
    sun_azimuth_deg: float = key(Real("deg", low=-360.0, high=360.0), 125.0)
    ambient: float = key(Real("", low=0.0, high=1.0), 0.4)


@dataclass(frozen=True, kw_only=True)
class Ground:
    """The ground: a rectangle x0 y0 x1 y1, flat or with fractal relief.

    Relief is zero-mean with the given peak height over `wavelength_m`; `roughness` is the ratio of amplitudes from one
    octave to the next; steps of height `scarp_m` cut through it. `map_m_per_px`: resolution of what is painted on it.
    """

    extent_m: tuple[float, float, float, float] = key(AREA, (-40.0, -40.0, 200.0, 40.0))
    material: str = key(MATERIAL, "grass")
    albedo: float = key(ALBEDO, 0.35)
    contrast: float = key(Real("", low=0.0, high=2.0), 1.0)
    map_m_per_px: float = key(Real("m", low=0.01, high=1.0), 0.06)
    relief_m: float = key(Real("m", low=0.0, high=100.0), 0.0)
    wavelength_m: float = key(Real("m", low=1.0, high=FURTHEST_M), 40.0)
    roughness: float = key(Real("", low=0.1, high=0.8), 0.45)
    scarp_m: float = key(Real("m", low=0.0, high=20.0), 0.0)
    grid_m: float = key(Real("m", low=0.05, high=10.0), 0.3)
    orthophoto_m_per_px: float = key(Real("m", low=0.005, high=2.0), 0.1)


@dataclass(frozen=True, kw_only=True)
class World:
    """Section `scene`. `summary` is one line for lists, `shows` what is to be learnt from a flight and why."""

    summary: str = key(Text(), "")
    shows: str = key(Text(), "")
    gravity_m_s2: float = key(Real("m/s^2", above=0.0, high=30.0), 9.80665)
    light: Light = section(Light)
    ground: Ground = section(Ground)
    objects: tuple[Any, ...] = key(OBJECTS, ())


@dataclass(frozen=True, kw_only=True)
class Start:
    """Where the IMU is at time zero and how it moves; the first segment goes on from here."""

    position_m: tuple[float, float, float] = key(Vector(3, POSITION), (0.0, 0.0, 0.35))
    velocity_m_s: tuple[float, float, float] = key(Vector(3, SPEED), (0.0, 0.0, 0.0))
    yaw_deg: float = key(YAW, 0.0)


@dataclass(frozen=True, kw_only=True)
class Segment:
    """A piece of the trajectory; pieces follow one another."""

    TAG_KEY: ClassVar[str] = "do"
    TAG: ClassVar[str] = ""
    duration_s: float = key(DURATION)


@dataclass(frozen=True, kw_only=True)
class Hold(Segment):
    """Goes on with the velocity it has; stands when that is zero."""

    TAG = "hold"


@dataclass(frozen=True, kw_only=True)
class Move(Segment):
    """A smooth displacement and turn on top of the velocity it has."""

    TAG = "move"
    by_m: tuple[float, float, float] = key(Vector(3, POSITION), (0.0, 0.0, 0.0))
    yaw_deg: float = key(YAW, 0.0)


@dataclass(frozen=True, kw_only=True)
class Velocity(Segment):
    """A smooth change to another velocity, which lasts."""

    TAG = "velocity"
    to_m_s: tuple[float, float, float] = key(Vector(3, SPEED))


@dataclass(frozen=True, kw_only=True)
class Turn(Segment):
    """Turns velocity and nose together, left is positive."""

    TAG = "turn"
    by_deg: float = key(Real("deg", low=-180.0, high=180.0))


@dataclass(frozen=True, kw_only=True)
class Sway(Segment):
    """Swings about the path it is on, all axes at once, swelling up and fading out."""

    TAG = "sway"
    amplitude_m: tuple[float, float, float] = key(Vector(3, Real("m", low=-20.0, high=20.0)), (0.0, 0.0, 0.0))
    frequency_hz: tuple[float, float, float] = key(Vector(3, Real("Hz", above=0.0, high=5.0)), (0.3, 0.37, 0.23))
    yaw_deg: float = key(Real("deg", low=-180.0, high=180.0), 0.0)
    yaw_frequency_hz: float = key(Real("Hz", above=0.0, high=5.0), 0.11)


@dataclass(frozen=True, kw_only=True)
class Gusts:
    """Residual motion of a vehicle that is held against the wind: a band of random sines, rms per axis."""

    velocity_rms_m_s: tuple[float, float, float] = key(Vector(3, Real("m/s", low=0.0, high=5.0)), (0.0, 0.0, 0.0))
    yaw_rms_deg: float = key(Real("deg", low=0.0, high=45.0), 0.0)
    band_hz: tuple[float, float] = key(Vector(2, Real("Hz", above=0.0, high=5.0), ascending=True), (0.08, 0.7))
    start_s: float = key(Real("s", low=0.0, high=3600.0), 3.0)
    swell_s: float = key(DURATION, 4.0)


@dataclass(frozen=True, kw_only=True)
class Path:
    """Section `trajectory`. `lean`: share of a multirotor's lean into its acceleration, 0 stays level."""

    start: Start = section(Start)
    lean: float = key(Real("", low=0.0, high=1.5), 1.0)
    segments: tuple[Any, ...] = key(Items("do", (Hold, Move, Velocity, Turn, Sway)))
    gusts: Gusts = section(Gusts)

    @property
    def length_s(self) -> float:
        """Time from the first to the last segment's end."""
        return float(sum(segment.duration_s for segment in self.segments))


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A scene file."""

    scene: World = section(World)
    trajectory: Path = section(Path, required=True)
    sensors: Sensors = section(Sensors)
    faults: tuple[Any, ...] = key(FAULTS, ())
