"""A small Transformer encoder with a class token (the recognizer of Neural Marionette, section 5.1.2)."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn.functional import pad

from motiongen.motion.skeleton import Skeleton
from motiongen.options import PositiveInt, Share
from motiongen.recognition.recognizer import Recognizer, RecognizerOutput
from motiongen.recognition.signals import SIGNALS, body_signals


class TransformerRecognizer(Recognizer):
    """Short runs of frames and a class token through a pre-norm Transformer; the token's output is the motion's code.

    Args:
        tags: actions to tell apart.
        skeleton: the body whose joints it looks at.
        patch: frames that share a token. Recognition loses nothing by it and costs that many times less.
        width: width of the Transformer.
        heads: attention heads.
        layers: Transformer layers.
        feedforward: width of the feed-forward layers.
        dropout: in embedding, attention and feed-forward layers, while training.
        feature_width: numbers in the motion's code. FID needs more samples than this to be of full rank.
    """

    def __init__(
        self,
        *,
        tags: PositiveInt,
        skeleton: Skeleton,
        patch: PositiveInt = 4,
        width: PositiveInt = 128,
        heads: PositiveInt = 4,
        layers: PositiveInt = 2,
        feedforward: PositiveInt = 256,
        dropout: Share = 0.1,
        feature_width: PositiveInt = 64,
    ) -> None:
        super().__init__()
        if width % heads or width % 2:
            raise ValueError(f"recognizer.network: width {width} is even and a multiple of heads ({heads})")
        self.register_buffer("offsets", skeleton.offsets.clone())
        self.patch = patch
        self.embed = nn.Linear(patch * SIGNALS, width)
        self.token = nn.Parameter(torch.zeros(1, 1, width))
        self.dropout = nn.Dropout(dropout)
        layer = nn.TransformerEncoderLayer(
            width, heads, feedforward, dropout, activation="gelu", batch_first=True, norm_first=True
        )
        # Nested tensors would turn padding into another code path with other rounding.
        self.encoder = nn.TransformerEncoder(layer, layers, norm=nn.LayerNorm(width), enable_nested_tensor=False)
        self.to_features = nn.Linear(width, feature_width)
        self.to_logits = nn.Linear(feature_width, tags)

    def forward(self, motion: Tensor, mask: Tensor) -> RecognizerOutput:
        """Motion (B, T, 135), mask (B, T) to logits (B, A) and features (B, E)."""
        return self.recognize(body_signals(motion, mask, Skeleton(self.get_buffer("offsets"))), mask)

    def recognize(self, signals: Tensor, mask: Tensor) -> RecognizerOutput:
        """As `forward`, of what `body_signals` makes of the motion (B, T, SIGNALS)."""
        rest = -mask.shape[1] % self.patch
        patches = self.embed(pad(signals, (0, 0, 0, rest)).unflatten(1, (-1, self.patch)).flatten(2))
        patches = patches + sinusoids(patches.shape[1], patches.shape[2]).to(patches)
        tokens = torch.cat([self.token.expand(len(patches), -1, -1), patches], dim=1)
        valid = pad(mask, (0, rest)).unflatten(1, (-1, self.patch)).any(dim=2)
        valid = torch.cat([torch.ones_like(valid[:, :1]), valid], dim=1)
        code = self.encoder(self.dropout(tokens), src_key_padding_mask=~valid)[:, 0]
        features = torch.tanh(self.to_features(code))
        return RecognizerOutput(logits=self.to_logits(self.dropout(features)), features=features)


def sinusoids(length: int, width: int) -> Tensor:
    """Sinusoidal encodings (length, width) of places 0, 1, ... (Vaswani et al. 2017, section 3.5)."""
    position = torch.arange(length).unsqueeze(1)
    frequency = torch.exp(torch.arange(0, width, 2) * (-math.log(10000.0) / width))
    return torch.stack([(position * frequency).sin(), (position * frequency).cos()], dim=-1).flatten(1)
