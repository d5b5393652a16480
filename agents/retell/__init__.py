"""One construction told again: edited, varied, or for another silhouette."""
