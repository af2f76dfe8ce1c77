import pytest
import torch

from motiongen.motion.skeleton import JOINTS, Skeleton
from motiongen.recognition.transformer import TransformerRecognizer


def test_heads_must_divide_the_width() -> None:
    with pytest.raises(ValueError, match="multiple of heads"):
        TransformerRecognizer(tags=5, skeleton=Skeleton(torch.zeros(JOINTS, 3)), width=10, heads=4)
