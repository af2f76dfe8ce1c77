"""Every command line and option of the documentation passes the check that a user's would meet."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
from hydra._internal.utils import get_args_parser

from motiongen.application import with_quotes
from motiongen.configuration import ConfigurationError, check, compose

ROOT = Path(__file__).parents[1]
PAGES = sorted([ROOT / "README.md", *ROOT.glob("docs/*.md"), *ROOT.glob("plugins/*/README.md")])
COMMAND = re.compile(r"^ +(?:[A-Z_]+=\S+ )*(?:python -m )?motiongen ((?:.*\\\n)*.*)$", re.MULTILINE)
OPTION = re.compile(r"`([+~]?[a-z_0-9./@]+=[^` ]+)`")
PLACE = re.compile(r"<[^>]*>")
OPEN = re.compile(r"\.\.\.|~/|=mine\.yaml|\bprogress\]|=my\.|=a,b$|=value$|=option$")
"""What is the reader's own."""
FOREIGN = re.compile(r"hydra[/.]launcher")
"""Options of packages that are installed where they are wanted."""
BASES = (
    *[[f"+experiment={name}"] for name in ("marionette", "actor", "um_cvae", "hierarchical_rvae", "recognizer")],
    ["+experiment=actor", "objective=joints"],
    ["task=synthesize", "correction=action_revision"],
    *[[f"task={name}"] for name in ("long_motion", "prepare", "compare", "report")],
    *[["+experiment=marionette", f"data={name}"] for name in ("bvh_folder", "smpl_folder", "humanact12", "bandai")],
)
"""Configurations, one of which has what an option sets."""


def found(pattern: re.Pattern[str]) -> Iterator[tuple[str, str]]:
    """Page, and what it says; `...` stands for what the reader fills in."""
    for page in PAGES:
        text = PLACE.sub("...", page.read_text(encoding="utf-8"))
        for match in pattern.findall(text):
            yield str(page.relative_to(ROOT)), match.replace("\\\n", " ")


@pytest.mark.parametrize(("page", "line"), found(COMMAND))
def test_a_command_of_the_documentation_is_right(page: str, line: str) -> None:
    typed = [text.strip("[]") if text[0] == "[" else text for text in shlex.split(line, comments=True)]
    flags = get_args_parser().parse_args(sorted(typed, key=lambda text: text != "-m"))
    if flags.help:
        return
    overrides = [with_quotes(text) for text in flags.overrides if not FOREIGN.match(text)]
    known = [text for text in overrides if not OPEN.search(text)]
    if known == overrides:
        check(known, multirun=flags.multirun)
    else:  # a task may not do without what is left open, but its other options are there
        compose(known)


@pytest.mark.parametrize("option", sorted({option for _, option in found(OPTION) if not OPEN.search(option)}))
def test_an_option_of_the_documentation_is_there(option: str) -> None:
    reasons = []
    for base in BASES:
        try:
            compose([*base, option])
        except ConfigurationError as error:
            reasons.append(f"{base}: {str(error).splitlines()[0]}")
        else:
            return
    pytest.fail("\n".join(reasons))


def test_the_documentation_has_commands() -> None:
    assert {page for page, _ in found(COMMAND)} > {"README.md", "docs/studies.md", "docs/long-motion.md"}
