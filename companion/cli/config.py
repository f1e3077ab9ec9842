"""`companion config`, `companion init` and `companion check-config`."""

import argparse
import sys
from pathlib import Path

from companion.cli.exit_codes import EXIT_OK
from companion.cli.tool_options import STARTING_FILES
from companion.config import Config
from companion.config.files import json_schema, load, shipped, with_assignments
from companion.config.reference import ConfigKey, as_markdown, as_yaml, changed_keys, keys
from companion.config.suspect_values import suspect_values
from companion.control.expected_response import expectations
from companion.demo import check_mock
from companion.extras import MissingExtraError
from companion.files.similar_names import MIN_SIMILARITY, most_similar_name
from companion.files.write_whole import write_whole
from companion.files.yaml_file import ConfigError
from companion.flight.maneuvers import configured_maneuvers
from companion.flight.start_checks import check_control, check_link, require_extras
from companion.guidance.follow import Follow
from companion.program_command import program_command


def show(options: argparse.Namespace) -> int:
    """Print the configuration or some keys as YAML, or the tables or schema of all keys."""
    if options.file and (options.schema or options.markdown or options.diff):
        raise ConfigError(
            f"leave out {options.file}: --diff takes its own FILE, and --schema and --markdown "
            "take none"
        )
    if options.schema:
        text = json_schema()
    elif options.markdown:
        text = as_markdown(keys(Config()))
    elif options.diff:
        changes = list(changed_keys(load(options.diff)))
        text = as_yaml(changes) if changes else f"# {options.diff} changes no default\n"
    else:
        config = load(options.file) if options.file else Config()
        text = as_yaml(_named_keys(config, options.get) if options.get else keys(config))
    sys.stdout.write(text)
    return EXIT_OK


def _named_keys(config: Config, name: str) -> list[ConfigKey]:
    """The key with that name, or all keys of a section."""
    known_keys = list(keys(config))
    matching = [key for key in known_keys if name in (key.section, f"{key.section}.{key.name}")]
    if not matching:
        hint = "`companion config` prints them all"
        if similar_names := _suggestions(known_keys, name):
            hint = f"did you mean {', '.join(similar_names)}?"
        raise ConfigError(f"--get: there is no key `{name}`; {hint}")
    return matching


def _suggestions(known_keys: list[ConfigKey], name: str) -> list[str]:
    """Suggestions for an unknown name: the keys that contain it, else the most similar ones."""
    keys_by_dotted_name = {f"{key.section}.{key.name}": key for key in known_keys}
    containing_names = [
        dotted_name for dotted_name, key in keys_by_dotted_name.items() if name in key.name
    ]
    if containing_names:
        return containing_names
    candidates: dict[str, list[str]] = {key.section: [key.section] for key in known_keys}
    for dotted_name, key in keys_by_dotted_name.items():
        candidates[dotted_name] = [dotted_name]
        # Several sections may have a key of this name.
        candidates.setdefault(key.name, []).append(dotted_name)
    similar_name = most_similar_name(name, candidates, MIN_SIMILARITY)
    return [] if similar_name is None else candidates[similar_name]


def init(options: argparse.Namespace) -> int:
    """Write a commented starting file: a shipped configuration with its includes merged.

    Raises:
        ConfigError: the file exists or cannot be written.
    """
    name = f"{STARTING_FILES[options.name]}.yaml"
    text = shipped(name).read_text(encoding="utf-8")
    lines = []
    for line in text.splitlines(keepends=True):
        if line.startswith("# yaml-language-server"):
            continue
        if not line.startswith("include: "):
            lines.append(line)
            continue
        included = shipped(line.split()[1]).read_text(encoding="utf-8")
        lines.append("# Response of the rate loop; `companion identify` measures yours.\n")
        lines.append(included[included.index("vehicle:\n") :])
    out = Path(options.out)
    if out.exists() or out.is_symlink():
        raise ConfigError(f"{out} exists already; choose another file with --out")
    try:
        own_text = "".join(lines).removeprefix("#\n")
        write_whole(out, own_text.replace(f"configs/{name}", str(out)))
    except OSError as error:
        raise ConfigError(f"--out: cannot write {out}: {error.strerror}") from error
    print(f"Wrote {out}. Check it with: {program_command('check-config', out)}")
    return EXIT_OK


def check(options: argparse.Namespace) -> int:
    """Check a configuration file, its includes, its maneuvers, and its section `mock`.

    Raises:
        ConfigError: the file cannot be used.
        SigningError: the signing key cannot be used.
    """
    config = with_assignments(load(options.file), options.set)
    try:
        check_link(config)
    except ConfigError as error:
        raise ConfigError(f"{options.file}: {error}") from error
    maneuvers = configured_maneuvers(config)
    check_control(config)
    if config.mock is not None:
        check_mock(options.file)
    for part in maneuvers.parts:
        if isinstance(part, Follow):
            print("\n".join(part.notes))
    for text in expectations(config):
        print(text)
    for value in suspect_values(config):
        print(f"warning: {value.sentence()}")
    try:
        require_extras(config)
    except MissingExtraError as error:  # the computer that flies may have it
        print(f"warning: {error}")
    if config.flight.trajectory is not None and "trajectory" not in config.flight.maneuvers:
        print(
            "warning: flight.trajectory is not flown; add trajectory to flight.maneuvers, as in "
            "`--set flight.maneuvers=[trajectory]`"
        )
    if config.mock is None and not list(changed_keys(config)):
        print(f"warning: {options.file} changes no default; is this the file that you meant?")
    print(f"{options.file}: ok")
    return EXIT_OK
