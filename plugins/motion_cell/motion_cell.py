"""The motion cell: a recurrent unit with a conditional VAE in it (Ghorbani et al. 2020, section 3.3)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import torch
from torch import Tensor, nn

from motiongen.contracts import Posterior
from motiongen.options import PositiveInt

LEAST_DEVIATION = 1e-4
"""Softplus alone may round to 0, whose logarithm the KL divergence takes."""


@dataclass(frozen=True)
class Step:
    """What a cell made of one word."""

    latent: Tensor
    """(B, D): z_n, as it was drawn."""
    word: Tensor
    """(B, W): the word as the cell decoded it."""
    state: Tensor
    """(B, H): h_n."""


class MotionCell(nn.Module):
    """Algorithms 1 and 2; the networks are those of Table 1.

    Args:
        word_width: W, numbers of a word.
        attribute_width: numbers of the attribute vector a.
        output: the activation that a word ends with.
        latent: D, numbers of z.
        features: width of what f_w and f_z extract.
        hidden: width of the hidden layers.
        state: width of each of the two GRU cells; h is both, H = 2 `state`.
    """

    def __init__(
        self,
        word_width: int,
        attribute_width: int,
        output: nn.Module,
        *,
        latent: PositiveInt,
        features: PositiveInt,
        hidden: PositiveInt,
        state: PositiveInt,
    ) -> None:
        super().__init__()
        self.state_width = 2 * state
        context = self.state_width + attribute_width
        self.read_word = nn.Sequential(_hidden(word_width, hidden, 2), nn.Linear(hidden, features), nn.ELU())
        self.read_latent = nn.Sequential(_hidden(latent, hidden, 2), nn.Linear(hidden, features), nn.ELU())
        self.write_word = nn.Sequential(_hidden(features + context, hidden, 2), nn.Linear(hidden, word_width), output)
        self.posterior = Gaussian(features + context, latent, hidden)
        self.prior = Gaussian(context, latent, hidden)
        self.lower, self.upper = nn.GRUCell(2 * features, state), nn.GRUCell(state, state)

    def forward(
        self, word: Tensor, attributes: Tensor, state: Tensor, dropped: Tensor, generator: torch.Generator
    ) -> tuple[Step, Posterior]:
        """Algorithm 1, one step of training, but for the prior: it takes no part in the step.

        Args:
            word: (B, W) w_n.
            attributes: (B, A) a_n.
            state: (B, H) h_{n-1}.
            dropped: (B, 1) bool, where the cell goes on from its own word instead of w_n.
            generator: for the draw of z.
        """
        seen = self.read_word(word)
        posterior = self.posterior(seen, state, attributes)
        latent = posterior.sample(generator)
        code = self.read_latent(latent)
        made = self.write_word(torch.cat([code, state, attributes], dim=-1))
        heard = torch.where(dropped, self.read_word(made), seen)
        return Step(latent, made, self.transition(heard, code, state)), posterior

    def sample(self, attributes: Tensor, state: Tensor, generator: torch.Generator) -> Step:
        """Algorithm 2, one step of generation: attributes (B, A), state (B, H)."""
        latent = self.prior(state, attributes).sample(generator)
        code = self.read_latent(latent)
        made = self.write_word(torch.cat([code, state, attributes], dim=-1))
        return Step(latent, made, self.transition(self.read_word(made), code, state))

    def transition(self, seen: Tensor, code: Tensor, state: Tensor) -> Tensor:
        """h_n = f_h(f_w(w_n), f_z(z_n), h_{n-1}) (Eq. 11): two stacked GRU cells, their states side by side."""
        low, up = state.chunk(2, dim=-1)
        low = self.lower(torch.cat([seen, code], dim=-1), low)
        return torch.cat([low, self.upper(low, up)], dim=-1)


class Gaussian(nn.Module):
    """Mean and deviation of z from the concatenated inputs, by a network each (Eq. 5 and 8)."""

    def __init__(self, inputs: int, latent: int, hidden: int) -> None:
        super().__init__()
        self.mean = nn.Sequential(_hidden(inputs, hidden, 4), nn.Linear(hidden, latent))
        self.deviation = nn.Sequential(_hidden(inputs, hidden, 4), nn.Linear(hidden, latent), nn.Softplus())

    def forward(self, *inputs: Tensor) -> Posterior:
        """(..., any widths) to a distribution over (..., D)."""
        joined = torch.cat(inputs, dim=-1)
        return Posterior(self.mean(joined), 2 * (self.deviation(joined) + LEAST_DEVIATION).log())


def _hidden(inputs: int, width: int, layers: int) -> nn.Sequential:
    """As many times [FC(width) + ELU]."""
    sizes = [inputs] + [width] * layers
    return nn.Sequential(*(nn.Sequential(nn.Linear(before, after), nn.ELU()) for before, after in pairwise(sizes)))
