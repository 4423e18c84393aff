"""The table of presses: its views, its file, the sites and segments that every later step relies on."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter

from palpate.mechanics.errors import ModelError
from palpate.mechanics.model.files import read_presses, write_csv, write_presses
from palpate.mechanics.presses.making import of_places
from palpate.mechanics.presses.repeats import sites_of
from palpate.mechanics.presses.segmentation import FoundAround, FoundPresses, free_segments, segment_recording
from palpate.mechanics.presses.table import FITS
from palpate.mechanics.recording.recording import Recording

UP = np.array([0.0, 0.0, 1.0])
TIP, RATE, STIFF = 0.005, 1000.0, 300.0


def recording(
    *, places=3, repeats=2, delay=0, bias=(0.0, 0.0, 0.0), noise=0.01, seed=0, rate=RATE
) -> Recording:
    """Straight presses onto z = 0 by a spring of 300 N/m: 1 s of air, 0.5 s down, 0.5 s up, at places 20 mm
    apart, each pressed `repeats` times; the force is read `delay` samples late."""
    n = round(2.0 * rate)
    clock = np.arange(n) / rate
    depth = np.interp(clock, [0, 0.6, 1.0, 1.5, 2.0], [-0.01, -0.01, -0.002, 0.004, -0.002])
    x = np.repeat(np.tile(np.arange(places) * 0.02, repeats), n)
    depths = np.tile(depth, places * repeats)
    position = np.column_stack([x, np.zeros_like(x), TIP - depths])
    force = STIFF * np.clip(depths, 0, None)[:, None] * UP + np.array(bias)
    force = np.roll(force, delay, axis=0) + noise * np.random.default_rng(seed).standard_normal(
        position.shape
    )
    return Recording(np.arange(len(x)) / rate, position, force, rate, TIP, force_noise_std_n=noise)


def table(made: Recording, places=3, repeats=2, until_s=None, **around):
    count = places * repeats
    begin = 2.0 * np.arange(count)
    x = np.tile(np.arange(places) * 0.02, repeats)
    centre = np.column_stack([x, np.zeros(count), np.full(count, TIP)])
    return segment_recording(
        made,
        FoundPresses(begin + 1.0 + 1 / 6, begin + 1.5, centre, np.tile(UP, (count, 1)), until_s=until_s),
        FoundAround(**around),
    )


def test_a_table_knows_touch_depth_site_and_noise():
    presses = table(recording())
    assert len(presses) == 6 and presses.sites == 3
    assert list(presses.site) == [0, 1, 2, 0, 1, 2] and list(presses.repeat) == [0, 0, 0, 1, 1, 1]
    # back at what it was in the air within 2 % of the greatest force
    assert presses.end_s - presses.onset_s == pytest.approx(np.full(6, 2 / 3), abs=0.015)
    assert presses.depth_m == pytest.approx(np.full(6, 0.004), rel=1e-3)
    assert presses.noise.raw_n == pytest.approx(0.01, rel=0.05)
    assert presses.noise.step_n == pytest.approx(0.01 / np.sqrt(10), rel=0.1)
    assert presses.noise.variance_inflation < 1.5
    assert not presses.t.flags.writeable


def test_a_press_is_over_where_the_tip_has_left_whatever_the_force_reads():
    """A tool's weight reads on, and the hand swings down beside the object: it was 26 mm deep, and a lump."""
    made = recording()
    clock = made.t % 2.0
    gone = np.clip((clock - 1.85) / 0.15, 0, 1)[:, None] * (clock >= 1.85)[:, None]
    swing = 0.03 * np.sin(np.pi * gone) * UP + gone**2 * [0.0, 0.05, -0.026]
    weighs = 0.4 * ((clock > 1.55) & (clock < 2.0))[:, None] * UP
    moved = dataclasses.replace(
        made, position=made.position + swing, force_on_tool=made.force_on_tool + weighs
    )
    presses = table(moved)
    assert presses.end_s - presses.onset_s == pytest.approx(np.full(6, 0.7), abs=0.05)
    assert presses.depth_m == pytest.approx(np.full(6, 0.004), rel=1e-3)


def test_work_that_does_not_come_back_is_a_share_of_what_was_spent():
    """A log of a material that creeps gave 28 kPa (26.5 to 29.4), and 22 with its creep: nothing said so."""
    made = recording(noise=0.05)
    assert table(made).lost_work == pytest.approx(0.0, abs=0.01)
    back = np.arange(len(made.t)) % round(2.0 * RATE) >= round(1.5 * RATE)
    softer = made.force_on_tool * np.where(back, 0.7, 1.0)[:, None]
    assert table(dataclasses.replace(made, force_on_tool=softer)).lost_work == pytest.approx(0.3, abs=0.02)


def test_what_a_swung_tool_reads_is_no_noise():
    """80 g at 2 m/s^2 and 5 mN: with what it reads in the air taken off, the noise is the sensor's."""
    made = recording(noise=0.005)
    read = 0.16 * np.sin(np.array([9.0, 7.0, 11.0]) * made.t[:, None])
    noise = table(dataclasses.replace(made, force_on_tool=made.force_on_tool + read), free_air=read).noise
    assert noise.raw_n == pytest.approx(0.005, rel=0.05)
    assert noise.step_n == pytest.approx(0.005 / np.sqrt(10), rel=0.1)
    assert noise.variance_inflation < 1.5


def test_what_a_tool_that_turns_unseen_wanders_by_is_no_noise():
    """It is followed straight from one touch to the next."""
    made = recording(noise=0.005)
    read = 0.1 * np.sin(np.array([0.9, 0.7, 1.1]) * made.t[:, None])
    turned = dataclasses.replace(made, force_on_tool=made.force_on_tool + read)
    noise = table(turned, free_air=read, followed=True).noise
    assert noise.raw_n == pytest.approx(0.005, rel=0.05)
    assert noise.step_n == pytest.approx(0.005 / np.sqrt(10), rel=0.15)
    assert noise.variance_inflation < 2.0


@pytest.mark.parametrize("followed", [False, True])
def test_slow_noise_is_noise(followed):
    """30 % of its power below 10 Hz, read at 2 kHz: without it a sound object was nearly unknown."""
    made = recording(noise=0.01 * np.sqrt(0.7), rate=2000.0)
    memory = np.exp(-2 * np.pi * 10.0 / 2000.0)
    steps = np.random.default_rng(3).standard_normal(made.position.shape) * np.sqrt(1 - memory**2)
    slow = 0.01 * np.sqrt(0.3) * lfilter([1.0], [1.0, -memory], steps, axis=0)
    read = np.zeros_like(slow)
    noisy = dataclasses.replace(made, force_on_tool=made.force_on_tool + slow)
    noise = table(noisy, free_air=read, followed=followed).noise
    assert noise.raw_n == pytest.approx(0.01, rel=0.1)
    # what is slower than 0.3 s is followed
    least = 0.75 if followed else 0.85
    assert least < noise.step_n / (0.01 * np.sqrt(0.3 + 0.7 / 20)) < 1.1


def test_rows_are_seen_from_the_place_that_was_touched():
    presses = table(recording(noise=0.0))
    assert presses.travel[:, 0] == pytest.approx(presses.depth, abs=1e-12)
    assert presses.local_force[:, 0] == pytest.approx(STIFF * np.clip(presses.depth, 0, None), abs=1e-9)
    assert np.abs(presses.local_force[:, 1:]).max() < 1e-12
    counted = presses.touching(presses.t)
    assert (counted[presses.counted]).all()


def test_net_undoes_bias_and_delay():
    bias = (0.1, -0.2, 0.3)
    made = recording(delay=20, bias=bias, noise=0.0)
    late = table(made, delay_s=0.02, free_air=np.tile(bias, (len(made.t), 1)))
    assert late.net.push == pytest.approx(STIFF * np.clip(late.depth, 0, None), abs=1e-9)
    assert late.net.delay_s == 0 and np.abs(late.net.free_air).max() == 0


def test_a_weight_that_turns_after_a_touch_does_not_prolong_it():
    made = recording()
    # the tool turns by 0.3 N while the hand lifts it, 50 ms before the force is gone
    turned = np.outer(0.3 * np.clip((made.t % 2.0 - 1.78) / 0.05, 0.0, 1.0), UP)
    heavy = dataclasses.replace(made, force_on_tool=made.force_on_tool + turned)
    plain, known = table(made), table(heavy, free_air=turned)
    assert known.end_s == pytest.approx(plain.end_s, abs=0.002)
    assert (table(heavy).end_s > plain.end_s + 0.1).all()


def test_a_touch_is_lost_soon_after_it_stood_above_the_noise_last():
    made = recording()
    wrong = np.outer(0.1 * (made.t % 2.0 > 1.6), UP)
    heavy = dataclasses.replace(made, force_on_tool=made.force_on_tool + wrong)
    until = 2.0 * np.arange(6) + 1.83
    assert (table(heavy, until_s=until).end_s <= until + 0.11).all()
    assert (table(heavy).end_s > until + 0.12).any()


def test_thinning_keeps_means_and_whitens_by_its_root():
    presses = table(recording())
    thin = presses.thinned(0.01)
    first = presses.rows([0])[:10]
    assert thin.force[0] == pytest.approx(presses.force[first].mean(axis=0))
    assert thin.block == 10 and thin.noise_n == presses.noise.step_n
    assert len(thin) == len(presses) and (np.diff(thin.starts) == np.diff(presses.starts) // 10).all()


def test_views_cut_rows_and_presses():
    presses = table(recording())
    near = presses.window(0.05, 0.0)
    since = near.t - near.onset_s[near.press]
    assert since.min() >= -0.05 and (near.t <= near.end_s[near.press]).all()
    some = presses.of(np.array([1, 4, 5]))
    assert len(some) == 3 and list(some.site) == [0, 0, 1]
    assert np.array_equal(some.t, presses.t[presses.rows([1, 4, 5])])
    assert len(presses.of(presses.site == 2)) == 2


def test_free_air_keeps_clear_of_every_touch_and_of_the_tracing():
    made = recording()
    presses = table(made, trace_s=(0.0, 0.3), others_s=[(6.5, 6.6)])
    free = presses.within("free", made.t)
    assert free.any() and not (free & presses.touching(made.t, 0.149)).any()
    assert not free[made.t < 0.8].any()
    assert not free[(made.t > 6.36) & (made.t < 6.74)].any()
    assert presses.within("trace", np.array([0.1, 0.4])).tolist() == [True, False]
    assert free_segments(np.arange(5.0), np.array([2.0]), np.array([2.0]), 10.0) == ()


@pytest.mark.parametrize("rate", [300.0, 500.0, 1000.0, 2000.0])
def test_the_rate_of_sampling_does_not_matter(rate):
    presses = table(recording(rate=rate))
    assert presses.end_s - presses.onset_s == pytest.approx(np.full(6, 2 / 3), abs=0.02)
    assert presses.depth_m == pytest.approx(np.full(6, 0.004), rel=0.01)
    assert presses.noise.raw_n == pytest.approx(0.01, rel=0.05)


def scattered(spacing: float, spread: float, *, count=5, repeats=3, seed=0) -> tuple[np.ndarray, np.ndarray]:
    """(points, true sites) of a square raster, each place touched again with an error."""
    random = np.random.default_rng(seed)
    grid = spacing * np.stack(np.meshgrid(np.arange(count), np.arange(count)), axis=-1).reshape(-1, 2)
    flat = np.tile(grid, (repeats, 1)) + spread * random.standard_normal((repeats * len(grid), 2))
    return np.column_stack([flat, np.zeros(len(flat))]), np.tile(np.arange(len(grid)), repeats)


@pytest.mark.parametrize(
    ("spacing", "spread", "repeats"),
    [
        (0.02, 0.5e-3, 3),
        (0.02, 1.5e-3, 3),
        (0.005, 0.0, 1),
        (0.003, 0.0, 1),
        (0.005, 0.2e-3, 3),
        (0.012, 1e-3, 2),
    ],
)
def test_sites_follow_the_datas_own_spacing(spacing, spread, repeats):
    points, truth = scattered(spacing, spread, repeats=repeats)
    assert np.array_equal(sites_of(points, np.tile(UP, (len(points), 1))), truth)


def test_two_faces_of_a_rim_are_two_sites():
    points = np.array([[0.0, 0, 0], [0.001, 0, 0], [0.0005, 0, 0]])
    assert list(sites_of(points, np.array([UP, [1.0, 0, 0], UP]))) == [0, 1, 0]


def test_a_table_comes_back_from_its_files_bit_for_bit(tmp_path):
    fits = {name: np.arange(6.0) for name in FITS}
    made = recording()
    presses = table(made, trace_s=(0.0, 0.3), delay_s=0.004, delay_error_s=1e-4).with_fits(**fits)
    write_presses(tmp_path / "presses.bin", presses)
    again = read_presses(tmp_path / "presses.bin")
    for field in dataclasses.fields(presses):
        one, other = getattr(presses, field.name), getattr(again, field.name)
        if field.name in ("fits", "columns"):
            assert all(np.array_equal(one[n], other[n]) for n in one)
        else:
            assert np.array_equal(one, other) if isinstance(one, np.ndarray) else one == other, field.name
    assert again.recording == made.content
    write_csv(tmp_path / "palpations.csv", presses)
    rows = np.genfromtxt(tmp_path / "palpations.csv", delimiter=",", names=True)
    assert np.array_equal(np.stack([rows[n] for n in "xyz"], axis=1), presses.point)
    assert np.array_equal(rows["k_kv"], fits["k_kv"])


def test_a_damaged_table_is_refused_in_one_line(tmp_path):
    path = tmp_path / "presses.bin"
    write_presses(path, table(recording()))
    content = bytearray(path.read_bytes())
    content[-5] ^= 1
    path.write_bytes(content)
    with pytest.raises(ModelError, match="damaged.*reconstruct"):
        read_presses(path)


def test_columns_of_another_length_are_refused():
    with pytest.raises(ModelError, match="other lengths"):
        dataclasses.replace(of_places(np.zeros((3, 3)), np.tile(UP, (3, 1)), TIP), onset_s=np.zeros(2))


def test_an_altered_recording_is_another_one():
    made = recording()
    louder = dataclasses.replace(made, force_on_tool=1.1 * made.force_on_tool)
    assert made.content != louder.content
    assert made.content == dataclasses.replace(made, object_name="another name").content
