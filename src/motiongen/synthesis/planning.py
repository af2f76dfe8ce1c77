"""From a timeline to what the pipeline generates from: initial motions, tags as vectors, paths frame by frame."""

from __future__ import annotations

import logging

import torch
from torch import Tensor

from motiongen.data.clips import INITIAL_FRAMES
from motiongen.data.datamodule import MotionData
from motiongen.data.sources.folder import read_motion
from motiongen.motion.canonical import GroundFrame
from motiongen.suggestions import did_you_mean
from motiongen.synthesis.limits import Limits, limits_of
from motiongen.synthesis.paths import (
    DrawnPath,
    PlacedPath,
    RecordedPath,
    cut_line,
    direction,
    fit_bezier,
    fit_path,
    length,
    sample_bezier,
)
from motiongen.synthesis.pipeline import Plan, Step
from motiongen.synthesis.timeline import Action, Timeline, TimelineError

DURATION_TOLERANCE = 1.1
"""An action may be this much longer or shorter than the training clips without a warning."""
SPEED_TOLERANCE = 1.1
"""A path may be this much faster than the fastest half second of training."""

_log = logging.getLogger(__name__)


class Planner:
    """Plans the motions of one timeline.

    Args:
        timeline: whose tags are the data's (`timeline.resolve`).
        data: what the generator was trained on.

    Raises:
        TimelineError: a path of an action that does not travel or that is too fast for it, an unknown style or clip, a
            frame that the start does not have. What is merely unusual is logged: a duration outside of the training
            clips', a path that begins in a direction in which none of them does.
        DataError: the start's file is no motion.
    """

    def __init__(self, timeline: Timeline, data: MotionData) -> None:
        self.timeline = timeline
        self.data = data
        self.items = data.train_items()
        tags = dict.fromkeys(tag for action in timeline.actions for tag in action.tags)
        self.limits = {tag: limits_of(tag, data) for tag in tags}
        self.style = self._style()
        for number, action in enumerate(timeline.actions):
            self._check_duration(number, action)
        self.drawn = self._drawn_paths()
        self.given = self._given_start()

    def plan(self, seed: int) -> Plan:
        """One motion; what the timeline leaves open, initial motion and paths, is drawn from the training clips."""
        draw = torch.Generator().manual_seed(seed)
        steps = [self._step(number, draw) for number in range(len(self.timeline.actions))]
        styles = self.style
        if self.given is not None:
            initial_motion = self.given
        else:
            item = self.items[self._draw(self.timeline.actions[0], draw)]
            initial_motion = item.initial_motion
            styles = item.styles if styles is None else styles
        if styles is None:
            styles = torch.zeros(len(self.data.styles))
        return Plan(self._placed(initial_motion), steps, styles)

    def _style(self) -> Tensor | None:
        style, known = self.timeline.style, self.data.styles
        if style is None:
            return None
        if style not in known:
            listed = f"\n  styles: {', '.join(known)}" if known else "; the data has none"
            raise TimelineError(
                f"{self.timeline.name}: style: unknown style {style!r}{did_you_mean(style, known)}{listed}"
            )
        return torch.tensor([float(one == style) for one in known])

    def _check_duration(self, number: int, action: Action) -> None:
        shortest = min(self.limits[tag].shortest for tag in action.tags)
        longest = max(self.limits[tag].longest for tag in action.tags)
        if not shortest / DURATION_TOLERANCE <= action.seconds <= longest * DURATION_TOLERANCE:
            _log.warning(
                "%s: actions[%d] (%s): %g s; training clips take %.1f to %.1f s",
                *(self.timeline.name, number, action.label, action.seconds, shortest, longest),
            )

    def _drawn_paths(self) -> dict[int, DrawnPath | PlacedPath]:
        """The paths that the user drew, by the number of the action."""
        actions, line = self.timeline.actions, self.timeline.path
        travelling = [number for number, action in enumerate(actions) if self._travels(action)]
        pieces: dict[int, Tensor] = {}
        for number, action in enumerate(actions):
            if action.path is not None:
                if number not in travelling:
                    roots = ", ".join(tag for tag in self.data.tags if tag in self.data.store.root_tags)
                    raise TimelineError(
                        f"{self.timeline.name}: actions[{number}].path: {action.label} does not travel\n"
                        f"  tags that do: {roots}"
                    )
                pieces[number] = torch.tensor(action.path)
        if line is not None:
            if not travelling:
                raise TimelineError(f"{self.timeline.name}: path: none of the actions travels")
            ways = [actions[number].frames * self._limits(number).usual_speed for number in travelling]
            pieces = dict(zip(travelling, cut_line(torch.tensor(line), ways), strict=True))
        paths: dict[int, DrawnPath | PlacedPath] = {}
        for number, piece in pieces.items():
            curve = sample_bezier(fit_bezier(piece), actions[number].frames) - piece[0]
            self._check_speed(number, curve)
            paths[number] = DrawnPath(curve) if line is None else PlacedPath(piece[0], curve)
        return paths

    def _check_speed(self, number: int, curve: Tensor) -> None:
        action, top = self.timeline.actions[number], self._limits(number).top_speed
        way = length(curve)
        speed = way / action.seconds
        if speed > SPEED_TOLERANCE * top:
            field = f"actions[{number}].path" if self.timeline.path is None else "path"
            usual = action.seconds * self._limits(number).usual_speed
            raise TimelineError(
                f"{self.timeline.name}: {field}: {way:.1f} m in {action.seconds:g} s are {speed:.1f} m/s, too fast for "
                f"actions[{number}] ({action.label}), which reaches {top:.1f} m/s in training; {usual:.1f} m are usual"
            )

    def _limits(self, number: int) -> Limits:
        """Those of the fastest of an action's tags that travel."""
        tags = [tag for tag in self.timeline.actions[number].tags if tag in self.data.store.root_tags]
        return max((self.limits[tag] for tag in tags), key=lambda own: own.top_speed)

    def _given_start(self) -> Tensor | None:
        """(K, 135) in the canonical frame of the last, where the timeline says what it begins from."""
        start, where = self.timeline.start, f"{self.timeline.name}: start"
        if start is None:
            return None
        if start.file is not None:
            motion, first = read_motion(start.file), 0
            last = len(motion) - 1 if start.frame is None else start.frame
        else:
            names = [sequence.name for sequence in self.data.store.sequences]
            if start.clip not in names:
                raise TimelineError(f"{where}.clip: unknown clip {start.clip!r}{did_you_mean(str(start.clip), names)}")
            motion = self.data.store.features(names.index(start.clip))
            first = INITIAL_FRAMES - 1
            last = first if start.frame is None else start.frame
        if not first <= last < len(motion):
            raise TimelineError(f"{where}.frame: {last} is not among the frames {first} to {len(motion) - 1}")
        earlier = (torch.arange(INITIAL_FRAMES) + last + 1 - INITIAL_FRAMES).clamp(min=0)
        initial_motion = motion[earlier].float()
        return GroundFrame.of(initial_motion[-1]).enter(initial_motion)

    def _step(self, number: int, draw: torch.Generator) -> Step:
        action = self.timeline.actions[number]
        tags = torch.tensor([float(tag in action.tags) for tag in self.data.tags])
        if not self._travels(action):
            return Step(tags, action.frames)
        if number in self.drawn:
            return Step(tags, action.frames, self.drawn[number], self._limits(number).directions)
        recorded = self.items[self._draw(action, draw, action.frames)].trajectory
        return Step(tags, action.frames, RecordedPath(fit_path(recorded, action.frames)))

    def _draw(self, action: Action, draw: torch.Generator, frames: int = 0) -> int:
        """A training item with the first of the action's tags that fits best: of the style, and long enough."""
        sequences, clips = self.data.store.sequences, self.items.clips
        segments = [sequences[clip.sequence].segments[clip.segment] for clip in clips]
        chosen = [index for index, segment in enumerate(segments) if action.tags[0] in segment.tags]
        chosen = [index for index in chosen if self.timeline.style in segments[index].styles] or chosen
        enough = [index for index in chosen if len(clips[index]) >= frames]
        if not enough:
            return max(chosen, key=lambda index: len(clips[index]))
        return enough[int(torch.randint(len(enough), (), generator=draw))]

    def _placed(self, initial_motion: Tensor) -> Tensor:
        """The initial motion where the first drawn path begins, turned so that the path can be followed."""
        if not self.drawn:
            return initial_motion
        number = min(self.drawn)
        path, own = self.drawn[number], self.timeline.actions[0].path
        origin = path.start if isinstance(path, PlacedPath) else torch.tensor(own[0] if own else (0.0, 0.0))
        yaw = direction(path.points) - self._limits(number).directions.middle
        return GroundFrame(torch.tensor(yaw), origin).leave(initial_motion)

    def _travels(self, action: Action) -> bool:
        return bool(set(action.tags) & set(self.data.store.root_tags))
