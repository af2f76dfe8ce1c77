"""UM-CVAE's composition, small, for several tests."""

from __future__ import annotations

from functools import partial

import torch

from motiongen.contracts import Dimensions
from motiongen.generation.staged import StagedGenerator
from motiongen.motion.representation import FEATURES
from motiongen_plugins.action_agnostic_tcn.action_agnostic_tcn import ActionAgnosticTCN
from motiongen_plugins.direct.direct import Direct
from motiongen_plugins.film.film import FiLM
from motiongen_plugins.gru_decoder.gru_decoder import GRUDecoder
from motiongen_plugins.latent_reinforcement.latent_reinforcement import LatentReinforcement
from motiongen_plugins.linear_time.linear_time import LinearTime
from tests.compositions import INITIAL_FRAMES, TAGS, WIDTH

DIMENSIONS = Dimensions(FEATURES, TAGS, INITIAL_FRAMES, WIDTH)
FILM = {"channels": 8, "graph_layers": 2, "candidates": 3, "temporal_layers": 2, "kernel": 3}
TCN = {"layers": 6, "channels": 16, "kernel": 3, "normalize_after": 3, "segments": 4}


def um_cvae(interpolation: float = 0.0) -> StagedGenerator:
    """Weights from seed 0; the bank is empty."""
    torch.manual_seed(0)
    return StagedGenerator(
        features=FEATURES,
        tags=TAGS,
        initial_frames=INITIAL_FRAMES,
        width=WIDTH,
        encoder=partial(ActionAgnosticTCN, **TCN),
        conditioning=partial(FiLM, interpolation=interpolation, **FILM),
        unroller=LinearTime,
        decoder=partial(GRUDecoder, layer_input={"latent_reinforcement": LatentReinforcement}, layers=4),
        training=Direct(),
    )
