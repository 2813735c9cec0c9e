"""`liealign run` and `liealign align`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from liealign import console
from liealign.cli.flags import ALIGN_FLAGS, FLAGS, Given, takes_flags
from liealign.cli.work import align_flight, demand_aligned, exit_codes, run_to_folder

Quiet = Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")]
RequireAligned = Annotated[
    bool, typer.Option("--require-aligned", help='Exit with code 4 unless the verdict is "aligned".')
]


@takes_flags(FLAGS)
def run(
    given: Given,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="OUT", help="Folder for the results.")],
    require_aligned: RequireAligned = False,
    quiet: Quiet = False,
) -> None:
    """Align the heading, filter, smooth, write the results into OUT. Flags are stronger than FLIGHT.toml."""
    with exit_codes():
        results = run_to_folder(given.config(), output, quiet=quiet, require_aligned=require_aligned)
        if not quiet:
            console.print_run(*results, output)


@takes_flags(ALIGN_FLAGS)
def align(
    given: Given,
    json: Annotated[bool, typer.Option("--json", help="Print alignment.json on stdout.")] = False,
    require_aligned: RequireAligned = False,
    quiet: Quiet = False,
) -> None:
    """Find the heading only. Flags are stronger than FLIGHT.toml."""
    with exit_codes():
        prepared, alignment = align_flight(given.config(), quiet)
        if json:
            sys.stdout.write(alignment.json_text)
        elif not quiet:
            console.print_alignment(prepared, alignment)
        demand_aligned(alignment, require_aligned)
