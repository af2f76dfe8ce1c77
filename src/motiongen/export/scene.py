"""What a preview shows: one motion on one body, with the condition that it answers."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from PIL import ImageColor
from torch import Tensor

from motiongen.errors import InputError
from motiongen.motion.bodies.body import Body
from motiongen.motion.representation import FEATURES
from motiongen.motion.skeleton import JOINT_NAMES

COLORS = ("#3b82f6", "#f59e0b", "#10b981", "#ec4899", "#8b5cf6", "#14b8a6", "#ef4444", "#84cc16", "#6366f1", "#eab308")
"""Of labels, in the order in which their texts first appear."""

SKIN, SHIRT, TROUSERS = "#b7c6e2", "#6d9cf0", "#445c94"


class SceneError(InputError):
    """A scene whose parts do not fit together; the message names the scene and the part."""


@dataclass(frozen=True)
class Scene:
    """A motion to look at."""

    title: str
    features: Tensor
    """(T, 135) world frame, z up, metres: the initial frames, then the motion."""
    body: Body
    initial_frames: int = 0
    """How many of the frames were given rather than generated."""
    trajectory: Tensor | None = None
    """(N, 2) ground-plane path that was asked for, metres, or none."""
    labels: tuple[tuple[int, int, str], ...] = ()
    """(start, stop, text): what happens in frames [start, stop)."""
    fps: float = 30.0

    def __post_init__(self) -> None:
        if self.features.dim() != 2 or self.features.shape[1] != FEATURES or len(self.features) == 0:
            raise self._error(f"features have shape {tuple(self.features.shape)}, not (T, {FEATURES}) with T > 0")
        if not torch.isfinite(self.features).all():
            raise self._error("features have values that are not finite")
        if not 0 <= self.initial_frames <= self.frames:
            raise self._error(f"initial_frames is {self.initial_frames}, not in 0..{self.frames}")
        if self.trajectory is not None:
            if self.trajectory.dim() != 2 or self.trajectory.shape[1] != 2:
                raise self._error(f"trajectory has shape {tuple(self.trajectory.shape)}, not (N, 2)")
            if not torch.isfinite(self.trajectory).all():
                raise self._error("trajectory has values that are not finite")
        for start, stop, text in self.labels:
            if not 0 <= start < stop <= self.frames:
                raise self._error(f"label {text!r} spans frames [{start}, {stop}), outside 0..{self.frames}")
        if not self.fps > 0:
            raise self._error(f"fps is {self.fps}, not positive")

    @property
    def frames(self) -> int:
        return len(self.features)

    @property
    def initial_frame(self) -> int | None:
        """The last of the given frames, or none."""
        return self.initial_frames - 1 if self.initial_frames else None

    def label_at(self, frame: int) -> str:
        """All labels of a frame, joined by " + "."""
        return " + ".join(text for start, stop, text in self.labels if start <= frame < stop)

    def color_of(self, text: str) -> str:
        """Color of a label's text, #rrggbb."""
        texts = list(dict.fromkeys(label[2] for label in self.labels))
        return COLORS[texts.index(text) % len(COLORS)]

    def _error(self, message: str) -> SceneError:
        return SceneError(f"scene {self.title!r}: {message}")


def outfit(body: Body) -> Tensor:
    """Vertex colors (V, 3) in 0..1 that tell limbs apart: a shirt, trousers, and bare head, forearms and feet."""
    worn = {"pelvis": TROUSERS, "hip": TROUSERS, "knee": TROUSERS, "spine": SHIRT, "collar": SHIRT, "shoulder": SHIRT}
    names = [next((color for part, color in worn.items() if part in joint), SKIN) for joint in JOINT_NAMES]
    colors = torch.tensor([ImageColor.getrgb(name) for name in names]) / 255
    # A power of the skinning weights makes the hems crisp.
    shares = body.weights.cpu() ** 4
    return shares / shares.sum(dim=1, keepdim=True) @ colors
