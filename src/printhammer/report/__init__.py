"""The report: figures and claims of the paper for one hammer, as one page, pictures and `claims.json`."""

from printhammer.report.build import Report, write_report

__all__ = ["Report", "write_report"]
