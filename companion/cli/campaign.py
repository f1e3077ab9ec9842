"""The command `campaign` and its sub-commands."""

import argparse
from pathlib import Path

from rich.console import Console

from companion.cli.exit_codes import EXIT_FAILURE, EXIT_OK
from companion.cli.flying import write_flight_page


def run(options: argparse.Namespace) -> int:
    """Run a campaign, or continue one."""
    from companion.campaign import running  # noqa: PLC0415  no other command needs it

    return running.run(options)


def report(options: argparse.Namespace) -> int:
    """Write the page about a campaign, and all results in one table."""
    from companion.campaign.report import page  # noqa: PLC0415

    return page.run(options)


def tune(options: argparse.Namespace) -> int:
    """Search limits, gains and weights over the flights of a campaign."""
    from companion.campaign.tune import command  # noqa: PLC0415

    return command.run(options)


def rerun(options: argparse.Namespace) -> int:
    """Fly one case again, and tell whether the flight is identical."""
    from companion.campaign.rerun import rerun as fly_again  # noqa: PLC0415

    console = Console(highlight=False, soft_wrap=True, markup=False)
    again = fly_again(options.folder, options.case)
    for text in (
        *again.lines,
        f"Recorded in {again.folder}",
        write_flight_page(Path(again.folder)),
    ):
        console.print(text)
    return EXIT_OK if again.identical else EXIT_FAILURE
