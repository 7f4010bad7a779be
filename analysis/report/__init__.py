"""The list of chapters, and the page that they make."""
