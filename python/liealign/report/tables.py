"""The parts of the page that are HTML and no figure: tiles, findings, tables. All text is escaped here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

from liealign.report.review import NIS_90, Residuals, Review
from liealign.report.verdicts import MARKS
from liealign.report.words import (
    Finding,
    as_exact_as,
    counted,
    duration,
    latency_text,
    percent,
    scale_text,
    significant,
    spread_text,
)
from liealign.solution import Array, Receiver

_SIGNS = {
    "good": ("✓", "fine"),
    "fact": ("i", "to know"),
    "look": ("!", "look at this"),
    "bad": ("✕", "wrong"),
}


def sentences(texts: Iterable[str]) -> str:
    """Return an unordered list of sentences."""
    return "".join(f"<li>{escape(text)}</li>" for text in texts)


def finding_rows(found: Sequence[Finding]) -> str:
    """Return the findings, each with a sign and a word for readers who see no colour."""
    rows = []
    for finding in found:
        sign, word = _SIGNS[finding.state]
        rows.append(
            f'<li class="{finding.state}"><span class="sign" role="img" aria-label="{word}">{sign}</span>'
            f"<b>{escape(finding.topic)}</b><span>{escape(finding.text)}</span></li>"
        )
    return "".join(rows)


def tiles(review: Review) -> str:
    """Return the key numbers: value large, what it is above, what belongs to it below."""
    s = review.summary
    taken = s["fixes_used"] + s["fixes_weighted"] + s["fixes_reacquired"]
    rest = [f"{s[f'fixes_{word}']} {word}" for word in ("weighted", "rejected", "reacquired")]
    heading = s["median_std_heading_deg"] if review.states_heading else None
    p_rms = s["p_rms_m"]
    entries = [
        ("Duration", duration(s["duration_s"]), counted(s["epochs"], "epoch", "epochs")),
        ("IMU rate", f"{s['imu_rate_hz']:g} Hz", counted(s["imu_gaps"], "gap", "gaps")),
        ("Fixes in the filter", f"{taken} of {s['fixes']}", ", ".join(rest)),
        ("P_RMS", _with_unit(p_rms, "m"), "rms of the position innovations"),
        (
            "NIS, 90 % point",
            "–" if s["nis_90"] is None else significant(s["nis_90"]),
            f"{NIS_90:.2f} expected",
        ),
        *_position_tiles(review),
        (
            "Roll, pitch sigma",
            f"{significant(s['median_std_roll_deg'])}, {significant(s['median_std_pitch_deg'])}°",
            "median, stated",
        ),
        ("Heading sigma", "none" if heading is None else f"{significant(heading)}°", "median, stated"),
        ("GNSS latency", *_split(latency_text(review))),
        ("IMU noise scale", *_split(scale_text(review, "imu_noise_scale"))),
        ("GNSS sigma scale", *_split(scale_text(review, "gnss_std_scale"))),
    ]
    if review.receiver is not None:
        found = review.receiver
        entries[-3:] = [
            ("GNSS latency", _milliseconds(found.latency_s, found.latency_std_s), "of positions"),
            (
                "Velocity latency",
                _milliseconds(found.velocity_latency_s, found.velocity_latency_std_s),
                "of the GNSS velocities",
            ),
            entries[-2],
        ]
    return "".join(
        f'<div class="tile"><span>{escape(name)}</span><strong>{escape(value)}</strong>'
        f"<small>{escape(note)}</small></div>"
        for name, value, note in entries
    )


def _position_tiles(review: Review) -> list[tuple[str, str, str]]:
    """Return the sigmas of the position: horizontal and vertical, or both against the Earth and relative."""
    s = review.summary
    if review.receiver is None:
        return [
            ("Horizontal sigma", _with_unit(s["median_std_horizontal_m"], "m"), "median, stated"),
            ("Vertical sigma", _with_unit(s["median_std_down_m"], "m"), "median, stated"),
        ]
    both = [
        ", ".join(significant(s[f"median_{kind}_{axis}_m"]) for axis in ("horizontal", "down")) + " m"
        for kind in ("std", "relative_std")
    ]
    return [
        ("Position sigma", both[0], "horizontal, vertical; against the Earth"),
        ("Relative sigma", both[1], "horizontal, vertical; in the receiver's datum"),
    ]


def _milliseconds(value_s: float, std_s: float | None) -> str:
    if std_s is None:
        return f"{1e3 * value_s:.4g} ms"
    return f"{as_exact_as(1e3 * value_s, 1e3 * std_s)} ± {significant(1e3 * std_s)} ms"


def _split(text: str) -> tuple[str, str]:
    value, _, note = text.rpartition(" ")
    return value, "taken as given" if note == "given" else "estimated from the flight"


def _with_unit(value: float | None, unit: str) -> str:
    return "–" if value is None else f"{significant(value)} {unit}"


def table(head: Sequence[str], rows: Iterable[Sequence[str]], kind: str = "numbers") -> str:
    """Return a table of "numbers" or "text" whose first column names the row."""
    cells = "".join(f'<th scope="col">{escape(text)}</th>' for text in head)
    body = "".join(
        f'<tr><th scope="row">{escape(row[0])}</th>{"".join(f"<td>{escape(c)}</td>" for c in row[1:])}</tr>'
        for row in rows
    )
    inner = f"<thead><tr>{cells}</tr></thead><tbody>{body}</tbody>"
    return f'<div class="scroll"><table class="{kind}">{inner}</table></div>'


def accuracy_table(review: Review) -> str:
    """Return median, 95 % point and largest of each stated sigma over the epochs of the trajectory."""
    s = review.solution
    p, v, a = s.std_p_n_m, s.std_v_n_mps, review.std_rpy_deg
    rows = _position_rows("position", p)
    if review.receiver is not None:
        rows = _position_rows("position against the Earth", p)
        rows += _position_rows("position in the receiver's datum", s.relative_std_p_n_m)
    rows += [
        *((f"{name} velocity, m/s", v[:, i]) for i, name in enumerate(("north", "east", "vertical"))),
        *((f"{name}, deg", a[:, i]) for i, name in enumerate(("roll", "pitch", "heading"))),
    ]
    return table(
        ("One sigma", "median", "95 % below", "largest"), ((name, *_spread(values)) for name, values in rows)
    )


def _position_rows(what: str, std: Array) -> list[tuple[str, Array]]:
    return [
        (f"horizontal {what}, m", np.hypot(std[:, 0], std[:, 1])),
        *((f"{name} {what}, m", std[:, i]) for i, name in enumerate(("north", "east", "vertical"))),
    ]


def _spread(values: Array) -> list[str]:
    if not np.isfinite(values).any():
        return ["–", "–", "not stated"]
    return [significant(float(np.nanquantile(values, q)), 3) for q in (0.5, 0.95, 1.0)]


def receiver_table(review: Review, found: Receiver) -> str:
    """Return what was found of the receiver: value, and what it means."""
    white = [significant(found.white_std_scale * std) for std in review.stated_std_m]
    lasting_m = [significant(review.summary["gnss_std_scale"] * std) for std in review.stated_std_m]
    jitter_cm = significant(100.0 * 10.0 * found.stamp_jitter_s)
    lasting = (
        "none"
        if found.velocity_correlated_std_mps == 0.0
        else _with_unit(found.velocity_correlated_std_mps, "m/s")
    )
    smoothing = "not smoothed" if found.smoothing_time_s == 0.0 else _with_unit(found.smoothing_time_s, "s")
    rows = [
        (
            "latency of positions",
            _milliseconds(found.latency_s, found.latency_std_s),
            "how late their stamps are" + ("; as given" if found.latency_std_s is None else ""),
        ),
        (
            "latency of velocities",
            _milliseconds(found.velocity_latency_s, found.velocity_latency_std_s),
            "receivers filter them for longer"
            + ("; not estimated" if found.velocity_latency_std_s is None else ""),
        ),
        (
            "spread between models",
            spread_text(found),
            "by how much other models move the latency of positions",
        ),
        (
            "jitter of the stamps",
            f"{significant(1e3 * found.stamp_jitter_s)} ms",
            f"at 10 m/s {jitter_cm} cm along the track",
        ),
        (
            "position error that lasts",
            f"{lasting_m[0]} m, {lasting_m[1]} m",
            "horizontal, down; from the file, not found",
        ),
        (
            "it lasts for",
            _with_unit(found.correlation_time_s, "s"),
            "a longer one of a larger error would look the same",
        ),
        ("smoothed over", smoothing, "by the receiver's own filter"),
        ("white part of a position", f"{white[0]} m, {white[1]} m", "horizontal, down; anew with each fix"),
        ("velocity error that lasts", lasting, "along north, east, down"),
    ]
    return table(("Receiver", "value", "meaning"), rows, "text")


def residual_table(residuals: Residuals) -> str:
    """Return the statistics of the residuals of each component, over all fixes that were updates."""
    rows = []
    normalized = np.abs(residuals.normalized)
    res, std, unit = residuals.res_n, residuals.std_n, residuals.unit
    for name, values in (
        ("mean", res.mean(axis=0)),
        ("rms", np.sqrt((res**2).mean(axis=0))),
        ("rms as the noise model has it", np.sqrt((std**2).mean(axis=0))),
        ("largest", np.abs(res).max(axis=0)),
    ):
        rows.append((f"{name}, {unit}", *(significant(float(x)) for x in values)))
    for sigmas, expected in ((1, "68.3 %"), (2, "95.4 %"), (3, "99.7 %")):
        shares = np.mean(normalized <= sigmas, axis=0)
        rows.append((f"inside {sigmas} sigma ({expected} expected)", *(percent(float(x)) for x in shares)))
    return table((residuals.of.capitalize(), "north", "east", "down"), rows)


def verdict_key(verdicts: Iterable[str], extra: Sequence[tuple[str, str, str]] = ()) -> str:
    """Return the key under a figure: symbols of the verdicts that occur, with their counts, then `extra`."""
    words = list(verdicts)
    entries = [
        (mark.glyph, mark.color, f"{mark.words} ({words.count(name)})")
        for name, mark in MARKS.items()
        if name in words
    ]
    return key([*entries[::-1], *extra])


def key(entries: Iterable[tuple[str, str, str]]) -> str:
    """Return a key of symbol, colour and words; line, dash, dot and area are drawn by the style sheet."""
    items = "".join(
        f"<span>{_symbol(symbol, color)}{escape(words)}</span>" for symbol, color, words in entries
    )
    return f'<p class="key">{items}</p>'


def _symbol(symbol: str, color: str) -> str:
    if symbol in ("line", "dash", "dot", "area"):
        return f'<i class="{symbol}" style="color:{color}"></i>'
    return f'<i style="color:{color}">{symbol}</i>'
