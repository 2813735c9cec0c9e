"""The words and tables of the DInSAR section."""

# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from section import Json, markdown_table, number, percent, picture

WANTED = 0.99
_INSIDE = {
    "north_10_mm": "north (10 mm)",
    "east_10_mm": "east (10 mm)",
    "down_10_mm": "down (10 mm)",
    "norm_10_mm": "3-D (10 mm)",
    "roll_and_pitch_0.1_deg": "roll and pitch (0.1 deg)",
    "heading_1_deg": "heading (1 deg)",
}
_RMSE = {
    "north_mm": "north mm",
    "east_mm": "east mm",
    "down_mm": "down mm",
    "position_mm": "3-D mm",
    "roll_deg": "roll deg",
    "pitch_deg": "pitch deg",
    "heading_deg": "heading deg",
}


@dataclass(frozen=True)
class Summary:
    """Sums over the flights of one variant; `all`, `each`: rmse, own_sigma, inside, inside_expected."""

    name: str
    flights: int
    all: Json
    each: list[Json]  # of the first campaign's three flights
    alignment_rms_deg: float
    alignment_sigma_deg: float
    latency_rms_ms: float
    lines: int
    los_mm: float
    los_sigma_mm: float
    pass_to_pass_mm: float  # along the line of sight
    pass_to_pass_ned_mm: list[float]
    pass_to_pass_3d_mm: float
    apertures: Json

    def numbers(self) -> Json:
        """For numbers.json."""
        return dataclasses.asdict(self)


def rmse_rows(s: Summary) -> list[list[str]]:
    """The first three flights, all, and the own sigma of all."""
    rows = [[s.name, f"flight {k + 1}", *(number(f["rmse"][c]) for c in _RMSE)] for k, f in enumerate(s.each)]
    rows.append([s.name, f"all {s.flights}", *(number(s.all["rmse"][c]) for c in _RMSE)])
    rows.append([s.name, "own sigma", *(number(s.all["own_sigma"][c]) for c in _RMSE)])
    return rows


def inside_rows(s: Summary) -> list[list[str]]:
    """Shares inside the limits, beside what the own sigmas let expect."""
    rows = [
        [s.name, f"flight {k + 1}", *(percent(f["inside"][c]) for c in _INSIDE)] for k, f in enumerate(s.each)
    ]
    rows.append([s.name, f"all {s.flights}", *(percent(s.all["inside"][c]) for c in _INSIDE)])
    rows.append([s.name, "from own sigma", *(percent(s.all["inside_expected"][c]) for c in _INSIDE)])
    return rows


def phase_rows(s: Summary, bands_m: dict[str, float]) -> list[list[str]]:
    """Line-of-sight errors in mm and in degrees of phase at each band."""

    def row(what: str, mm: float) -> list[str]:
        phases = [
            number(math.degrees(4.0 * math.pi * 1e-3 * mm / wavelength)) for wavelength in bands_m.values()
        ]
        return [s.name, what, number(mm), *phases]

    rows = [
        row("error along the line", s.los_mm),
        row("its own sigma", s.los_sigma_mm),
        row("pass to pass", s.pass_to_pass_mm),
    ]
    for key, a in s.apertures.items():
        seconds = key.replace("_", " ")
        rows.append(row(f"within {seconds}, mean removed", a["mean_removed_mm"]))
        rows.append(row(f"within {seconds}, mean and trend removed", a["trend_removed_mm"]))
    return rows


def verdict(s: Summary) -> str:
    """Which of the limits are kept in 99 % of the epochs."""
    shares = s.all["inside"]
    kept = [what for c, what in _INSIDE.items() if shares[c] >= WANTED]
    short = [f"{what}, {percent(shares[c])} %" for c, what in _INSIDE.items() if shares[c] < WANTED]
    return f"kept for {', '.join(kept) or 'none'}; short for {', '.join(short) or 'none'}"


def conclusion(summaries: list[Summary], bands_m: dict[str, float]) -> str:
    """What the numbers say, whatever they are."""
    auto, given, fast = summaries
    rmse, own = given.all["rmse"]["position_mm"], given.all["own_sigma"]["position_mm"]
    inside, expected = given.all["inside"]["norm_10_mm"], given.all["inside_expected"]["norm_10_mm"]
    c_band = math.degrees(4.0 * math.pi * 1e-3 / bands_m["C"])
    longest = auto.apertures["10_s"]["trend_removed_mm"]
    return f"""\
**What it shows.** 99 % of the airborne epochs inside each limit, all automatic: {verdict(auto)}. Given:
{verdict(given)}. Attitude has a margin of more than an order of magnitude.
{position_words(given, rmse, own, inside, expected)} Five times as many fixes, were their errors as white,
have {percent(fast.all["inside"]["norm_10_mm"])} % of the epochs inside 10 mm in 3-D and
{percent(fast.all["inside"]["down_10_mm"])} % in down; those of a real receiver are correlated in time, so
this is the better end. Estimating latency and noise scales instead of telling them costs
{number(auto.all["rmse"]["position_mm"] - rmse, 2)} mm of 3-D RMSE; along the track, where the radar does not
look, {number(auto.all["rmse"]["east_mm"])} mm instead of {number(given.all["rmse"]["east_mm"])} (latency off
by {number(auto.latency_rms_ms, 2)} ms rms). From pass to pass the position differs by
{number(auto.pass_to_pass_3d_mm)} mm (3-D), the line of sight by {number(auto.pass_to_pass_mm)} mm rms:
{number(auto.pass_to_pass_mm * c_band, 2)} deg of phase at C band, slowly along the track, which an
interferogram has to take out with its reference points. Within an aperture of 10 s the error left after mean
and trend is {number(longest, 2)} mm ({number(longest * c_band, 2)} deg at C band): the images focus."""


def position_words(given: Summary, rmse: float, own: float, inside: float, expected: float) -> str:
    """Whether the position is at its limit."""
    near = (
        f"the RMSE of {number(rmse)} mm (3-D) is {number(rmse / own, 3)} times the smoother's own sigma of"
        f" {number(own)} mm"
    )
    shares = (
        f"{percent(inside)} % of the epochs inside 10 mm in 3-D where the own sigmas let expect"
        f" {percent(expected)} %"
    )
    if inside >= WANTED:
        return f"The position is inside: {near}; {shares}."
    if rmse > 1.1 * own:
        return f"The position is short, and not at the limit of the sensors: {near}; {shares}."
    return (
        f"What is short in position is the sensors' limit, not the estimator's: {near}, with {shares}. The"
        " down axis sets it: its fixes come once a second with 3 cm, and no smoother of this model has more"
        " than they say and the accelerometers carry from one to the next."
    )


def pass_words(summaries: list[Summary]) -> str:
    """The differences from pass to pass by axis."""
    parts = [
        f"{s.name} {', '.join(map(number, s.pass_to_pass_ned_mm))} and {number(s.pass_to_pass_3d_mm)} mm"
        for s in summaries
    ]
    return f"Pass to pass by axis, rms along north, east, down and in 3-D: {'; '.join(parts)}."


def section_text(summaries: list[Summary], bands_m: dict[str, float]) -> str:
    """All of it."""
    auto, _, fast = summaries
    bands = ", ".join(f"{band} {wavelength:g} m" for band, wavelength in bands_m.items())
    phase_head = ("", "line of sight, rms", "mm", *(f"{band} deg" for band in bands_m))
    return f"""\
**The papers.** DRONES section 1 wants the path within 10 mm, roll and pitch within 0.1 deg, heading within 1
deg, for radars in P, L and C band. TAES V-E flies one west-east track three times, parked for 15 minutes
before and after each, and gives in Table IV the RMSE of the relative DInSAR error: 1.136 m with D-LIE-EKF,
1.179 m and 1.174 m with the loosely and the tightly coupled Inertial Explorer. Those flights are proprietary,
and so is the radar processing: **Table IV cannot be re-run.** What follows is a stand-in.

**Here.** Campaigns of three flights on one track: parked 15 minutes, take-off to 60 m, {auto.lines} passes
west-east and back over 200 m at 6 m/s (each line 1 m beside the last), landing, parked 15 minutes; 35 minutes
in all, 5 of them in the air. The nose is 15 deg off the track, as in the wind of 4 m/s from 20 deg that the
drone leans against. Gusts and sensors differ from flight to flight. Campaign 1 has seeds 1 to 3, campaign 2
seeds 4 to 6, ...; {auto.flights} flights *automatic* (only the lever arm is told, all else is default), the
same ones *given*, and {fast.flights} *given* with fixes at 5 Hz. "Within" is counted over all airborne epochs
at 200 Hz: for each axis, for the length of the 3-D error, for roll and pitch both at once.

RMSE of the smoothed trajectory while airborne, and the smoother's own sigma:

{markdown_table(("", "flight", *_RMSE.values()), [r for s in summaries for r in rmse_rows(s)])}
Share of the airborne epochs inside the limit [%]; *from own sigma* is what normal errors with the stated
sigmas would give:

{markdown_table(("", "flight", *_INSIDE.values()), [r for s in summaries for r in inside_rows(s)])}
The radar looks south, across the track, 45 deg down; phase error 4π dr/λ ({bands}). *Pass to pass* is the
difference of the errors of two flights at the same place of the same line (all pairs); *within* an aperture:
pieces of 2, 5 and 10 s, that is 12, 30 and 60 m.

{markdown_table(phase_head, [r for s in (auto, fast) for r in phase_rows(s, bands_m)])}
{pass_words(summaries)}

{picture("dinsar.png", "Line-of-sight error and phase error along the track")}
{conclusion(summaries, bands_m)}
"""
