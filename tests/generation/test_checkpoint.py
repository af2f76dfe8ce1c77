from __future__ import annotations

import pickle

import pytest
import torch

from motiongen.generation.checkpoint import CheckpointError, load_generator, save_generator
from tests.compositions import marionet

TAGS = ("bow", "kick", "run", "walk", "wave")


def test_round_trip(tmp_path):
    original, other = marionet(), marionet()
    torch.nn.init.ones_(other.decoder.pose.weight)
    trained_on = (("a store", "take1", 0, 60), ("a store", "take2", 30, 90))
    save_generator(tmp_path / "generator.pt", original, TAGS, trained_on)
    assert load_generator(tmp_path / "generator.pt", other, TAGS) == trained_on
    for name, value in original.state_dict().items():
        assert torch.equal(value, other.state_dict()[name]), name
    assert [path.name for path in tmp_path.iterdir()] == ["generator.pt"]


def test_missing_file(tmp_path):
    with pytest.raises(CheckpointError, match=r"generator\.pt: no such file"):
        load_generator(tmp_path / "generator.pt", marionet(), TAGS)


def test_cut_file(tmp_path):
    path = tmp_path / "generator.pt"
    save_generator(path, marionet(), TAGS, ())
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(CheckpointError, match=r"generator\.pt: not a generator's weights"):
        load_generator(path, marionet(), TAGS)


class Harm:
    def __reduce__(self):
        return (print, ("executed",))


def test_code_in_a_file_is_not_executed(tmp_path, capsys):
    path = tmp_path / "generator.pt"
    path.write_bytes(pickle.dumps(Harm()))
    with pytest.raises(CheckpointError):
        load_generator(path, marionet(), TAGS)
    assert "executed" not in capsys.readouterr().out


def test_missing_field(tmp_path):
    path = tmp_path / "generator.pt"
    save_generator(path, marionet(), TAGS, ())
    content = torch.load(path, weights_only=True)
    del content["trained_on"]
    torch.save(content, path)
    with pytest.raises(CheckpointError, match=r"generator\.pt: field 'trained_on' is missing"):
        load_generator(path, marionet(), TAGS)


def test_other_tags(tmp_path):
    save_generator(tmp_path / "generator.pt", marionet(), TAGS, ())
    with pytest.raises(CheckpointError, match="field 'tags'"):
        load_generator(tmp_path / "generator.pt", marionet(), TAGS[::-1])
