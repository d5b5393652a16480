"""The studio: a page in the browser that shows a search at work, and the local server behind it."""
