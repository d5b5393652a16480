"""Training of policies: configuration, exams, and what is kept of them."""
