"""Export of a state as text: hammer file, drive file, Python script, command line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from printhammer.drive.waveforms.shapes import Sampled
from printhammer.studio.states.links import file_of

if TYPE_CHECKING:
    from printhammer.studio.states.state import State

HAMMER_FILE: Final = "studio-hammer.toml"
DRIVE_FILE: Final = "studio-drive.toml"


def texts_of(state: State) -> dict[str, str]:
    """Export a state as texts, by kind.

    "hammer" and "drive" are TOML; "python" and "command" produce the same run; "state" is a file that the
    studio opens.

    Raises
    ------
    InputError
        The state has no valid hammer or drive.
    """
    return {
        "hammer": state.changed.to_toml(),
        "drive": state.drive.to_toml(),
        "python": python_of(state),
        "command": command_of(state),
        "state": file_of(state),
    }


def python_of(state: State) -> str:
    """Return a Python script that builds the hammer and the drive of a state and simulates the motion."""
    lines = ["import printhammer as ph", ""]
    if name := _name(state):
        lines.append(f"hammer = ph.load({name!r})")
    else:
        lines.append(f"hammer = ph.Hammer.from_toml({state.base.to_toml()!r})")
    if state.settings:
        changes = [f"        {key!r}: {value!r}," for key, value in state.settings.items()]
        lines += ["hammer = hammer.replace(", "    {", *changes, "    }", ")"]
    waveform = "hammer.waveform"
    if state.waveform is not None:
        made = state.fired
        lines.insert(1, f"from printhammer.drive.waveforms.shapes import {type(made).__name__}")
        fields = dict(state.waveform)
        fields.pop("shape")
        name = type(made).__name__
        if isinstance(made, Sampled):
            columns = f"{list(fields['times'])!r}, {list(fields['values'])!r}"
            lines.append(f"waveform = {name}.from_samples({columns}, quantity={fields['quantity']!r})")
        else:
            lines.append(
                f"waveform = {name}({', '.join(f'{key}={value!r}' for key, value in fields.items())})"
            )
        waveform = "waveform"
    overlap = "" if state.overlap == "add" else f", overlap={state.overlap!r}"
    if state.pattern:
        lines.append(
            f"times = [slot / {state.rate!r} for slot, mark in enumerate({state.pattern!r}) if mark == '1']"
        )
        lines.append(f"drive = ph.PulseTrain({waveform}, at=times{overlap})")
    else:
        lines.append(
            f"drive = ph.PulseTrain({waveform}, rate={state.rate!r}, pulses={state.pulses}{overlap})"
        )
    lines += ["motion = ph.simulate(hammer, drive)", "print(motion.dots)", ""]
    return "\n".join(lines)


def command_of(state: State) -> str:
    """Return the `printhammer run` command that simulates the hammer and drive of a state.

    An edited hammer or drive is passed as the file that the studio saves it to.
    """
    hammer = (not state.settings and _name(state)) or HAMMER_FILE
    if state.waveform is None and not state.pattern:
        overlap = "" if state.overlap == "add" else f" --overlap {state.overlap}"
        return f"printhammer run {hammer} --rate '{state.rate!r} Hz' --pulses {state.pulses}{overlap}"
    return f"printhammer run {hammer} --drive {DRIVE_FILE}"


def _name(state: State) -> str:
    """Return the name or file from which the unchanged hammer can be loaded, if any."""
    if state.text:
        return ""
    if not state.shelf.is_guest(state.hammer) or state.shelf.is_shipped(state.hammer):
        return state.hammer
    return state.base.path if Path(state.base.path).is_file() else ""
