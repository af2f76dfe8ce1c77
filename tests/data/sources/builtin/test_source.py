from __future__ import annotations

from collections import Counter
from itertools import islice, pairwise
from typing import Any

import pytest
import torch

from motiongen.data.clips import DataError, Sequence
from motiongen.data.sources.builtin.source import BLOCK, BuiltinSource

PROMISED = {
    "walk", "run", "step", "turn", "sit down", "stand up", "stand", "jump", "kick", "punch", "throw", "wave hand",
}  # fmt: skip


def test_same_seed_gives_the_same_bits(corpus: tuple[Sequence, ...]) -> None:
    again = list(islice(BuiltinSource().sequences(), 6))
    for first, second in zip(corpus, again, strict=False):
        assert torch.equal(first.features, second.features)
        assert first.segments == second.segments


def test_a_session_does_not_depend_on_how_many_follow(corpus: tuple[Sequence, ...]) -> None:
    short = list(BuiltinSource(sessions=2).sequences())
    assert torch.equal(short[1].features, corpus[1].features)


def test_another_seed_gives_other_motion(corpus: tuple[Sequence, ...]) -> None:
    other = next(BuiltinSource(seed=1).sequences())
    assert other.features.shape != corpus[0].features.shape or not torch.equal(other.features, corpus[0].features)


def test_every_promised_tag_has_clips_to_learn_from(corpus: tuple[Sequence, ...]) -> None:
    counts = Counter(tag for sequence in corpus for part in sequence.segments for tag in part.tags)
    assert set(counts) >= PROMISED
    assert min(counts.values()) >= 40
    assert len(corpus) == len(BuiltinSource())
    assert len({sequence.name for sequence in corpus}) == len(corpus)


def test_segments_touch_and_the_first_has_a_predecessor(corpus: tuple[Sequence, ...]) -> None:
    for sequence in corpus:
        parts = sequence.segments
        assert parts[0].start >= 6
        assert all(before.stop == after.start for before, after in pairwise(parts))
        assert parts[-1].stop == len(sequence.features)
        assert all(20 <= part.stop - part.start <= 130 for part in parts)
        assert sequence.features.dtype == torch.float32
        assert torch.isfinite(sequence.features).all()


def test_a_chair_is_left_before_anything_else(corpus: tuple[Sequence, ...]) -> None:
    for sequence in corpus:
        tags = [part.tags[0] for part in sequence.segments]
        for index, tag in enumerate(tags):
            if tag == "sit down":
                assert tags[index + 1 : index + 3] == ["sit", "stand up"]


def test_fingerprint_follows_the_settings() -> None:
    prints = {
        source.fingerprint()
        for source in (
            BuiltinSource(),
            BuiltinSource(seed=1),
            BuiltinSource(sessions=3),
            BuiltinSource(subjects=4),
            BuiltinSource(repertoire="babel_mag"),
            BuiltinSource(body_spread=0.05),
        )
    }
    assert len(prints) == 6
    assert BuiltinSource().fingerprint() == BuiltinSource().fingerprint()


@pytest.mark.parametrize("settings", [{"sessions": 0}, {"subjects": 0}, {"seed": -1}, {"body_spread": 0.2}])
def test_settings_out_of_range_are_named(settings: dict[str, Any]) -> None:
    with pytest.raises(DataError, match=next(iter(settings))):
        BuiltinSource(**settings)


def test_blocks_are_made_by_themselves(corpus: tuple[Sequence, ...]) -> None:
    jobs = BuiltinSource(sessions=BLOCK + 2).jobs()
    assert len(jobs) == 2
    last = list(jobs[1].read())
    assert [sequence.name for sequence in last] == [f"session_{BLOCK + index:03d}" for index in range(2)]
    names = [sequence.name for sequence in BuiltinSource(sessions=BLOCK + 2).jobs()[0].read()]
    assert names[: len(corpus)] == [sequence.name for sequence in corpus]


def test_an_unknown_repertoire_is_named() -> None:
    with pytest.raises(DataError, match=r"repertoire: .everything. is none of basic"):
        BuiltinSource(repertoire="everything")  # type: ignore[arg-type]
