"""Motion words: runs of frames as feature vectors (Ghorbani et al. 2020, section 3.2)."""

from __future__ import annotations

from torch import Tensor, nn

from motiongen.options import PositiveInt


class MotionWords(nn.Module):
    """w_n = f_enc(l poses), l poses = f_dec(w_n) (Eq. 1 and 3), fully connected (Table 1).

    Args:
        pose_width: P, numbers of a pose.
        frames: l, poses in a word.
        width: W, numbers of a word.
        hidden: width of the hidden layers.
    """

    def __init__(self, pose_width: int, *, frames: PositiveInt, width: PositiveInt, hidden: PositiveInt) -> None:
        super().__init__()
        self.frames = frames
        self.width = width
        self.output = nn.ELU()
        self.encoder = nn.Sequential(
            *(nn.Linear(frames * pose_width, hidden), nn.ELU(), nn.Linear(hidden, hidden), nn.ELU()),
            *(nn.Linear(hidden, width), self.output),
        )
        self.decoder = nn.Sequential(
            *(nn.Linear(width, hidden), nn.ELU(), nn.Linear(hidden, hidden), nn.ELU()),
            nn.Linear(hidden, frames * pose_width),
        )

    def encode(self, poses: Tensor) -> Tensor:
        """Poses (B, N l, P) to words (B, N, W)."""
        return self.encoder(poses.unflatten(1, (-1, self.frames)).flatten(2))

    def decode(self, words: Tensor) -> Tensor:
        """Words (B, N, W) to poses (B, N l, P)."""
        return self.decoder(words).unflatten(2, (self.frames, -1)).flatten(1, 2)


class SingleFrames(nn.Module):
    """Every pose is its own word: the paper's ablation SL ("single layer"), without f_enc and f_dec."""

    frames = 1

    def __init__(self, pose_width: int) -> None:
        super().__init__()
        self.width = pose_width
        self.output = nn.Identity()

    def encode(self, poses: Tensor) -> Tensor:
        """(B, T, P) as it is."""
        return poses

    def decode(self, words: Tensor) -> Tensor:
        """(B, T, P) as it is."""
        return words
