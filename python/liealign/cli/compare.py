"""`liealign compare`: the errors of a trajectory against truth."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from liealign import console
from liealign.cli.work import exit_codes
from liealign.comparison import compare as compare_tracks
from liealign.track import read_trajectory


def compare(
    truth: Annotated[
        Path,
        typer.Argument(metavar="TRUTH", help="truth.csv, or any trajectory.csv or SBET.", show_default=False),
    ],
    trajectory: Annotated[
        Path,
        typer.Argument(
            metavar="TRAJECTORY", help="trajectory.csv, filtered.csv or trajectory.sbet.", show_default=False
        ),
    ],
    from_s: Annotated[
        float | None, typer.Option("--from", metavar="S", help="First time to compare.")
    ] = None,
    to_s: Annotated[float | None, typer.Option("--to", metavar="S", help="Last time to compare.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON.")] = False,
) -> None:
    """Show the errors of TRAJECTORY against TRUTH.

    Each channel has its mean, rms, 95 % point and maximum, and, where TRAJECTORY states sigmas, the share of
    errors inside one and two of them and the rms of error over sigma. Both have to be of the same point and
    axes.
    """
    with exit_codes():
        better, found = read_trajectory(truth), read_trajectory(trajectory)
        result = compare_tracks(better, found, from_s=from_s, to_s=to_s)
        if as_json:
            content = {"truth": str(truth), "trajectory": str(trajectory), **result.to_dict()}
            print(json.dumps(content, indent=2))
        else:
            console.print_comparison(result)
