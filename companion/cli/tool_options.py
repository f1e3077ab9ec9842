"""The options of the commands that do not fly."""

import argparse
from pathlib import Path

from companion.cli.options import (
    Commands,
    add_endpoint,
    add_flag,
    add_flight_folder,
    add_json,
    add_live,
    add_path,
    add_required_config,
    add_set,
    number_parser,
    whole_number_parser,
)
from companion.study import registry

STARTING_FILES = {"px4": "px4", "ardupilot": "ardupilot", "mock": "mock-px4"}
"""For each name that `init` accepts: the shipped file from which `init` makes a new one."""


def add_serve(commands: Commands) -> None:
    """Add `serve`."""
    serve = commands.add_parser(
        "serve",
        help="let other programs use the link: ground stations, MAVSDK, scripts",
        description="Forward messages between the autopilot and the clients at serve.clients, "
        "until Ctrl-C. When a client sends setpoints and commands OFFBOARD (PX4) or GUIDED "
        "(ArduPilot), our control law flies its setpoints. Only one client is in control.",
    )
    add_required_config(serve)
    add_endpoint(serve)
    serve.add_argument(
        "--client",
        action="append",
        default=[],
        metavar="ENDPOINT",
        help="replaces serve.clients, such as udpin://127.0.0.1:14551; may be repeated",
    )
    add_set(serve, "link.target_system=2")
    add_json(serve, "print the counters at the end as one line of JSON")
    add_live(serve)
    serve.set_defaults(run="cli.serve.serve")


def add_tune(commands: Commands) -> None:
    """Add `tune`."""
    tune = commands.add_parser(
        "tune",
        help="propose gain, weights and bandwidth for an identified vehicle",
        description="Search gain, weights and bandwidth for the smallest expected position error "
        "within stability margins (7 dB, 31°), by linear analysis of the identified vehicle. Fly "
        "the old and the new values on the mock vehicle. Write the new values, with the reasons as "
        "comments, as YAML for the configuration to include. docs/identify.md explains "
        "what it computes. Exit code 1: with the new values a flight failed or was worse; "
        "the first line says which.",
    )
    source = "vehicle.yaml of `companion identify`, or the folder of its flight"
    add_path(tune, "vehicle", source, "PATH")
    add_path(
        tune, "--config", "configuration to tune (default: that of the flight, or the defaults)"
    )
    tune.add_argument(
        "--out",
        "--output",  # the former name of --out
        dest="output",
        type=Path,
        metavar="FILE",
        help="file for the result (default: tuned.yaml beside the vehicle file)",
    )
    add_flag(tune, "--force", "replace FILE if it exists")
    add_flag(tune, "--no-flights", "do not fly the values on the mock vehicle")
    add_json(tune)
    tune.set_defaults(run="cli.tune.tune")


def add_benches(commands: Commands) -> None:
    """Add `bench link`, `bench serve`, `bench planner` and `bench flight`."""
    bench = commands.add_parser("bench", help="measure this program's speed")
    benches = bench.add_subparsers(required=True, metavar="WHAT")
    link = benches.add_parser(
        "link", help="latency from sample to setpoint: ours, echo, pymavlink, MAVSDK"
    )
    serve = benches.add_parser(
        "serve", help="latency from sample to setpoint, with three clients on the link and without"
    )
    for each in (link, serve):
        _add_seconds(each, 0.1, 20.0, "duration for each program")
        each.add_argument(
            "--rate",
            dest="rate_hz",
            type=number_parser(1.0, 2000.0),
            default=250.0,
            metavar="RATE",
            help="samples per second (250)",
        )
    step_bench = benches.add_parser(
        "planner", help="time of one step of each planner, in a flight and in batches"
    )
    _add_seconds(step_bench, 0.001, 5.0, "duration of the measurement")
    flight = benches.add_parser(
        "flight", help="speed of whole flights in one process, as a multiple of real time"
    )
    _add_seconds(flight, 0.1, 20.0, "duration of the hover in each flight")
    add_flag(flight, "--profile", "also show the processor time of each part")
    for name, each in benches.choices.items():
        add_json(each, "print the figures as one JSON line")
        each.set_defaults(run="cli.tools.bench", bench=name)


def _add_seconds(
    bench: argparse.ArgumentParser, least: float, default: float, meaning: str
) -> None:
    parser = number_parser(least, 3600.0)
    bench.add_argument("--seconds", type=parser, default=default, help=f"{meaning} ({default:g})")


def add_study(commands: Commands) -> None:
    """Add `study`."""
    study = commands.add_parser(
        "study",
        help="the paper's experiments and further ones: figures, tables, a page (extra `study`)",
        epilog=f"studies:\n{registry.help_table()}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    study.add_argument(
        "name", choices=registry.study_names(), metavar="NAME", help="a study, see below"
    )
    case_help = (
        f"for {registry.names_with_case()}: file with the step to fly (configs/study-case.yaml)"
    )
    add_path(study, "--case", case_help)
    out_help = "folder for the results (default: study)"
    add_path(study, "--out", out_help, "DIR", default=Path("study"))
    study.add_argument(
        "--workers",
        type=whole_number_parser(1, 256),
        metavar="N",
        help="processes for `study all`; default: one for each core",
    )
    add_json(study, f"for {registry.names_with_json()}: print its rows as one JSON list")
    study.set_defaults(run="cli.tools.study")


def add_config(commands: Commands) -> None:
    """Add `config`, `init` and `check-config`."""
    show = commands.add_parser(
        "config",
        help="print the configuration: every key, its default, unit, range and meaning",
        description="Print every key as commented YAML, with the values of FILE or the defaults.",
    )
    add_path(show, "file", "configuration", nargs="?")
    selection = show.add_mutually_exclusive_group()
    add_path(selection, "--diff", "print only the keys that FILE changes")
    selection.add_argument(
        "--get", metavar="KEY", help="print only this key, such as limits.max_tilt_deg"
    )
    add_flag(selection, "--schema", "print the JSON Schema, for editors")
    add_flag(selection, "--markdown", "print tables, as in docs/configuration.md")
    show.set_defaults(run="cli.config.show")

    start = commands.add_parser("init", help="write a commented starting configuration")
    start.add_argument("name", choices=list(STARTING_FILES), help="vehicle of the configuration")
    out_help = "file to write (default: companion.yaml); an existing file is never replaced"
    add_path(start, "--out", out_help, default=Path("companion.yaml"))
    start.set_defaults(run="cli.config.init")

    check = commands.add_parser(
        "check-config",
        help="check a configuration file",
        description="Check a configuration file and what it includes. The format is YAML 1.2 "
        "(010 is ten, yes is a text) without aliases and tags, up to 250 kB and 6000 values. "
        "`companion config` shows the range of each key.",
    )
    check.add_argument("file", type=Path, metavar="FILE")
    add_set(check, "planner.gain_per_s=4")
    check.set_defaults(run="cli.config.check")


def add_recordings(commands: Commands) -> None:
    """Add `plot`, `report`, `compare`, `export` and `replay`."""
    _add_plot(commands)
    _add_reports(commands)
    _add_export(commands)
    _add_replay(commands)


def _add_plot(commands: Commands) -> None:
    plot = commands.add_parser(
        "plot",
        help="draw a recorded flight (extra `plot`)",
        description="Draw a recorded flight as a picture: its path, its steps, and error, speed, "
        "tilt and height over time, with the place and the reason of an early end.",
    )
    add_flight_folder(plot)
    add_path(plot, "--out", "picture (default: FOLDER/flight.png)")
    plot.set_defaults(run="cli.recordings.plot")


def _add_export(commands: Commands) -> None:
    export = commands.add_parser(
        "export",
        help="write a recorded flight as CSV or Parquet",
        description="Write the tables of a recorded flight: samples, setpoints, guidance, events.",
    )
    add_flight_folder(export)
    kind = export.add_mutually_exclusive_group(required=True)
    add_flag(kind, "--csv", "one CSV file for each channel")
    add_flag(kind, "--parquet", "one Parquet file for each channel (extra `export`)")
    add_path(export, "--into", "folder for the files (default: FOLDER/export)", "FOLDER")
    export.set_defaults(run="cli.recordings.export")


def _add_replay(commands: Commands) -> None:
    replay = commands.add_parser(
        "replay",
        help="run the control loops again on the inputs of a recorded flight",
        description="Run the control loop and guidance again on the recorded inputs of a flight, "
        "and compare each setpoint. With the flight's own configuration, all setpoints must be "
        "equal to the bit. With another one, the command shows what would have been sent.",
    )
    add_flight_folder(replay)
    add_path(replay, "--config", "configuration that replaces the flight's own")
    add_set(replay, "planner.gain_per_s=4")
    add_path(replay, "--csv", "write both setpoints for each sample to this file")
    replay.set_defaults(run="cli.recordings.replay")


def _add_reports(commands: Commands) -> None:
    report = commands.add_parser(
        "report",
        help="one HTML page about a flight, or about any .tlog (extra `report`)",
        description="Write one HTML page, without other files, about a flight or any .tlog.",
    )
    add_path(report, "flight", "the flight's folder, or a .tlog of any program", "FOLDER")
    add_path(report, "--out", "page (default: FOLDER/report.html)")
    report.set_defaults(run="cli.recordings.report")
    compare = commands.add_parser(
        "compare",
        help="one HTML page that compares flights (extra `report`)",
        description="Write one HTML page that shows the motions of flights, and the "
        "configuration keys and figures in which they differ.",
    )
    add_path(compare, "flights", "folders of flights, or .tlog files", "FOLDER", nargs="+")
    add_path(compare, "--out", "page (default: compare.html)", default=Path("compare.html"))
    compare.set_defaults(run="cli.recordings.compare")
