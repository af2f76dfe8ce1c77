from __future__ import annotations

from pathlib import Path

import pytest
from omegaconf import OmegaConf

from motiongen.configuration import compose
from motiongen.runs import RunError
from motiongen.studies.identity import Identity, code_digest, configuration_digest, identity_of

LINE = ["+experiment=actor", "scale=smoke"]


def digest(*changes: str) -> str:
    return configuration_digest(compose([*LINE, *changes]))


def test_what_changes_no_result_changes_no_digest() -> None:
    assert digest() == digest("cache=/elsewhere", "tracker=none", "retry_failed=true", "formats=[bvh]")


def test_what_changes_a_result_does() -> None:
    changes = ["seed=1", "generator.width=24", "objective.weights.kl=0.5", "evaluation.seeds=9", "data.draws=3"]
    assert len({digest(), *map(digest, changes)}) == 1 + len(changes)


def test_an_identity_tells_in_what_another_differs() -> None:
    identity = identity_of(compose(LINE))
    assert identity.differences(identity.to_json()) == []
    assert identity.code == code_digest()
    other = Identity(identity.configuration, identity_of(compose([*LINE, "data.source.sessions=9"])).data, "0")
    assert other.differences(identity.to_json()) == ["data", "code"]
    assert identity.differences({}) == ["configuration", "data", "code"]


def test_what_is_judged_is_a_part_of_the_identity(tmp_path: Path) -> None:
    def judging(folder: Path, *changes: str) -> Identity:
        return identity_of(compose(["task=long_motion", f"runs=[{folder}]", "scale=smoke", *changes]))

    def trained(name: str, weights: bytes) -> Path:
        folder = tmp_path / name
        (folder / ".hydra").mkdir(parents=True)
        OmegaConf.save(OmegaConf.create([]), folder / ".hydra" / "overrides.yaml")
        (folder / "generator.pt").write_bytes(weights)
        return folder

    one, same, other = trained("one", b"weights"), trained("same", b"weights"), trained("other", b"others")
    assert judging(one) == judging(same)
    assert judging(one).differences(judging(other).to_json()) == ["configuration"]
    assert judging(one).differences(judging(one, "sequences.count=7").to_json()) == ["configuration"]
    assert judging(one).code != code_digest()
    with pytest.raises(RunError, match=r"runs: .*nowhere is not the folder of a run"):
        judging(tmp_path / "nowhere")
