"""Put labels beside points so that none covers another."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from string import ascii_uppercase
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.report.style import MUTED

_TURNS = tuple(np.deg2rad((0, 30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180)))
_REACHES = (1.0, 1.6, 2.4, 3.4, 4.8)
_NEAR = 1.6
_CUT = 10.0


@dataclass(frozen=True, eq=False)
class Label:
    """A text that belongs to a point.

    Attributes:
        text: What to write.
        point: Shape (2,), data coordinates.
        direction: Shape (2,), where the text should lie as seen from the point, on paper.
        style: Passed to matplotlib.
        distance: From the point to the middle of the text at first, points (1/72 inch).
        avoid: Shape (k, 4), boxes that this label keeps free too, as from `point_boxes`.
    """

    text: str
    point: FloatArray
    direction: FloatArray
    style: dict[str, Any] = field(default_factory=dict)
    distance: float = 9.0
    avoid: FloatArray = field(default_factory=lambda: np.empty((0, 4)))


def letter(k: int) -> str:
    """A to Z for 0 to 25, then AA, AB and so on."""
    head, tail = divmod(k, len(ascii_uppercase))
    return (letter(head - 1) if head else '') + ascii_uppercase[tail]


def renderer_of(axes: Axes) -> Any:
    """The renderer with which texts are measured.

    Raises:
        TypeError: The figure is not drawn by Agg.
    """
    canvas = axes.figure.canvas
    if not isinstance(canvas, FigureCanvasAgg):
        raise TypeError('the axes must be in a figure with a FigureCanvasAgg')
    return cast(Any, canvas).get_renderer()


def point_boxes(axes: Axes, points: FloatArray, radius: float) -> FloatArray:
    """Squares on paper around points, to be kept free.

    Args:
        axes: Whose limits are final.
        points: Shape (p, 2), data coordinates.
        radius: Half a side, points (1/72 inch).

    Returns:
        Shape (p, 4): left, bottom, right, top, pixels.
    """
    centres = np.asarray(axes.transData.transform(np.reshape(points, (-1, 2))))
    half = radius * _pixels(axes)
    return np.hstack([centres - half, centres + half])


def place_labels(axes: Axes, labels: Sequence[Label], taken: FloatArray) -> tuple[Annotation, ...]:
    """Write labels where they are free of each other, of what is taken, and inside the axes.

    Every label tries its own direction first, then turns away from it, then farther out with a
    thin line to its point. Where nothing is free the place with the least overlap is used.

    Args:
        axes: Whose limits and position are final.
        labels: In order of precedence.
        taken: Shape (k, 4), boxes to be kept free, as from `point_boxes`.
    """
    renderer = renderer_of(axes)
    pixels = _pixels(axes)
    frame = np.array([axes.get_window_extent(renderer).extents])
    occupied = taken[_overlaps(frame[0], taken) > 0.0]
    placed = []
    for label in labels:
        annotation = axes.annotate(
            label.text,
            xy=(label.point[0], label.point[1]),
            xytext=(0.0, 0.0),
            textcoords='offset points',
            ha='center',
            va='center',
            **label.style,
        )
        extent = _extent(annotation, renderer)
        anchor = np.asarray(axes.transData.transform(label.point))
        half = np.array([extent.width, extent.height]) / 2.0 + pixels
        best_cost, best_offset, best_reach = np.inf, np.zeros(2), 0.0
        for offset, reach in _offsets(label.direction, label.distance * pixels, half):
            box = np.concatenate([anchor + offset - half, anchor + offset + half])
            outside = 4.0 * half[0] * half[1] - _overlaps(box, frame)[0]
            covered = _overlaps(box, occupied).sum() + _overlaps(box, label.avoid).sum()
            cost = covered + _CUT * outside
            if cost < best_cost - 1e-6:
                best_cost, best_offset, best_reach = cost, offset, reach
            if best_cost < 1e-6:
                break
        annotation.xyann = tuple(best_offset / pixels)
        box = np.concatenate([anchor + best_offset - half, anchor + best_offset + half])
        occupied = np.vstack([occupied, box])
        placed.append(annotation)
        if best_reach > _NEAR:
            _leader(axes, label.point, best_offset / pixels)
    return tuple(placed)


def _extent(annotation: Annotation, renderer: Any) -> Bbox:
    """Extent on paper of a text, or of the box around it."""
    patch = annotation.get_bbox_patch()
    if patch is None:
        return annotation.get_window_extent(renderer)
    annotation.update_bbox_position_size(renderer)
    return patch.get_window_extent(renderer)


def _pixels(axes: Axes) -> float:
    """Pixels in a point (1/72 inch)."""
    return float(axes.figure.dpi) / 72.0


def _offsets(
    direction: FloatArray, distance: float, half: FloatArray
) -> Iterator[tuple[FloatArray, float]]:
    """Candidate offsets of a text's middle, pixels, each with its reach, the best first."""
    heading = np.arctan2(direction[1], direction[0])
    for reach in _REACHES:
        for turn in _TURNS:
            ray = np.array([np.cos(heading + turn), np.sin(heading + turn)])
            support = float(np.abs(ray) @ (half - half.min()))
            yield ray * (distance * reach + support), reach


def _overlaps(box: FloatArray, others: FloatArray) -> FloatArray:
    """Areas that a box, shape (4,), shares with others, shape (k, 4)."""
    sides = np.minimum(box[2:], others[:, 2:]) - np.maximum(box[:2], others[:, :2])
    return np.asarray(np.prod(np.maximum(sides, 0.0), axis=1))


def _leader(axes: Axes, point: FloatArray, offset: FloatArray) -> None:
    axes.annotate(
        '',
        xy=(point[0], point[1]),
        xytext=(0.8 * offset[0], 0.8 * offset[1]),
        textcoords='offset points',
        arrowprops={'arrowstyle': '-', 'color': MUTED, 'linewidth': 0.5, 'shrinkB': 3.0},
    )
