from __future__ import annotations

import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image, ImageSequence

from cfplan_core.errors import CfplanError
from cfplan_core.model import Problem
from cfplan_core.report.animation import grasp_at, sample_instants, write_animation
from cfplan_core.report.style import body_colours
from cfplan_core.trajectory.plan_result import PlanResult


@pytest.fixture
def short(result: PlanResult) -> PlanResult:
    """The first eleven frames: 0.35 s, one change of stability."""
    return replace(
        result,
        times=result.times[:11],
        joints=result.joints[:11],
        object_poses=result.object_poses[:11],
        torque_lower=result.torque_lower[:11],
        torque_upper=result.torque_upper[:11],
        segments=(result.segments[0], replace(result.segments[1], last_frame=10)),
    )


def test_images_are_equally_spaced_and_end_in_the_last_frame(result: PlanResult) -> None:
    instants = sample_instants(result, 0.05)
    moving = instants[instants < result.times[-1]]
    assert instants[0] == result.times[0]
    assert np.allclose(np.diff(moving), 0.05)
    assert result.times[-1] - moving[-1] <= 0.05 + 1e-12
    assert np.sum(instants == result.times[-1]) == 20  # Held for a second.


def test_between_frames_motion_is_linear(result: PlanResult) -> None:
    grasp = grasp_at(result, float(result.times[3] + result.times[4]) / 2.0)
    assert np.allclose(grasp.joints, (result.joints[3] + result.joints[4]) / 2.0)
    assert np.allclose(grasp.object_pose, (result.object_poses[3] + result.object_poses[4]) / 2.0)


def test_a_gif_has_an_image_per_instant_and_lasts_as_long(
    problem: Problem, short: PlanResult, tmp_path: Path
) -> None:
    path = write_animation(problem, short, tmp_path / 'new' / 'plan.gif', fps=20.0)
    instants = sample_instants(short, 0.05)
    with Image.open(path) as gif:
        durations = [frame.info['duration'] for frame in ImageSequence.Iterator(gif)]
    assert len(durations) == len(set(instants))  # Equal images are one, shown longer.
    assert sum(durations) == 50 * len(instants)


def test_a_gif_runs_in_real_time_at_rates_that_it_cannot_keep(
    problem: Problem, short: PlanResult, tmp_path: Path
) -> None:
    path = write_animation(problem, short, tmp_path / 'plan.gif', fps=30.0)
    with Image.open(path) as gif:
        duration = sum(frame.info['duration'] for frame in ImageSequence.Iterator(gif))
    assert duration / 1000.0 == pytest.approx(short.times[-1] + 1.0, abs=0.06)


def test_bodies_in_a_gif_have_exactly_their_colours(
    problem: Problem, short: PlanResult, tmp_path: Path
) -> None:
    path = write_animation(problem, short, tmp_path / 'plan.gif', fps=10.0)
    with Image.open(path) as gif:
        for frame in ImageSequence.Iterator(gif):
            pixels = np.asarray(frame.convert('RGB')).reshape(-1, 3)
            for colour in set(body_colours(problem.hand).values()):
                exact = np.rint(255.0 * np.array(to_rgb(colour)))
                assert np.sum(np.all(pixels == exact, axis=1)) > 1000


def test_progress_counts_all_images(problem: Problem, short: PlanResult, tmp_path: Path) -> None:
    calls: list[tuple[int, int]] = []
    write_animation(problem, short, tmp_path / 'plan.gif', 10.0, lambda k, n: calls.append((k, n)))
    total = len(sample_instants(short, 0.1))
    assert calls == [(k + 1, total) for k in range(total)]


def test_a_plan_that_stands_still_can_be_animated(
    problem: Problem, still: PlanResult, tmp_path: Path
) -> None:
    with Image.open(write_animation(problem, still, tmp_path / 'still.gif')) as gif:
        assert gif.size[0] > 0


@pytest.mark.parametrize('name', ['plan', 'plan.avi', 'plan.gif.zip'])
def test_other_suffixes_are_refused(
    problem: Problem, short: PlanResult, tmp_path: Path, name: str
) -> None:
    with pytest.raises(CfplanError, match=r'must end in \.gif or \.mp4, got .*plan'):
        write_animation(problem, short, tmp_path / name)


@pytest.mark.parametrize('fps', [0.0, -5.0, 51.0, float('nan')])
def test_rates_out_of_range_are_refused(
    problem: Problem, short: PlanResult, tmp_path: Path, fps: float
) -> None:
    with pytest.raises(CfplanError, match='fps must be from 1 to 50'):
        write_animation(problem, short, tmp_path / 'plan.gif', fps)


def test_only_a_solved_plan_is_animated(
    problem: Problem, unsolved: PlanResult, tmp_path: Path
) -> None:
    with pytest.raises(CfplanError, match='status is budget_exhausted'):
        write_animation(problem, unsolved, tmp_path / 'plan.gif')


def test_a_path_that_cannot_be_written_is_named(
    problem: Problem, short: PlanResult, tmp_path: Path
) -> None:
    (tmp_path / 'file').write_text('')
    with pytest.raises(CfplanError, match=r'cannot write .*file/plan\.gif'):
        write_animation(problem, short, tmp_path / 'file' / 'plan.gif')


def test_without_ffmpeg_an_mp4_says_what_to_install(
    problem: Problem, short: PlanResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('PATH', str(tmp_path))
    with pytest.raises(CfplanError, match=r'install it .*\.gif'):
        write_animation(problem, short, tmp_path / 'plan.mp4')


def test_an_ffmpeg_that_fails_is_quoted_and_leaves_no_file(
    problem: Problem, short: PlanResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / 'bin').mkdir()
    program = tmp_path / 'bin' / 'ffmpeg'
    program.write_text('#!/bin/sh\necho unknown encoder >&2\nexit 3\n')
    program.chmod(0o755)
    monkeypatch.setenv('PATH', str(tmp_path / 'bin') + os.pathsep + os.environ['PATH'])
    with pytest.raises(CfplanError, match='ffmpeg failed: unknown encoder'):
        write_animation(problem, short, tmp_path / 'out' / 'plan.mp4')
    assert list((tmp_path / 'out').iterdir()) == []


@pytest.mark.skipif(shutil.which('ffmpeg') is None, reason='needs ffmpeg')
def test_an_mp4_lasts_as_long_as_the_plan_and_the_pause(
    problem: Problem, short: PlanResult, tmp_path: Path
) -> None:
    path = write_animation(problem, short, tmp_path / 'plan.mp4', fps=30.0)
    said = subprocess.run(['ffmpeg', '-i', str(path)], capture_output=True, text=True, check=False)
    hours, minutes, seconds = said.stderr.split('Duration: ')[1].split(',')[0].split(':')
    length = 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds)
    assert length == pytest.approx(short.times[-1] + 1.0, abs=0.1)
