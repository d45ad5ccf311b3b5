"""Figures: neutral descriptions made from results, and two renderers, page and print."""
