"""Agents measured on suites: targets, tasks, records as they come, tables."""

from training.evaluation.suite import GROUND_TRUTH, Entry, Printed, Suite, find_suite
from training.evaluation.tasks import EvalTask, solve_task

__all__ = ["GROUND_TRUTH", "Entry", "EvalTask", "Printed", "Suite", "find_suite", "solve_task"]
