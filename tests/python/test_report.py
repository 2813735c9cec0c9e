"""report.html: the verdict first, the numbers of the run, no outlier lost, nothing fetched, all drawn."""

from __future__ import annotations

import base64
import dataclasses
import json
import math
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import liealign
import numpy as np
import pytest
from liealign.report import thin, words
from liealign.report.page import render
from liealign.report.review import Residuals, Review, chi_square_3, make_review
from scipy.stats import chi2

from .conftest import Files, SimulatedCase
from .test_cli import cut_to_rest

SECTIONS = [
    *("verdict", "findings", "map", "height", "attitude", "velocity", "biases", "residuals-position"),
    *("residuals-velocity", "receiver", "heading", "filter", "sigmas", "accuracy", "run"),
]
MAX_BYTES = 8_000_000
NO_PLOTLY = "/* plotly */"  # for the tests that only read the page


class Html(HTMLParser):
    """Tags with their attributes, and the text outside of scripts and styles, in order."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.raw: dict[str, list[str]] = {"script": [], "style": []}
        self.inside = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self.inside = tag if tag in self.raw else ""

    def handle_endtag(self, tag: str) -> None:
        self.inside = "" if tag in self.raw else self.inside

    def handle_data(self, data: str) -> None:
        (self.raw[self.inside] if self.inside else self.words).append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.words))

    def ids(self, start: str = "") -> list[str]:
        found = [attrs["id"] for _, attrs in self.tags if attrs.get("id")]
        return [name for name in found if name and name.startswith(start)]


def figures_of(page: str) -> dict[str, Any]:
    """The figures as the script of the page unpacks them."""
    text = re.search(r'<script type="application/json" id="figures">(.*?)</script>', page, re.DOTALL)
    assert text
    data = json.loads(text.group(1), parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    columns = [np.frombuffer(base64.b64decode(c), "<f4").astype(float) for c in data["columns"]]

    def unpack(value: Any) -> Any:
        if isinstance(value, dict) and "column" in value:
            return columns[value["column"]] + value["from"]
        if isinstance(value, dict):
            return {name: unpack(inner) for name, inner in value.items()}
        return [unpack(inner) for inner in value] if isinstance(value, list) else value

    figures: dict[str, Any] = unpack(data["figures"])
    return figures


def named(figure: dict[str, Any], name: str) -> list[dict[str, Any]]:
    return [trace for trace in figure["data"] if trace.get("name") == name]


@pytest.fixture(scope="module")
def review(case: SimulatedCase) -> Review:
    return make_review(case.prepared, case.alignment, case.solution)


@pytest.fixture(scope="module")
def page(case: SimulatedCase) -> str:
    return liealign.report_html(case.prepared, case.alignment, case.solution)


@pytest.fixture(scope="module")
def figures(page: str) -> dict[str, Any]:
    return figures_of(page)


# ---- what is on the page -----------------------------------------------------------------------------------


def test_verdict_and_heading_come_first(case: SimulatedCase, page: str) -> None:
    html = Html(page)
    a, facts = case.alignment, case.alignment.to_dict()
    std = a.heading_std_deg
    assert std is not None
    digits = max(1 - math.floor(math.log10(std)), 0)
    low, high = facts["heading_95_deg"]
    expected = [
        "Aligned",
        f"{a.heading_deg:.{digits}f}° ± {std:.{digits}f}°",
        f"95 % interval {low:.{digits}f}° to {high:.{digits}f}°, at {a.start_time_s:.3f} s",
    ]
    after = html.text.index("Run and configuration")  # the list of contents goes before
    positions = [html.text.index(words, after) for words in (*expected, "Findings", "Smoothed trajectory")]
    assert positions == sorted(positions)
    assert ("section", {"class": "verdict good", "id": "s-verdict"}) in html.tags


def test_every_section_is_there_in_order_and_in_the_contents(page: str) -> None:
    html = Html(page)
    assert html.ids("s-") == [f"s-{name}" for name in SECTIONS]
    links = [attrs["href"] for tag, attrs in html.tags if tag == "a"]
    assert links == [f"#s-{name}" for name in SECTIONS]


def test_every_figure_has_its_place_and_units(page: str, figures: dict[str, Any]) -> None:
    places = [attrs["id"] for tag, attrs in Html(page).tags if attrs.get("class") == "figure"]
    assert sorted(str(place) for place in places) == sorted(figures)
    units = re.compile(r", (m|m/s|deg|deg/h|mg|s|no unit)( \(|$)")
    for name, figure in figures.items():
        layout = figure["layout"]
        labels = [a["text"] for a in layout["annotations"] if a["text"]] + [layout["xaxis"]["title"]["text"]]
        axes = [axis for axis in layout if axis.startswith("yaxis")]
        assert len(labels) == len(axes) + 1, name
        for label in labels:
            assert units.search(label), f"{name}: {label}"


def test_numbers_are_those_of_the_summary(case: SimulatedCase, page: str) -> None:
    text, s = Html(page).text, case.solution.summary
    for expected in (
        f"{s['fixes_used'] + s['fixes_weighted'] + s['fixes_reacquired']} of {s['fixes']}",
        f"{s['epochs']} epochs",
        f"P_RMS {words.significant(s['p_rms_m'])} m",
        f"Heading sigma {words.significant(s['median_std_heading_deg'])}°",
        "estimated from the flight",
        f"liealign report {liealign.__version__}",
    ):
        assert expected in text, expected


def test_config_is_there_as_used(case: SimulatedCase, page: str) -> None:
    assert liealign.dump_config(case.prepared.config).strip() in "".join(Html(page).words)


def test_parabola_and_interval_are_the_alignments(case: SimulatedCase, figures: dict[str, Any]) -> None:
    a, curve = case.alignment, figures["curve"]
    assert a.heading_std_deg is not None
    (parabola,) = named(curve, "parabola")
    np.testing.assert_allclose(
        parabola["y"], (parabola["x"] - a.heading_deg) ** 2 / (2 * a.heading_std_deg**2), atol=1e-4
    )
    (interval,) = [shape for shape in curve["layout"]["shapes"] if shape["type"] == "rect"]
    assert [interval["x0"], interval["x1"]] == pytest.approx(a.to_dict()["heading_95_deg"], abs=1e-9)

    (sampled,) = named(curve, "candidates")
    near = np.abs(sampled["x"] - a.heading_deg) < 3 * a.heading_std_deg
    on_parabola = (sampled["x"] - a.heading_deg) ** 2 / (2 * a.heading_std_deg**2)
    assert near.sum() >= 9
    np.testing.assert_allclose(sampled["y"][near], on_parabola[near], atol=0.5)
    (triple,) = named(curve, "three points of the parabola")
    assert len(triple["x"]) == 3


def test_interval_that_contains_north(case: SimulatedCase, review: Review) -> None:
    north = dataclasses.replace(case.alignment, heading_deg=0.01, heading_std_deg=0.02)
    facts = {**review.facts, "heading_95_deg": [359.97, 0.05]}
    figures = figures_of(
        render(dataclasses.replace(review, alignment=north, facts=facts), NO_PLOTLY),
    )
    (interval,) = [shape for shape in figures["curve"]["layout"]["shapes"] if shape["type"] == "rect"]
    assert [interval["x0"], interval["x1"]] == pytest.approx([-0.03, 0.05])


def test_filter_minus_smoother_is_that_of_the_events(case: SimulatedCase, figures: dict[str, Any]) -> None:
    filtered, smoothed = case.solution.engine.filtered_at_events(), case.solution.engine.smoothed_at_events()
    (north,) = named(figures["filter-velocity"], "north")
    expected = filtered["v_n_mps"][:, 0] - smoothed["v_n_mps"][:, 0]
    np.testing.assert_allclose(north["y"], expected, atol=1e-6)
    (down,) = named(figures["filter-position"], "down")
    assert np.abs(down["y"] + filtered["height_m"] - smoothed["height_m"]).max() < 1e-4


def test_without_events_the_page_says_how_to_get_them(case: SimulatedCase) -> None:
    solution = liealign.process(case.prepared, case.alignment, keep_events=False)
    html = Html(liealign.report_html(case.prepared, case.alignment, solution))
    assert "keep_events=True" in html.text
    assert not [name for name in html.ids() if name.startswith("filter-")]


def test_without_velocity_there_is_no_velocity_section(case: SimulatedCase) -> None:
    i = case.solution.innovations
    nothing = dataclasses.replace(
        i, nis_velocity=np.full_like(i.nis, np.nan), res_v_n_mps=np.full_like(i.res_p_n_m, np.nan)
    )
    solution = dataclasses.replace(case.solution, innovations=nothing)
    html = Html(render(make_review(case.prepared, case.alignment, solution), NO_PLOTLY))
    assert html.ids("s-") == [f"s-{name}" for name in SECTIONS if name != "residuals-velocity"]


def test_without_any_update(case: SimulatedCase) -> None:
    i = case.solution.innovations
    gone = np.full_like(i.nis, np.nan)
    nothing = dataclasses.replace(
        i, nis=gone, nis_velocity=gone, verdict=np.full_like(i.verdict, "outside_imu")
    )
    solution = dataclasses.replace(case.solution, innovations=nothing)
    text = Html(render(make_review(case.prepared, case.alignment, solution), NO_PLOTLY)).text
    assert text.count("No fix was an update of the filter") == 2


@pytest.fixture(scope="module")
def unobservable(case: SimulatedCase, tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("still")
    files = Files(folder)
    for name in ("imu.csv", "gnss.csv", "FLIGHT.toml"):
        (folder / name).write_bytes((case.folder / name).read_bytes())
    cut_to_rest(files)
    flight = liealign.prepare_flight(liealign.read_flight(folder / "FLIGHT.toml"))
    alignment = liealign.align_heading(flight)
    assert alignment.verdict == "unobservable" and alignment.heading_std_deg is None
    return liealign.report_html(flight, alignment, liealign.process(flight, alignment))


def test_unobservable_heading_is_not_made_up(unobservable: str) -> None:
    html, figures = Html(unobservable), figures_of(unobservable)
    assert ("section", {"class": "verdict bad", "id": "s-verdict"}) in html.tags
    assert "Heading not observable" in html.text and "No heading" in html.text
    assert "Heading sigma none" in html.text and "heading, deg – – not stated" in html.text
    assert not re.search(r"\b(nan|None|inf)\b", html.text)
    assert not [a for a in figures["map"]["layout"]["annotations"] if a.get("showarrow")]
    assert "the flight does not show it" in figures["attitude"]["layout"]["annotations"][2]["text"]
    assert not named(figures["curve"], "parabola")
    assert not [s for s in figures["curve"]["layout"]["shapes"] if s["type"] == "rect"]


def test_both_sigmas_of_a_position_and_what_they_rest_on(case: SimulatedCase, page: str) -> None:
    text, s = Html(page).text, case.solution.summary
    found = case.solution.receiver
    assert found is not None
    for kind, topic in (("std", "Position sigma"), ("relative_std", "Relative sigma")):
        both = (words.significant(s[f"median_{kind}_{axis}_m"]) for axis in ("horizontal", "down"))
        assert f"{topic} {', '.join(both)} m" in text
    assert "The absolute accuracy cannot be checked from this flight: the file states 0.014 m" in text
    assert "only its drift was measured. A base, a check point or a loop closure can." in text
    assert f"jitter of the stamps {words.significant(1e3 * found.stamp_jitter_s)} ms" in text
    assert "Velocity latency" in text and "latency of velocities" in text
    assert "stated accuracy is too optimistic" not in text


def test_white_errors_have_one_sigma(case: SimulatedCase) -> None:
    white = liealign.make_config({"gnss.error_model": "white"}, base=case.simulated.flight.config)
    flight = liealign.prepare_flight(case.simulated.flight.with_config(white))
    text = Html(liealign.report_html(flight, case.alignment, liealign.process(flight, case.alignment))).text
    assert "independent from fix to fix (white)" in text and "Horizontal sigma" in text
    assert "Relative sigma" not in text and "cannot be checked from this flight" not in text


# ---- what an analyst must not overlook ---------------------------------------------------------------------


def test_hostile_names_and_warnings_stay_text(case: SimulatedCase, review: Review) -> None:
    hostile = '</script><script>alert(1)</script><img src=x onerror=alert(2)>&"größe.csv'
    config = liealign.make_config({"imu.file": f"a/{hostile}", "gnss.file": hostile})
    summary = {**case.solution.summary, "warnings": [hostile]}
    changed = dataclasses.replace(
        review,
        prepared=SimpleNamespace(config=config),  # type: ignore[arg-type]
        config=liealign.config_entries(config),
        solution=dataclasses.replace(case.solution, summary=summary),
    )
    html, usual = Html(render(changed, NO_PLOTLY)), Html(render(review, NO_PLOTLY))
    assert [tag for tag, _ in html.tags if tag in ("script", "img")] == ["script"] * 3
    assert len(html.raw["script"]) == len(usual.raw["script"])
    assert "<" not in html.raw["script"][0], "nothing in the figures can end their element"
    assert f"Warning: {hostile}." in html.text
    assert "".join(html.words).count(hostile) == 3  # the warning and both inputs


def test_mismatch_takes_the_green_away(review: Review) -> None:
    white = {**review.summary, "gnss_error_model": "white"}
    loud = dataclasses.replace(
        review,
        facts={**review.facts, "gate_scale_position": 25.0},
        solution=dataclasses.replace(review.solution, summary=white),
    )
    html = Html(render(loud, NO_PLOTLY))
    std = review.alignment.heading_std_deg
    assert std is not None
    assert ("section", {"class": "verdict look", "id": "s-verdict"}) in html.tags
    assert "Aligned, but the stated accuracy is too optimistic" in html.text
    assert f"about {words.significant(5.0 * std)}°, not {words.significant(std)}°" in html.text


def residuals_of(scale: float, correlation: float = 0.0, n: int = 2000) -> Residuals:
    noise = np.random.default_rng(1).standard_normal((n, 3))
    for k in range(1, n):
        noise[k] = correlation * noise[k - 1] + math.sqrt(1.0 - correlation**2) * noise[k]
    z = scale * noise
    used = np.full(n, "used")
    return Residuals(
        "position", "m", 1.0, np.arange(n) + 0.0, 0.02 * z, np.full((n, 3), 0.02), (z**2).sum(1), used
    )


@pytest.mark.parametrize(
    ("scale", "state", "words_of_it"),
    [
        (1.0, "good", "As modelled: 95."),
        (1.5, "look", "Larger than modelled"),
        (4.0, "bad", "Larger than modelled"),
        (0.5, "look", "Smaller than modelled: 100 %"),
    ],
)
def test_noise_model_is_judged(scale: float, state: str, words_of_it: str) -> None:
    finding = words.noise_finding(residuals_of(scale))
    assert (finding.state, finding.text.startswith(words_of_it)) == (state, True), finding


def test_a_handful_of_fixes_is_not_judged() -> None:
    assert words.noise_finding(residuals_of(9.0, n=5)).text == "Too few to judge: 5 fixes."


def test_waves_in_the_residuals_are_named(review: Review) -> None:
    white = dataclasses.replace(review, position=residuals_of(1.0), velocity=None)
    waves = dataclasses.replace(review, position=residuals_of(1.0, correlation=0.9), velocity=None)
    topics = [{finding.topic for finding in words.findings(r)} for r in (white, waves)]
    assert "Pattern of the residuals" not in topics[0]
    assert "Pattern of the residuals" in topics[1]


@pytest.mark.parametrize("probability", [0.5, 0.9, 0.999])
def test_chi_square(probability: float) -> None:
    assert chi_square_3(probability) == pytest.approx(chi2.ppf(probability, 3), rel=1e-9)


# ---- thinning ----------------------------------------------------------------------------------------------


def test_thinning_keeps_the_extremes() -> None:
    rng = np.random.default_rng(2)
    values = rng.standard_normal((123_457, 2))
    values[70_001, 0], values[70_003, 0], values[5, 1] = 50.0, -60.0, 70.0
    values[200:300] = np.nan
    kept = thin.extremes(values, 500)
    assert kept.size <= 2 * 2 * 500 + 2
    assert {0, 5, 70_001, 70_003, 123_456} <= set(kept.tolist())
    assert np.all(np.diff(kept) > 0)
    # A bin keeps its own extremes, so the envelope is that of all values wherever one looks.
    for bin_of in np.array_split(np.arange(len(values)), 50):
        inside = kept[(kept >= bin_of[0]) & (kept <= bin_of[-1])]
        np.testing.assert_array_equal(np.nanmax(values[bin_of], 0), np.nanmax(values[inside], 0))
        np.testing.assert_array_equal(np.nanmin(values[bin_of], 0), np.nanmin(values[inside], 0))


@pytest.mark.parametrize("n", [0, 1, 2, 1000, 2001])
def test_thinning_of_few_and_of_nothing_but_nan(n: int) -> None:
    assert thin.extremes(np.arange(n) + 0.0, 1001).size == n
    assert thin.extremes(np.full(n, np.nan), 100).size <= 202


@pytest.fixture(scope="module")
def long_review(case: SimulatedCase) -> Review:
    """31 minutes at 200 Hz, fixes at 10 Hz with velocity, noisy in every trace, and 300 rejected fixes."""
    rng = np.random.default_rng(4)
    n, m = 31 * 60 * 200, 31 * 60 * 10
    s, i = case.solution, case.solution.innovations

    def stretched(array: np.ndarray, rows: int) -> np.ndarray:
        whole = np.resize(array, (rows, *array.shape[1:]))
        return whole * (1.0 + 1e-3 * rng.standard_normal(whole.shape)) if whole.dtype == float else whole

    def grown(values: Any, rows: int) -> dict[str, Any]:
        arrays = {f: stretched(np.asarray(values[f]), rows) for f in values}
        return arrays | {"time_s": 1000.0 + np.arange(rows) * (1860.0 / rows)}

    trajectory = grown({f.name: getattr(s, f.name) for f in dataclasses.fields(liealign.Trajectory)}, n)
    updates = np.isfinite(i.nis)
    innovations = grown({f.name: getattr(i, f.name)[updates] for f in dataclasses.fields(i)}, m)
    rejected = rng.choice(m, 300, replace=False)
    innovations["verdict"] = np.full(m, "used", dtype="<U20")
    innovations["verdict"][rejected] = "rejected"
    innovations["res_p_n_m"][rejected] += rng.uniform(-30.0, 30.0, (300, 3))
    events = [grown(of(), m) for of in (s.engine.filtered_at_events, s.engine.smoothed_at_events)]
    engine = SimpleNamespace(filtered_at_events=lambda: events[0], smoothed_at_events=lambda: events[1])
    solution = dataclasses.replace(
        s, **trajectory, innovations=liealign.Innovations(**innovations), engine=engine, filtered=None
    )
    fixes = stretched(case.prepared.fix_p_ea_e_m, m)
    prepared: Any = SimpleNamespace(
        config=case.prepared.config, fix_p_ea_e_m=fixes, fix_std_p_n_m=case.prepared.fix_std_p_n_m
    )
    return make_review(prepared, case.alignment, solution)


def test_rejected_fixes_are_never_thinned_away(long_review: Review) -> None:
    figures = figures_of(render(long_review, NO_PLOTLY))
    i = long_review.solution.innovations
    times = np.sort(i.time_s[i.verdict == "rejected"])
    for name in ("residuals-position", "nis-position", "height"):
        for axis in {trace["yaxis"] for trace in figures[name]["data"]}:
            traces = [
                t
                for t in figures[name]["data"]
                if t["yaxis"] == axis and t.get("name", "").endswith("rejected")
            ]
            shown = np.sort(np.concatenate([t["x"] for t in traces]))
            np.testing.assert_allclose(shown, times, atol=1e-3, err_msg=name)
    used = [t for t in figures["residuals-position"]["data"] if t.get("name", "").endswith("used")]
    assert all(t["x"].size <= 2002 for t in used), "ordinary fixes are thinned"
    on_map = named(figures["map"], "rejected")
    assert sum(t["x"].size for t in on_map) == 300


def test_page_of_a_long_flight_is_small(long_review: Review) -> None:
    from plotly.offline import get_plotlyjs

    page = render(long_review, get_plotlyjs())
    assert len(page.encode()) < MAX_BYTES
    assert len(page) - len(get_plotlyjs()) > 200_000, "the figures are there"


# ---- the file ----------------------------------------------------------------------------------------------


def test_nothing_is_fetched(page: str) -> None:
    html = Html(page)
    for tag, attrs in html.tags:
        assert tag not in {"link", "iframe", "object", "embed", "base", "img"}
        for name in {"src", "srcset", "href", "action", "poster", "data", "background"} & attrs.keys():
            assert (attrs[name] or "").startswith("#"), f"<{tag} {name}={attrs[name]}>"
        assert "url(" not in (attrs.get("style") or "")
    style = "".join(html.raw["style"])
    assert "url(" not in style and "@import" not in style
    policies = [a["content"] for t, a in html.tags if a.get("http-equiv") == "Content-Security-Policy"]
    assert len(policies) == 1 and str(policies[0]).startswith("default-src 'none';")
    assert not re.search(r"https?:", str(policies[0]))


def test_write_report(case: SimulatedCase, page: str, tmp_path: Path) -> None:
    folder = tmp_path / "größe" / "out"
    liealign.write_report(folder, case.prepared, case.alignment, case.solution)
    assert [path.name for path in folder.iterdir()] == ["report.html"]
    assert (folder / "report.html").read_text(encoding="utf-8") == page
    liealign.write_results(folder, case.prepared, case.alignment, case.solution)
    assert not (folder / "report.html").exists(), "of an earlier run"


def test_write_report_of_the_flight_as_read(case: SimulatedCase, page: str, tmp_path: Path) -> None:
    flight = liealign.read_flight(case.folder / "FLIGHT.toml")
    liealign.write_report(tmp_path, flight, case.alignment, case.solution)
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page


def test_folder_that_cannot_be_made(case: SimulatedCase, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(liealign.InputError, match="cannot be written"):
        liealign.write_report(tmp_path / "file" / "out", case.prepared, case.alignment, case.solution)


# ---- in a browser ------------------------------------------------------------------------------------------

PROBE = """<script>
window.addEventListener("error", (e) => { document.documentElement.dataset.fault = e.message; });
const probe = setInterval(() => {
  const root = document.documentElement;
  if (root.dataset.complete !== "yes") return;
  clearInterval(probe);
  const drawn = [...document.querySelectorAll(".figure")].filter((d) => d.querySelector(".main-svg .trace"));
  const wide = root.scrollWidth - window.innerWidth;
  const fault = root.dataset.fault || "";
  const buttons = [...new Set([...document.querySelectorAll(".modebar-btn")].map((b) => b.dataset.title))];
  document.title = "probe " + JSON.stringify({ drawn: drawn.map((d) => d.id), wide, fault, buttons });
}, 50);
</script>"""


@pytest.fixture(scope="session")
def chromium() -> str:
    for name in ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"):
        if found := shutil.which(name):
            return found
    pytest.skip("no chromium or chrome is installed; with one, the report is drawn in it")


# Chromium opens no window narrower than 500 px; the layout for phones begins at 560.
@pytest.mark.parametrize("width", [1440, 500])
@pytest.mark.parametrize("which", ["page", "unobservable"])
def test_chromium_draws_every_figure_without_a_complaint(
    chromium: str, which: str, width: int, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    page: str = request.getfixturevalue(which)
    path = tmp_path / "report.html"
    path.write_text(page.replace('<div class="page">', f'{PROBE}<div class="page">', 1), encoding="utf-8")
    done = subprocess.run(
        [
            *(
                chromium,
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
                "--dump-dom",
                "--enable-logging=stderr",
            ),
            *(f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={width},900"),
            *("--virtual-time-budget=60000", path.as_uri()),
        ],
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
        timeout=180,
    )
    complaints = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    assert not complaints, "\n".join(complaints)
    title = re.search(r"<title>probe (\{.*?\})</title>", done.stdout)
    assert title, "the figures were not all drawn"
    found = json.loads(title.group(1))
    assert found["fault"] == ""
    assert found["wide"] <= 0, "the page scrolls sideways"
    sends = [
        title for title in found["buttons"] if re.search("cloud|share|studio|upload", title, re.IGNORECASE)
    ]
    assert not sends, "no button may send the data away"
    assert sorted(found["drawn"]) == sorted(figures_of(page))
