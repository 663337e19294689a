"""Building blocks of C headers: identifiers, comments and integer arrays."""

from __future__ import annotations

import re
import zlib

import numpy as np
import numpy.typing as npt


def identifier(text: str) -> str:
    """Return a valid C identifier, in lower case, derived from any text."""
    return re.sub(r"\W+", "_", f"printhammer_{text}", flags=re.ASCII).lower()


def comment(text: str) -> str:
    """Convert a text for use inside a C comment: printable ASCII, without "*/" and backslashes."""
    plain = text.encode("ascii", "replace").decode().replace("*/", "* /").replace("\\", "/")
    return "".join(letter if letter.isprintable() else " " for letter in plain)


def guarded(guard: str, body: str) -> str:
    """Return a C header with the text `body` and the include guard `guard`, a macro.

    The value of the macro is a checksum of the body.

    Two headers with one name and different contents stop the compiler; without the checksum, the guard would
    skip the second header without a message.
    """
    checksum = f"0x{zlib.crc32(body.encode()):08x}u"
    return f"""\
/* SPDX-License-Identifier: MIT */
#ifdef {guard}
#if {guard} != {checksum}
#error "two headers with different tables have the name {guard}"
#endif
#else
#define {guard} {checksum}

{body}
#endif
"""


def numbers(values: npt.ArrayLike) -> str:
    """Format integers as C source, separated by commas, ten per line."""
    texts = [str(int(value)) for value in np.asarray(values).tolist()]
    return ",\n".join("    " + ", ".join(texts[at : at + 10]) for at in range(0, len(texts), 10))


def nested(values: npt.ArrayLike) -> str:
    """Format the initialiser of a C integer array of any number of dimensions."""
    whole = np.asarray(values)
    if whole.ndim == 1:
        return f"{{\n{numbers(whole)}\n  }}"
    rows = "\n".join(f"  {nested(row)}," for row in whole)
    return f"{{\n{rows}\n}}"


def table(kind: str, name: str, values: npt.ArrayLike) -> str:
    """Format the definition of a two-dimensional C array with elements of the type `kind`."""
    whole = np.asarray(values)
    return f"static const {kind} {name}[{whole.shape[0]}][{whole.shape[1]}] = {nested(whole)};\n"
