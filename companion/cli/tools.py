"""The commands that do not fly: `bench` and `study`."""

import argparse
import json

from rich.console import Console

from companion.cli.exit_codes import EXIT_FAILURE, EXIT_OK
from companion.files.yaml_file import ConfigError
from companion.study import registry


def bench_link(options: argparse.Namespace) -> int:
    """Measure the latency of our link and of others."""
    from companion.bench import link  # noqa: PLC0415  no other command needs it

    figures = link.run(options.seconds, options.rate, options.json)
    if options.json:
        print(json.dumps(figures))
    return EXIT_OK


def bench_serve(options: argparse.Namespace) -> int:
    """Measure the latency of our link with and without other programs on it."""
    from companion.bench import serve  # noqa: PLC0415  no other command needs it

    figures = serve.run(options.seconds, options.rate, options.json)
    if options.json:
        print(json.dumps(figures))
    return EXIT_OK


def bench_planner(options: argparse.Namespace) -> int:
    """Measure the time of one step of each planner."""
    from companion.bench import planner  # noqa: PLC0415  no other command needs it

    figures = planner.run(options.seconds, options.json)
    if options.json:
        print(json.dumps(figures))
    return EXIT_OK


def bench_flight(options: argparse.Namespace) -> int:
    """Measure how fast one core flies."""
    from companion.bench import flight  # noqa: PLC0415  no other command needs it

    figures = flight.run(options.seconds, options.json, profile=options.profile)
    if options.json:
        print(json.dumps(figures))
    return EXIT_OK


def study(options: argparse.Namespace) -> int:
    """Run the experiments of the paper and our own."""
    if options.json and not all(study.prints_json for study in registry.chosen(options.name)):
        raise ConfigError(
            f"--json needs study {registry.names_with_json()}; study {options.name} writes its"
            " tables as CSV"
        )
    registry.check_extras(options.name)
    from companion.study import runner, workers  # noqa: PLC0415  needs the extra

    count = options.workers or workers.cores()
    console = Console(stderr=options.json, markup=False)
    try:
        page, rows = runner.run(options.name, options.case, options.out, console, count)
    except KeyboardInterrupt:
        message = f"Interrupted: in {options.out} only the files of finished studies are complete."
        console.print(f"{message} Run the command again.", highlight=False)
        return EXIT_FAILURE
    console.print(f"Open {page}", soft_wrap=True, highlight=False)
    if options.json:
        print(json.dumps(rows, allow_nan=False))
    return EXIT_OK
