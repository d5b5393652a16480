"""The report of a comparison: its page, tables, charts and gallery."""

from training.report.comparison import Comparison, Row, Run, Series, read_runs, rows_of
from training.report.statistics import Interval, bootstrap_mean, bootstrap_means

__all__ = [
    "Comparison",
    "Interval",
    "Row",
    "Run",
    "Series",
    "bootstrap_mean",
    "bootstrap_means",
    "read_runs",
    "rows_of",
]
