"""One self-contained HTML page about a run: data collected from its datasets, drawn by the page's own script."""
