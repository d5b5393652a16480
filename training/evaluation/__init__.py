"""Agents measured on suites: targets, tasks, records as they come, tables."""
