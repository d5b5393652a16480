"""Training of nFAP-Net and WarpNet: samples, labels, the trainer, what the networks reach and cost."""
