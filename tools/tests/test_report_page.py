"""The page itself, from files to what a browser makes of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import made_flight
from browser import Browser, chromium
from plumb_tools.report import animation
from plumb_tools.report.__main__ import main
from plumb_tools.report.flight import read_flight
from plumb_tools.report.figures_filter import range_profile
from plumb_tools.report.model import build
from plumb_tools.report.run import RangeOutcome, read_run
from plumb_tools.report.sections import numbers
from plumb_tools.report.theme import OUTCOME_NAMES

MAX_BYTES = 15_000_000


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report of both replays."""
    folder = tmp_path_factory.mktemp("report")
    made_flight.write_flight(folder / "straight")
    made_flight.write_run(folder / "range")
    made_flight.write_run(folder / "vio", scale=1.1, with_range=False)
    out = folder / "page" / "report.html"
    replays = [str(folder / "range"), str(folder / "vio")]
    assert main([*replays, "--flight", str(folder / "straight"), "--out", str(out), "--images", "12"]) == 0
    return out


@pytest.fixture(scope="module")
def browser(page: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser with the page open."""
    if chromium() is None:
        pytest.skip("no Chromium to open the page in; tools/setup --tests installs it")
    with Browser(tmp_path_factory.mktemp("profile")) as opened:
        opened.open(page)
        yield opened


def test_page_is_one_file_without_links_to_a_network(page: Path) -> None:
    text = page.read_text()
    assert len(text) < MAX_BYTES
    assert "{{" not in text.split("<script>")[0]
    for loading in ('src="http', "src='http", 'rel="stylesheet"', "@import"):
        assert loading not in text.split("<script>")[0]
    assert [path.name for path in page.parent.iterdir()] == [page.name]


def test_scales_of_a_figure_that_is_not_drawn_yet_can_be_changed(browser: Browser) -> None:
    assert browser.run("document.querySelector('#attitude .plot').data === undefined")
    browser.run("document.querySelector('#attitude .release').click()")
    browser.wait_for(
        "document.querySelector('#attitude .plot').layout?.yaxis2?.range?.[1] === data.figures.attitude.own.yaxis2[1]"
    )
    assert browser.complaints == []


def test_every_figure_is_drawn_without_a_complaint(browser: Browser) -> None:
    browser.run("Promise.all(plots.map(draw)).then(() => null)")
    keys = browser.run("plots.filter((div) => div.data).map((div) => div.dataset.key)")
    assert {"range", "space", "plan", "profile", "position", "velocity", "attitude", "scale"} <= set(keys)
    assert {"nees", "modes", "features", "cpu"} <= set(keys)
    assert browser.complaints == []


def test_axes_over_time_have_units(browser: Browser) -> None:
    titles = browser.run(
        "Object.values(data.figures).flatMap((f) => Object.keys(f.layout).filter(isAxis)"
        ".map((axis) => f.layout[axis].title?.text).filter(Boolean))"
    )
    unitless = {"position", "velocity", "attitude", "tracks", "SLAM used", "MSCKF used"}
    assert all("[" in title or title in unitless for title in titles)


def test_slider_moves_image_overlay_facts_and_cursor(browser: Browser) -> None:
    def state() -> tuple[str, str, str]:
        return tuple(
            browser.run(f"document.getElementById('{name}').{what}")
            for name, what in (("image", "src"), ("overlay", "innerHTML"), ("clock", "textContent"))
        )

    browser.run("viewer.show(0)")
    before = state()
    browser.run("slider.value = 6; slider.dispatchEvent(new Event('input'))")
    after = state()
    assert all(first != second for first, second in zip(before, after, strict=True))
    browser.run("document.getElementById('range').scrollIntoView({behavior: 'instant'})")
    browser.wait_for(
        "(document.querySelector('#range .plot').layout?.shapes || []).some("
        "(s) => s.name === 'cursor' && Math.abs(s.x0 - viewer.data.frames[6].t) < 1e-9)"
    )
    assert browser.complaints == []


def test_gated_image_is_shown_in_red(browser: Browser) -> None:
    browser.run(f"viewer.showTime({made_flight.GATED_ROW / made_flight.RATE_HZ})")
    assert "gated" in browser.run("document.getElementById('facts').textContent")
    assert browser.run("document.querySelector('#facts dd.gated') !== null")
    assert "#ff3b42" in browser.run("viewer.groups.ranged.innerHTML")


def test_layers_can_be_hidden_and_colours_changed(browser: Browser) -> None:
    browser.run("document.querySelector('#layers input').click()")
    assert browser.run("viewer.groups.facets.style.display") == "none"
    browser.run("document.querySelector('#layers input').click()")
    first = browser.run("document.documentElement.dataset.theme")
    browser.run("document.getElementById('theme').click()")
    assert {first, browser.run("document.documentElement.dataset.theme")} == {"light", "dark"}
    browser.run("document.querySelector('.release').click()")
    assert browser.complaints == []


def test_flight_without_truth_has_a_page_of_what_is_known(tmp_path: Path) -> None:
    flight = made_flight.write_flight(tmp_path / "real")
    (flight / "mav0/state_groundtruth_estimate0/data.csv").unlink()
    run = made_flight.write_run(tmp_path / "range")
    assert main([str(run), "--flight", str(flight), "--out", str(tmp_path / "out.html"), "--images", "3"]) == 0
    assert "This flight has no truth." in (tmp_path / "out.html").read_text()


@pytest.mark.parametrize("suffix", animation.SUFFIXES)
def test_animation_moves(tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(animation, "FRAMES", 12)
    flight = read_flight(made_flight.write_flight(tmp_path / "flight"))
    run = read_run(made_flight.write_run(tmp_path / "range"), "range-VIO")
    out = tmp_path / f"overlay{suffix}"
    assert animation.save(flight, run, out) == out.stat().st_size
    with Image.open(out) as image:
        assert image.n_frames == 12
        assert image.size[0] == animation.WIDTH_PX


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere", "--flight", "{flight}"], "no such folder"),
        (["{run}", "--flight", "nowhere"], "no such folder"),
        (["{run}", "--flight", "{run}"], "not an ASL folder"),
    ],
)
def test_bad_input_is_told_in_a_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    known = {"flight": made_flight.write_flight(tmp_path / "flight"), "run": made_flight.write_run(tmp_path / "run")}
    words = [word.format(**known) for word in arguments]
    assert main([*words, "--out", str(tmp_path / "out.html")]) == 2
    error = capsys.readouterr().err
    assert message in error and "Traceback" not in error
    assert not (tmp_path / "out.html").exists()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("cam0/data.csv", b"\xff\xfe1,1.png\n", "cannot be read as text"),
        ("cam0/data.csv", b"now,1.png\n", "data.csv:1: expected a stamp in nanoseconds"),
        ("cam0/sensor.yaml", b"\xff\xfe", "cannot be read as text"),
        ("imu0/sensor.yaml", b"T_BS: {data: [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]}", "not a rotation"),
        ("imu0/sensor.yaml", b"T_BS: {data: [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}", "not a rotation"),
        ("imu0/sensor.yaml", b"rate_hz: 250", "T_BS is missing"),
    ],
)
def test_damaged_files_of_a_flight_are_named(
    name: str, content: bytes, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flight = made_flight.write_flight(tmp_path / "flight")
    run = made_flight.write_run(tmp_path / "run")
    (flight / "mav0" / name).write_bytes(content)
    assert main([str(run), "--flight", str(flight), "--out", str(tmp_path / "out.html")]) == 2
    told = capsys.readouterr().err
    assert f"{flight / 'mav0' / name}:" in told and message in told


def test_replays_in_the_wrong_order_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flight = made_flight.write_flight(tmp_path / "flight")
    vio = made_flight.write_run(tmp_path / "vio", with_range=False)
    run = made_flight.write_run(tmp_path / "range")
    assert main([str(vio), str(run), "--flight", str(flight), "--out", str(tmp_path / "out.html")]) == 2
    assert "flown without a single range" in capsys.readouterr().err


def test_a_replay_that_never_started_is_named_beside_the_other(tmp_path: Path) -> None:
    flight = made_flight.write_flight(tmp_path / "flight")
    run = made_flight.write_run(tmp_path / "range")
    vio = made_flight.never_start(made_flight.write_run(tmp_path / "vio", with_range=False))
    out = tmp_path / "out.html"
    assert main([str(run), str(vio), "--flight", str(flight), "--out", str(out), "--images", "3"]) == 0
    head = out.read_text().split('id="seen"')[0]
    assert head.count("<b>never started</b><span>VIO</span>") == 6
    assert "<b>VIO</b>: never started: none of 120 images has a state; without range, only a standstill" in head
    vio = made_flight.write_run(tmp_path / "other", with_range=False)
    made_flight.never_start(run)
    assert main([str(run), str(vio), "--flight", str(flight), "--out", str(out), "--images", "3"]) == 0
    assert "<b>never started</b><span>range-VIO</span>" in out.read_text()


def test_what_has_nothing_to_show_is_refused_in_plain_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flight = made_flight.write_flight(tmp_path / "flight")
    run = made_flight.write_run(tmp_path / "range")
    vio = made_flight.never_start(made_flight.write_run(tmp_path / "vio", with_range=False))
    options = ["--flight", str(flight), "--out", str(tmp_path / "out.html")]
    assert main([str(vio), *options]) == 2
    told = capsys.readouterr().err
    assert f"report: {vio}: never started: none of 120 images has a state; " in told and "no data line" not in told
    assert main([str(vio), str(run), *options]) == 2
    assert f"{run}: flown with ranges; it goes first" in capsys.readouterr().err


def test_spare_ranges_are_in_the_profile(tmp_path: Path) -> None:
    run = read_run(made_flight.write_run(tmp_path / "range"), "range-VIO")
    run.states["range_outcome"][20:30] = RangeOutcome.SPARE
    model = build(read_flight(made_flight.write_flight(tmp_path / "flight")), [run])
    profile = range_profile(model)
    assert profile is not None
    drawn = {trace.name: trace for trace in profile.figure.data}
    assert len(drawn["spare"].x) == 10 and drawn["spare"].marker.symbol == "circle-open"
    returned = run.states["range_outcome"] != RangeOutcome.NONE
    names = {OUTCOME_NAMES[kind] for kind in RangeOutcome}
    assert sum(len(trace.x) for name, trace in drawn.items() if name in names) == np.count_nonzero(returned)


@pytest.mark.parametrize("option", ["--out", "--animation"])
def test_a_page_that_cannot_be_written_is_told_at_the_start(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    target = tmp_path / "file/a.webp"
    assert main(["nowhere", "--flight", "nowhere", option, str(target)]) == 2
    assert f"{option} {target}: cannot be written" in capsys.readouterr().err


def test_missing_image_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flight = made_flight.write_flight(tmp_path / "flight")
    run = made_flight.write_run(tmp_path / "run")
    for image in (flight / "mav0/cam0/data").iterdir():
        image.unlink()
    assert main([str(run), "--flight", str(flight), "--out", str(tmp_path / "out.html")]) == 2
    assert "no such image" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (None, "m", "&ndash;"),
        (0.00747, "m", "0.747"),
        (1.234, "m", "1.23"),
        (-0.0184, "%", "&minus;0.018"),
        (6489.0, "", "6489"),
    ],
)
def test_numbers_are_short(value: float | None, unit: str, text: str) -> None:
    assert numbers([value], 3, unit)[0].startswith(text)


def test_numbers_to_compare_have_the_same_unit() -> None:
    small, large = numbers([0.0666, 0.132], 3, "m")
    assert small.startswith("0.067<") and large.startswith("0.132<")
    assert all("cm/s" in text for text in numbers([0.0064, 0.0087], 3, "m/s"))
