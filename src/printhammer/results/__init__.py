"""Results, declared once: Dataset, table, files, docstring and HTML repr are generated from the fields."""

from printhammer.results.declare import Column, Declared, column, coordinate, derived, part, scalar
from printhammer.results.files import ENDINGS, Reopened, reopen, save_dataset
from printhammer.results.provenance import KEYS, provenance
from printhammer.results.result import RESULTS, Result, Rows
from printhammer.results.summary import Cells, Facts, Grid, Summary

__all__ = [
    "ENDINGS",
    "KEYS",
    "RESULTS",
    "Cells",
    "Column",
    "Declared",
    "Facts",
    "Grid",
    "Reopened",
    "Result",
    "Rows",
    "Summary",
    "column",
    "coordinate",
    "derived",
    "part",
    "provenance",
    "reopen",
    "save_dataset",
    "scalar",
]
