"""Whatever is played, in blocks of whatever size: no click, nothing too loud, then silence."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from services.robot_io.tones.synth import RAMP_SECONDS, ToneSynth

HZ = st.just(0.0) | st.sampled_from((300.0, 440.0)) | st.floats(300.0, 8000.0)
BLOCKS = st.lists(st.tuples(st.integers(1, 2048), HZ), min_size=1, max_size=40)


@given(BLOCKS, st.sampled_from((44100.0, 48000.0, 96000.0)), st.floats(0.0, 1.0))
def test_no_two_samples_differ_by_more_than_those_of_the_highest_tone(
    blocks: list[tuple[int, float]], rate: float, volume: float
):
    synth = ToneSynth(rate, volume)
    parts = [synth.render(count, hz) for count, hz in blocks]
    parts.append(synth.render(math.ceil(RAMP_SECONDS * rate) + 1, 0.0))
    assert [len(part) for part in parts[:-1]] == [count for count, _ in blocks]
    samples = np.concatenate(parts)
    assert samples.dtype == np.float32
    assert np.isfinite(samples).all()
    assert np.abs(samples).max() <= volume * (1 + 1e-6)
    highest = max(hz for _, hz in blocks)
    steepest = 2.0 * volume * math.sin(math.pi * highest / rate)
    assert np.abs(np.diff(samples.astype(np.float64), prepend=0.0)).max() <= steepest + 1e-6
    assert samples[-1] == 0.0
    assert not synth.render(64, 0.0).any()
