"""Puts the page together: the verdict and the findings first, then the sections."""

from __future__ import annotations

import json
from html import escape
from importlib.resources import files
from string import Template

from liealign.report import tables, words
from liealign.report.review import Review
from liealign.report.sections import SECTIONS, Page, p
from liealign.report.style import pooled


def render(review: Review, plotly_js: str) -> str:
    """Return the page."""
    page = Page()
    for add in SECTIONS:
        add(page, review)
    contents = [("verdict", "Verdict"), ("findings", "Findings"), *((a, t) for a, t, _ in page.sections)]
    body = [_head(review), f'<div class="tiles">{tables.tiles(review)}</div>', _findings(review)]
    body += [
        f'<section id="s-{a}"><h2>{escape(title)}</h2>\n{html}</section>' for a, title, html in page.sections
    ]
    parts = files("liealign.report")
    # "<" cannot end the script element that the figures stand in.
    figures = json.dumps(pooled(page.figures), separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return Template((parts / "page.html").read_text("utf-8")).substitute(
        title=escape(f"liealign report: {_files(review)}"),
        version=escape(str(review.summary["version"])),
        files=escape(_files(review)),
        contents="".join(f'<li><a href="#s-{a}">{escape(t)}</a></li>' for a, t in contents),
        css=(parts / "page.css").read_text("utf-8"),
        js=(parts / "page.js").read_text("utf-8"),
        body="\n".join(body),
        figures=figures,
        plotly=plotly_js,
        footer=p(
            "Lines are thinned to what a screen shows; the lowest and the highest value of each stretch "
            "are kept, and so is every fix that was weighted down, rejected or reacquired. The full data "
            "are in trajectory.csv, biases.csv and innovations.csv. This page loads nothing from a network."
        ),
    )


def _files(review: Review) -> str:
    named = [str(review.config.get(key) or "") for key in ("imu.file", "gnss.file")]
    names = [name.replace("\\", "/").rsplit("/", 1)[-1] for name in named if name]
    return " + ".join(names) if names else "a flight from arrays"


# ---- the head ----------------------------------------------------------------------------------------------


def _head(review: Review) -> str:
    title, state = words.TITLES[review.alignment.verdict]
    caution = words.caution(review)
    if caution and state == "good":
        state = "look"
        title += ", but the stated accuracy is too optimistic"
    value, interval = words.heading_lines(review)
    note = "heading, one sigma as stated" if caution else "heading, one sigma"
    sigma = f"<small>{note}</small>" if review.alignment.heading_std_deg is not None else ""
    advice = review.alignment.advice
    parts = [
        f'<section class="verdict {state}" id="s-verdict"><h1>{escape(title)}</h1>',
        f'<p class="heading"><b>{escape(value)}</b> {sigma}</p>',
        p(interval),
    ]
    if not any(advice in warning for warning in review.solution.warnings):
        parts.append(p(f"{advice[:1].upper()}{advice[1:]}."))
    if review.solution.warnings:
        parts.append(f'<ul class="warnings">{tables.sentences(map(_warning, review.solution.warnings))}</ul>')
    if caution:
        parts.append(f'<p class="caution"><b>Read with care.</b> {escape(caution)}</p>')
    parts.append(
        "<noscript><p>The figures need JavaScript, which is switched off here; all words and tables are "
        "there.</p></noscript></section>"
    )
    return "\n".join(parts)


def _warning(text: str) -> str:
    return f"Warning: {text}."


def _findings(review: Review) -> str:
    rows = tables.finding_rows(words.findings(review))
    return f'<section id="s-findings"><h2>Findings</h2><ul class="findings">{rows}</ul></section>'
