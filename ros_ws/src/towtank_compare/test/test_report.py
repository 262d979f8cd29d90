# SPDX-License-Identifier: Apache-2.0
"""The report, opened in a browser: charts drawn, tables filled, nothing loaded, no error."""

import re
import shutil

import numpy as np
import pytest
from playwright.sync_api import sync_playwright
from synthetic_trial import CRANK_HZ, START_NS, trial_samples, write_trial
from towtank_compare.charts import amplitude_spectrum, heave_chart
from towtank_compare.report import write_report
from towtank_compare.series import Series
from towtank_compare.trial_result import trial_result
from towtank_node import topics


@pytest.fixture(scope="module")
def page():
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    assert chromium, "no Chromium found: install the package chromium"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield browser.new_page()
        browser.close()


def open_report(page, path, width=1200):
    """Errors and network requests that the report caused."""
    troubles = []
    page.on("console", lambda m: troubles.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda error: troubles.append(str(error)))
    page.on("request", lambda r: troubles.append(r.url) if r.url.startswith("http") else None)
    page.set_viewport_size({"width": width, "height": 900})
    page.goto(path.as_uri())
    page.wait_for_function(
        "() => [...document.querySelectorAll('.plotly-graph-div')]"
        ".every(chart => chart.querySelector('.main-svg'))"
    )
    return troubles


@pytest.fixture(scope="module")
def report(trial_bag, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(trial_bag, trial_result(trial_bag), path)
    return path


def test_all_charts_are_drawn_without_error_or_network(page, report):
    troubles = open_report(page, report)
    assert troubles == []
    drawn = {
        chart.get_attribute("id"): chart.locator(".scatterlayer .trace").count()
        for chart in page.locator(".plotly-graph-div").all()
    }
    assert drawn == {
        "chart-heave": 6,
        "chart-pitch": 3,
        "chart-drive": 2,
        "chart-shape": 4,
        "chart-spectra": 6,
    }
    titles = page.locator(
        "svg .xtitle, svg .x2title, svg .ytitle, svg .y2title"
    ).all_text_contents()
    assert all(re.search(r", (s|m|mm|Hz|rpm|m/s|degrees)\b|pitch", title) for title in titles)
    assert len(titles) >= 13


def test_the_table_holds_the_results(page, report, trial_bag):
    open_report(page, report)
    result = trial_result(trial_bag)
    text = page.locator("#heave-ratio").inner_text()
    assert f"{result['heave_ratio']['measured']['value']:.4f}" in text
    assert f"{result['heave_ratio']['measured']['u95']:.4f}" in text
    assert f"{result['heave_ratio']['twin']['value']:.4f}" in text
    assert f"{1e3 * result['amplitude_m']['fish']['measured']:.2f}" in text
    assert "1601, 1599, 2, 1" in page.locator("#acquisition").inner_text()
    fish = page.locator("#sensor-health tbody tr").all_inner_texts()[0].split()
    assert fish[-6:] == ["10", "0", "0", "0", "0", "100"]
    assert "flagged “noise” in 100 of" in page.inner_text("body")
    calibrations = page.locator("#calibrations tbody tr").all_inner_texts()
    assert len(calibrations) == len(result["calibrations"])
    assert "fish-pressure-assumed" in calibrations[0]
    rows = page.locator("#assumptions tbody tr").count()
    assert rows == len(result["assumptions"])
    assert "pressure port" in page.inner_text("body")
    assert page.locator("table.budget").count() == 2


def test_it_fits_a_phone(page, report):
    """Nothing is wider than the screen; wide tables scroll in themselves."""
    assert open_report(page, report, width=390) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_trial_without_twin_plant_and_pitch_is_reported_too(page, tmp_path):
    kept = [
        s
        for s in trial_samples()
        if not s.topic.startswith(("/twin", "/plant", topics.INCLINATION.name))
    ]
    bag = write_trial(tmp_path / "bag", kept)
    path = tmp_path / "report.html"
    write_report(bag, trial_result(bag), path)
    assert open_report(page, path) == []
    assert "No heave ratio for twin: not in the bag." in page.inner_text("body")
    assert page.locator("#chart-shape").count() == 0


def test_a_lost_reference_of_the_encoders_is_told(page, tmp_path):
    bag = write_trial(tmp_path / "bag", trial_samples(reset_s=9.0))
    path = tmp_path / "report.html"
    write_report(bag, trial_result(bag), path)
    assert open_report(page, path) == []
    text = page.inner_text("body")
    assert "from 7.00 s after the log's start on, the positions of crank and carriage are" in text
    assert "No heave ratio for measured: the crank's angle is not known at 7.00 s" in text
    assert "unknown (unknown)" in page.locator("#acquisition").inner_text()


def test_an_existing_report_is_not_overwritten(trial_bag, tmp_path):
    path = tmp_path / "report.html"
    path.write_text("mine")
    with pytest.raises(FileExistsError):
        write_report(trial_bag, trial_result(trial_bag), path)
    assert path.read_text() == "mine"


def test_gaps_are_not_bridged():
    """8 s are missing behind the first 20 s. What a straight line over them would do to the
    spectrum, the broken one shows not; the longest part is 20 s long."""
    time = np.concatenate((np.arange(0, 20, 0.01), np.arange(28.3, 40, 0.01)))
    stamps = START_NS + np.rint(1e9 * time).astype(np.int64)
    heave = Series(stamps, 0.02 * np.cos(2 * np.pi * CRANK_HZ * time))
    frequency, amplitude = amplitude_spectrum(heave)
    assert amplitude[np.argmax(amplitude)] == pytest.approx(20.0, rel=1e-3)
    assert amplitude[frequency > 2 * CRANK_HZ].max() < 0.1
    (line,) = heave_chart({"fish": {"measured": heave}}, START_NS).data
    assert np.flatnonzero(np.isnan(line.x)).tolist() == [2000]
    assert np.isnan(line.y[2000])


def test_a_spectrum_shows_a_sinusoids_amplitude():
    """16 s hold 8 whole periods of 0.5 Hz: the line falls on a bin. Between the samples at 100 Hz
    the heave is bridged linearly, which loses (π f/100)²/2 of the amplitude at most: 1e-4."""
    stamps = START_NS + np.arange(4001) * 10_000_000
    time = (stamps - START_NS) * 1e-9
    heave = Series(stamps, 3.0 + 0.02 * np.cos(2 * np.pi * CRANK_HZ * time))
    frequency, amplitude = amplitude_spectrum(heave)
    peak = np.argmax(amplitude)
    assert frequency[peak] == pytest.approx(CRANK_HZ)
    assert amplitude[peak] == pytest.approx(20.0, rel=1e-3)
