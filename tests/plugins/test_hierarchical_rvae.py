from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import pytest
import torch

from motiongen.configuration import compose
from motiongen.contracts import CompositionError, GeneratorModule, MotionBatch, Posterior
from motiongen.generation.pose_forms import AxisAngle, Matrix, Quaternion, Rot6d
from motiongen.generation.schedules import LinearRamp
from motiongen.motion.representation import FEATURES
from motiongen.objectives.geodesic import HierarchicalGeodesic
from motiongen.objectives.objective import Objective
from motiongen.objectives.terms import kl_divergence
from motiongen_plugins.attribute_classifier.attribute_classifier import AttributeClassifier
from motiongen_plugins.hierarchical_rvae.attributes import AttributeClassifiers, InitialState, Judgement, cross_entropy
from motiongen_plugins.hierarchical_rvae.hierarchical_rvae import HierarchicalRvae
from motiongen_plugins.motion_cell.motion_cell import MotionCell
from motiongen_plugins.motion_denoiser.motion_denoiser import MotionDenoiser, NoDenoiser
from motiongen_plugins.motion_words.motion_words import MotionWords, SingleFrames
from tests.compositions import STYLES, TAGS, batch, skeleton
from tests.motion.poses import standing

DENOISER = partial(MotionDenoiser, width=8, kernel=3, corrupted=0.1, noise=0.5, ready=0.0)


def rvae(**changes) -> HierarchicalRvae:
    """The paper's composition, small, with weights from seed 0."""
    torch.manual_seed(0)
    options = {
        "features": FEATURES,
        "tags": TAGS,
        "initial_frames": 6,
        "styles": STYLES,
        "attribute_width": 8,
        "pose": Quaternion,
        "words": partial(MotionWords, frames=3, width=16, hidden=24),
        "cell": partial(MotionCell, latent=8, features=12, hidden=24, state=16),
        "dropping": LinearRamp(0.25, 0.75),
        "classifier": partial(AttributeClassifier, layers=3, width=8, kernel=5),
        "denoiser": NoDenoiser,
    }
    return HierarchicalRvae(**(options | changes))


COMPOSITIONS = {
    "paper": {},
    "single_layer": {"words": SingleFrames},
    "axis_angle": {"pose": AxisAngle},
    "matrix": {"pose": Matrix},
    "denoiser": {"denoiser": DENOISER},
}


@pytest.fixture(params=COMPOSITIONS, ids=str)
def generator(request) -> HierarchicalRvae:
    return rvae(**COMPOSITIONS[request.param])


def objective() -> Objective:
    weights = ("geodesic", "root", "kl", "valid_rotations", "classifier", "auxiliary")
    return Objective(
        quantities={},
        distances={"geodesic": HierarchicalGeodesic()},
        weights=dict.fromkeys(weights, 1.0),
        velocity=0.0,
        first_pass=0.0,
        last_pass=1.0,
    )


def seeded() -> torch.Generator:
    return torch.Generator().manual_seed(7)


@pytest.mark.parametrize("progress", [0.0, 0.5, 1.0])
def test_gradients_reach_every_parameter(generator, progress):
    loss, data = objective(), batch((9, 5, 13))
    terms = loss.terms(generator.reconstruct(data, progress, seeded()), data, skeleton())
    loss.total(terms, progress).backward()
    assert all(p.grad.isfinite().all() for p in generator.parameters())
    missing = [name for name, p in generator.named_parameters() if not p.grad.abs().sum() > 0]
    assert missing == []


@pytest.mark.parametrize("progress", [0.0, 0.6])
def test_neither_padding_nor_what_it_holds_changes_valid_frames_and_terms(generator, progress):
    tight, loose = batch((9, 5)), batch((9, 5), frames=20)
    hole = ~loose.condition.mask.unsqueeze(-1)
    dirty = MotionBatch(loose.motion + 100 * hole, loose.condition)
    with torch.no_grad():
        expected, *others = (generator.reconstruct(data, progress, seeded()) for data in (tight, loose, dirty))
    mask = tight.condition.mask
    for other in others:
        # Quaternions of an untrained network are short: making them unit ones magnifies rounding.
        torch.testing.assert_close(other.motion[:, :9][mask], expected.motion[mask], atol=1e-4, rtol=1e-4)
        for name in expected.terms.keys() - {"auxiliary"}:  # the denoiser's noise is drawn for padded frames too
            torch.testing.assert_close(other.terms[name], expected.terms[name], atol=1e-4, rtol=1e-4)


def test_generation_of_valid_frames_does_not_depend_on_padding(generator):
    short = generator.generate(batch((9, 5)).condition, seed=1)
    long = generator.generate(batch((9, 5), frames=20).condition, seed=1)
    torch.testing.assert_close(short, long[:, :9], atol=1e-4, rtol=1e-4)
    assert (long[:, 9:] == 0).all()


@pytest.mark.parametrize("frames", [1, 20, 60, 200])
def test_generates_the_length_that_was_asked_for(generator, frames):
    motion = generator.generate(batch((frames,)).condition, seed=0)
    assert motion.shape == (1, frames, FEATURES)
    assert motion.isfinite().all()


def test_the_seed_decides_the_motion(generator):
    condition = batch((8, 8)).condition
    assert torch.equal(generator.generate(condition, 1), generator.generate(condition, 1))
    assert not torch.equal(generator.generate(condition, 1), generator.generate(condition, 2))


def test_action_and_style_both_change_the_motion():
    generator, condition = rvae(), batch((8, 8)).condition
    base = generator.generate(condition, seed=0)
    for field in ("tags", "styles"):
        changed = generator.generate(replace(condition, **{field: getattr(condition, field).flip(0)}), seed=0)
        assert (base - changed).abs().max() > 1e-4, field


def test_data_without_styles_trains_and_generates():
    generator, data = rvae(styles=0), batch((7, 4))
    data = MotionBatch(data.motion, replace(data.condition, styles=torch.zeros(2, 0)))
    assert set(generator.classifiers.classifiers) == {"tags"}
    loss = objective()
    assert loss.total(loss.terms(generator.reconstruct(data, 0.5, seeded()), data, skeleton()), 0.5).isfinite()
    assert generator.generate(data.condition, 0).isfinite().all()


def test_bfloat16_autocast():
    generator, data, loss = rvae(denoiser=DENOISER), batch((9, 5)), objective()
    with torch.autocast("cpu", dtype=torch.bfloat16):
        loss.total(loss.terms(generator.reconstruct(data, 0.5, seeded()), data, skeleton()), 0.5).backward()
        assert generator.generate(data.condition, 0).isfinite().all()
    assert all(p.grad.isfinite().all() for p in generator.parameters())


def test_a_few_steps_lower_the_reconstruction_loss():
    generator, loss, data = rvae(), objective(), batch((12, 9))
    data = MotionBatch(standing(12).repeat(2, 1, 1), data.condition)
    optimizer = torch.optim.Adam(generator.parameters(), lr=3e-3)
    losses = []
    for _ in range(40):
        terms = loss.terms(generator.reconstruct(data, 0.0, seeded()), data, skeleton())
        optimizer.zero_grad()
        loss.total(terms, 0.0).backward()
        optimizer.step()
        losses.append(terms["geodesic"].item())
    assert losses[-1] < 0.5 * losses[0]


def test_before_dropping_starts_the_cell_hears_the_true_words():
    """At ratio 1 it hears its own alone, so that later true words reach it through the posterior only."""

    def last_frames(ratio: float, change: float) -> torch.Tensor:
        generator = rvae(dropping=lambda progress: ratio)
        # A posterior that does not look: what is left of the words is what the transition hears.
        for parameter in generator.cell.posterior.parameters():
            torch.nn.init.zeros_(parameter)
        data = batch((12,))
        data.motion[:, :3] *= change
        with torch.no_grad():
            return generator.reconstruct(data, 0.5, seeded()).motion[:, -3:, 6:132]

    assert (last_frames(0.0, 1.0) - last_frames(0.0, -1.0)).abs().max() > 1e-4
    assert torch.equal(last_frames(1.0, 1.0), last_frames(1.0, -1.0))


def test_kl_is_summed_over_words_and_latents_and_divided_by_frames():
    """Two words of three frames; a prior of N(0, 1) and a posterior of N(1, 1) in 8 dimensions: 8 / 2 a word."""

    class Constant(torch.nn.Module):
        def __init__(self, mean):
            super().__init__()
            self.mean = mean

        def forward(self, first, *others):
            shape = (*first.shape[:-1], 8)
            return Posterior(torch.full(shape, self.mean), torch.zeros(shape))

    generator = rvae()
    generator.cell.prior, generator.cell.posterior = Constant(0.0), Constant(1.0)
    with torch.no_grad():
        terms = generator.reconstruct(batch((6, 3)), 0.0, seeded()).terms
    assert terms["kl"].item() == pytest.approx(4.0 / 3, rel=1e-5)


def test_kl_divergence_agrees_with_torch():
    torch.manual_seed(0)
    one, other = (Posterior(torch.randn(4, 5), torch.randn(4, 5)) for _ in range(2))
    normals = [torch.distributions.Normal(p.mean, (0.5 * p.log_variance).exp()) for p in (one, other)]
    expected = torch.distributions.kl_divergence(*normals).sum(dim=-1)
    torch.testing.assert_close(kl_divergence(one, other), expected)


def test_initial_states_are_those_of_the_combination():
    states = InitialState(TAGS, STYLES, 4)
    torch.nn.init.normal_(states.mean)
    condition = batch((5,) * 7).condition
    mean = states(condition).mean
    tag, style = 2, 2  # row 2: both cycle
    shared, own, manner = states.mean[0], states.mean[1 + tag], states.mean[1 + TAGS + style]
    pair = states.mean[1 + TAGS + STYLES + tag * STYLES + style]
    torch.testing.assert_close(mean[2], shared + own + manner + pair)
    torch.testing.assert_close(states(condition).log_variance, torch.full((7, 4), 2 * math.log(0.1)))
    unknown = replace(condition, tags=torch.zeros(7, TAGS), styles=torch.zeros(7, STYLES))
    torch.testing.assert_close(states(unknown).mean[0], shared)


def classifiers() -> AttributeClassifiers:
    torch.manual_seed(0)
    network = partial(AttributeClassifier, 6, layers=2, width=8, kernel=3)
    return AttributeClassifiers({"tags": network(TAGS), "styles": network(STYLES)})


def test_only_unknown_attributes_are_inferred():
    condition = batch((5, 5, 5)).condition
    condition = replace(condition, tags=condition.tags * torch.tensor([[1.0], [0.0], [1.0]]))
    logits = torch.zeros(3, TAGS)
    logits[:, 4] = 1.0
    judged = {"tags": Judgement(logits, ()), "styles": Judgement(torch.randn(3, STYLES), ())}
    completed = classifiers().completed(condition, judged)
    assert completed.tags.argmax(dim=1).tolist() == [0, 4, 2]
    assert completed.tags.sum(dim=1).tolist() == [1, 1, 1]
    assert torch.equal(completed.styles, condition.styles)


def test_a_batch_with_hidden_labels_trains_on_inferred_ones():
    """The motion that is made of a clip without labels is that of the same clip with the inferred label."""
    generator, data = rvae(), batch((9, 5))
    hidden = MotionBatch(data.motion, replace(data.condition, tags=torch.zeros(2, TAGS)))
    with torch.no_grad():
        poses, mask = generator._whole_words(hidden)
        guess = generator.classifiers(poses, mask)["tags"].logits.argmax(dim=1)
        told = MotionBatch(data.motion, replace(data.condition, tags=torch.eye(TAGS)[guess]))
        one, other = (generator.reconstruct(own, 0.5, seeded()) for own in (hidden, told))
    torch.testing.assert_close(one.motion, other.motion)
    assert one.terms["auxiliary"] < other.terms["auxiliary"], "what is inferred is not learned from"


def test_classifiers_do_not_learn_from_reconstructed_motion():
    network, condition = classifiers(), batch((8, 8)).condition
    poses, mask = torch.randn(2, 8, 6), torch.ones(2, 8, dtype=torch.bool)
    made = torch.randn(2, 8, 6, requires_grad=True)
    network.disagreement(made, mask, condition, network(poses, mask)).backward()
    assert made.grad.abs().sum() > 0
    assert all(parameter.grad is None for parameter in network.parameters())


def test_reconstructed_motion_that_is_the_recorded_one_agrees_in_its_features():
    network, condition = classifiers(), batch((8, 8)).condition
    poses, mask = torch.randn(2, 8, 6), torch.ones(2, 8, dtype=torch.bool)
    judged = network(poses, mask)
    torch.testing.assert_close(network.disagreement(poses, mask, condition, judged), network.loss(condition, judged))


def test_cross_entropy_leaves_out_what_is_not_labelled():
    logits = torch.tensor([[1.0, 2.0, 0.0], [0.0, 0.0, 0.0], [5.0, 1.0, 1.0]])
    labels = torch.tensor([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    expected = (-torch.log_softmax(logits[0], 0)[1] + math.log(3)) / 2
    torch.testing.assert_close(cross_entropy(logits, labels), expected)
    assert cross_entropy(logits, torch.zeros(3, 3)).item() == 0


def test_the_6d_form_is_refused():
    with pytest.raises(CompositionError, match=r"no rotations in the form Rot6d; choose generator/pose=quaternion"):
        rvae(pose=Rot6d)


@pytest.mark.parametrize(
    "change",
    [
        (),
        ("generator/words=single_frames",),
        ("objective.distances.geodesic.hierarchical=false",),
        ("objective.weights.classifier=0.0",),
        ("objective.distances.geodesic.form=matrix", "generator/pose=matrix"),
        ("generator/denoiser=convolutional",),
    ],
    ids=" ".join,
)
def test_the_experiment_and_its_ablations_train_and_generate(change):
    from hydra.utils import instantiate

    config = compose(["+experiment=hierarchical_rvae", "scale=smoke", "data.hidden_labels=0.5", *change])
    generator: GeneratorModule = instantiate(config.generator)(
        features=FEATURES, tags=TAGS, initial_frames=6, styles=STYLES
    )
    loss: Objective = instantiate(config.objective)
    data = batch((9, 5))
    terms = loss.terms(generator.reconstruct(data, 0.5, seeded()), data, skeleton())
    loss.total(terms, 0.5).backward()
    assert generator.generate(data.condition, 0).isfinite().all()


def test_the_experiment_has_the_papers_numbers():
    config = compose(["+experiment=hierarchical_rvae", "scale=paper"])
    cell = config.generator.cell
    assert (cell.latent, cell.features, cell.hidden, cell.state) == (96, 96, 128, 512)
    words = config.generator.words
    assert (words.frames, words.width, words.hidden, config.generator.attribute_width) == (3, 96, 128, 8)
    assert (config.data.batch_size, config.data.max_frames) == (64, 200)
    assert (config.trainer.max_epochs, config.trainer.gradient_clip_val) == (1600, 0.1)
    assert config.optimizer.optimizer.lr == 0.001


def test_the_code_of_a_motion_is_the_mean_over_its_own_words() -> None:
    """Two words of three frames: padding that makes a third one changes nothing, and one word is itself."""
    generator = rvae().eval()
    noise = torch.Generator()
    with torch.inference_mode():
        short, padded = (generator.code(batch((6, 6), frames), noise.manual_seed(1)) for frames in (6, 9))
        torch.testing.assert_close(padded.latent, short.latent)
        torch.testing.assert_close(padded.modulated, short.modulated)
        one = generator.code(batch((3, 3)), noise.manual_seed(1))
    assert (one.latent.shape, one.modulated.shape) == ((2, 8), (2, 16))
    noise.manual_seed(1)
    word = batch((3, 3))
    with torch.inference_mode():
        state = generator.initial_state(word.condition).sample(noise)
        attributes = generator.attributes(torch.cat([word.condition.tags, word.condition.styles], dim=1))
        torch.rand(2, 1, generator=noise)
        poses, _ = generator._whole_words(word)
        first = generator.words.encode(poses)[:, 0]
        step, posterior = generator.cell(first, attributes, state, torch.zeros(2, 1, dtype=torch.bool), noise)
    torch.testing.assert_close(one.latent, step.latent)
    torch.testing.assert_close(one.modulated, step.word)
    assert not torch.equal(step.latent, posterior.mean)
