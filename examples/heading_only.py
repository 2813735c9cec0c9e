"""The heading and how far to trust it, without the trajectory: `python heading_only.py FLIGHT.toml`.

Worth doing in the field, before you drive home: a verdict other than "aligned" says what to fly again.
"""

from __future__ import annotations

import sys

import liealign


def main(toml: str) -> None:
    alignment = liealign.align_heading(liealign.read_flight(toml))
    print(f"{alignment.verdict}: {alignment.advice}")
    for warning in alignment.warnings:
        print(f"warning: {warning}")

    # No sigma: the flight does not show the heading, and heading_deg is not to be used.
    if alignment.heading_std_deg is None:
        sys.exit("no heading")
    low, high = alignment.to_dict()["heading_95_deg"]
    print(f"heading {alignment.heading_deg:.2f} deg, 95 % within {low:.2f} to {high:.2f} deg")
    print(f"at {alignment.start_time_s:.3f} s, from {alignment.evaluations} candidate filters")

    # More than one mode is an ambiguous flight: two headings explain it.
    for heading_deg, mass in zip(alignment.mode_heading_deg, alignment.mode_mass, strict=True):
        print(f"  about {heading_deg:.0f} deg has {100 * mass:.1f} % of the probability")


if __name__ == "__main__":
    main(*sys.argv[1:])
