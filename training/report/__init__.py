"""The report of a comparison: its page, tables, charts and gallery."""
