"""Pose forms: round trips, gradients, continuity, and their place in the staged generator."""

from __future__ import annotations

import math
import subprocess
import sys

import pytest
import roma
import torch
from hydra.utils import instantiate
from torch import Tensor

from motiongen.configuration import ConfigurationError, compose
from motiongen.contracts import Code, MotionBatch
from motiongen.generation.pose_forms import AxisAngle, Matrix, Quaternion, Rot6d
from motiongen.generation.staged import StagedGenerator, encoded
from motiongen.motion.representation import FEATURES, pack
from motiongen.motion.skeleton import JOINTS
from tests.compositions import INITIAL_FRAMES, TAGS, batch, marionet

FORMS = [Rot6d, Matrix, Quaternion, AxisAngle]
SIZES = [135, 201, 91, 69]


def clip(frames: int = 7, dtype: torch.dtype = torch.float64) -> Tensor:
    """Two clips of random poses, (2, T, 135)."""
    generator = torch.Generator().manual_seed(0)
    rotations = roma.rotvec_to_rotmat(2 * torch.randn(2, frames, JOINTS, 3, generator=generator, dtype=dtype))
    return pack(rotations, torch.randn(2, frames, 3, generator=generator, dtype=dtype))


def turning(frames: int, start: float, stop: float) -> Tensor:
    """All joints turn steadily about one axis, angles in degrees, (1, T, 135)."""
    axis = torch.nn.functional.normalize(torch.tensor([0.2, -0.5, 0.8], dtype=torch.float64), dim=0)
    angles = torch.linspace(math.radians(start), math.radians(stop), frames, dtype=torch.float64)
    rotations = roma.rotvec_to_rotmat(angles[:, None] * axis)[None, :, None].expand(1, frames, JOINTS, 3, 3)
    return pack(rotations, torch.zeros(1, frames, 3, dtype=torch.float64))


@pytest.mark.parametrize(("form", "size"), list(zip(FORMS, SIZES, strict=True)))
def test_round_trip(form, size) -> None:
    pose = form(FEATURES)
    there = pose.encode(clip())
    assert there.shape == (2, 7, size)
    assert pose.features == size
    torch.testing.assert_close(pose.decode(there), clip())


@pytest.mark.parametrize("form", FORMS)
def test_whatever_a_decoder_gives_is_a_pose_and_learns(form) -> None:
    pose = form(FEATURES)
    torch.manual_seed(0)
    raw = torch.randn(1, 2, pose.features, dtype=torch.float64, requires_grad=True)
    decoded = pose.decode(raw)
    matrices = roma.special_gramschmidt(decoded[..., :-3].unflatten(-1, (JOINTS, 2, 3)).transpose(-1, -2))
    if form is not Rot6d:
        torch.testing.assert_close(pack(matrices, decoded[..., -3:]), decoded)
    (gradient,) = torch.autograd.grad((decoded * torch.randn_like(decoded)).sum(), raw)
    assert (gradient != 0).all()
    assert torch.autograd.gradcheck(pose.decode, raw.detach()[:, :1].requires_grad_())


@pytest.mark.parametrize("form", FORMS)
def test_zeros_from_a_decoder_break_nothing(form) -> None:
    raw = torch.zeros(1, 1, form(FEATURES).features, requires_grad=True)
    decoded = form(FEATURES).decode(raw)
    (gradient,) = torch.autograd.grad(decoded.sum(), raw)
    assert decoded.isfinite().all()
    assert gradient.isfinite().all()


@pytest.mark.parametrize("form", [Quaternion, AxisAngle])
@pytest.mark.parametrize(("start", "stop"), [(100, 260), (-170, -200), (179, 350), (-30, 30)])
def test_a_joint_that_turns_past_half_a_turn_makes_no_jump(form, start: float, stop: float) -> None:
    steps = form(FEATURES).encode(turning(81, start, stop)).diff(dim=1).abs()
    assert steps.max() < math.radians(abs(stop - start)) / 80 + 1e-9


def test_a_clip_starts_within_half_a_turn() -> None:
    first = AxisAngle(FEATURES).encode(turning(2, 270, 271))[0, 0, :3]
    assert first.norm().item() == pytest.approx(math.radians(90))
    assert (Quaternion(FEATURES).encode(turning(2, 270, 271))[0, 0, 3:-3:4] > 0).all()


def test_axis_angle_is_the_rotation_vector() -> None:
    vectors = torch.randn(1, 1, JOINTS, 3, dtype=torch.float64)
    features = pack(roma.rotvec_to_rotmat(vectors), torch.ones(1, 1, 3, dtype=torch.float64))
    expected = torch.cat([vectors.flatten(-2), torch.ones(1, 1, 3)], dim=-1)
    torch.testing.assert_close(AxisAngle(FEATURES).encode(features), expected)


def test_no_seam_between_initial_motion_and_motion() -> None:
    whole = turning(INITIAL_FRAMES + 10, 150, 210).float()
    data = batch((10,))
    condition = type(data.condition)(**{**vars(data.condition), "initial_motion": whole[:, :INITIAL_FRAMES]})
    split = encoded(MotionBatch(whole[:, INITIAL_FRAMES:], condition), Quaternion(FEATURES))
    step = split.motion[:, 0] - split.condition.initial_motion[:, -1]
    assert step.abs().max() < 0.05


def test_padded_frames_stay_zero() -> None:
    data = encoded(batch((5, 3), frames=8), Matrix(FEATURES))
    assert (data.motion[1, 3:] == 0).all()
    assert (data.motion[1, :3] != 0).any(dim=-1).all()


def small(pose: str) -> StagedGenerator:
    config = compose(["+experiment=marionette", "scale=smoke", f"generator/pose={pose}"])
    torch.manual_seed(0)
    return instantiate(config.generator)(features=FEATURES, tags=TAGS, initial_frames=INITIAL_FRAMES)


@pytest.mark.parametrize(("pose", "size"), [("rot6d", 135), ("matrix", 201), ("quaternion", 91), ("axis_angle", 69)])
def test_stages_see_the_form_and_nobody_else_does(pose: str, size: int) -> None:
    generator, data = small(pose), batch((9, 5))
    assert generator.dimensions.features == generator.decoder.pose.out_features == size
    prediction = generator.reconstruct(data, 1.0, torch.Generator().manual_seed(0))
    assert prediction.motion.shape == prediction.first_pass.shape == data.motion.shape
    motion = generator.generate(data.condition, seed=0)
    assert motion.shape == data.motion.shape
    assert (motion[1, 5:] == 0).all()


def test_the_data_s_own_form_changes_no_bit() -> None:
    generator, data = marionet().eval(), batch((9, 5))
    with torch.no_grad():
        found = generator.reconstruct(data, 1.0, torch.Generator().manual_seed(3))
        draws = torch.Generator().manual_seed(3)
        latent = generator.encoder.posterior(data).sample(draws)
        controls = generator.unroller(Code(latent, latent), data.condition)
        expected = generator.scheme(generator.decoder, controls, data, 1.0, draws)
    assert torch.equal(found.motion, expected.motion)
    assert torch.equal(found.first_pass, expected.first_pass)


def test_rot6d_is_the_default() -> None:
    assert isinstance(marionet().pose, Rot6d)
    assert compose(["+experiment=marionette"]).generator.pose._target_.endswith(".Rot6d")


def test_a_form_needs_a_staged_generator() -> None:
    with pytest.raises(ConfigurationError, match="generator/pose"):
        compose(["generator/pose=quaternion"])


def test_forms_take_other_numbers_of_joints() -> None:
    sizes = [form(24 * 6 + 3).features for form in FORMS]
    assert sizes == [147, 24 * 9 + 3, 24 * 4 + 3, 24 * 3 + 3]


def test_violations_by_hand():
    assert Quaternion(FEATURES).violation(torch.tensor([0.0, 0.0, 0.0, 2.0])).item() == pytest.approx(3.0)
    # R = 2 I: |4 I - I|^2 = 27 and |8 - 1| = 7.
    assert Matrix(FEATURES).violation(2 * torch.eye(3).flatten()).item() == pytest.approx(34.0)
    assert AxisAngle(FEATURES).violation(torch.tensor([1.0, 9.0, 0.0])).item() == 0


TRAINING_AFTER_GENERATION = """
import torch
from motiongen.generation.pose_forms import Matrix

with torch.inference_mode():
    Matrix(features=9).to_matrices(torch.randn(5, 9))
output = torch.randn(5, 9, requires_grad=True)
Matrix(features=9).to_matrices(output).square().sum().backward()
assert output.grad.isfinite().all()
"""


def test_matrices_are_trained_in_a_process_that_generated_first():
    subprocess.run([sys.executable, "-c", TRAINING_AFTER_GENERATION], check=True)
