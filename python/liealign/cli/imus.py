"""`liealign imus`: the IMU profiles, all as a table or one as TOML."""

from __future__ import annotations

import json
import textwrap
from typing import Annotated, Any

import typer
from rich.table import Table

from liealign import _core, console
from liealign._core import ImuProfile, InputError
from liealign.cli.work import exit_codes

# Number of a profile and configuration key, heading in the table, unit.
_NUMBERS = (
    ("gyro_arw_deg_sqrt_h", "gyro\nARW", "deg/sqrt(h)"),
    ("accel_vrw_mps_sqrt_h", "accel\nVRW", "m/s/sqrt(h)"),
    ("gyro_bias_instability_deg_h", "gyro\ndrift", "deg/h"),
    ("accel_bias_instability_ug", "accel\ndrift", "ug"),
    ("gyro_bias_turn_on_deg_h", "gyro\nturn-on", "deg/h"),
    ("accel_bias_turn_on_mg", "accel\nturn-on", "mg"),
)
_LEGEND = (
    "ARW deg/sqrt(h), VRW m/s/sqrt(h); drift: bias instability, deg/h and ug;",
    "turn-on: bias at power-up, one sigma, deg/h and mg; ~ our estimate.",
    "liealign imus NAME shows one with its source; run --imu-model NAME uses it.",
)


def _estimates(profile: ImuProfile) -> list[str]:
    return [name for name in profile.estimated.split(", ") if name]


def _text(value: float) -> str:
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def _print_all(profiles: list[ImuProfile]) -> None:
    table = Table(box=None, pad_edge=False)
    table.add_column("name\n", no_wrap=True)
    for _, heading, _ in _NUMBERS:
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("IMU\n")
    for p in profiles:
        estimates = _estimates(p)
        numbers = [("~" if name in estimates else "") + _text(getattr(p, name)) for name, *_ in _NUMBERS]
        table.add_row(p.name, *numbers, p.description)
    console.print_table(table)
    for line in _LEGEND:
        print(line)


def _print_one(profile: ImuProfile) -> None:
    """As TOML: the model, and its numbers as the keys that override them."""
    for line in (f"{profile.name}: {profile.description}.", f"Source: {profile.source}."):
        print(textwrap.fill(line, 80, initial_indent="# ", subsequent_indent="# ", break_on_hyphens=False))
    print(f'\n[imu]\nmodel = "{profile.name}"')
    print("# What the profile stands for; of these lines keep those whose number you change.")
    estimates = _estimates(profile)
    for name, _, unit in _NUMBERS:
        note = f"{unit}, our estimate" if name in estimates else unit
        print(f"{name} = {getattr(profile, name):.6g}  # {note}")


def _fields(profile: ImuProfile) -> dict[str, Any]:
    return {
        "name": profile.name,
        "description": profile.description,
        **{name: getattr(profile, name) for name, *_ in _NUMBERS},
        "source": profile.source,
        "estimated": _estimates(profile),
    }


def _profile(name: str) -> ImuProfile:
    profiles = {profile.name: profile for profile in _core.imu_profiles()}
    if name.lower() in profiles:
        return profiles[name.lower()]
    hint = _core.did_you_mean(name, list(profiles)) or f"; expected one of: {', '.join(profiles)}"
    raise InputError(f'no IMU profile is named "{name}"{hint}')


def imus(
    name: Annotated[str | None, typer.Argument(metavar="NAME", help="Show this one, as TOML.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print them as JSON.")] = False,
) -> None:
    """List the noise profiles that imu.model and --imu-model name."""
    with exit_codes():
        profile = _profile(name) if name is not None else None
        if as_json:
            shown = _fields(profile) if profile else [_fields(p) for p in _core.imu_profiles()]
            print(json.dumps(shown, indent=2, ensure_ascii=False))
        elif profile is not None:
            _print_one(profile)
        else:
            _print_all(_core.imu_profiles())
