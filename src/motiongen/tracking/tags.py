"""What to search runs by: the option that each slot is filled with, read from the resolved configuration.

Hydra's own record of choices leaves out groups that take a list (the mechanisms of an unroller's query).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from omegaconf import DictConfig, OmegaConf

from motiongen.discovery import options


def choice_tags(config: DictConfig, choices: Mapping[str, Any]) -> dict[str, str]:
    """`{"generator/encoder": "condition_encoder", "generator/unroller/query": "tag_injection", ...}`.

    Args:
        config: the configuration of a run.
        choices: `HydraConfig.get().runtime.choices`.
    """
    tags = {group: str(choice) for group, choice in choices.items() if choice and not group.startswith("hydra/")}
    offered: dict[str, set[str]] = {}
    for option in options():
        offered.setdefault(option.group, set()).add(option.name)
    for group, names in offered.items():
        node = OmegaConf.select(config, group.replace("/", "."))
        if isinstance(node, DictConfig) and "_target_" not in node and len(node) > 0:
            chosen = [str(key) for key in node]
            if names.issuperset(chosen):
                tags[group] = "+".join(chosen)
    return tags
