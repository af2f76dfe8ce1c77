"""Overrides from the folder of a run, which may be a stranger's: options and values, but nothing that names code.

Hydra calls whatever a `_target_` names. What installed options name may be called; what a folder names may not.
"""

from __future__ import annotations

import re
from functools import cache

from motiongen.discovery import options
from motiongen.resolvers import RESOLVERS

TARGET = re.compile(r"^\s*(?:- )?_target_:\s*([\w.]+)\s*$", re.MULTILINE)
"""Where an option's file names code"""
OVERRIDE_OF_TARGET = re.compile(r"[\w./]+\._target_=([\w.]+)")
REFERENCE = re.compile(rf"\$\{{(?:(?:{'|'.join(RESOLVERS)}):[^${{}}]*|[\w./@\[\]-]+)\}}")
"""An interpolation that names another value or calls one of our own functions; others make values of text"""
OUT_OF_OPTIONS = re.compile(r"\.\.|[\\:]|(?:^|[\[,'\"\s])/")
"""Of an option's name: what could lead out of the folders that options lie in"""


def danger_in(override: str) -> str:
    """Why an override of a run must not be taken from its folder; empty for one that names options and values."""
    plain = override.lstrip("+~")
    key, _, value = plain.partition("=")
    if "_target_" in plain:
        found = OVERRIDE_OF_TARGET.fullmatch(plain)
        if found is None or found[1] not in offered_targets():
            return "names code that no installed option offers"
    if "${" in REFERENCE.sub("", value):
        return "makes a value by a function that is none of motiongen's"
    if key.partition("@")[0] in offered_groups() and OUT_OF_OPTIONS.search(value):
        return "names a file that is no option"
    return ""


@cache
def offered_groups() -> frozenset[str]:
    """The groups that have options, and the groups that they are parts of."""
    parts = [option.group.split("/") for option in options()]
    return frozenset("/".join(own[: depth + 1]) for own in parts for depth in range(len(own)))


@cache
def offered_targets() -> frozenset[str]:
    """What the files of all installed options name by `_target_`."""
    return frozenset(name for option in options() for name in TARGET.findall(option.path.read_text(encoding="utf-8")))
