"""The library's answers, a module for each group of chapters, each with a ``TABLE``."""
