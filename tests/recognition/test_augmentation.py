import torch

from motiongen.motion.canonical import heading
from motiongen.motion.representation import FEATURES, TRANSLATION
from motiongen.recognition.augmentation import Augmentation, change_tempo
from tests.motion.poses import standing


def test_tempo_resamples_a_straight_line_exactly_and_scales_the_length() -> None:
    motion = torch.zeros(2, 9, FEATURES)
    motion[..., TRANSLATION] = torch.arange(9.0).view(1, 9, 1)
    mask = torch.ones(2, 9, dtype=torch.bool)
    mask[1, 5:] = False
    motion[1, 5:] = 0
    new, valid = change_tempo(motion, mask, torch.tensor([2.0, 0.5]))
    assert valid.sum(dim=1).tolist() == [5, 9]
    torch.testing.assert_close(new[0, :5, -1], torch.arange(5) * 2.0)
    torch.testing.assert_close(new[1, :9, -1], torch.arange(9) * 0.5)
    assert (new[~valid] == 0).all()


def test_without_strength_nothing_changes() -> None:
    motion = torch.randn(3, 7, FEATURES, generator=torch.Generator().manual_seed(0))
    mask = torch.arange(7) < torch.tensor([[7], [3], [1]])
    motion = motion * mask.unsqueeze(-1)
    new, valid = Augmentation(tempo=0.0, yaw=0.0, noise=0.0)(motion, mask, torch.Generator())
    torch.testing.assert_close(new, motion, atol=1e-6, rtol=0)
    assert torch.equal(valid, mask)


def test_yaw_turns_the_whole_motion_by_one_angle() -> None:
    motion = standing(6).unsqueeze(0)
    new, _ = Augmentation(tempo=0.0, yaw=0.5, noise=0.0)(
        motion, torch.ones(1, 6, dtype=torch.bool), torch.Generator().manual_seed(0)
    )
    angles = heading(new[0])
    assert angles.abs().min() > 0.01
    torch.testing.assert_close(angles, angles[:1].expand(6))
