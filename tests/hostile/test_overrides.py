"""What a run of a stranger says on its command line is a configuration of installed options, or refused."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from omegaconf import DictConfig, ListConfig, OmegaConf

from motiongen.configuration import compose
from motiongen.foreign import offered_targets
from motiongen.runs import stored_overrides
from tests.hostile.reader import EXAMPLES, often, outcome
from tests.hostile.runs import OVERRIDES, write_run
from tests.hostile.structures import changes

PIECES = (
    *("generator", "encoder", "_target_", "os.system", "hydra", "searchpath", "seed", "scale", "smoke", "paper", "x"),
    *(".", "/", "@", "=", "+", "++", "~", "[", "]", "{", "}", ":", ",", "'", '"', "\\", " ", "${", "oc.create:", "1"),
    *("..", "null", "???", "${seed}", "${width:8}", "choice(1,2)", "range(1,3)", "1e999", "9" * 400, "é", "\n"),
)
texts = st.lists(st.sampled_from(PIECES), max_size=8).map("".join)
"""Pieces of command lines that say anything"""


def targets(node: Any) -> Iterator[str]:
    """What Hydra would call, interpolations resolved where they can be."""
    if isinstance(node, DictConfig | ListConfig):
        for key in node if isinstance(node, DictConfig) else range(len(node)):
            value = None if OmegaConf.is_missing(node, key) else outcome_of(node, key)
            if key == "_target_":
                yield str(value)
            yield from targets(value)


def outcome_of(node: DictConfig | ListConfig, key: Any) -> Any:
    try:
        return node[key]
    except Exception:
        return None  # told by the checks of a configuration


def check(overrides: Any, folder: Path) -> None:
    if not any(folder.iterdir()):
        write_run(folder)
    (folder / ".hydra" / "overrides.yaml").write_text(json.dumps(overrides))
    kept, complaint = outcome(lambda place: stored_overrides(place, "run"), folder)
    if complaint:
        assert "overrides.yaml" in complaint
        return
    config, complaint = outcome(lambda place: compose(kept), folder)
    if not complaint:
        assert set(targets(config)) <= offered_targets()


@given(change=changes(with_arrays=False), more=st.lists(texts, max_size=3))
@settings(often, max_examples=max(3, EXAMPLES // 20))
def test_what_a_run_was_started_with_calls_nothing_but_installed_options(
    change: Callable[[Any], Any], more: list[str], tmp_path: Path
) -> None:
    changed = change(OVERRIDES)
    check([*changed, *more] if isinstance(changed, list) else changed, tmp_path)


def test_an_ordinary_run_is_composed(tmp_path: Path) -> None:
    write_run(tmp_path)
    found = set(targets(compose(stored_overrides(tmp_path, "run"))))
    assert "motiongen.generation.staged.StagedGenerator" in found
    assert found <= offered_targets()
