"""The histogram and the seqlock."""

from __future__ import annotations

import threading

import numpy as np

from palpate.servo.histogram import BINS, Histogram, bin_of, count, lower_edge_ns
from palpate.servo.layout import begin_write, read_copy, write_block
from palpate.servo.report import ServoReport

from ...support.waiting import eventually


def test_every_duration_lies_in_its_bin_and_bins_are_3_percent_wide():
    for value in np.unique(np.geomspace(1, 1e11, 4000).astype(np.int64)):
        index = bin_of(value)
        assert lower_edge_ns(index) <= value < lower_edge_ns(index + 1)
        if value >= 64:
            assert lower_edge_ns(index + 1) / lower_edge_ns(index) < 1.04
    assert bin_of(-5) == 0 and bin_of(2**62) == BINS - 1


def test_quantiles_agree_with_sorting():
    values = np.random.default_rng(0).lognormal(9.0, 1.0, 20_000).astype(np.int64)
    bins, extremes = np.zeros(BINS, dtype=np.int64), np.zeros(3, dtype=np.int64)
    for value in values:
        count(bins, extremes, value)
    histogram = Histogram(bins, int(extremes[1]), int(extremes[2]))
    for share in (0.5, 0.99, 0.999):
        exact = np.quantile(values, share) / 1000.0
        np.testing.assert_allclose(histogram.quantile_us(share), exact, rtol=0.04)
    summary = histogram.as_json()
    assert summary["max"] == values.max() / 1000.0
    np.testing.assert_allclose(summary["mean"], values.mean() / 1000.0)


def distinct(copies) -> set[float]:
    return {float(copy[0]) for copy in copies if copy is not None}


def test_a_reader_never_sees_half_a_write():
    version, block = np.zeros(1, dtype=np.int64), np.zeros(64)
    read_copy(version, block)
    write_block(version, block, np.zeros(64))
    stop = threading.Event()

    def write() -> None:
        k = 0.0
        while not stop.is_set():
            k += 1.0
            write_block(version, block, np.full(64, k))

    writer = threading.Thread(target=write)
    writer.start()
    try:
        seen = [read_copy(version, block) for _ in range(5000)]

        def another() -> bool:
            seen.append(read_copy(version, block))
            return len(distinct(seen)) > 1

        assert eventually(another)
    finally:
        stop.set()
        writer.join()
    assert all(copy is None or (copy == copy[0]).all() for copy in seen)


def test_a_writer_that_died_half_way_is_noticed():
    version, block = np.zeros(1, dtype=np.int64), np.zeros(4)
    begin_write(version)
    assert read_copy(version, block) is None


def test_a_report_says_what_held_back_the_force_that_was_not_sent():
    def said(sent_n: float) -> str:
        times, acted = (
            Histogram(np.zeros(BINS, dtype=np.int64), 0, 0),
            {"force is off": 3, "ramping in": 50, "limited in its rise": 9},
        )
        return ServoReport(100, 0.1, 1000, 0, 0, times, times, 2.5, sent_n, 0.5, 0, 0, acted).text()

    held_back = "(safety held the rest back: ramping in, limited in its rise)"
    assert f"2.50 N rendered, 0.70 N sent to the device {held_back}" in said(0.7)
    assert "2.45 N sent to the device;" in said(2.45)
