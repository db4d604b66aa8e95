"""What the report prepares from files before anything is drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import made_flight
from plumb_tools.report import analysis
from plumb_tools.report.camera import Camera
from plumb_tools.report.events import events_of
from plumb_tools.report.flight import Flight, read_flight
from plumb_tools.report.headline import cost_of, headline_of
from plumb_tools.report.model import build, ground_of, travelled
from plumb_tools.report.overlay import choose_rows, delaunay_facets, views
from plumb_tools.report.run import RangeOutcome, Run, read_run, stage_names
from plumb_tools.report.tables import read_table
from plumb_tools.trajectory import InputError

LENSES = [
    ("none", ()),
    ("radial-tangential", (-0.283, 0.074, 0.0002, 0.00002)),
    ("equidistant", (-0.01, 0.02, -0.005, 0.001)),
    ("fov", (0.9,)),
]


@pytest.fixture
def flight(tmp_path: Path) -> Flight:
    return read_flight(made_flight.write_flight(tmp_path / "flight"))


@pytest.fixture
def run(tmp_path: Path) -> Run:
    return read_run(made_flight.write_run(tmp_path / "range"), "range-VIO")


@pytest.mark.parametrize(("distortion", "coefficients"), LENSES)
def test_undistorting_inverts_the_lens(distortion: str, coefficients: tuple[float, ...]) -> None:
    camera = Camera(752, 480, (458.0, 457.0, 367.0, 248.0), distortion, coefficients)
    plane = np.random.default_rng(1).uniform([-0.7, -0.45], [0.7, 0.45], (50, 2))
    points = np.column_stack([plane, np.ones(50)]) * 3.0
    np.testing.assert_allclose(camera.undistort(camera.project(points)), plane, atol=1e-9)


def test_projection_agrees_with_numbers_worked_out_by_hand() -> None:
    camera = Camera(640, 480, (400.0, 400.0, 320.0, 240.0), "radial-tangential", (0.1, 0.01, 0.001, 0.002))
    # x = 0.5, y = 0: r2 = 0.25, radial 1.025625, dx = 0.002 * 0.75, dy = 0.001 * 0.25
    expected = [320.0 + 400.0 * (0.5 * 1.025625 + 0.0015), 240.0 + 400.0 * 0.00025]
    np.testing.assert_allclose(camera.project(np.array([[1.0, 0.0, 2.0]]))[0], expected)
    assert np.isnan(camera.project(np.array([[1.0, 0.0, -2.0]]))).all()


def test_errors_show_a_scale_error_along_the_flight_only(flight: Flight, tmp_path: Path) -> None:
    run = read_run(made_flight.write_run(tmp_path / "vio", scale=1.1), "VIO")
    assert flight.truth is not None
    errors = analysis.errors_of(analysis.pairs_of(flight.truth, run.estimate))
    flown_s = errors.t_s - errors.t_s[0]
    np.testing.assert_allclose(errors.position_m[:, 0], 0.1 * made_flight.SPEED_M_S * flown_s, atol=1e-6)
    np.testing.assert_allclose(errors.velocity_m_s[:, 0], 0.1 * made_flight.SPEED_M_S, atol=1e-6)
    np.testing.assert_allclose(errors.position_m[:, 2], 0.0, atol=1e-9)
    np.testing.assert_allclose(errors.attitude_rad, 0.0, atol=1e-9)
    np.testing.assert_allclose(errors.sigma_position_m, 0.01)
    np.testing.assert_allclose(errors.nees_position[-1], np.sum((errors.position_m[-1] / 0.01) ** 2), rtol=1e-6)


def test_sliding_scale_is_the_scale_where_a_whole_window_moves(flight: Flight, tmp_path: Path) -> None:
    run = read_run(made_flight.write_run(tmp_path / "vio", scale=1.1), "VIO")
    assert flight.truth is not None
    scale = analysis.sliding_scale(analysis.pairs_of(flight.truth, run.estimate), 2.0)
    assert np.isnan(scale[0]) and np.isnan(scale[-1])
    np.testing.assert_allclose(scale[len(scale) // 2], 1.1, rtol=1e-6)


def test_headline_and_cost(flight: Flight, tmp_path: Path) -> None:
    run = read_run(made_flight.write_run(tmp_path / "vio", scale=1.1), "VIO")
    assert flight.truth is not None
    headline, _ = headline_of(flight.truth, run)
    assert headline.max_axis_percent == pytest.approx(10.0, abs=0.1)
    assert headline.scale_error_percent == pytest.approx(10.0, abs=0.1)
    assert headline.velocity_rmse_m_s == pytest.approx(0.2, abs=0.001)
    cost = cost_of(run)
    assert cost.cpu_ms == pytest.approx(4.1)
    assert cost.realtime_factor == pytest.approx((made_flight.IMAGES - 1) / made_flight.RATE_HZ / 2.0)


def test_stretches_cover_the_time_without_overlap() -> None:
    found = analysis.stretches(np.array([0.0, 1.0, 2.0, 3.0, 4.0]), np.array([0, 0, 2, 2, 1]))
    assert [(s.start_s, s.end_s, s.value) for s in found] == [(0.0, 2.0, 0), (2.0, 4.0, 2), (4.0, 4.0, 1)]


def test_thinning_keeps_ends_and_peaks() -> None:
    assert analysis.thinned(10, 100).tolist() == list(range(10))
    kept = analysis.thinned(10_001, 100)
    assert len(kept) == 100 and kept[0] == 0 and kept[-1] == 10_000
    totals = np.ones(1000)
    totals[[137, 801]] = 9.0
    assert {137, 801} <= set(analysis.worst_of_blocks(totals, 50).tolist())


def test_distance_ignores_noise_while_standing() -> None:
    path = np.zeros((100, 3))
    path[:, 0] = np.concatenate([np.zeros(50), np.linspace(0.0, 5.0, 50)])
    path[:50, 1] = 0.001 * np.random.default_rng(2).standard_normal(50)
    assert travelled(path)[-1] == pytest.approx(5.0, abs=0.02)


def test_ground_lies_under_the_flight(flight: Flight, run: Run) -> None:
    ground = ground_of(build(flight, [run]))
    assert ground is not None
    accepted = ground.outcome == RangeOutcome.USED
    np.testing.assert_allclose(ground.point_m[accepted, 2], 0.0, atol=1e-6)
    assert ground.point_m[~accepted, 2] == pytest.approx(3.0)
    assert ground.point_m[0, 0] == pytest.approx(0.1 + made_flight.SPEED_M_S * ground.t_s[0])


def test_images_with_a_gated_range_are_preferred() -> None:
    outcomes = np.full(100, int(RangeOutcome.NO_FACET))
    outcomes[[12, 13]] = RangeOutcome.USED
    outcomes[37] = RangeOutcome.GATED
    rows = choose_rows(outcomes, 10)
    assert len(rows) == 10 and 37 in rows and 13 in rows and np.all(np.diff(rows) > 0)


def test_view_has_features_tails_facets_and_the_ranged_facet(flight: Flight, run: Run) -> None:
    (view,) = views(flight, run, np.array([GATED := made_flight.GATED_ROW]))
    assert view.slam_px.shape == (4, 2) and view.tracks_px.tolist() == [[150 - GATED, 60]]
    (tail,) = view.tails_px
    assert tail[-1].tolist() == [150 - GATED, 60] and tail[0, 0] > tail[-1, 0]
    assert len(view.facets_px) == 2
    assert view.ranged_px is not None and view.ranged_px.tolist() == [[40, 30], [120, 30], [80, 100]]
    assert view.beam_px is not None and view.beam_px.tolist() == [80, 60]


def test_view_without_features_file_still_shows_the_beam(flight: Flight, tmp_path: Path) -> None:
    run = read_run(made_flight.write_run(tmp_path / "old", with_features=False), "range-VIO")
    (view,) = views(flight, run, np.array([made_flight.GATED_ROW]))
    assert not len(view.slam_px) and view.ranged_px is None and view.beam_px is not None


def test_points_on_a_line_make_no_facets(flight: Flight) -> None:
    line = np.column_stack([np.arange(5.0), np.arange(5.0)])
    assert not len(delaunay_facets(line, flight.camera))
    assert not len(delaunay_facets(line[:2], flight.camera))


def test_events_tell_of_the_start_and_the_gated_range(flight: Flight, run: Run) -> None:
    texts = [event.text for event in events_of(flight, run)]
    assert texts == ["mode: range-VIO", "range gated: measured 7.00 m, the filter says 10.00 m"]


def test_tables_keep_nanoseconds_and_name_what_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("t_ns,a,hash\n1403636584763555584,nan,00ff\n1403636584763555585,2,00fe\n")
    table = read_table(path, ("a",), ("b",))
    assert table.t_ns.tolist() == [1403636584763555584, 1403636584763555585]
    assert np.isnan(table["a"][0]) and "b" not in table
    with pytest.raises(InputError, match=r"missing column\(s\) b; it has t_ns, a, hash"):
        read_table(path, ("b",))


def test_stages_are_those_of_the_file_without_its_sums() -> None:
    assert stage_names(["t_ns", "a_us", "filter_us", "step_us", "heap_calls"]) == ("a",)
