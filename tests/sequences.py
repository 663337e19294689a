"""Random waveforms and firing times for sequences of different pulses; used by several tests."""

from typing import cast

import numpy as np
from hypothesis import strategies as st

from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.shapes import Chain, HalfSine, Rectangle, Sampled, Trapezoid, Waveform

widths = st.floats(1e-5, 2e-3)
edges = st.one_of(st.just(0.0), st.floats(1e-6, 1e-4))
amplitudes = st.floats(-2.0, 2.0)
offsets = st.floats(0.0, 1e-3)


def chain(parts: list[Waveform], gaps: list[float]) -> Chain:
    """Arrange waveforms in succession, each a given time after the end of the preceding one."""
    placed: list[tuple[float, Waveform]] = []
    end = 0.0
    for part, gap in zip(parts, gaps, strict=False):
        placed.append((end + gap, part))
        end = end + gap + part.support
    return Chain(parts=tuple(placed))


simple: st.SearchStrategy[Waveform] = st.one_of(
    st.builds(HalfSine, amplitude=amplitudes, width=widths),
    st.builds(Rectangle, amplitude=amplitudes, width=widths, rise=edges, decay=edges),
    st.builds(Trapezoid, amplitude=amplitudes, rise=edges, width=widths, fall=edges),
    st.builds(
        lambda values, step: Sampled.from_samples(np.arange(len(values)) * step, values),
        st.lists(amplitudes, min_size=2, max_size=5),
        st.floats(1e-5, 5e-4),
    ),
)
chains = st.builds(chain, st.lists(simple, min_size=1, max_size=3), st.lists(offsets, min_size=3, max_size=3))
waveforms: st.SearchStrategy[Waveform] = st.one_of(simple, cast("st.SearchStrategy[Waveform]", chains))


@st.composite
def sequences(draw: st.DrawFn) -> PulseSequence:
    """Up to eight firings of up to three waveforms."""
    kinds = draw(st.lists(waveforms, min_size=1, max_size=3))
    ticks = draw(st.lists(st.integers(0, 400), min_size=1, max_size=8, unique=True).map(sorted))
    which = draw(st.lists(st.sampled_from(kinds), min_size=len(ticks), max_size=len(ticks)))
    return PulseSequence(which, np.array(ticks) * 1e-5, draw(st.sampled_from(["add", "replace"])))
