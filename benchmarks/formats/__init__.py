"""Which program reads which of our files right: `python -m benchmarks.formats`, whose table is docs/formats.md."""
