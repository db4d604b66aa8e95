"""The suite: what it flies, what it flies again, and the page it writes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from plumb_tools.demo import pipeline
from plumb_tools.demo.pipeline import Folders, Scene
from plumb_tools.demo.process import Steps
from plumb_tools.demo.results import Figures, Outcome
from plumb_tools.report.headline import Cost, Headline
from plumb_tools.score import results_page, suite
from plumb_tools.score.__main__ import main
from plumb_tools.score.results_page import SceneResults
from plumb_tools.sim import scene_file

HEADLINE = Headline(150.0, 0.6, 0.4, 0.25, -0.3, 0.2, 0.04, 3.1, 2.9, 3.3, 0.5, 99.0, 0)
GOOD = Figures(HEADLINE, Cost(7.0, 9.0, 4.0))
BAD = Figures(replace(HEADLINE, max_axis_m=5.4, max_axis_percent=3.6, scale_error_percent=4.0), Cost(6.9, 8.8, 4.1))


SCENE = """\
scene:
  summary: Roofs after grass.
  shows: Steps under the beam.
trajectory:
  segments: [{do: hold, duration_s: 9}]
"""


@pytest.fixture
def flown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A suite of one scene whose flights cost nothing; the list tells what was flown."""
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes/outdoor.yaml").write_text(SCENE)
    (tmp_path / "plumb-replay").write_text("first")
    monkeypatch.setattr(scene_file, "SCENES", tmp_path / "scenes")
    monkeypatch.setattr(scene_file, "FLIGHTS", tmp_path / "flights")
    monkeypatch.setattr(pipeline, "REPLAY", tmp_path / "plumb-replay")
    calls: list[str] = []

    def build(steps: Steps, out: Path) -> None:
        """Built already."""

    def simulate(steps: Steps, scene: Scene, seed: int, log: Path) -> Path:
        flight = scene.flight(seed)
        flight.mkdir(parents=True, exist_ok=True)
        calls.append(f"simulate {scene.name} {seed}")
        return flight

    def fly(steps: Steps, name: str, flight: Path, folders: Folders) -> None:
        for run in ("range-VIO", "VIO"):
            folders.run(run).mkdir(parents=True, exist_ok=True)
        calls.append(f"fly {name}")

    def judge(scene: str, seed: int, flight: Path, folders: Folders) -> Outcome:
        return Outcome(scene, seed, GOOD, BAD, {})

    for function in (build, simulate, fly, judge):
        monkeypatch.setattr(pipeline, function.__name__, function)
    return calls


def _run(tmp_path: Path, *more: str) -> str:
    out = tmp_path / "results.md"
    assert main(["--suite", "--seeds", "2", "--out", str(out), "--work", str(tmp_path / "work"), *more]) == 0
    return out.read_text()


def test_every_seed_is_flown_and_the_page_tells_all(flown: list[str], tmp_path: Path) -> None:
    text = _run(tmp_path)
    assert flown == ["simulate outdoor 1", "fly outdoor, seed 1", "simulate outdoor 2", "fly outdoor, seed 2"]
    assert "| outdoor | **range-VIO** | 2 | 0.40 (0.40) | 0.600 (0.600) | 0.250 (0.250) | 0.30 (0.30) |" in text
    assert "|  | VIO | 2 | 3.60 (3.60) |" in text
    assert "### outdoor, 150 m\n\nRoofs after grass. Steps under the beam.\n" in text
    told = " ".join(text.split())
    assert "within 0.4 % of the distance on each axis; kept in 2 of 2 flights. Target: scale error" in told
    assert "scale error at most 0.2 %; kept in 0 of 2 flights. The greatest error of VIO is 9.0" in told
    assert "tools/score --suite --seeds 2" in text


def test_a_target_that_is_missed_is_told() -> None:
    runs = (GOOD, BAD, None)
    flights = [Outcome("mars", seed, run, BAD, {}) for seed, run in enumerate(runs, 1)]
    text = results_page.markdown([SceneResults(Scene("mars", scene_file.find("mars")), flights)], "")
    assert "within 0.4 %" in text and "kept in 1 of 3 flights" in " ".join(text.split())
    flights = [Outcome("excitation", 1, GOOD, BAD, {}), Outcome("excitation", 2, BAD, GOOD, {})]
    text = results_page.markdown([SceneResults(Scene("excitation", scene_file.find("excitation")), flights)], "")
    assert "at most 10 % above that of VIO; kept in 1 of 2 flights" in " ".join(text.split())


def test_seeds_may_be_given_scene_by_scene(flown: list[str], tmp_path: Path) -> None:
    _run(tmp_path, "--scenes", "outdoor:1")
    assert flown == ["simulate outdoor 1", "fly outdoor, seed 1"]


def test_seeds_may_begin_later(flown: list[str], tmp_path: Path) -> None:
    text = _run(tmp_path, "--scenes", "outdoor", "--first-seed", "7")
    assert flown == [f"{done} {seed}" for seed in (7, 8) for done in ("simulate outdoor", "fly outdoor, seed")]
    assert "tools/score --suite --scenes outdoor --first-seed 7 --seeds 2" in text


def test_second_run_flies_nothing_and_a_new_build_everything(flown: list[str], tmp_path: Path) -> None:
    first = _run(tmp_path)
    flown.clear()
    assert _run(tmp_path) == first
    assert flown == []
    (tmp_path / "plumb-replay").write_text("second")
    _run(tmp_path)
    assert len(flown) == 4


def test_flights_are_kept_unless_they_are_discarded(flown: list[str], tmp_path: Path) -> None:
    _run(tmp_path)
    assert {path.name for path in (tmp_path / "flights").iterdir()} == {"outdoor-1", "outdoor-2"}
    (tmp_path / "plumb-replay").write_text("second")
    _run(tmp_path, "--discard")
    assert list((tmp_path / "flights").iterdir()) == []


def test_damaged_figures_are_made_again(flown: list[str], tmp_path: Path) -> None:
    _run(tmp_path)
    flown.clear()
    (tmp_path / "work/outdoor/seed-1" / suite.RESULT_FILE).write_text('{"key": ')
    _run(tmp_path)
    assert flown == ["simulate outdoor 1", "fly outdoor, seed 1"]


def test_replay_without_solution_is_counted_and_explained() -> None:
    scene = Scene("cruise", scene_file.find("cruise"))
    lost = Outcome("cruise", 2, GOOD, None, {"VIO": "no solution: trajectory.tum: holds no data line"})
    flights = [Outcome("cruise", 1, GOOD, BAD, {}), lost]
    text = results_page.markdown([SceneResults(scene, flights)], "tools/score --suite")
    assert "|  | VIO | 1 of 2 | 3.60 |" in text
    assert "Seed 2, VIO: no solution: trajectory.tum: holds no data line." in text


@pytest.mark.parametrize(
    ("scenes", "expected"),
    [
        ("outdoor,moon", "moon: no such scene"),
        ("outdoor:0", "--scenes outdoor:0: expected a number of seeds, 1 to 1000"),
        ("outdoor:many", "expected a number of seeds"),
        ("outdoor,outdoor:3", "outdoor stands there twice; expected every scene once"),
        ("outdoor,", "--scenes: : no such scene"),
        ("outdoor,{folder}/bad.yaml", "bad.yaml: scene.gravty: unknown key"),
    ],
)
def test_bad_scenes_are_refused_before_anything_is_flown(
    scenes: str, expected: str, flown: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "bad.yaml").write_text(SCENE.replace("summary", "gravty"))
    scenes = scenes.format(folder=tmp_path)
    assert main(["--suite", "--scenes", scenes, "--out", str(tmp_path / "results.md")]) == 2
    assert expected in capsys.readouterr().err
    assert flown == []


@pytest.fixture
def project(flown: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project of two scenes with a page of results; returns that page."""
    (tmp_path / "scenes/indoor.yaml").write_text(SCENE)
    monkeypatch.setattr(suite, "ROOT", tmp_path)
    page = tmp_path / suite.DEFAULT_OUT
    page.parent.mkdir()
    page.write_text("as it was")
    return page


def test_some_of_the_scenes_leave_the_results_of_all_alone(
    project: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    work = ["--suite", "--seeds", "1", "--work", str(tmp_path / "work")]
    assert main([*work, "--scenes", "outdoor"]) == 0
    told = capsys.readouterr().out
    assert "| outdoor | **range-VIO** | 1 |" in told and "docs/results.md stays as it is" in told
    assert project.read_text() == "as it was"
    assert main([*work, "--scenes", "outdoor", "--out", str(tmp_path / "new/page.md")]) == 0
    assert "### outdoor" in (tmp_path / "new/page.md").read_text()
    assert project.read_text() == "as it was"
    assert main([*work, "--scenes", "outdoor,indoor:2"]) == 0
    assert "### indoor" in project.read_text()
    project.write_text("as it was")
    assert main(work) == 0
    assert "### indoor" in project.read_text()
    assert [path.name for path in project.parent.iterdir()] == [project.name]


@pytest.mark.parametrize(("option", "place"), [("--out", "file/page.md"), ("--out", ""), ("--work", "file")])
def test_where_nothing_can_be_written_is_told_before_anything_is_flown(
    option: str, place: str, flown: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert main(["--suite", option, str(tmp_path / place)]) == 2
    assert f"{option} {tmp_path / place}: " in capsys.readouterr().err
    assert flown == []


def test_help_has_examples(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["--suite", "--help"])
    assert stop.value.code == 0
    assert "examples:" in capsys.readouterr().out
