"""A plan in motion: GIF by Pillow, MP4 by ffmpeg."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from itertools import chain, combinations
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

from cfplan_core.errors import CfplanError
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Grasp, Problem
from cfplan_core.report.figures.drawing import (
    draw_bodies,
    draw_contacts,
    figure_header,
    new_figure,
    world_axes,
)
from cfplan_core.report.figures.saving import replacing
from cfplan_core.report.scene import check_belongs, contact_marks, plan_grasps, segment_at, view_of
from cfplan_core.report.style import FONT_SIZE, INK, MUTED, PAPER, body_colours, stability_style
from cfplan_core.trajectory.plan_result import PlanResult

FASTEST = 50.0
_WIDTH = 5.6
_DPI = 120
_HOLD = 1.0


def write_animation(
    problem: Problem,
    result: PlanResult,
    path: str | Path,
    fps: float = 20.0,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write a plan in real time as a GIF or an MP4 file.

    The last image is held for a second. Between frames of the plan the motion is interpolated.

    Args:
        problem: What was planned for.
        result: A solved one.
        path: Ends in ``.gif`` or ``.mp4``; its folder is made if it does not exist.
        fps: Images per second; a GIF's pause between images is rounded to 10 ms.
        progress: Called with the number of images done and of all images.

    Returns:
        The path.

    Raises:
        CfplanError: There is no plan, it is not the problem's, the suffix is another one, the
            rate is out of range, ffmpeg is missing or fails, or the path cannot be written.
    """
    target = Path(path)
    kind = target.suffix.lower()
    if kind not in ('.gif', '.mp4'):
        raise CfplanError(f'animation file must end in .gif or .mp4, got {target}')
    if not 1.0 <= fps <= FASTEST:
        raise CfplanError(f'fps must be from 1 to {FASTEST:g} images per second, got {fps:g}')
    if not result.solved:
        raise CfplanError(f'only a solved plan can be animated, status is {result.status.value}')
    check_belongs(problem, result)
    if kind == '.mp4' and shutil.which('ffmpeg') is None:
        raise CfplanError(
            f'cannot write {target}: .mp4 needs the program ffmpeg; install it (package ffmpeg), '
            'or use a name that ends in .gif'
        )
    pause = round(100.0 / fps) / 100.0 if kind == '.gif' else 1.0 / fps
    instants = sample_instants(result, pause)
    images = _images(problem, result, instants, progress)
    with replacing(target) as temporary:
        if kind == '.gif':
            _write_gif(temporary, images, _palette(problem), pause)
        else:
            _write_mp4(temporary, images, fps)
    return target


def sample_instants(result: PlanResult, pause: float) -> FloatArray:
    """Instants of the images, s: equally spaced from the first to the last frame, then held."""
    first, last = result.times[0], result.times[-1]
    moving = first + pause * np.arange(int(np.ceil((last - first) / pause)))
    return np.concatenate([moving, np.full(max(1, round(_HOLD / pause)), last)])


def grasp_at(result: PlanResult, instant: float) -> Grasp:
    """Configuration at an instant (s), linear between frames."""
    rows = np.hstack([result.object_poses, result.joints])
    row = np.array([np.interp(instant, result.times, column) for column in rows.T])
    return Grasp(row[:3], row[3:])


def _images(
    problem: Problem,
    result: PlanResult,
    instants: FloatArray,
    progress: Callable[[int, int], None] | None,
) -> Iterator[Image.Image]:
    """Draw one image after the other; equal instants share a drawing."""
    view = view_of(problem, plan_grasps(result))
    height = _WIDTH * view.height / view.width
    figure = new_figure(_WIDTH + 0.2, height + 0.7)
    figure.set_dpi(_DPI)
    axes = world_axes(figure, 0.1, 0.36, _WIDTH, view)
    figure_header(figure, problem, axes, view)
    bodies = draw_bodies(axes, problem, grasp_at(result, float(instants[0])))
    caption = figure.text(0.5, 0.015, '', ha='center', va='bottom', fontsize=FONT_SIZE, color=INK)
    image = None
    for k, instant in enumerate(instants):
        if image is None or instant != instants[k - 1]:
            grasp = grasp_at(result, float(instant))
            bodies['object'].set_xy(problem.object.world_vertices(grasp.object_pose))
            for name, vertices in problem.hand.world_vertices(grasp.joints).items():
                bodies[name].set_xy(vertices)
            frame = int(np.searchsorted(result.times, instant, side='right')) - 1
            number = segment_at(result.segments, max(0, min(frame, len(result.times) - 2)))
            segment = result.segments[number]
            caption.set_text(
                f't = {instant - result.times[0]:.2f} s, frame {frame}, segment {number + 1} of '
                f'{len(result.segments)}: {stability_style(segment.stability).label}'
            )
            marks = contact_marks(problem, grasp, segment.contacts)
            drawn = draw_contacts(axes, marks, 0.22 * problem.object.size, size=3.2)
            image = _render(figure)
            for artist in drawn:
                artist.remove()
        yield image
        if progress is not None:
            progress(k + 1, len(instants))


def _render(figure: Figure) -> Image.Image:
    canvas: Any = figure.canvas
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert('RGB')


def _write_gif(
    path: Path, images: Iterator[Image.Image], palette: Image.Image, pause: float
) -> None:
    first, *rest = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    first.save(
        path,
        format='GIF',
        save_all=True,
        append_images=rest,
        duration=round(1000.0 * pause),
        loop=0,
        optimize=False,
    )


def _palette(problem: Problem) -> Image.Image:
    """The exact colours of what is drawn, and three steps between any two for smooth edges."""
    names = dict.fromkeys((PAPER, INK, MUTED, *body_colours(problem.hand).values()))
    colours = 255.0 * np.array([to_rgb(name) for name in names])
    steps = [
        part * a + (1.0 - part) * b
        for a, b in combinations(colours, 2)
        for part in (0.25, 0.5, 0.75)
    ]
    palette = Image.new('P', (1, 1))
    palette.putpalette(np.rint([*colours, *steps]).astype(np.uint8).tobytes())
    return palette


def _write_mp4(path: Path, images: Iterator[Image.Image], fps: float) -> None:
    """Pipe raw images through ffmpeg, padded to the even sizes that H.264 needs.

    Raises:
        CfplanError: ffmpeg fails, with the last line that it says.
    """
    first = next(images)
    command = ['ffmpeg', '-y', '-loglevel', 'error', '-f', 'rawvideo', '-pix_fmt', 'rgb24']
    command += ['-s', f'{first.width}x{first.height}', '-r', f'{fps:g}', '-i', '-']
    command += ['-vf', 'pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white', '-pix_fmt', 'yuv420p']
    command += ['-movflags', '+faststart', '-f', 'mp4', str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None
        try:
            for image in chain([first], images):
                process.stdin.write(image.tobytes())
        except BrokenPipeError:
            pass  # ffmpeg has stopped reading; its message says why.
        _, complaint = process.communicate()
    if process.returncode != 0:
        lines = complaint.decode(errors='replace').strip().splitlines() or ['no message']
        raise CfplanError(f'ffmpeg failed: {lines[-1]}; a name that ends in .gif needs no ffmpeg')
