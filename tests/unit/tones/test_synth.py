"""The tone: its pitch, and that it never clicks."""

import math

import numpy as np
import pytest

from services.robot_io.tones.synth import RAMP_SECONDS, ToneSynth

RATE = 48000.0
VOLUME = 0.3


def render(plan: list[tuple[float, float]], block: int = 128) -> np.ndarray:
    """Return what sounds: for each (seconds, hz), in blocks as a sound card asks for them."""
    synth = ToneSynth(RATE, VOLUME)
    parts = [
        synth.render(block, hz)
        for seconds, hz in plan
        for _ in range(round(seconds * RATE / block))
    ]
    return np.concatenate(parts).astype(np.float64)


def pitch(samples: np.ndarray) -> float:
    """Return the strongest frequency (Hz), between the bins of the transform."""
    spectrum = np.abs(np.fft.rfft(samples * np.hanning(len(samples))))
    top = int(np.argmax(spectrum))
    before, here, after = np.log(spectrum[top - 1 : top + 2])
    return (top + 0.5 * (before - after) / (before - 2 * here + after)) * RATE / len(samples)


def steepest(hz: float) -> float:
    """Return the largest difference of two samples of a pure tone."""
    return 2.0 * VOLUME * math.sin(math.pi * hz / RATE)


@pytest.mark.parametrize("hz", [440.0, 300.0])
def test_the_pitch_is_what_was_asked_for(hz: float):
    samples = render([(1.0, hz)])
    assert pitch(samples) == pytest.approx(hz, abs=0.01)
    assert np.abs(samples).max() == pytest.approx(VOLUME, rel=1e-3)
    assert np.abs(np.diff(samples)).max() == pytest.approx(steepest(hz), rel=1e-3)


@pytest.mark.parametrize(
    "plan",
    [
        [(0.05, 0.0), (0.1, 440.0), (0.05, 0.0)],
        [(0.1, 440.0), (0.1, 300.0), (0.1, 440.0), (0.05, 0.0)],
        [(0.01, 440.0), (0.01, 0.0)] * 20,  # a score that flickers from step to step
        [(0.01, 440.0), (0.01, 300.0)] * 20,
        [(0.003, 440.0), (0.003, 0.0), (0.003, 300.0), (0.003, 0.0)] * 20,  # within the ramp
    ],
)
def test_no_start_change_or_stop_is_steeper_than_the_pure_tone(plan: list[tuple[float, float]]):
    samples = render(plan, block=48)
    assert np.abs(np.diff(samples, prepend=0.0)).max() <= steepest(440.0) * (1 + 1e-5)
    assert np.abs(samples).max() <= VOLUME * (1 + 1e-6)


def test_a_cut_would_be_seen_as_a_click():
    """The measure of the test above, on a tone that is simply cut off."""
    samples = render([(0.1, 440.0)])
    quarter = round(RATE / 440.0 / 4)
    end = len(samples) - len(samples) % (4 * quarter) - 3 * quarter
    cut = np.concatenate([samples[:end], np.zeros(100)])
    assert np.abs(np.diff(cut)).max() > 3.0 * steepest(440.0)


def test_a_tone_is_at_full_loudness_after_the_ramp_and_silent_after_the_other():
    samples = render([(0.1, 440.0), (0.1, 0.0)], block=48)
    ramp = round(RAMP_SECONDS * RATE)
    stop = len(samples) // 2
    assert np.abs(samples[ramp : ramp + 120]).max() > 0.99 * VOLUME
    assert np.abs(samples[stop + ramp // 2 : stop + ramp]).max() > 0.0
    assert not samples[stop + ramp :].any()


def test_blocks_of_any_size_make_the_same_sound():
    whole = render([(0.096, 440.0), (0.096, 0.0)], block=4608)
    parts = render([(0.096, 440.0), (0.096, 0.0)], block=36)
    assert np.abs(whole - parts).max() < 1e-6


def test_silence_costs_nothing_and_is_exactly_zero():
    synth = ToneSynth(RATE, VOLUME)
    assert not synth.render(4800, 0.0).any()
    assert synth.render(7, 0.0).dtype == np.float32
