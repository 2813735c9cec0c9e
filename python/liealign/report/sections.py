"""The sections of the page in their order: each has its sentences, its figures and their keys."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from html import escape

import numpy as np

from liealign import _core
from liealign.report import accuracy, fixes, heading, motion, tables, words
from liealign.report.review import NIS_90, NIS_MEDIAN, Residuals, Review
from liealign.report.style import ACCENT, ALERT, COMPONENTS, GREY, INK, TRACK, WARM, Figure
from liealign.report.words import percent, significant

_LINE, _DASH, _DOT, _AREA = "line", "dash", "dot", "area"
_NED_KEY = tuple(zip((_LINE, _LINE, _DOT), COMPONENTS, ("north", "east", "down"), strict=True))
_RPY_KEY = tuple(zip((_LINE, _LINE, _DOT), COMPONENTS, ("roll", "pitch", "heading"), strict=True))
_BAND_KEY = ((_LINE, ACCENT, "smoothed"), (_AREA, "#a9c6de", "one sigma either way"))


@dataclass
class Page:
    """The sections so far, and the figures that the script draws into them."""

    figures: dict[str, Figure] = field(default_factory=dict)
    sections: list[tuple[str, str, str]] = field(default_factory=list)  # anchor, title, HTML

    def figure(self, name: str, figure: Figure, about: str, *, time: bool = True) -> str:
        """Take a figure and return its place; `about` is for readers who do not see it."""
        self.figures[name] = figure
        linked = ' data-time="1"' if time else ""
        return (
            f'<div class="figure" id="{name}" role="img" aria-label="{escape(about)}"{linked} '
            f'style="min-height:{figure["layout"]["height"]}px"></div>'
        )

    def section(self, anchor: str, title: str, *parts: str) -> None:
        """Add a section of paragraphs and figures, HTML."""
        self.sections.append((anchor, title, "\n".join(parts)))


def p(text: str, kind: str = "") -> str:
    """Return a paragraph of plain text."""
    return f'<p class="{kind}">{escape(text)}</p>' if kind else f"<p>{escape(text)}</p>"


# ---- the motion --------------------------------------------------------------------------------------------


def _map(page: Page, review: Review) -> None:
    verdicts = review.solution.innovations.verdict
    what = "the point that [output] names" if review.moved_output else "the IMU"
    text = f"Smoothed trajectory of {what} and the fixes of the antenna, in metres from the first epoch. "
    if review.alignment.heading_std_deg is not None:
        text += "The arrow is the heading at the start. "
    if review.receiver is not None:
        text += (
            "The trajectory need not pass through the fixes: of the error that they have in common, what the "
        )
        text += "flight shows is taken out."
    extra = [(_LINE, TRACK, "smoothed trajectory")]
    if review.alignment.heading_std_deg is not None:
        extra.append(("➝", INK, "heading at the start"))
    page.section(
        "map",
        "Map",
        p(text.rstrip()),
        page.figure("map", motion.map_figure(review), "Map of trajectory and fixes", time=False),
        tables.verdict_key(verdicts, extra),
    )


def _height(page: Page, review: Review) -> None:
    page.section(
        "height",
        "Height",
        p(f"Trajectory from {words.start_of_flight(review)}, and the heights of the fixes (antenna)."),
        page.figure("height", motion.height_figure(review), "Height over time"),
        tables.verdict_key(review.solution.innovations.verdict, [(_LINE, TRACK, "smoothed trajectory")]),
    )


def _attitude(page: Page, review: Review) -> None:
    what = "the axes that [output] names" if review.moved_output else "the IMU"
    text = f"Of {what} against north, east, down. The bands are too narrow to see where the sigma is small; "
    text += "the last panel shows the sigmas themselves."
    if not review.states_heading:
        text += f" The verdict is {review.alignment.verdict}, so the heading has no stated sigma."
    page.section(
        "attitude",
        "Attitude",
        p(text),
        page.figure("attitude", motion.attitude_figure(review), "Roll, pitch and heading over time"),
        tables.key([*_BAND_KEY, *((g, c, f"sigma of {n}") for g, c, n in _RPY_KEY)]),
    )


def _velocity(page: Page, review: Review) -> None:
    page.section(
        "velocity",
        "Velocity",
        p("Against the Earth, in north, east and down; down is positive when the vehicle descends."),
        page.figure("velocity", motion.velocity_figure(review), "Velocity over time"),
        tables.key(_BAND_KEY),
    )


def _biases(page: Page, review: Review) -> None:
    page.section(
        "biases",
        "Sensor biases",
        p(
            "Estimated offsets of the IMU (measured = true + bias). They should wander slowly inside their "
            "bands; steps or a steady climb point to vibration, temperature or a wrong lever arm."
        ),
        "<h3>Gyro</h3>",
        page.figure("gyro", motion.gyro_bias_figure(review), "Gyro biases over time"),
        "<h3>Accelerometer</h3>",
        page.figure("accel", motion.accel_bias_figure(review), "Accelerometer biases over time"),
        tables.key(_BAND_KEY),
    )


# ---- the fixes ---------------------------------------------------------------------------------------------


def _residuals(page: Page, review: Review) -> None:
    if review.position is None and review.velocity is None:
        page.section("residuals", "Residuals of the fixes", p("No fix was an update of the filter."))
    for residuals in (review.position, review.velocity):
        if residuals is not None:
            _residuals_of(page, review, residuals)


def _residuals_of(page: Page, review: Review, residuals: Residuals) -> None:
    of = residuals.of
    verdict = words.noise_finding(residuals)
    measured = "Measured minus predicted by the forward filter, before the fix is used."
    if review.receiver is not None and of == "position":
        measured += " The first fix, which tells the run where it is, is left out."
    bounds = [(_AREA, "#c3cad0", "one sigma of the residual"), (_AREA, "#e3e7ea", "three sigma")]
    page.section(
        f"residuals-{of}",
        f"Residuals, {of}",
        p(measured),
        p(verdict.text),
        page.figure(
            f"residuals-{of}", fixes.residual_figure(review, residuals), f"Residuals of the {of} over time"
        ),
        tables.verdict_key(residuals.verdict, [*bounds, *_arrow_key(residuals)]),
        tables.residual_table(residuals),
        "<h3>Size of the residuals against the noise model</h3>",
        p(_nis_sentence(review, residuals)),
        page.figure(f"nis-{of}", fixes.nis_figure(review, residuals), f"NIS of the {of} over time"),
        tables.verdict_key(residuals.verdict, _nis_key(review, residuals)),
    )


def _receiver(page: Page, review: Review) -> None:
    title, found = "GNSS receiver", review.receiver
    if found is None:
        text = (
            "The errors of the fixes were taken for independent from fix to fix (white), with one latency "
            f"for positions and velocities: {words.latency_text(review)}."
        )
        page.section("receiver", title, p(text))
        return
    text = f"{words.receiver_model(found)} What was found from the flight, and what the file says:"
    page.section("receiver", title, p(text), tables.receiver_table(review, found))


def _arrow_key(residuals: Residuals) -> list[tuple[str, str, str]]:
    beyond = sum(
        int(np.count_nonzero(np.abs(res) > fixes.axis_reach(res, std)))
        for res, std in zip(residuals.res_n.T, residuals.std_n.T, strict=True)
    )
    return [("⇡", INK, f"beyond the axis ({beyond})")] if beyond else []


def _nis_sentence(review: Review, residuals: Residuals) -> str:
    threshold = fixes.nis_threshold(review)
    probability = float(review.config["gnss.outlier_probability"])
    median, tail = (float(np.quantile(residuals.nis, q)) for q in (0.5, 0.9))
    above = int(np.count_nonzero(residuals.nis > threshold))
    text = (
        "The normalised innovation squared (NIS) measures a residual in its own sigmas. Half of the fixes "
        f"are below {significant(median)} ({NIS_MEDIAN:.2f} expected) and 90 % below {significant(tail)} "
        f"({NIS_90:.2f} expected). {above} of {residuals.nis.size} exceed {threshold:.2f}, which a good "
        f"fix stays below with {percent(probability)} probability."
    )
    if residuals.gate_scale > 1.1:
        text += (
            f" The noise model is too small for this flight, so the outlier test was opened by a factor "
            f"of {significant(residuals.gate_scale)}, to {significant(threshold * residuals.gate_scale)}."
        )
    return text


def _nis_key(review: Review, residuals: Residuals) -> list[tuple[str, str, str]]:
    entries = [(_DOT, GREY, "3, the mean when the noise model is right")]
    probability = percent(float(review.config["gnss.outlier_probability"]))
    entries.append((_DASH, ALERT, f"{probability} threshold"))
    if residuals.gate_scale > 1.1:
        entries.append((_LINE, ALERT, "threshold as opened for this flight"))
    return entries


# ---- the heading -------------------------------------------------------------------------------------------


def _heading(page: Page, review: Review) -> None:
    alignment = review.alignment
    circle = heading.circle_figure(review)
    text = (
        f"{alignment.evaluations} candidate filters started from different headings; the cost says how "
        "badly each predicts the fixes. "
    )
    if alignment.heading_std_deg is None:
        text += "No heading stands out, so there is no parabola and no interval."
    else:
        text += (
            "Around the minimum it is a parabola whose width is the sigma: candidates that lie on it are "
            "what a heading with a Gaussian error looks like. The 95 % interval is shaded."
        )
    if not alignment.settled:
        text += " The fit did not settle."
    near = page.figure(
        "curve", heading.curve_figure(review), "Cost of the candidates around the minimum", time=False
    )
    keys = [
        ("●", ACCENT, "candidates with the outlier test"),
        ("△", WARM, "candidates that take every fix in full"),
    ]
    if alignment.heading_std_deg is not None:
        keys += [(_LINE, GREY, "parabola"), (_AREA, "#c8dcec", "95 % interval"), ("│", INK, "heading found")]
    blocks = [f"<div><h3>Around the minimum</h3>{near}{tables.key(keys)}</div>"]
    if circle is None:
        text += " The search started from the heading that was given, not from the full circle."
    else:
        around = page.figure("circle", circle, "Cost of the candidates over the full circle", time=False)
        modes = ", ".join(
            f"{mode:.0f}° ({percent(float(mass))})"
            for mode, mass in zip(alignment.mode_heading_deg, alignment.mode_mass, strict=True)
            if mass > 0.001
        )
        keys = [
            ("●", ACCENT, "candidates of the first, coarse search"),
            (_DASH, WARM, "below: a rival at least 1 % as probable as the best"),
        ]
        if alignment.verdict != "unobservable":
            keys.append((_DOT, GREY, f"basins and their share of the probability: {modes}"))
        blocks.append(f"<div><h3>Over the full circle</h3>{around}{tables.key(keys)}</div>")
    page.section(
        "heading", "How the heading was found", p(text), f'<div class="pair">{"".join(blocks)}</div>'
    )


# ---- the accuracy ------------------------------------------------------------------------------------------


def _filter(page: Page, review: Review) -> None:
    found = accuracy.differences(review)
    title = "Filter against smoother"
    if review.filtered is None or not found:
        text = (
            "Not shown: this run did not keep the filter's states at the fixes. Make it with "
            "liealign.process(flight, alignment, keep_events=True)."
        )
        page.section("filter", title, p(text))
        return
    text = (
        "Forward filter minus smoother, of the IMU, at the fixes and rest updates, over one sigma of the "
        "filter. The smoother also knows the future. Where the model is right, at least two thirds of the "
        "differences are inside one sigma; a difference that stays outside is an error that the model does "
        "not have."
    )
    parts = [p(text)]
    for difference in found:
        inside = (
            f"{percent(difference.within)} of the differences are inside one sigma, at least 68 % expected."
        )
        parts += [
            f"<h3>{difference.of.capitalize()}</h3>",
            p(inside),
            page.figure(
                f"filter-{difference.of}",
                accuracy.difference_figure(review, review.filtered, difference),
                f"Filter minus smoother, {difference.of}",
            ),
        ]
    parts.append(
        tables.key([(_LINE, ACCENT, "filter minus smoother"), (_AREA, "#a9c6de", "one sigma of the filter")])
    )
    page.section("filter", title, *parts)


def _sigmas(page: Page, review: Review) -> None:
    text = "One sigma of the smoothed trajectory as the smoother states it; log axes. They rise where "
    text += "fixes are missing."
    page.section(
        "sigmas",
        "Stated standard deviations",
        p(text),
        page.figure("sigmas", accuracy.sigma_figure(review), "Standard deviations over time"),
        tables.key(_NED_KEY),
        tables.key(_RPY_KEY),
    )


def _accuracy(page: Page, review: Review) -> None:
    text = "What the smoother states about itself, over all epochs of the trajectory."
    if review.mismatch is not None:
        text += (
            f" The {review.mismatch[0]} residuals are {significant(review.mismatch[1])} times as large as "
            "modelled; take these numbers as too small by about that factor."
        )
    parts = [p(text)]
    if review.receiver is not None:
        two = (
            "A position has two sigmas. Against the Earth: how far the whole trajectory may be off, which "
            "the receiver's lasting error decides. In the receiver's own datum: how far the trajectory is "
            "bent in itself, which is what blurs an image (SAR, lidar, photogrammetry)."
        )
        parts += [p(two), p(words.absolute_accuracy(review))]
    page.section("accuracy", "Accuracy summary", *parts, tables.accuracy_table(review))


def _run(page: Page, review: Review) -> None:
    s = review.summary
    rows = [
        (key.removeprefix("fixes_").replace("_", " "), str(s[key])) for key in s if key.startswith("fixes_")
    ]
    inputs = [
        (name, str(review.config.get(key) or "from arrays"))
        for name, key in (("IMU log", "imu.file"), ("GNSS log", "gnss.file"), ("IMU profile", "imu.model"))
    ]
    if review.config.get("baro.file"):
        inputs.insert(2, ("Barometer log", str(review.config["baro.file"])))
    page.section(
        "run",
        "Run and configuration",
        tables.table(("Input", ""), inputs, "text"),
        tables.table(("Rows of the GNSS log", "count"), [("all", str(s["fixes"])), *rows]),
        p(f"liealign {s['version']}, {s['epochs']} epochs, {words.start_of_flight(review)}."),
        "<details><summary>Configuration as used</summary>"
        f"<pre>{escape(_core.dump_config(review.prepared.config))}</pre></details>",
    )


SECTIONS: tuple[Callable[[Page, Review], None], ...] = (
    _map,
    _height,
    _attitude,
    _velocity,
    _biases,
    _residuals,
    _receiver,
    _heading,
    _filter,
    _sigmas,
    _accuracy,
    _run,
)
