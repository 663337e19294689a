"""Pieces of C headers: names, comments and arrays of whole numbers."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt


def identifier(text: str) -> str:
    """Return a name that C takes, in lower case, from any text."""
    return re.sub(r"\W+", "_", f"printhammer_{text}", flags=re.ASCII).lower()


def comment(text: str) -> str:
    """Return a text that can stand in a comment: plain ASCII that does not end it."""
    plain = text.encode("ascii", "replace").decode().replace("*/", "* /").replace("\\", "/")
    return "".join(letter if letter.isprintable() else " " for letter in plain)


def numbers(values: npt.ArrayLike) -> str:
    """Return whole numbers, ten a line."""
    texts = [str(int(value)) for value in np.asarray(values).tolist()]
    return ",\n".join("    " + ", ".join(texts[at : at + 10]) for at in range(0, len(texts), 10))


def nested(values: npt.ArrayLike) -> str:
    """Return the initialiser of an array of whole numbers, of any dimensions."""
    whole = np.asarray(values)
    if whole.ndim == 1:
        return f"{{\n{numbers(whole)}\n  }}"
    rows = "\n".join(f"  {nested(row)}," for row in whole)
    return f"{{\n{rows}\n}}"


def table(kind: str, name: str, values: npt.ArrayLike) -> str:
    """Return the definition of an array of two dimensions."""
    whole = np.asarray(values)
    return f"static const {kind} {name}[{whole.shape[0]}][{whole.shape[1]}] = {nested(whole)};\n"
