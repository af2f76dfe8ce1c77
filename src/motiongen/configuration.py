"""Composes a configuration and says what is wrong with it, before torch is loaded or a folder is made."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from importlib.util import find_spec

import yaml
from hydra import compose as hydra_compose
from hydra import initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Glob, IntervalSweep, Override, Sweep
from hydra.errors import HydraException, MissingConfigException, OverrideParseException
from omegaconf import DictConfig, ListConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from motiongen.data.roots import DataError, check_root
from motiongen.discovery import core_conf, options, register_search_path
from motiongen.errors import InputError
from motiongen.export.formats import ENDINGS, PACKAGES
from motiongen.options_check import problems_in
from motiongen.resolvers import register_resolvers
from motiongen.runs import known_tags
from motiongen.search.naming import SEARCH
from motiongen.signatures import TargetError, summary_of
from motiongen.suggestions import did_you_mean
from motiongen.synthesis.timeline import TimelineError, read_timeline, resolve
from motiongen.tasks import TASKS

HYDRA_VERSION_BASE = "1.3"
COMPOSITION_ERRORS = (HydraException, OmegaConfBaseException, yaml.YAMLError, ValueError)
PLACED_AT_THE_TOP = ("experiment", "ablation", "search")
"""Groups whose options are parts of the whole configuration, so that they are added with `+`."""


class ConfigurationError(InputError):
    """What is wrong with a command line or a configuration file, in words for the person who typed it."""


def compose(overrides: Sequence[str] = (), *, with_hydra: bool = False) -> DictConfig:
    """The configuration that a command line gets, e.g. compose(["+experiment=marionette", "scale=smoke"]).

    `with_hydra` keeps the node `hydra` in it. Not to be called while Hydra runs a job: it has one state per process.

    Raises:
        ConfigurationError: an override or a file is wrong; the message names it and the nearest right name.
    """
    register_search_path()
    register_resolvers()
    try:
        return _compose(overrides, with_hydra=with_hydra)
    except COMPOSITION_ERRORS as error:
        raise ConfigurationError(_reworded(error, list(overrides))) from error


def _compose(overrides: Sequence[str], *, with_hydra: bool) -> DictConfig:
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(core_conf()), job_name="motiongen", version_base=HYDRA_VERSION_BASE):
        return hydra_compose("config", list(overrides), return_hydra_config=with_hydra)


def check(overrides: Sequence[str], *, multirun: bool = False) -> DictConfig:
    """Composes and checks the configuration of a command line, and of every value that it sweeps over.

    Returns:
        the (first) configuration.

    Raises:
        ConfigurationError: naming everything that was found wrong.
    """
    variants = list(_variants(overrides)) if multirun else [list(overrides)]
    configs = []
    for variant in variants:
        config = compose(variant, with_hydra=True)
        _check_one(config)
        configs.append(config)
    if configs[0].hydra.runtime.choices.get("hydra/sweeper") == SEARCH and not multirun:
        raise ConfigurationError("a search is a multirun: add -m")
    return configs[0]


def _check_one(config: DictConfig) -> None:
    problems = list(_unknown_sections(config))
    name = str(config.task.name)
    task = TASKS.get(name)
    if task is None:
        raise ConfigurationError(
            f"task={name}: there is no such task{did_you_mean(name, TASKS)}\n{_list('tasks', TASKS)}"
        )
    if task.needs_experiment and not config.get("name"):
        names = [option.name for option in options() if option.group == "experiment"]
        raise ConfigurationError(
            f"task={name} needs an experiment: add +experiment={names[0] if names else '...'}\n"
            f"{_list('experiments', names)}"
        )
    needed = [*task.needs, *(key for key in config.needs if key in task.reads)]
    for keys in (key.split("|") for key in needed):
        if all(config.get(key) is None for key in keys):
            problems.append(f"{' or '.join(keys)} must be given: {' or '.join(f'{key}=...' for key in keys)}")
    problems += problems_in(config, task.reads)
    if "data" in task.reads:
        problems += _missing_data(config)
    if "formats" in task.reads:
        problems += _unknown_formats(config)
    if "timeline" in task.reads and config.timeline is not None:
        problems += _unreadable_timeline(config)
    if problems:
        raise ConfigurationError("\n".join(problems))


def _missing_data(config: DictConfig) -> Iterator[str]:
    root = OmegaConf.select(config, "data.source.root", throw_on_missing=False)
    if root is not None:
        try:
            check_root(root)
        except DataError as error:
            yield f"{error}{_expected(config.data.source)}"


def _expected(source: DictConfig) -> str:
    """What lies in a data set's folder and where it comes from, as its class says."""
    try:
        summary = summary_of(source["_target_"])
    except TargetError:
        return ""  # is said already
    return f"\n  expected: {summary}" if summary else ""


def _unknown_formats(config: DictConfig) -> Iterator[str]:
    formats = config.formats
    known = ", ".join(ENDINGS)
    if not isinstance(formats, ListConfig):
        yield f"formats={formats}: takes a list, such as formats=[{next(iter(ENDINGS))}]\n  formats: {known}"
        return
    for name in formats:
        if name not in ENDINGS:
            yield f"formats: there is no format {name!r}{did_you_mean(str(name), ENDINGS)}\n  formats: {known}"
        elif name in PACKAGES and find_spec(PACKAGES[name][0]) is None:
            package, extra = PACKAGES[name]
            yield f"formats: {name} needs the package {package}: pip install 'motiongen[{extra}]'"


def _unreadable_timeline(config: DictConfig) -> Iterator[str]:
    """What is wrong with a timeline whatever the data is, and tags that the run does not know."""
    try:
        if not isinstance(config.variants, int) or config.variants < 1:
            yield f"variants={config.variants}: takes a whole number of at least 1"
        timeline = read_timeline(str(config.timeline))
        tags = known_tags(config.run)
        if tags is not None:
            resolve(timeline, tags)
    except TimelineError as error:
        yield str(error)


def _unknown_sections(config: DictConfig) -> Iterator[str]:
    """Keys at the top that no file declares: `+sead=1` would otherwise be taken without a word."""
    known = {str(key) for key in OmegaConf.load(core_conf() / "config.yaml")} | {"hydra"}
    known |= {option.group.split("/")[0] for option in options() if option.group not in PLACED_AT_THE_TOP}
    for key in map(str, config):
        if key not in known:
            groups = {option.group for option in options()}
            yield f"there is no key {key!r}{did_you_mean(key, (known | groups) - {'defaults'})}"


def _variants(overrides: Sequence[str]) -> Iterator[list[str]]:
    """One command line for each value of each sweep, the other sweeps at their first value."""
    try:
        parsed = OverridesParser.create().parse_overrides(list(overrides))
    except HydraException as error:
        raise ConfigurationError(_reworded(error, list(overrides))) from error
    lines = [_values(override) for override in parsed]
    first = [line[0] for line in lines]
    yield first
    for index, line in enumerate(lines):
        for value in line[1:]:
            yield [*first[:index], value, *first[index + 1 :]]


def _values(override: Override) -> list[str]:
    """`key=value` for every value that decides whether a sweep is valid: all choices, the ends of a range."""
    value = override.value()
    if not isinstance(value, Sweep | Glob):
        return [str(override.input_line)]
    key = override.get_key_element()
    names = [option.name for option in options() if option.group == override.key_or_group]
    if isinstance(value, Glob):
        matches = value.filter(names)
        if not matches:
            raise ConfigurationError(f"{override.input_line}: no option matches\n{_list('options', names)}")
        return [f"{key}={name}" for name in matches]
    if isinstance(value, IntervalSweep):
        return [f"{key}={value.start}", f"{key}={value.end}"]
    values = list(override.sweep_string_iterator())
    for name in values if names else []:  # told before anything is composed, however long the sweep
        if name not in names and not name.startswith("["):
            raise ConfigurationError(_missing_option(f"{override.key_or_group}/{name}", ""))
    if override.is_range_sweep():
        values = [values[0], values[-1]]
    return [f"{key}={value}" for value in values]


def _reworded(error: Exception, overrides: list[str]) -> str:
    """Hydra's composition error in terms of what was typed, the nearest right name and what there is to choose."""
    message = str(error) or str(error.__cause__)
    if isinstance(error, OverrideParseException):
        problem = message.splitlines()[0]
        return f"{error.override!r} cannot be read: {problem}; quote values with special characters, key='a b'"
    if isinstance(error, MissingConfigException) and error.missing_cfg_file:
        return _missing_option(str(error.missing_cfg_file), message)
    if match := re.search(r"Could not (?:override|append to config|delete from config)\W+'?([\w./@]+)'?", message):
        return _unknown_key(match[1], message, overrides)
    cause = error.__cause__
    detail = f" ({str(cause).splitlines()[0]})" if isinstance(cause, OmegaConfBaseException) and message else ""
    return message.strip() + detail


def _missing_option(path: str, message: str) -> str:
    group, _, name = path.rpartition("/")
    names = [option.name for option in options() if option.group == group]
    where = re.match(r"In '([^']+)'", message)
    origin = f" (named by {where[1]})" if where and where[1] != "config" else ""
    if not names:
        groups = sorted({option.group for option in options()})
        return f"{group}={name}: nothing offers options for {group}{origin}\n{_list('groups', groups)}"
    return f"{group}={name}: there is no such option{origin}{did_you_mean(name, names)}\n{_list('options', names)}"


def _unknown_key(key: str, message: str, overrides: list[str]) -> str:
    typed = next((text for text in overrides if text.lstrip("+~").split("=")[0] == key), key)
    if key in PLACED_AT_THE_TOP:
        return f"{typed}: {key} is added, not replaced: +{typed}"
    if "already at" in message:
        return f"{typed}: {key} is there already; leave out the +"
    try:
        config = _compose([text for text in overrides if text != typed], with_hydra=False)
    except COMPOSITION_ERRORS:
        config = OmegaConf.create()
    groups = {option.group for option in options()}
    known = set(_keys(config))
    last = key.rpartition(".")[2]
    near = did_you_mean(key, known | groups)
    if not near:  # the right name in the wrong place, or without its place
        same = sorted(name for name in known if name.rpartition(".")[2] == last)
        near = f"; did you mean {' or '.join(repr(name) for name in same[:3])}?" if same else ""
    parent, _, _ = key.rpartition(".")
    siblings = sorted(name[len(parent) :].lstrip(".") for name in known if name.rpartition(".")[0] == parent)
    siblings = [name for name in siblings if not name.startswith("_")]
    return f"{typed}: there is no key {key!r}{near}\n" + _list(f"keys of {parent}" if parent else "keys", siblings)


def _keys(config: DictConfig, prefix: str = "") -> Iterator[str]:
    for key in map(str, config):
        yield f"{prefix}{key}"
        if not OmegaConf.is_interpolation(config, key) and not OmegaConf.is_missing(config, key):
            value = config[key]
            if isinstance(value, DictConfig):
                yield from _keys(value, f"{prefix}{key}.")


def _list(title: str, names: Iterable[str]) -> str:
    return f"  {title}: {', '.join(names) or 'none'}"
