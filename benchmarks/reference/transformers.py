"""ACTOR and MARIONET as papers publish them: time first, padding computed along, one nn.Transformer after another.

Each takes over the weights of a generator of ours, so that both give the same numbers.
"""

from __future__ import annotations

import copy

import torch
from torch import Tensor, nn

from motiongen.contracts import Condition, GeneratorModule, MotionBatch


class PositionalEncoding(nn.Module):
    """Adds the sinusoids of a table to a sequence (T, B, D), as in PyTorch's tutorial."""

    def __init__(self, width: int, dropout: float = 0.0, longest: int = 5000) -> None:
        super().__init__()
        self.dropout = nn.Dropout(dropout)
        place = torch.arange(longest, dtype=torch.float).unsqueeze(1)
        rate = torch.exp(torch.arange(0, width, 2).float() * (-torch.log(torch.tensor(10000.0)) / width))
        table = torch.zeros(longest, width)
        table[:, 0::2] = torch.sin(place * rate)
        table[:, 1::2] = torch.cos(place * rate)
        self.register_buffer("table", table.unsqueeze(1))

    def forward(self, x: Tensor) -> Tensor:
        return self.dropout(x + self.table[: x.shape[0]])


def time_first(stack: nn.TransformerEncoder | nn.TransformerDecoder) -> nn.TransformerEncoder | nn.TransformerDecoder:
    """The same stack of layers for sequences (T, B, D)."""
    ours = stack.layers[0]
    is_decoder = isinstance(ours, nn.TransformerDecoderLayer)
    build = nn.TransformerDecoderLayer if is_decoder else nn.TransformerEncoderLayer
    attention, feedforward = ours.self_attn, ours.linear1
    layer = build(attention.embed_dim, attention.num_heads, feedforward.out_features, ours.dropout.p, ours.activation)
    layers = len(stack.layers)
    if is_decoder:
        plain: nn.TransformerEncoder | nn.TransformerDecoder = nn.TransformerDecoder(layer, layers)
    else:
        plain = nn.TransformerEncoder(layer, layers, enable_nested_tensor=False)
    plain.load_state_dict(stack.state_dict())
    return plain.train(stack.training)


class PlainActor(nn.Module):
    """ACTOR in the style of its published code."""

    def __init__(self, ours: GeneratorModule) -> None:
        super().__init__()
        ours = copy.deepcopy(ours)
        encoder, decoder = ours.encoder, ours.decoder
        width = ours.dimensions.width
        self.embedding, self.final = encoder.pose_embedding, decoder.pose
        self.mean_tokens, self.spread_tokens = encoder.mean_tokens, encoder.log_variance_tokens
        self.biases = ours.conditioning.biases
        self.positions = PositionalEncoding(width, encoder.dropout.p)
        self.encoder, self.decoder = time_first(encoder.transformer), time_first(decoder.transformer)
        self.train(ours.training)

    def forward(self, batch: MotionBatch, noise: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """The motion (B, T, F), mean and log-variance (B, D)."""
        label, mask = batch.condition.tags.argmax(dim=1), batch.condition.mask
        x = self.embedding(batch.motion.permute(1, 0, 2))
        x = torch.cat((self.mean_tokens[label][None], self.spread_tokens[label][None], x), dim=0)
        extended = torch.cat((torch.ones(len(label), 2, dtype=torch.bool), mask), dim=1)
        encoded = self.encoder(self.positions(x), src_key_padding_mask=~extended)
        mean, spread = encoded[0], encoded[1]
        code = mean + torch.exp(0.5 * spread) * noise + self.biases[label]
        queries = self.positions(torch.zeros(mask.shape[1], len(label), code.shape[1]))
        decoded = self.final(self.decoder(tgt=queries, memory=code[None], tgt_key_padding_mask=~mask))
        return decoded.permute(1, 0, 2), mean, spread


class PlainMarionet(nn.Module):
    """MARIONET, which has no published code, in the same style."""

    def __init__(self, ours: GeneratorModule) -> None:
        super().__init__()
        ours = copy.deepcopy(ours)
        encoder, unroller, decoder = ours.encoder, ours.unroller, ours.decoder
        branch = unroller.branches["trajectory_branch"]
        self.pose, self.tag, self.final = encoder.pose_embedding, encoder.tag_embedding, decoder.pose
        self.mean, self.spread, self.projection = encoder.mean, encoder.log_variance, unroller.projection
        self.point = branch.embedding
        self.positions = PositionalEncoding(ours.dimensions.width)
        self.path_positions = PositionalEncoding(branch.width)
        self.encoder, self.unroller = time_first(encoder.transformer), time_first(unroller.transformer)
        self.path, self.decoder = time_first(branch.transformer), time_first(decoder.transformer)
        self.residual = decoder.residual
        self.train(ours.training)

    def controls(self, condition: Condition, noise: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Frame-level controls (T, B, D), mean and log-variance (B, D) of the code."""
        mask, tag = condition.mask, self.tag(condition.tags)
        context = torch.cat((self.pose(condition.initial_motion.permute(1, 0, 2)), tag[None]), dim=0)
        context = torch.cat((context, self.tag(condition.next_tags)[None]), dim=0)
        pooled = self.encoder(self.positions(context))[-2]
        mean, spread = self.mean(pooled), self.spread(pooled)
        code = mean + torch.exp(0.5 * spread) * noise
        left = (mask.sum(dim=1)[:, None] - torch.arange(mask.shape[1])).clamp(min=0)
        query = self.positions.table[left, 0].permute(1, 0, 2) + tag[None]
        unrolled = self.projection(self.unroller(query, code[None], tgt_key_padding_mask=~mask))
        points = self.path_positions(self.point(condition.trajectory.permute(1, 0, 2)))
        return torch.cat((unrolled, self.path(points, src_key_padding_mask=~mask)), dim=2), mean, spread

    def decode(self, past: Tensor, controls: Tensor, mask: Tensor) -> Tensor:
        """Poses so far (T, B, F) to the poses that follow each of them."""
        future = nn.Transformer.generate_square_subsequent_mask(len(past))
        hidden = ~mask
        decoded = self.decoder(
            self.positions(self.pose(past)), controls, tgt_mask=future, memory_key_padding_mask=hidden
        )
        return self.residual * past + self.final(decoded)

    @torch.no_grad()
    def generate(self, condition: Condition, noise: Tensor) -> Tensor:
        """The motion (B, T, F): the decoder runs over all past frames at every step."""
        controls, _, _ = self.controls(condition, noise)
        past = condition.initial_motion[:, -1:].permute(1, 0, 2)
        for _ in range(condition.mask.shape[1]):
            past = torch.cat((past, self.decode(past, controls, condition.mask)[-1:]), dim=0)
        return past[1:].permute(1, 0, 2)
