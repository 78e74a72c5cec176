"""How right, stable, fast and robust the program is: problems with known answers, ladders, reports, pictures of docs.

The product (`mpm`, `structure`, `coupling`) never imports this package; its commands join `gush` as entry points.
"""
