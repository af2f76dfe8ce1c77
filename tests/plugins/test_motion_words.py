from __future__ import annotations

import torch

from motiongen_plugins.motion_words.motion_words import MotionWords, SingleFrames


def words() -> MotionWords:
    torch.manual_seed(0)
    return MotionWords(5, frames=3, width=8, hidden=16)


def test_a_word_is_made_of_its_own_frames_alone():
    coder, poses = words(), torch.randn(2, 12, 5)
    changed = poses.clone()
    changed[:, 4] += 1
    before, after = coder.encode(poses), coder.encode(changed)
    assert before.shape == (2, 4, 8)
    assert ((before - after).abs().amax(dim=(0, 2)) > 0).tolist() == [False, True, False, False]


def test_frames_come_back_in_their_order():
    """The decoder's last layer gives 3 x 5 numbers: the first five are the first frame."""
    coder = words()
    torch.nn.init.zeros_(coder.decoder[-1].weight)
    coder.decoder[-1].bias.data = torch.arange(15.0)
    decoded = coder.decode(torch.randn(2, 4, 8))
    assert decoded.shape == (2, 12, 5)
    assert torch.equal(decoded[1], torch.arange(15.0).reshape(3, 5).repeat(4, 1))


def test_a_word_ends_with_elu_as_the_cell_is_told():
    coder = words()
    assert coder.encode(5 * torch.randn(50, 3, 5)).min() > -1
    assert coder.output is coder.encoder[-1]


def test_single_frames_are_the_poses_themselves():
    coder, poses = SingleFrames(5), torch.randn(2, 7, 5)
    assert (coder.frames, coder.width) == (1, 5)
    assert coder.encode(poses) is poses
    assert coder.decode(poses) is poses
