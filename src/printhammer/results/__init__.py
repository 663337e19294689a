"""Results: declared once, and from that Dataset, table, files, docstring, HTML repr and picture."""

from printhammer.results.declare import Column, Declared, column, coordinate, derived, part, scalar
from printhammer.results.files import ENDINGS, Reopened, reopen, save_dataset
from printhammer.results.provenance import KEYS, provenance
from printhammer.results.result import RESULTS, Result
from printhammer.results.rows import Rows

__all__ = [
    "ENDINGS",
    "KEYS",
    "RESULTS",
    "Column",
    "Declared",
    "Reopened",
    "Result",
    "Rows",
    "column",
    "coordinate",
    "derived",
    "part",
    "provenance",
    "reopen",
    "save_dataset",
    "scalar",
]
