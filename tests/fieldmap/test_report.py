"""The report: valid, whole, escaped, and without a network."""

from __future__ import annotations

import json
import re
import subprocess
from html.parser import HTMLParser
from typing import TYPE_CHECKING

import numpy as np
import pytest

from browser import BROWSER
from sparsor.fieldmap.picture import map_picture
from sparsor.fieldmap.report import CELL_COLUMNS, Report, report_html
from sparsor.fieldmap.timeline import timeline_svg
from sparsor.plot import map_png, uncertainty_png

from .maps import NAME, example_map, example_samples

if TYPE_CHECKING:
    from pathlib import Path

VOID = {"meta", "img", "path"}  # path: written <path/>
LOADING = {"src", "href", "srcset", "action", "data", "poster", "xlink:href"}


class Page(HTMLParser):
    """Everything of a page, and whether its elements are closed in order."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)

    def count(self, tag):
        return sum(name == tag for name, _ in self.elements)


@pytest.fixture(scope="module")
def report() -> Report:
    field_map, samples = example_map(), example_samples()
    picture = map_picture(field_map, samples)
    return Report(
        field_map,
        samples,
        map_png(picture),
        uncertainty_png(picture),
        [("samples", "55 used, 5 left out")],
        ["the sensor froze <script>alert(1)</script> & stayed"],
    )


@pytest.fixture(scope="module")
def html(report) -> str:
    return report_html(report).decode()


def test_its_elements_are_closed_and_it_says_what_it_should(report, html):
    page = Page(html)
    assert not page.open
    assert html.startswith("<!DOCTYPE html>")
    text = " ".join(page.texts)
    for said in (NAME, "ug/m3", "kriging", report.warnings[0], "55 used, 5 left out", "spike <i>", "flight.tlog"):
        assert said in text
    assert page.count("img") == 2
    assert all(attributes.get("alt") for tag, attributes in page.elements if tag == "img")
    measured = int(report.field_map.measured.sum())
    assert len(re.findall(r"<tr><td>", html)) == measured


def test_nothing_in_it_is_loaded_from_elsewhere(html):
    for _, attributes in Page(html).elements:
        for name in LOADING & attributes.keys():
            assert attributes[name].startswith("data:")
    assert "://" not in re.sub(r"data:image/png;base64,[A-Za-z0-9+/=]+", "", html)
    assert "default-src 'none'" in html


def test_words_of_others_are_no_elements(html):
    page = Page(html)
    assert page.count("script") == 1
    assert page.count("b") == page.count("i") == 0


def test_the_same_report_has_the_same_bytes(report, html):
    assert report_html(report).decode() == html


def test_the_time_line_of_a_long_flight_keeps_its_peaks_and_stays_small():
    few = example_samples()
    times = 3000
    many = type(few)(
        **{name: np.tile(getattr(few, name), times) for name in few.__dataclass_fields__ if name != "time_s"},
        time_s=np.arange(times * few.time_s.size) * 0.2,
    )
    many.value[many.value.size // 2 - 20] = 99.0
    assert many.used[many.value.size // 2 - 20]
    svg = timeline_svg(many, "ppb")
    assert len(svg) < 300_000
    heights = [
        float(y) for y in re.findall(r"[ML][0-9.]+,([0-9.]+)", re.search(r'class="line reading" d="([^"]+)"', svg)[1])
    ]
    assert min(heights) == pytest.approx(25, abs=5)  # the peak, a twentieth below the upper edge


@pytest.mark.parametrize("value", [0.0, 5e15, -3e-9])
def test_a_time_line_may_be_flat(value):
    samples = example_samples()
    samples.value[:] = value
    assert "nan" not in timeline_svg(samples, "")


def opened(html: str, folder: Path) -> tuple[str, str, set[str]]:
    """What a browser makes of a page, what it says to its console, and whom the page makes it ask."""
    page, log = folder / "report.html", folder / "net.json"
    page.write_text(html, encoding="utf-8")
    quiet = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking")
    ran = subprocess.run(
        [
            BROWSER,
            *quiet,
            "--enable-logging=stderr",
            f"--user-data-dir={folder / 'profile'}",
            f"--log-net-log={log}",
            "--dump-dom",
            page.as_uri(),
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    said = "\n".join(line for line in ran.stderr.splitlines() if "CONSOLE" in line)
    events = (event.get("params", {}) for event in json.loads(log.read_text())["events"])
    # What the browser asks for itself, such as updates, has no page as its initiator.
    asked = {
        event["url"]
        for event in events
        if "url" in event and event.get("initiator", "not an origin") != "not an origin"
    }
    return ran.stdout, said, asked


@pytest.mark.browser
def test_a_browser_opens_it_without_a_word_and_without_asking_anybody(html, tmp_path: Path):
    dom, said, asked = opened(html, tmp_path)
    assert "Measured cells" in dom
    assert not said
    assert not {url for url in asked if not url.startswith(("file:", "data:"))}


@pytest.mark.browser
def test_a_browser_sorts_the_cells_and_a_slip_would_be_seen(html, tmp_path: Path):
    value_head = 'document.querySelectorAll(".cells button")[4]'
    slips = f'{value_head}.click();{value_head}.click();new Image().src="http://127.0.0.1:9/x.png";nothing.there;'
    open_to_all = re.sub("<meta http-equiv[^>]*>", "", html)
    dom, said, asked = opened(open_to_all.replace("</script></body>", f"{slips}</script></body>"), tmp_path)
    assert "nothing is not defined" in said
    assert "http://127.0.0.1:9/x.png" in asked
    lines = [re.findall(r"<td>([^<]+)</td>", row) for row in dom.split("<tr>")]
    values = [float(line[4]) for line in lines if len(line) == len(CELL_COLUMNS)]
    assert len(values) > 100
    assert values == sorted(values, reverse=True)
