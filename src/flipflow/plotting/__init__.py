"""A neutral figure from each result, drawn by plotly or on paper."""
