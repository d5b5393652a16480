"""Search guided by networks: the paper's nFAP-Net and WarpNet, and the evaluators that bring them into the search."""
