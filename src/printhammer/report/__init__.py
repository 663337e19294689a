"""Report: figures and claims of the paper for one hammer, as HTML page, figure files and `claims.json`."""

from printhammer.report.build import write_report
from printhammer.report.contents import Report

__all__ = ["Report", "write_report"]
