"""Benchmarks: how fast and how good AutoPoly is, measured beside others on the machine at hand."""

import os

# Before numpy is imported: its dot products of some ten thousand numbers would be shared out to threads, which costs
# milliseconds on a busy machine, and which DEODR (and nothing of ours) would have to pay.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
