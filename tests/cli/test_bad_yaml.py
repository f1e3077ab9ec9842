"""Files that attack the reader: each is refused in a sentence, at once.

The programs that read YAML are tried with the same files: the configuration, and the bundled
vehicle, which has a reader of its own.
"""

import contextlib
import os
import time
from typing import ClassVar

import pytest
import yaml

from companion.cli.main import main
from companion.config import Config
from companion.config.files import load
from companion.files import bounded_yaml
from companion.files.bounded_yaml import MOST_BYTES, YamlError
from companion.files.yaml_file import ConfigError, Section, parse
from sitl_mock.config.section import ConfigError as MockConfigError
from sitl_mock.settings import load_settings

QUICK = 2.0
"""s of processor time; a refusal takes no longer."""

ATTACKS = {
    "5000 digits": f"limits: {{max_tilt_deg: {'9' * 5000}}}",
    "5000 digits of a float": f"limits: {{max_tilt_deg: 1.{'9' * 3000}}}",
    "5000 digits of a key": f"{'9' * 5000}: 1",
    "a date": "limits: {max_tilt_deg: 2024-01-01}",
    "a time": "limits: {max_tilt_deg: 2024-01-01T00:00:00Z}",
    "an impossible date": "limits: {max_tilt_deg: 2024-99-99}",
    "a tagged number": "limits: {max_tilt_deg: !!int 'abc'}",
    "a tagged float": "limits: {max_tilt_deg: !!float 'abc'}",
    "a tagged truth": "flight: {arm: !!bool maybe}",
    "a tagged date": "flight: {arm: !!timestamp x}",
    "a python object": "flight: !!python/object/apply:os.system [ls]",
    "deep lists": "a: " + "[" * 20_000,
    "deep closed lists": "a: " + "[" * 3000 + "]" * 3000,
    "deep mappings": "{a: " * 20_000,
    "deep blocks": "\n".join(" " * n + "a:" for n in range(600)),
    "an alias bomb": "a: &a [1, 1]\n"
    + "\n".join(
        f"{chr(98 + n)}: &{chr(98 + n)} [*{chr(97 + n)}, *{chr(97 + n)}]" for n in range(24)
    ),
    "an endless alias": "a: &a [*a]",
    "an endless merge": "a: &a {<<: *a}",
    "20,000 keys": "\n".join(f"key{n}: 1" for n in range(20_000)),
    "20,000 keys of a section": "limits:\n" + "\n".join(f"  k{n}: 1" for n in range(20_000)),
    "4000 unknown keys": "\n".join(f"key{n}: 1" for n in range(4000)),
    "a null character": "link: {endpoint: 'a\0b'}",
    "an escaped null character": 'link: {endpoint: "udpin://a\\0b:1"}',
    "an impossible escape": 'link: {endpoint: "\\UFFFFFFFF"}',
    "half a character": 'link: {endpoint: "\\ud800"}',
    "a large value": f"link: {{endpoint: '{'a' * 5_000_000}'}}",
    "a long value": f"link: {{endpoint: '{'a' * 200_000}'}}",
    "a long key": f"{'a' * 5000}: 1",
    "a mapping as a key": "{[1, 2]: 3}",
    "a number as a key": "1: 2",
    "no key": "~: 2",
    "the same key twice": "a: 1\na: 2",
    "two documents": "---\nlink: {}\n---\nlink: {}",
    "an endless version": f"%YAML 1.{'9' * 5000}\n---\na: 1",
    "an unknown anchor": "a: *b",
    "a scalar": "42",
    "a list": "- a",
    "an open quotation": "a: '" + "b\n" * 5000,
    "tabs": "a:\n\t- b",
    "no text": "\ufeff\ufeff\0",
    "a huge number": "safety: {max_speed_m_s: 1.0e+308}",
    "a huger number": "safety: {max_speed_m_s: 1e999}",
    "not a number": "safety: {max_speed_m_s: .nan}",
    "base sixty": "safety: {max_speed_m_s: 1:30}",
    "a thousand": "safety: {max_speed_m_s: 1_0_}",
    "a large whole number": "link: {target_system: 0xffffffffffffffff}",
}


def refusal(path):
    """What the command says of a file, which it refuses in time and in one piece."""
    began = time.process_time()
    with pytest.raises(ConfigError) as raised:
        load(path)
    assert time.process_time() - began < QUICK
    told = str(raised.value)
    assert str(path) in told
    assert len(told) < 1500
    assert "\n" not in told
    return told


@pytest.mark.parametrize("text", ATTACKS.values(), ids=ATTACKS)
def test_an_attack_is_refused_at_once_in_a_sentence(tmp_path, text):
    path = tmp_path / "attack.yaml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    assert refusal(path)


@pytest.mark.parametrize("text", ATTACKS.values(), ids=ATTACKS)
def test_the_bundled_vehicle_ends_an_attack_as_soon(tmp_path, text):
    path = tmp_path / "attack.yaml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    began = time.process_time()
    with contextlib.suppress(MockConfigError):  # other sections are not its business
        load_settings(path, {})
    assert time.process_time() - began < QUICK


@pytest.mark.parametrize("kind", ["directory", "pipe", "zero", "large", "latin-1"])
def test_what_is_no_file_of_text_is_refused_at_once(tmp_path, kind):
    path = tmp_path / "c.yaml"
    if kind == "directory":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "zero":
        path.symlink_to("/dev/zero")
    elif kind == "large":
        path.write_text("#" * (MOST_BYTES + 1))
    else:
        path.write_bytes("a: größe".encode("latin-1"))
    assert refusal(path)
    (tmp_path / "main.yaml").write_text("include: c.yaml\n")
    with pytest.raises(ConfigError, match=r"c\.yaml: .*\(included by .*main\.yaml\)"):
        load(tmp_path / "main.yaml")
    with pytest.raises(MockConfigError, match=r"c\.yaml: "):
        load_settings(path, {})


@pytest.mark.parametrize("command", [("doctor", "--undo"), ("study", "custom", "--case")])
def test_every_command_reads_within_the_bounds(tmp_path, capsys, command):
    config = tmp_path / "c.yaml"
    config.write_text("")
    more = ("--config", str(config)) if command[0] == "doctor" else ()
    assert main([*command, "/dev/zero", *more]) == 2
    assert "not a regular file" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("010", 10),
        ("0o10", 8),
        ("0x1F", 31),
        ("-7", -7),
        ("1e3", 1000.0),
        ("+.5", 0.5),
        ("-.inf", -float("inf")),
        ("1:30", "1:30"),
        ("1_000", "1_000"),
        ("2024-01-01", "2024-01-01"),
        ("yes", "yes"),
        ("off", "off"),
        ("True", True),
        ("~", None),
        ("", None),
        ("'5'", "5"),
        ("<<", "<<"),
    ],
)
def test_values_mean_what_yaml_1_2_says(text, value):
    read = bounded_yaml.parse(f"key: {text}")["key"]
    assert (read, type(read)) == (value, type(value))


@pytest.mark.parametrize("word", ["yes", "on", "1", "'true'", "null"])
def test_a_truth_is_true_or_false_and_nothing_else(word):
    for key in ("arm", "slow_down"):
        with pytest.raises(ConfigError, match=f"`flight.{key}`: must be true or false"):
            parse(f"flight: {{{key}: {word}}}", "c.yaml", Config)


@pytest.mark.parametrize(
    "text",
    ["12e45", "0000000000012e45", "0o17", "1e3", "010", "yes", "1:30", "~", "2024-01-01", ""],
)
def test_what_is_written_is_read_as_it_was_by_either_version_of_yaml(text):
    numbers = [1e-5, 1e300, 3, -0.0]
    data = {"uid": text, "one": numbers, "the same": numbers, "truth": True, "none": None}
    assert bounded_yaml.parse(bounded_yaml.dump(data)) == data
    assert yaml.safe_load(bounded_yaml.dump(data)) == data


def test_a_refusal_names_the_line():
    with pytest.raises(ConfigError, match=r"c\.yaml, line 3: a number is longer than 40"):
        parse(f"link: {{}}\nlimits:\n  max_tilt_deg: {'9' * 41}\n", "c.yaml", Config)
    with pytest.raises(YamlError, match="write out what the alias"):
        bounded_yaml.parse("a: &a 1\nb: *a\n")


def test_the_bundled_vehicle_reads_numbers_as_yaml_1_2_has_them(tmp_path):
    path = tmp_path / "c.yaml"
    path.write_text("mock: {seed: 010, lockstep: {enabled: true}, airframe: {mass_kg: 1e0}}")
    settings = load_settings(path, {})
    assert (settings.seed, settings.airframe.mass_kg) == (10, 1.0)
    for wrong in ("1:30", "2024-01-01", "0o17"):
        path.write_text(f"mock: {{seed: {wrong}}}")
        with pytest.raises(MockConfigError, match=r"mock\.seed"):
            load_settings(path, {})


class _Inner(Section):
    speed_m_s: float = 1.0


class _File(Section):
    former_keys: ClassVar = {
        "old": "is now `inner`",
        "inner.pace": "is now `inner.speed_m_s`",
    }
    inner: _Inner = _Inner()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("old: {pace: 1}", "f.yaml, line 1: `old` is now `inner`"),
        ("old:", "f.yaml, line 1: `old` is now `inner`"),
        ("inner: {pace: 1}", "f.yaml, line 1: `inner.pace` is now `inner.speed_m_s`"),
        ("pace: 1", "f.yaml, line 1: `pace` is not a known key; known here: inner"),
    ],
)
def test_a_former_key_is_refused_with_what_became_of_it(text, words):
    with pytest.raises(ConfigError) as raised:
        parse(text, "f.yaml", _File)
    assert str(raised.value) == words


@pytest.mark.parametrize("key", Config.former_keys)
def test_a_former_key_of_the_configuration_says_what_became_of_it(key):
    text = "".join(f"{'  ' * depth}{part}:\n" for depth, part in enumerate(key.split(".")))
    with pytest.raises(ConfigError) as raised:
        parse(text, "c.yaml", Config)
    assert str(raised.value) == f"c.yaml, line {text.count(':')}: `{key}` {Config.former_keys[key]}"
