"""The commands that do not fly: `bench` and `study`."""

import argparse
import json
from importlib import import_module

from rich.console import Console

from companion.child_process import usable_cores
from companion.cli.exit_codes import EXIT_FAILURE, EXIT_OK
from companion.files.yaml_file import ConfigError
from companion.study import registry


def bench(options: argparse.Namespace) -> int:
    """Run the benchmark `options.bench`, a module in `companion.bench`."""
    settings = {
        name: getattr(options, name)
        for name in ("seconds", "rate_hz", "profile")
        if hasattr(options, name)
    }
    benchmark = import_module(f"companion.bench.{options.bench}")
    figures = benchmark.run(**settings, as_json=options.json)
    if options.json:
        print(json.dumps(figures))
    return EXIT_OK


def study(options: argparse.Namespace) -> int:
    """Run the experiments of the paper and our own."""
    if options.json and not all(
        study.prints_json for study in registry.selected_studies(options.name)
    ):
        raise ConfigError(
            f"--json needs study {registry.names_with_json()}; study {options.name} writes its"
            " tables as CSV"
        )
    registry.check_extras(options.name)
    from companion.study import runner  # noqa: PLC0415  needs the extra

    count = options.workers or usable_cores()
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
